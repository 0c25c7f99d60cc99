"""The contract of kinds of jobs. Subclass it and give the fixtures `kind` and `example`, a job in `tmp_path`."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterator
from dataclasses import astuple
from functools import cache
from pathlib import Path, PurePosixPath
from typing import Any

import pytest

from contact_core.errors import Cancelled, ContactError
from contact_core.farm.inputs import noting_files
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.slots import JobKind, JobOutcome, JobRequest
from contact_core.progress import NO_PROGRESS, CallbackProgress, Progress
from contact_core.testing.contract import Contract, needs

GARBAGE = (b"", b"\x00", b"\xff\xfe{[(", b"{" * 5000, b"schema = 1\n", bytes(range(256)) * 20)


@cache
def plugins() -> PluginManager:
    """What every job of the suite is run with."""
    return PluginManager()


def run(kind: JobKind, path: Path, folder: Path, progress: Progress = NO_PROGRESS, **more: Any) -> JobOutcome:
    return kind.run(JobRequest(path, folder, **more), plugins(), progress)


def content(folder: Path) -> dict[str, bytes]:
    """The bytes of all files below a folder, by path."""
    found = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in found}


def told(refusal: pytest.ExceptionInfo[ContactError]) -> str:
    """The sentence of a refusal, which has to be one."""
    sentence = str(refusal.value)
    assert len(sentence.split()) >= 4 and "Traceback" not in sentence, sentence
    return sentence


class JobKindContract(Contract):
    """Fixtures: `kind`, a JobKind; `example`, the path of a sound job in `tmp_path`; `reads`, the files beyond it
    that the job reads (none by default); `broken`, a job that cannot be done (its file cut in half by default)."""

    about, letter = "kind of job", "J"

    @pytest.fixture
    def reads(self, example: Path) -> list[Path]:
        return []

    @pytest.fixture
    def broken(self, example: Path) -> Path:
        path = example.with_name(f"broken_{example.name}")
        data = example.read_bytes()
        path.write_bytes(data[: len(data) // 2])
        return path

    def comparable(self, name: str, data: bytes) -> bytes:
        """A result's bytes without what may differ each time, such as the seconds that it took."""
        return data

    def results(self, folder: Path) -> dict[str, bytes]:
        return {name: self.comparable(name, data) for name, data in content(folder).items()}

    @pytest.fixture
    def out(self, example: Path) -> Path:
        """A folder that is not there yet, beside the job."""
        return example.parent / "results" / example.stem

    def test_j01_is_named(self, kind: JobKind) -> None:
        """Has a name, says in a sentence what it is, and has endings in lower case that begin with a dot."""
        assert kind.name == kind.name.strip() != ""
        assert len(kind.summary.split()) >= 3, kind.summary
        assert isinstance(kind.suffixes, tuple) and kind.suffixes
        for suffix in kind.suffixes:
            assert suffix.startswith(".") and suffix == suffix.lower(), suffix

    def test_j02_claims_its_jobs_and_raises_for_none(self, kind: JobKind, example: Path) -> None:
        """Claims a sound job; for files that are empty, damaged or gone it says yes or no and raises nothing."""
        assert kind.claims(example) is True
        for number, data in enumerate(GARBAGE):
            path = example.with_name(f"odd{number}{example.suffix}")
            path.write_bytes(data)
            assert isinstance(kind.claims(path), bool), data[:8]
        assert isinstance(kind.claims(example.with_name(f"gone{example.suffix}")), bool)
        (example.parent / f"folder{example.suffix}").mkdir()
        assert isinstance(kind.claims(example.parent / f"folder{example.suffix}"), bool)

    def test_j03_places_what_it_names(self, kind: JobKind, example: Path, out: Path) -> None:
        """Makes the folder, and every file that it names lies there, and no other; its picture is one of them."""
        outcome = run(kind, example, out)
        assert outcome.files and len(set(outcome.files)) == len(outcome.files)
        for name in outcome.files:
            pure = PurePosixPath(name)
            assert not pure.is_absolute() and ".." not in pure.parts, name
        assert set(content(out)) == set(outcome.files)
        assert outcome.picture is None or outcome.picture in outcome.files

    def test_j04_says_how_it_went(self, kind: JobKind, example: Path, out: Path) -> None:
        """Badness is a number from 0, above 1 where something fails and no more than 1 where nothing does; the rest
        is plain text that JSON holds."""
        outcome = run(kind, example, out)
        assert isinstance(outcome, JobOutcome)
        assert math.isfinite(outcome.badness) and outcome.badness >= 0.0
        assert outcome.badness >= 1.0 if outcome.failures else outcome.badness <= 1.0, outcome
        texts = [*outcome.failures, *outcome.notes, *outcome.files]
        assert all(isinstance(text, str) and text.strip() for text in texts)
        for name, value, fails in outcome.rows:
            assert isinstance(name, str) and isinstance(value, str) and isinstance(fails, bool)
        json.dumps(astuple(outcome)[:-1], allow_nan=False)

    def test_j05_leaves_everything_else_alone(
        self, kind: JobKind, example: Path, out: Path, capfd: pytest.CaptureFixture[str]
    ) -> None:
        """The job's files and all that lies beside them are the same bytes, nothing is left there, and the process
        stands in its folder with its environment."""
        before, where, variables = content(example.parent), Path.cwd(), dict(os.environ)
        run(kind, example, out)
        after = content(example.parent)
        inside = out.relative_to(example.parent).as_posix() + "/"
        assert {name: data for name, data in after.items() if not name.startswith(inside)} == before
        assert Path.cwd() == where
        assert dict(os.environ) == variables
        assert capfd.readouterr().out == "", "what a job prints would stand within the JSON of the batch"

    def test_j06_gives_the_same_again(self, kind: JobKind, example: Path, out: Path) -> None:
        """Done again, elsewhere or over its own results, it gives the same bytes and the same outcome."""
        first = run(kind, example, out)
        results = self.results(out)
        elsewhere = run(kind, example, out.with_name("elsewhere"))
        assert self.results(out.with_name("elsewhere")) == results
        over = run(kind, example, out)
        assert self.results(out) == results
        assert astuple(elsewhere)[:-1] == astuple(over)[:-1] == astuple(first)[:-1]

    def test_j07_its_inputs_are_known(self, kind: JobKind, example: Path, out: Path, reads: list[Path]) -> None:
        """Every file that decides the result is opened by Python, which notes it, or named among the inputs."""
        with noting_files() as noted:
            outcome = run(kind, example, out)
        known = set(noted) | set(map(os.path.realpath, outcome.inputs))
        assert all(path.is_absolute() for path in outcome.inputs)
        for path in (example, *reads):
            assert os.path.realpath(path) in known, f"a change of {path.name} would not be seen"

    def test_j08_is_all_or_nothing_when_cancelled(self, kind: JobKind, example: Path, out: Path) -> None:
        """Tells how far it is; cancelled at any of these moments it raises Cancelled, or ends, and its folder holds
        all results or none."""
        moments: list[str] = []
        whole = set(run(kind, example, out, CallbackProgress(lambda _, text: moments.append(text))).files)
        assert moments, "a job that tells nothing can be neither watched nor stopped"
        for stop in sorted({0, len(moments) // 2, len(moments) - 1}):
            folder = out.with_name(f"stopped{stop}")
            try:
                run(kind, example, folder, CallbackProgress(_stopping(stop)))
            except Cancelled:
                assert not content(folder), sorted(content(folder))
            else:
                assert set(content(folder)) == whole

    def test_j09_refuses_a_broken_job_in_words(self, kind: JobKind, broken: Path, out: Path) -> None:
        """A job that cannot be done is refused in a sentence, and what lay in its folder is as it was."""
        out.mkdir(parents=True)
        (out / "kept.txt").write_text("from before")
        with pytest.raises(ContactError) as refusal:
            run(kind, broken, out)
        told(refusal)
        assert content(out) == {"kept.txt": b"from before"}

    @needs("solving")
    def test_j10_heeds_a_solver_or_refuses_it(self, kind: JobKind, example: Path, out: Path) -> None:
        """A solver that nobody has is refused in a sentence that speaks of it."""
        with pytest.raises(ContactError) as refusal:
            run(kind, example, out, solver="nobody")
        assert "solver" in told(refusal)

    @needs("solving")
    def test_j11_heeds_frames_or_refuses_them(self, kind: JobKind, example: Path, out: Path) -> None:
        """Frames are refused in a sentence that speaks of them, or other frames give other results."""
        run(kind, example, out)
        try:
            run(kind, example, out.with_name("framed"), frames=(1.0, 3.0))
        except ContactError as error:
            assert "frames" in str(error) and not content(out.with_name("framed"))
        else:
            assert content(out.with_name("framed")) != content(out)


def _stopping(moment: int) -> Callable[[float | None, str], None]:
    """Cancels at one telling, and at those after it."""
    tellings: Iterator[int] = iter(range(1 << 30))

    def tell(fraction: float | None, text: str) -> None:
        if next(tellings) >= moment:
            raise Cancelled("enough")

    return tell
