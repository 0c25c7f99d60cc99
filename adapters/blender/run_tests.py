"""Blender's tests, each Blender in an environment of its own: `python adapters/blender/run_tests.py [--all]`.

A Blender is one process, one Python minor and one numpy, so it never shares an environment with the rest.
The main suite uses `environment()` and runs the same tests in one Blender (see tests/adapters/blender/conftest.py).
"""

from __future__ import annotations

import argparse
import contextlib
import fcntl
import hashlib
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
TESTS = REPOSITORY / "tests" / "adapters" / "blender"
DEFAULT = "5.0"
PYTHON_OF = {"4.2": "3.11", "4.5": "3.11", "5.0": "3.11", "5.1": "3.13", "5.2": "3.13"}  # as the wheels are tagged
PATIENCE = 600  # seconds for one process
MATRIX = ("4.5", "5.0", "5.2")
ONE_CORE = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")


class Unavailable(Exception):
    """This Blender cannot be had here; the text says why."""


def environment(blender: str = DEFAULT) -> Path:
    """The Python of an environment with this Blender and the project, made at first use. Raises Unavailable."""
    folder = REPOSITORY / ".venvs" / f"blender-{blender}"
    python, ready = folder / "bin" / "python", folder / ".ready"
    folder.parent.mkdir(exist_ok=True)
    with _alone(folder.with_suffix(".lock")):
        wanted = hashlib.sha256((REPOSITORY / "pyproject.toml").read_bytes()).hexdigest()
        if ready.is_file() and ready.read_text() == wanted:
            return python
        if not python.is_file():
            subprocess.run([_interpreter(PYTHON_OF[blender]), "-m", "venv", str(folder)], check=True)
        pip = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        made = subprocess.run(
            [*pip, f"bpy=={blender}.*", "--editable", f"{REPOSITORY}[testing]"], capture_output=True, text=True
        )
        if made.returncode == 0:
            ready.write_text(wanted)
        elif not ready.is_file():  # else an older one serves, without a network too
            raise Unavailable(f"bpy {blender} could not be installed: {made.stderr.strip().splitlines()[-1]}")
    return python


def modules() -> list[Path]:
    """The test modules; each runs in a process of its own."""
    return sorted(TESTS.glob("test_*.py"))


def run(python: Path, tests: list[str], *options: str, **variables: str) -> subprocess.CompletedProcess[str]:
    """One pytest process in a Blender environment."""
    command = ["-m", "pytest", "-p", "no:cacheprovider", "-q", *options, *tests]
    return _started(python, command, variables)


def run_script(python: Path, script: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """One script in a Blender environment."""
    return _started(python, [str(script), *arguments], {})


def _started(python: Path, command: list[str], variables: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """Run to the end, or for PATIENCE; a Blender that hangs is a failure that says so."""
    environ = {**os.environ, **ONE_CORE, **variables}
    try:
        return subprocess.run(
            [str(python), *command], cwd=REPOSITORY, env=environ, capture_output=True, text=True, timeout=PATIENCE
        )
    except subprocess.TimeoutExpired as late:
        said = late.stdout.decode() if isinstance(late.stdout, bytes) else late.stdout or ""
        return subprocess.CompletedProcess(command, 1, said, f"Blender did not end within {PATIENCE} seconds.")


@contextlib.contextmanager
def _alone(path: Path) -> Iterator[None]:
    """One process at a time: pytest-xdist's workers would make the same environment at once."""
    with path.open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _interpreter(version: str) -> str:
    """A Python of this minor version. Raises Unavailable."""
    named = shutil.which(f"python{version}")
    installed = sorted(Path.home().glob(f".pyenv/versions/{version}.*/bin/python"), reverse=True)
    for candidate in (sys.executable, *([named] if named else []), *map(str, installed)):
        asked = subprocess.run(
            [candidate, "-c", "import sys, venv; print('%d.%d' % sys.version_info[:2])"],
            capture_output=True,
            text=True,
        )
        if asked.returncode == 0 and asked.stdout.strip() == version:
            return candidate
    raise Unavailable(f"there is no Python {version} on this machine")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--blender", nargs="+", choices=sorted(PYTHON_OF), default=[DEFAULT])
    parser.add_argument("--all", action="store_true", help=f"the matrix: {', '.join(MATRIX)}")
    parser.add_argument("options", nargs="*", help="for pytest, after --")
    chosen = parser.parse_args()
    failed = 0
    for blender in MATRIX if chosen.all else chosen.blender:
        try:
            python = environment(blender)
        except Unavailable as reason:
            print(f"Blender {blender}: skipped, {reason}")
            continue
        for module in modules():
            result = run(python, [str(module)], *chosen.options)
            lines = result.stdout.strip().splitlines()
            print(f"Blender {blender}: {module.name}: {lines[-1] if lines else result.stderr.strip()}")
            if result.returncode:
                failed += 1
                print(result.stdout + result.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
