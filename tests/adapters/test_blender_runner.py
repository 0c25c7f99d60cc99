"""The runner of Blender's tests: nothing hangs for ever, nothing stays behind. Any Python serves as the Blender."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

pytest.importorskip("fcntl", reason="the runner locks and signals as POSIX systems do")

RUNNER = Path(__file__).parents[2] / "adapters" / "blender" / "run_tests.py"
PYTHON = Path(sys.executable)


@pytest.fixture
def run_tests() -> ModuleType:
    """A copy of the module of this test's own, to change its patience."""
    spec = importlib.util.spec_from_file_location("run_tests_under_test", RUNNER)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def script(folder: Path, text: str) -> Path:
    path = folder / "script.py"
    path.write_text(text)
    return path


def test_temporary_files_and_settings_go_with_the_process(run_tests: ModuleType, tmp_path: Path) -> None:
    """Also of one that leaves without its own end, as Blender's tests do."""
    text = """
import os, tempfile
print(tempfile.mkdtemp(prefix="blender_"), os.environ["BLENDER_USER_RESOURCES"], sep="\\n", flush=True)
os._exit(3)
"""
    done = run_tests.run_script(PYTHON, script(tmp_path, text))
    assert done.returncode == 3, done.stderr
    assert len(done.stdout.splitlines()) == 2
    for folder in map(Path, done.stdout.splitlines()):
        assert "contact-blender-" in str(folder) and not folder.exists()


@pytest.mark.parametrize(
    ("end", "code", "word"),
    [("", 0, ""), ("sys.exit(7)", 7, ""), ("sys.exit('no')", 1, ""), ("1 / 0", 1, "ZeroDivisionError")],
)
def test_a_script_ends_before_its_program_does(
    end: str, code: int, word: str, run_tests: ModuleType, tmp_path: Path
) -> None:
    """Blender's own end as a module is not to be trusted; arguments, neighbours and exit codes are as ever."""
    (tmp_path / "neighbour.py").write_text("NAME = 'next door'")
    text = f"""
import atexit, sys
from neighbour import NAME
atexit.register(lambda: print("the end of the program"))
print(NAME, sys.argv[1:], __name__)
{end}
"""
    done = run_tests.run_script(PYTHON, script(tmp_path, text), "one", "two")
    assert done.stdout == "next door ['one', 'two'] __main__\n"
    assert done.returncode == code and word in done.stderr


def test_a_process_that_hangs_is_ended_in_words(
    run_tests: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_tests, "PATIENCE", 1)
    done = run_tests.run_script(PYTHON, script(tmp_path, "import time\nwhile True: time.sleep(1000)\n"))
    assert done.returncode == 1 and "did not end within 1 seconds" in done.stderr


@pytest.mark.parametrize("deaf", [False, True], ids=["aborts", "ignores being aborted"])
def test_a_process_that_hangs_says_where(
    deaf: bool, run_tests: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_tests, "LAST_WORDS", 1 if deaf else run_tests.LAST_WORDS)
    text = f"""
import signal, time
if {deaf}: signal.signal(signal.SIGABRT, signal.SIG_IGN)
def in_here():
    print("there", flush=True)
    while True: time.sleep(1000)
in_here()
"""
    process = subprocess.Popen(
        [PYTHON, "-X", "faulthandler", script(tmp_path, text)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        assert process.stdout is not None and process.stdout.readline() == "there\n"  # from here on it hangs
        _, complaint = run_tests._last_words(process)
        assert process.returncode is not None and (deaf or "in_here" in complaint)
    finally:
        process.kill()
        process.wait()


def test_an_environment_that_cannot_be_made_says_why(run_tests: ModuleType) -> None:
    with pytest.raises(run_tests.Unavailable, match="no module named nothing_of_this_name"):
        run_tests._installing(sys.executable, "-c", "raise SystemExit('no module named nothing_of_this_name')")
