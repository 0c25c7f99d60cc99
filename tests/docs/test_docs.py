"""The documentation cannot drift: its code runs, its hooks are the code's, its tables are compared."""

from __future__ import annotations

import inspect
import json
import os
import pkgutil
import re
import shutil
import subprocess
import sys
import tomllib
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from contact_core.plugins import hookspecs
from contact_core.plugins.registry import AXIS_GENERATORS
from contact_core.plugins.slot import SLOTS, Slot
from contact_core.testing import SUITES
from contact_core.testing.contract import Contract, clause_table

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"^```(\w+)[^\n]*\n(.*?)^```", re.MULTILINE | re.DOTALL)
HOOKS = [name for name in vars(hookspecs) if name.startswith("contact_")]
TITLES = {"pose_solvers": "pose-solvers", "cli": "sub-commands"}


FILE = re.compile(r'^```python title="(\w+\.py)"\n(.*?)^```', re.MULTILINE | re.DOTALL)


def blocks(page: Path, language: str) -> list[str]:
    """Code that a reader types; what has the name of a file as its title is a file, and no part of these."""
    text = FILE.sub("", page.read_text(encoding="utf-8"))
    return [code for found, code in BLOCK.findall(text) if found == language]


def files(page: Path) -> dict[str, str]:
    """Files of a page, by name."""
    return dict(FILE.findall(page.read_text(encoding="utf-8")))


WITH_CODE = [
    page for page in PAGES if (code := blocks(page, "python")) and "bpy" not in "".join(code)
]  # that runs in Blender


@pytest.mark.parametrize("page", WITH_CODE, ids=lambda page: str(page.relative_to(ROOT)))
def test_the_code_of_every_page_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The blocks of a page run one after the other, as a reader would type them."""
    monkeypatch.chdir(tmp_path)
    module = ModuleType("page")
    monkeypatch.setitem(sys.modules, "page", module)
    for number, code in enumerate(blocks(page, "python"), start=1):
        exec(compile(code, f"{page.name}, block {number}", "exec"), module.__dict__)


def test_every_hook_is_documented_with_its_signature() -> None:
    text = (ROOT / "docs" / "plugins" / "hooks.md").read_text(encoding="utf-8")
    assert re.findall(r"^## (\w+)$", text, re.MULTILINE) == HOOKS
    for name in HOOKS:
        function = getattr(hookspecs, name)
        assert f"\n{name}{inspect.signature(function)}\n" in text, name
        assert (function.__doc__ or "").strip() in text, name


def page_of(slot: Slot[Any]) -> Path:
    name = slot.hook.removeprefix("contact_")
    return ROOT / "docs" / "plugins" / f"{TITLES.get(name, name.replace('_', '-'))}.md"


def test_every_slot_has_a_page_with_a_plugin_and_its_proof() -> None:
    assert SLOTS.keys() == {name for name in HOOKS if "choose" not in name} - {
        "contact_document_changed",
        "contact_pose_solved",
    }
    for slot in SLOTS.values():
        (plugin, code), (test, proof) = files(page_of(slot)).items()
        assert test == f"test_{plugin}" and plugin.removesuffix(".py") in proof
        assert f"@hookimpl\ndef {slot.hook}():" in code


def test_a_generator_takes_less_than_thirty_lines() -> None:
    code, _ = files(ROOT / "docs" / "plugins" / "axis-generators.md").values()
    assert len([line for line in code.splitlines() if line.strip()]) < 30


@pytest.fixture(scope="module")
def pasted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files of all pages, as a new author copies them."""
    folder = tmp_path_factory.mktemp("pasted")
    for slot in SLOTS.values():
        for name, code in files(page_of(slot)).items():
            folder.joinpath(name).write_text(code, encoding="utf-8")
    return folder


def typed(line: str, folder: Path, **variables: str) -> str:
    """What a shell line prints in a folder, with the programs of this environment; it must succeed."""
    if shutil.which("bash") is None:
        pytest.skip("the pages' shell lines are for bash")
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    environment = {**os.environ, "PATH": path, "PYTHONDONTWRITEBYTECODE": "1", **variables}
    run = subprocess.run(
        ["bash", "-ec", line], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stdout[-3000:] + run.stderr[-3000:]
    return run.stdout


def test_the_steps_for_a_new_author_work(pasted: Path, tmp_path: Path) -> None:
    """The page's shell lines, typed in an empty folder that holds the two files of one page."""
    for name in files(page_of(AXIS_GENERATORS)):
        (tmp_path / name).write_bytes((pasted / name).read_bytes())
    first, _ = blocks(ROOT / "docs" / "plugins" / "index.md", "bash")
    told = typed(first, tmp_path)
    assert "house_axes  (CONTACT_PLUGINS=house_axes, environment)\n    axis generator: from_the_middle" in told
    assert "axis generator FromTheMiddle" in told and "BROKEN" not in told


def test_every_pasted_plugin_is_listed_without_a_problem(pasted: Path) -> None:
    modules = {next(iter(files(page_of(slot)))).removesuffix(".py"): slot for slot in SLOTS.values()}
    told = typed("contact plugins --json", pasted, PYTHONPATH=".", CONTACT_PLUGINS=",".join(modules))
    records = {record["name"]: record for record in json.loads(told)}
    for name, slot in modules.items():
        assert records[name]["problems"] == [], name
        assert list(records[name]["offers"]) == [slot.noun] and records[name]["offers"][slot.noun], name


def test_every_pasted_plugin_keeps_its_contract(pasted: Path) -> None:
    told = typed("pytest -q -p no:cacheprovider --contact-report-file report.json", pasted)
    assert " passed" in told and "failed" not in told
    broken = json.loads((pasted / "report.json").read_text(encoding="utf-8"))["broken"]
    assert len(broken) == len(SUITES) and not any(broken.values()), broken


def suite(name: str) -> type[Contract]:
    module = import_module(f"contact_core.testing.{name}_contract")
    found = getattr(module, "".join(word.title() for word in name.split("_")) + "Contract")
    assert issubclass(found, Contract)
    return found


@pytest.mark.parametrize("name", SUITES)
def test_the_clauses_stand_in_the_adapters_readme(name: str) -> None:
    assert clause_table(suite(name)) in (ROOT / "adapters" / "README.md").read_text(encoding="utf-8")


def test_the_contract_report_is_the_suites(tmp_path: Path) -> None:
    """docs/contract-report.md says what a collection of the contract tests says; that they hold is what CI runs."""
    run = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "--collect-only", "-p", "no:xdist", "-p", "no:cacheprovider",
         "tests/contract", "tests/adapters", "tests/plugins", "--contact-report-file", str(tmp_path / "report.md")],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stdout[-2000:]
    told = (ROOT / "docs" / "contract-report.md").read_text(encoding="utf-8")
    assert told == (tmp_path / "report.md").read_text(encoding="utf-8"), "run `make contract-report`"


def test_the_site_builds_without_warnings(tmp_path: Path) -> None:
    pytest.importorskip("mkdocs")
    pytest.importorskip("material")
    run = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path / "site")],
        cwd=ROOT, capture_output=True, text=True, check=False, env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
    )  # fmt: skip
    assert run.returncode == 0 and "WARNING" not in run.stderr, run.stderr[-3000:]
    assert (tmp_path / "site" / "index.html").exists()


def required(extra: str | None) -> set[str]:
    """Names of the distributions that the core (None) or one of its extras asks for."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    listed = project["dependencies"] if extra is None else project["optional-dependencies"][extra]
    return {re.split(r"[<>=\[ ]", line)[0] for line in listed}


def test_every_library_has_its_licence_in_the_table() -> None:
    rows = re.findall(r"^\| ([^|]+) \| (\w+) \|", (ROOT / "docs" / "licences.md").read_text(encoding="utf-8"), re.M)
    told = {
        extra: {name.strip().lower() for cell, of in rows if of == extra for name in cell.split(",")}
        for _, extra in rows
    }
    for extra in ("io", "solvers", "samples", "viewer", "app", "usd", "blender", "engines", "testing"):
        assert required(extra) <= told[extra], extra
    assert required(None) <= told["core"]


def test_the_page_for_studios_names_what_the_core_needs_and_every_variable() -> None:
    page = (ROOT / "docs" / "studios.md").read_text(encoding="utf-8")
    (sentence,) = re.findall(r"The core needs ([^.]+)\.", page)
    assert set(re.split(r", | and ", sentence)) == required(None)
    sources = [path for folder in ("contact_core", "plugins", "adapters") for path in (ROOT / folder).rglob("*.py")]
    used = {
        word for path in sources for word in re.findall(r"\bCONTACT_[A-Z]+\b", path.read_text(encoding="utf-8"))
    }
    assert used - {"CONTACT_API"} == set(re.findall(r"^\| `(CONTACT_\w+)` \|", page, re.MULTILINE))


def test_no_committed_file_names_a_registry() -> None:
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("not a git checkout")
    words = ("index-" + "url", "--extra-" + "index", "pypi." + "org/simple", "/opt/" + "pypi")
    for name in filter(None, listed.stdout.split("\0")):
        path = ROOT / name
        if path.suffix not in (".png", ".npz") and path.is_file():
            text = path.read_text(encoding="utf-8", errors="ignore")
            assert not [word for word in words if word in text], name


SCRIPTS = sorted((ROOT / "examples").glob("[0-9]*.py"))
RUNNING = [
    path for path in SCRIPTS if "import bpy" not in path.read_text(encoding="utf-8")
]  # those of Blender run in it


@pytest.mark.parametrize("script", RUNNING, ids=lambda script: script.name)
def test_every_example_script_runs(script: Path, tmp_path: Path) -> None:
    run = subprocess.run([sys.executable, str(script)], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr[-2000:]
    assert run.stdout.strip()


NAMED = re.compile(r"`(contact_core(?:\.\w+)+)`")


def test_what_the_architecture_names_exists_and_its_picture_is_current() -> None:
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    names = NAMED.findall(text)
    assert len(names) > 20
    for name in names:
        assert pkgutil.resolve_name(name) is not None, name
    checked = subprocess.run([sys.executable, str(ROOT / ".ci" / "floors.py"), "--check"], check=False)
    assert checked.returncode == 0, "run python .ci/floors.py: the floors have changed"


def test_the_page_of_examples_names_every_script() -> None:
    page = (ROOT / "docs" / "examples.md").read_text(encoding="utf-8")
    assert re.findall(r"^\| `(\w+\.py)`", page, re.MULTILINE) == [path.name for path in SCRIPTS]
