"""Real processes in real trouble: killed while saving, out of room, two at once, in folders that refuse them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from contact_core.document.schema import dump_document, parse_document
from contact_core.edit.commands import SetExtra
from contact_core.edit.recovery import journal_path
from contact_core.session import Session

pytestmark = pytest.mark.skipif(os.name != "posix", reason="other systems have other limits and permissions")


START = """
import os, resource, sys
from pathlib import Path
from contact_core.edit.commands import SetExtra
from contact_core.errors import ContactError, FileRefused
from contact_core.session import Session
path = Path(sys.argv[1])
"""


def start(body: str, *arguments: object) -> subprocess.Popen[str]:
    """A Python that runs `body` after START, with arguments from sys.argv[1] (the path) on."""
    command = [sys.executable, "-c", START + body, *map(str, arguments)]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def wait_for(process: subprocess.Popen[str], line: str) -> None:
    assert process.stdout is not None and process.stdout.readline() == line + "\n"


def kill(process: subprocess.Popen[str]) -> None:
    process.kill()
    process.communicate(timeout=60)


# The temporary file of the second save is written and not renamed yet.
SAVE_AND_HANG = """
session = Session.open(path, discover=False)
session.do(SetExtra("a", 1))
session.save()
session.do(SetExtra("a", 2))
session._file._journal.flush()
os.fsync = lambda file: (print("saving", flush=True), sys.stdin.read())
session.save()
"""


def test_who_is_killed_while_saving_loses_nothing_and_leaves_no_litter(tmp_path: Path) -> None:
    """Temporary files of other documents, whose writers may be at work, stay, and so does what only looks alike."""
    paths = [tmp_path / f"{'n' * 50}1.json", tmp_path / f"{'n' * 50}2.json"]
    for path in paths:
        process = start(SAVE_AND_HANG, path)
        wait_for(process, "saving")
        kill(process)
    alike = tmp_path / f".{paths[0].name[:40]}.notes.json"
    alike.write_text("mine")
    hidden = {found for found in tmp_path.iterdir() if found.name.startswith(".")}
    assert len(hidden) == 3
    with Session.open(paths[0], discover=False) as session:
        assert dict(session.document.extras) == {"a": 2} and not session.history.is_clean
        left = {found for found in tmp_path.iterdir() if found.name.startswith(".")}
        assert len(left) == 2 and alike in left
    with Session.open(paths[1], discover=False) as session:
        assert dict(session.document.extras) == {"a": 2}
    assert [found for found in tmp_path.iterdir() if found.name.startswith(".")] == [alike]


FILL_THE_DISK = """
session = Session.open(path, discover=False)
session.do(SetExtra("number", 0))
session.save()
limit, size = int(sys.argv[2]), int(sys.argv[3])
resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))  # no file gets longer than this
for number in range(1, 40):
    try:
        session.do(SetExtra(f"x{number}", "y" * size))
        print("did", number, flush=True)
        if number % 3 == 0:
            session.save()
            print("saved", number, flush=True)
    except FileRefused as error:
        print("refused", number, error, flush=True)
os.kill(os.getpid(), 9)
"""


@settings(max_examples=3, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(limit=st.integers(600, 20_000), size=st.integers(1, 3_000))
@example(limit=600, size=3000)
@example(limit=775, size=1)  # room for the document, none for the line that says that it is saved
def test_a_full_disk_loses_no_acknowledged_edit(
    tmp_path_factory: pytest.TempPathFactory, limit: int, size: int
) -> None:
    path = tmp_path_factory.mktemp("full") / "document.json"
    told = start(FILL_THE_DISK, path, limit, size).communicate(timeout=120)[0].splitlines()
    did = {f"x{line.split()[1]}" for line in told if line.startswith("did")}
    refused = [line for line in told if line.startswith("refused")]
    assert all("File too large" in line for line in refused)
    assert refused or limit > 40 * size
    with Session.open(path, discover=False) as session:
        assert set(session.document.extras) == did | {"number"}
    saved = parse_document(path.read_bytes())
    last = max((int(line.split()[1]) for line in told if line.startswith("saved")), default=0)
    assert {name for name in did if int(name[1:]) <= last} | {"number"} == set(saved.extras)


WRITE_IN_TURN = """
print("ready", flush=True)
sys.stdin.readline()
session = Session.open(path, discover=False)
print("reads" if session.read_only else "writes", flush=True)
try:
    session.do(SetExtra(sys.argv[2], 1))
    session.save()
    print("saved", flush=True)
except ContactError as error:
    print(error, flush=True)
sys.stdin.readline()
"""


def test_of_several_writers_at_once_one_writes_and_the_others_are_told(tmp_path: Path) -> None:
    path = tmp_path / "document.json"
    with Session.open(path, discover=False) as session:
        session.save()
    writers = [start(WRITE_IN_TURN, path, f"writer {number}") for number in range(4)]
    for writer in writers:
        wait_for(writer, "ready")
    for writer in writers:
        assert writer.stdin is not None
        writer.stdin.write("\n")
        writer.stdin.flush()
    told = []
    for writer in writers:
        assert writer.stdout is not None
        told.append((writer.stdout.readline().strip(), writer.stdout.readline().strip()))
    for writer in writers:
        writer.communicate("\n", timeout=60)
    kinds = [kind for kind, _ in told]
    assert sorted(kinds) == ["reads"] * 3 + ["writes"]
    assert all("is open in " in line and "read-only" in line for kind, line in told if kind == "reads")
    winner = kinds.index("writes")
    assert told[winner][1] == "saved"
    assert dict(parse_document(path.read_bytes()).extras) == {f"writer {winner}": 1}


IN_A_FOLDER_THAT_REFUSES = """
with Session.open(Path(sys.argv[2]) / "warm.json", discover=False) as session:  # all modules are loaded
    session.do(SetExtra("a", 1))
    session.save()
if os.geteuid() == 0:
    os.setuid(65534)  # permissions do not bind an administrator
with Session.open(path, discover=False) as session:
    print(session.read_only, dict(session.document.extras), flush=True)
    print(*session.notes, flush=True)
    for act in (lambda: session.do(SetExtra("b", 1)), session.save):
        try:
            act()
            print("done", flush=True)
        except ContactError as error:
            print("refused:", error, flush=True)
"""


def test_a_folder_that_may_not_be_written_opens_read_only() -> None:
    """Not below pytest's folder, which is closed to everybody else."""
    with tempfile.TemporaryDirectory() as place, tempfile.TemporaryDirectory() as warm:
        folder = Path(place)
        path = folder / "document.json"
        with Session.open(path, discover=False) as session:
            session.do(SetExtra("a", 1))
            session.save()
        before = {found.name: found.read_bytes() for found in folder.iterdir()}
        folder.chmod(0o555)
        try:
            told = start(IN_A_FOLDER_THAT_REFUSES, path, warm).communicate(timeout=120)[0].splitlines()
        finally:
            folder.chmod(0o755)
        assert told[0] == "True {'a': 1}" and "it is opened read-only here" in told[1]
        assert all(line.startswith("refused:") for line in told[2:4]) and len(told) == 4
        assert {found.name: found.read_bytes() for found in folder.iterdir()} == before


@pytest.mark.parametrize("moment", [0, 4_102_444_800])
def test_a_clock_that_jumps_changes_nothing(tmp_path: Path, moment: int) -> None:
    """1970 or 2100, on the document or on its journal: no decision rests on the time of a file."""
    path = tmp_path / "document.json"
    for old in (path, journal_path(path)):
        process = start(SAVE_AND_HANG, path)
        wait_for(process, "saving")
        kill(process)
        os.utime(old, (moment, moment))
        with Session.open(path, discover=False) as session:
            assert dict(session.document.extras) == {"a": 2} and not session.history.is_clean
            session.save()
            assert path.read_bytes() == dump_document(session.document)
    assert -process.returncode == signal.SIGKILL
