"""Kinds of jobs and proxy makers, each broken in one way. `test_job_mutants` judges them."""

from __future__ import annotations

import itertools
import json
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from contact_core.atomic_file import write_atomic
from contact_core.atomic_set import replacing_set
from contact_core.errors import FileRefused, InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.slots import JobOutcome, JobRequest
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.testing import meshes
from contact_core.testing.job_kind_contract import JobKindContract
from contact_core.testing.mutants import Mutant
from contact_core.testing.proxy_maker_contract import ProxyMakerContract

# -- kinds of jobs -------------------------------------------------------------------------------------------------


class Sums:
    """A sound kind, as small as one can be: the numbers of a file are summed, and named over a shared limit."""

    name = "sums"
    summary = "the sum of the numbers in a file"
    suffixes: tuple[str, ...] = (".sums",)

    def claims(self, path: Path) -> bool:
        try:
            return path.read_bytes()[:1] == b"{"
        except OSError:
            return False

    def read(self, path: Path) -> list[float]:
        try:
            return [float(value) for value in json.loads(path.read_text())["numbers"]]
        except (OSError, ValueError, TypeError, KeyError, RecursionError) as error:
            raise FileRefused(f"{path.name} is no list of numbers.") from error

    def limit(self, request: JobRequest) -> tuple[float, tuple[Path, ...]]:
        return float(request.path.with_name("limit.txt").read_text()), ()

    def check(self, request: JobRequest) -> None:
        if request.solver is not None or request.frames is not None:
            raise InvalidInput("sums have neither a solver nor frames; leave both out.")

    def place(self, request: JobRequest, total: float, progress: Progress) -> None:
        with replacing_set(request.folder, ("sum.txt", "note.txt")) as stage:
            write_atomic(stage / "sum.txt", f"{total:.6g}\n")
            progress.tell(0.5, "Writing")
            write_atomic(stage / "note.txt", "summed\n")

    def run(self, request: JobRequest, plugins: PluginManager, progress: Progress) -> JobOutcome:
        progress.tell(0.0, "Reading")
        self.check(request)
        total = sum(self.read(request.path))
        limit, inputs = self.limit(request)
        self.place(request, total, progress)
        return JobOutcome(
            ("sum.txt", "note.txt"), total / limit, inputs=inputs, rows=(("sum", f"{total:g}", False),)
        )


class KindMutant(Mutant, JobKindContract):
    made: type[Sums] = Sums

    @pytest.fixture
    def kind(self) -> Sums:
        return self.made()

    @pytest.fixture
    def example(self, tmp_path: Path) -> Path:
        path = tmp_path / "shelf" / "one.sums"
        path.parent.mkdir()
        path.write_text('{"numbers": [1, 2, 3]}')
        path.with_name("limit.txt").write_text("10")
        return path

    @pytest.fixture
    def reads(self, example: Path) -> list[Path]:
        return [example.with_name("limit.txt")]


class Shouting(Sums):
    suffixes = (".SUMS",)


class TestShouting(KindMutant):
    made, breaks = Shouting, "J01"


class Credulous(Sums):
    """Parses a file that may be anything."""

    def claims(self, path: Path) -> bool:
        return "numbers" in json.loads(path.read_text())


class TestCredulous(KindMutant):
    made, breaks = Credulous, "J02"


class Untidy(Sums):
    """Leaves what it worked with among the results."""

    def place(self, request: JobRequest, total: float, progress: Progress) -> None:
        super().place(request, total, progress)
        (request.folder / "scratch.tmp").write_text("?")


class TestUntidy(KindMutant):
    made, breaks = Untidy, "J03"
    consequences: Sequence[str] = ("J08",)


class Modest(Sums):
    """Fails, and calls it perfect."""

    def run(self, request: JobRequest, plugins: PluginManager, progress: Progress) -> JobOutcome:
        return replace(super().run(request, plugins, progress), failures=("it is too small",), badness=0.0)


class TestModest(KindMutant):
    made, breaks = Modest, "J04"


class Wanderer(Sums):
    """Changes the folder of the whole process, to have short names."""

    def read(self, path: Path) -> list[float]:
        os.chdir(path.parent)
        return super().read(path)


class TestWanderer(KindMutant):
    made, breaks = Wanderer, "J05"

    @pytest.fixture(autouse=True)
    def back(self, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
        monkeypatch.chdir(tmp_path)


class Beside(Sums):
    """Keeps a file beside the job, for the next time."""

    def read(self, path: Path) -> list[float]:
        numbers = super().read(path)
        path.with_suffix(".kept").write_text("read")
        return numbers


class TestBeside(KindMutant):
    made, breaks = Beside, "J05"


class Dated(Sums):
    """Numbers its results."""

    numbers = itertools.count()

    def place(self, request: JobRequest, total: float, progress: Progress) -> None:
        super().place(request, total + 1e-3 * next(self.numbers), progress)


class TestDated(KindMutant):
    made, breaks = Dated, "J06"
    consequences: Sequence[str] = ("J11",)


class Secretive(Sums):
    """Reads its limit in a way that Python's files do not see, and does not name it."""

    def limit(self, request: JobRequest) -> tuple[float, tuple[Path, ...]]:
        import subprocess
        import sys

        command = [sys.executable, "-c", "import sys; print(open(sys.argv[1]).read())"]
        told = subprocess.run([*command, str(request.path.with_name("limit.txt"))], capture_output=True, text=True)
        return float(told.stdout), ()


class TestSecretive(KindMutant):
    made, breaks = Secretive, "J07"


class Piecemeal(Sums):
    """Writes one result after the other into the folder itself."""

    def place(self, request: JobRequest, total: float, progress: Progress) -> None:
        write_atomic(request.folder / "sum.txt", f"{total:.6g}\n")
        progress.tell(0.5, "Writing")
        write_atomic(request.folder / "note.txt", "summed\n")


class TestPiecemeal(KindMutant):
    made, breaks = Piecemeal, "J08"


class Silent(Sums):
    """Cannot be stopped."""

    def run(self, request: JobRequest, plugins: PluginManager, progress: Progress) -> JobOutcome:
        return super().run(request, plugins, NO_PROGRESS)


class TestSilent(KindMutant):
    made, breaks = Silent, "J08"


class Raw(Sums):
    """Lets Python speak."""

    def read(self, path: Path) -> list[float]:
        return [float(value) for value in json.loads(path.read_text())["numbers"]]


class TestRaw(KindMutant):
    made, breaks = Raw, "J09"


class Clearing(Sums):
    """Empties the folder before it knows whether there will be anything."""

    def read(self, path: Path) -> list[float]:
        for old in path.parent.glob("results/*/*"):
            old.unlink()
        return super().read(path)


class TestClearing(KindMutant):
    made, breaks = Clearing, "J09"


class Deaf(Sums):
    """Does not listen to the batch."""

    def check(self, request: JobRequest) -> None:
        return


class TestDeaf(KindMutant):
    made, breaks = Deaf, "J10"
    consequences: Sequence[str] = ("J11",)


class Frameless(Sums):
    """Passes over frames in silence."""

    def check(self, request: JobRequest) -> None:
        super().check(replace(request, frames=None))


class TestFrameless(KindMutant):
    made, breaks = Frameless, "J11"


# -- proxy makers --------------------------------------------------------------------------------------------------


class Boxes:
    """A sound maker, as plain as one can be: the box round the mesh, a little larger."""

    name = "boxes"
    summary = "the box round a mesh"

    def make(self, mesh: TriangleMesh, progress: Progress) -> TriangleMesh:
        progress.tell(0.0, "Packing")
        if not mesh.bounding_box_diagonal > 0.0:
            raise InvalidInput("a box needs a mesh with an extent, but it has none.")
        low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
        return self.packed(low, high)

    def packed(self, low: np.ndarray, high: np.ndarray) -> TriangleMesh:
        cube = meshes.blocks(np.ones((1, 1, 1), bool))
        unit = cube.points - cube.points.min(axis=0)
        return TriangleMesh(low + unit / np.ptp(cube.points, axis=0) * (high - low), cube.faces)


class MakerMutant(Mutant, ProxyMakerContract):
    made: type[Boxes] = Boxes

    @pytest.fixture
    def maker(self) -> Boxes:
        return self.made()

    @pytest.fixture
    def most_away(self) -> float:
        return 0.4


class Nameless(Boxes):
    summary = "box"


class TestNameless(MakerMutant):
    made, breaks = Nameless, "P01"


class Open(Boxes):
    """Forgets the lid."""

    def packed(self, low: np.ndarray, high: np.ndarray) -> TriangleMesh:
        mesh = super().packed(low, high)
        return TriangleMesh(mesh.points, mesh.faces[:-2])


class TestOpen(MakerMutant):
    made, breaks = Open, "P02"


class InsideOut(Boxes):
    def packed(self, low: np.ndarray, high: np.ndarray) -> TriangleMesh:
        mesh = super().packed(low, high)
        return TriangleMesh(mesh.points, mesh.faces[:, ::-1])


class TestInsideOut(MakerMutant):
    made, breaks = InsideOut, "P02"


class FarAway(Boxes):
    """Somewhere else."""

    def packed(self, low: np.ndarray, high: np.ndarray) -> TriangleMesh:
        return super().packed(low + 3.0 * (high - low), high + 3.0 * (high - low))


class TestFarAway(MakerMutant):
    made, breaks = FarAway, "P03"


class Trembling(Boxes):
    steps = itertools.count()

    def packed(self, low: np.ndarray, high: np.ndarray) -> TriangleMesh:
        return super().packed(low, high + 1e-4 * next(self.steps) * (high - low))


class TestTrembling(MakerMutant):
    made, breaks = Trembling, "P04"


class Metric(Boxes):
    """Adds a length in metres."""

    def packed(self, low: np.ndarray, high: np.ndarray) -> TriangleMesh:
        return super().packed(low - 0.3, high + 0.3)


class TestMetric(MakerMutant):
    made, breaks = Metric, "P05"


class Careless(Boxes):
    """Rounds the mesh that it was given."""

    def make(self, mesh: TriangleMesh, progress: Progress) -> TriangleMesh:
        mesh.points.flags.writeable = True
        mesh.points += 1e-9
        return super().make(mesh, progress)


class TestCareless(MakerMutant):
    made, breaks = Careless, "P06"


class Deafened(Boxes):
    def make(self, mesh: TriangleMesh, progress: Progress) -> TriangleMesh:
        return super().make(mesh, NO_PROGRESS)


class TestDeafened(MakerMutant):
    made, breaks = Deafened, "P07"


class Unasked(Boxes):
    """Does not look at what it gets."""

    def make(self, mesh: TriangleMesh, progress: Progress) -> TriangleMesh:
        progress.tell(0.0, "Packing")
        return self.packed(mesh.points.min(axis=0), mesh.points.max(axis=0))


class TestUnasked(MakerMutant):
    made, breaks = Unasked, "P08"
