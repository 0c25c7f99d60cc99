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
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
TESTS = REPOSITORY / "tests" / "adapters" / "blender"
DEFAULT = "5.0"
PYTHON_OF = {"4.2": "3.11", "4.5": "3.11", "5.0": "3.11", "5.1": "3.13", "5.2": "3.13"}  # as the wheels are tagged
PATIENCE = 600  # seconds for one process of Blender
LAST_WORDS = 20  # seconds for a process that hangs to say where
INSTALLING = 3600  # seconds to fetch and unpack a wheel of 400 MB
MATRIX = ("4.5", "5.0", "5.2")
# Runs a script and leaves without Blender's own end, which as a module now and then crashes (4.2) or hangs (4.5).
SCRIPT = """
import os, runpy, sys, traceback
sys.argv = sys.argv[1:]
sys.path[0] = os.path.dirname(sys.argv[0])
code = 1
try:
    runpy.run_path(sys.argv[0], run_name="__main__")
    code = 0
except SystemExit as end:
    code = end.code if isinstance(end.code, int) else int(end.code is not None)
except BaseException:
    traceback.print_exc()
finally:
    sys.stdout.flush(), sys.stderr.flush()
    os._exit(code)
"""
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
            _installing(_interpreter(PYTHON_OF[blender]), "-m", "venv", str(folder))
        pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        try:
            _installing(str(python), *pip, f"bpy=={blender}.*", "--editable", f"{REPOSITORY}[testing,samples]")
        except Unavailable as reason:
            if not ready.is_file():  # else an older one serves, without a network too
                raise Unavailable(f"bpy {blender} could not be installed: {reason}") from reason
        else:
            ready.write_text(wanted)
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
    return _started(python, ["-c", SCRIPT, str(script.resolve()), *arguments], {})


def _started(python: Path, command: list[str], variables: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """Run to the end, or for PATIENCE; a Blender that hangs is a failure that says so, and where.

    Blender's temporary files and its user's settings are in a folder that goes with the process, however it ends.
    """
    with tempfile.TemporaryDirectory(prefix="contact-blender-", ignore_cleanup_errors=True) as folder:
        own = {**dict.fromkeys(("TMPDIR", "TEMP", "TMP"), folder), "BLENDER_USER_RESOURCES": folder}
        own["PYTHON_OF_THE_SUITE"] = sys.executable  # which may have what no Blender has: OpenUSD's own library
        process = subprocess.Popen(
            [str(python), "-X", "faulthandler", *command],
            cwd=REPOSITORY,
            env={**os.environ, **ONE_CORE, **own, **variables},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            start_new_session=True,  # so that what it starts ends with it
        )
        try:
            said, complaint = process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            said, complaint = _last_words(process)
            complaint += f"\nBlender did not end within {PATIENCE} seconds; where its threads were stands above."
            return subprocess.CompletedProcess(command, 1, said, complaint)
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    return subprocess.CompletedProcess(command, process.returncode, said, complaint)


def _last_words(process: subprocess.Popen[str]) -> tuple[str, str]:
    """What a process that hangs has said, with the stacks that Python's fault handler prints when it is aborted."""
    if hasattr(resource, "prlimit"):  # no core file in the source tree
        resource.prlimit(process.pid, resource.RLIMIT_CORE, (0, 0))
    process.send_signal(signal.SIGABRT)
    try:
        return process.communicate(timeout=LAST_WORDS)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        return process.communicate()


def _installing(*command: str) -> None:
    """A step of making an environment. Raises Unavailable with the last line that it said."""
    try:
        made = subprocess.run(command, capture_output=True, text=True, timeout=INSTALLING)
    except subprocess.TimeoutExpired as late:
        raise Unavailable(f"{' '.join(command[1:4])} did not end within {INSTALLING} seconds") from late
    if made.returncode:
        raise Unavailable((made.stderr.strip() or made.stdout.strip() or "it said nothing").splitlines()[-1])


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
        try:
            asked = subprocess.run(
                [candidate, "-c", "import sys, venv; print('%d.%d' % sys.version_info[:2])"],
                capture_output=True,
                text=True,
                timeout=60,
            )
        except (OSError, subprocess.TimeoutExpired):
            continue
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
