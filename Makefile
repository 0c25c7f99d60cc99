# From a clean clone: `make demo` and `make test` set everything up by themselves (Python 3.11 or newer and make).
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

# The newest interpreter that the optional libraries all have wheels for; PYTHON=... chooses another.
PYTHON ?= $(shell for p in python3.11 python3.12 python3.13 python3 python; do \
	$$p -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 14))' 2>/dev/null && echo $$p && break; done)
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
OUT ?= out
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.PHONY: help demo gallery test explore test-blender-all test-blender-window blender-extension blender-extensions lint typecheck pytest wheel matrix bench docs contract-report clean

help:
	@echo "make demo | test | lint | bench | docs | clean"

$(READY): pyproject.toml
	@test -n "$(PYTHON)" || { echo "Python 3.11, 3.12 or 3.13 was wanted, and none is on the PATH."; exit 2; }
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --editable ".[dev]"
	@touch $@

demo: $(READY)
	$(BIN)/contact demo --out $(OUT)/demo

# The pages with pictures: docs/gallery.md, and those of docs/tutorial.md.
gallery: $(READY)
	$(BIN)/contact gallery --all --out docs
	$(BIN)/python .ci/tutorial.py

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports

typecheck: $(READY)
	$(BIN)/mypy

pytest: $(READY)
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 NUMBA_NUM_THREADS=1 $(BIN)/pytest -n 2 --dist loadfile --no-loadscope-reorder -q

# 500 processes that edit and save killed at random, 20 workers of a batch, 1000 damages of each stored format; each reader
# FUZZ seconds long given files that were spoilt at random; then the laws on examples that nobody drew before, ROUNDS times over.
ROUNDS ?= 5
FUZZ ?= 60
explore: $(READY)
	CONTACT_KILLS=500 CONTACT_BATCH_KILLS=20 $(BIN)/pytest -n 2 -q tests/core/edit/test_journal.py tests/core/farm -k kill
	CONTACT_FLIPS=1000 $(BIN)/pytest -n 2 -q tests/core/test_sealed.py
	CONTACT_FUZZ=$(FUZZ) $(BIN)/pytest -n 2 -q tests/fire/test_readers.py
	for round in $$(seq $(ROUNDS)); do OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 NUMBA_NUM_THREADS=1 \
		$(BIN)/pytest -n 2 --dist loadfile -q -m hypothesis --hypothesis-profile explore || exit 1; done

# Blender 4.5 LTS, 5.0 and 5.2, each in an environment of its own (make test has 5.0 already).
test-blender-all: $(READY)
	$(BIN)/python adapters/blender/run_tests.py --all

# A Blender with a window (CONTACT_BLENDER, else `blender`), under Xvfb, with mouse and keys; skips where there is none.
test-blender-window: $(READY)
	$(BIN)/pytest -q -rs tests/adapters/blender_window

# The zip that an artist installs, for this platform; BLENDER_PYTHON=3.13 for Blender 5.1 and later.
BLENDER_PYTHON ?= 3.11
blender-extension: $(READY)
	$(BIN)/python adapters/blender/build_extension.py --python $(BLENDER_PYTHON)

# Those of all platforms, with the sizes and hashes of their wheels.
blender-extensions: $(READY)
	$(BIN)/python adapters/blender/build_extension.py --all

wheel: $(READY)
	$(BIN)/python .ci/wheel.py

matrix: $(READY)
	$(BIN)/python .ci/matrix.py

test: lint typecheck pytest wheel matrix

bench: $(READY)
	$(BIN)/python -m benchmarks

clean:
	rm -rf $(VENV) .venvs $(OUT) build dist site .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache

docs: $(READY)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --site-dir site

contract-report: $(READY)
	$(BIN)/pytest -q --collect-only -p no:xdist tests/contract tests/adapters tests/plugins --contact-report-file docs/contract-report.md > /dev/null
