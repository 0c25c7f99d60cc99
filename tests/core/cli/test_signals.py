"""Signals to the real program: it ends in a word with the shell's exit code, and leaves nothing half done."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of other systems differ")

PLUGIN = """
import sys, time
from pathlib import Path
from contact_core.atomic_set import replacing_set
from contact_core.plugins import hookimpl

class Publish:
    name, summary = "publish", "fill a staging folder and wait"
    def configure(self, parser): parser.add_argument("folder", type=Path)
    def run(self, arguments):
        with replacing_set(arguments.folder, ("pose",)) as stage:
            (stage / "pose").write_text("half")
            print("ready", flush=True)
            time.sleep(60)
        return 0

@hookimpl
def contact_cli(): return [Publish]
"""


def _heed_interrupts() -> None:
    """Shells have what they run in the background ignore SIGINT, and children inherit that."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def publishing(tmp_path: Path) -> subprocess.Popen[str]:
    """A run of the program that stands in the middle of writing a set of files into `out`."""
    (tmp_path / "publishing.py").write_text(PLUGIN)
    process = subprocess.Popen(
        [sys.executable, "-m", "contact_core", "publish", str(tmp_path / "out")],
        env={
            **os.environ,
            "CONTACT_PLUGINS": "publishing",
            "PYTHONPATH": os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]),
        },
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=_heed_interrupts,
    )  # fmt: skip
    assert process.stdout is not None and process.stdout.readline() == "ready\n"
    return process


@pytest.mark.parametrize(
    ("number", "code", "word"), [(signal.SIGTERM, 143, "terminated"), (signal.SIGINT, 130, "interrupted")]
)
def test_a_signal_leaves_no_staging_folder(tmp_path: Path, number: int, code: int, word: str) -> None:
    process = publishing(tmp_path)
    process.send_signal(number)
    assert process.communicate(timeout=60) == ("", f"contact: {word}.\n")
    assert process.returncode == code and not (tmp_path / "out").exists()


def test_the_next_run_removes_what_a_killed_one_left_and_nothing_that_is_in_use(tmp_path: Path) -> None:
    killed, living = publishing(tmp_path), publishing(tmp_path)
    killed.kill()
    killed.communicate(timeout=60)
    assert len(list((tmp_path / "out").iterdir())) == 2
    third = publishing(tmp_path)
    assert len(list((tmp_path / "out").iterdir())) == 2  # the living one's and its own
    for process in (living, third):
        process.terminate()
        process.communicate(timeout=60)
    assert list((tmp_path / "out").iterdir()) == []


@pytest.mark.parametrize("delay", [0.0, 0.02, 0.05, 0.1, 0.2])
def test_an_interrupt_at_any_moment_is_a_word(delay: float) -> None:
    """From the first line of the program on, which it reports here by itself; before that it is Python's."""
    code = (
        "import os; import contact_core.__main__ as program\n"
        "real = program.signal.signal\n"
        "def told(*arguments):\n"
        "    before = real(*arguments); os.write(1, b'x'); program.signal.signal = real; return before\n"
        "program.signal.signal = told\n"
        "import sys; sys.argv = ['contact', 'plugins']; sys.exit(program.main())"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=_heed_interrupts
    )
    assert process.stdout is not None and process.stdout.read(1) == b"x"
    time.sleep(delay)
    process.send_signal(signal.SIGINT)
    error = process.communicate(timeout=60)[1]
    assert (process.returncode, error) in ((130, b"contact: interrupted.\n"), (0, b""))


def test_an_interrupt_that_python_drops_comes_again() -> None:
    """One that falls into the callback of a weak reference is ignored by Python, with a traceback."""
    code = (
        "import signal, sys, time, weakref\n"
        "import contact_core.__main__ as program, contact_core.cli as cli\n"
        "class Thing: pass\n"
        "def run():\n"
        "    thing = Thing()\n"
        "    watched = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGINT))\n"
        "    try: del thing; time.sleep(30)\n"
        "    except KeyboardInterrupt: return 130\n"
        "    return 0\n"
        "cli.main = run\n"
        "sys.exit(program.main())"
    )
    run = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True, text=True, preexec_fn=_heed_interrupts, check=False, timeout=20,  # it wakes who sleeps
    )  # fmt: skip
    assert (run.returncode, run.stderr) == (130, "")
