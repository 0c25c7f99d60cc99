"""Axis generators, brushes and formats, each broken in one way. `test_plugin_mutants` judges them."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from contact_builtins.axes.principal import Principal
from contact_builtins.brushes.disk import DiskBrush
from contact_builtins.formats.gltf import GltfFiles
from contact_core.contact.axis_generator import AxisRequest
from contact_core.contact.brush import BrushGesture, BrushMark
from contact_core.document.asset import Asset
from contact_core.geometry import SurfacePoints
from contact_core.rig.rig import Pose
from contact_core.settings import setting
from contact_core.testing.axis_generator_contract import AxisGeneratorContract
from contact_core.testing.brush_contract import BrushContract
from contact_core.testing.format_contract import FormatContract
from contact_core.testing.mutants import Mutant

# -- axis generators -----------------------------------------------------------------------------------------------


class OffTheMesh(Principal):
    """Numbers faces from one."""

    def generate(self, request: AxisRequest) -> SurfacePoints:
        axis = super().generate(request)
        return SurfacePoints(axis.faces + len(request.mesh.faces), axis.barycentric)


class OnePoint(Principal):
    """Forgets that an axis has two ends."""

    def generate(self, request: AxisRequest) -> SurfacePoints:
        return super().generate(request)[0]


class Fickle(Principal):
    """Turns round every other time."""

    turns = itertools.cycle((1, -1))

    def generate(self, request: AxisRequest) -> SurfacePoints:
        return super().generate(request)[:: next(self.turns)]


class FirstAndLast(Principal):
    """Depends on the order of the patch's points."""

    def generate(self, request: AxisRequest) -> SurfacePoints:
        super().generate(request)  # refuses what Principal refuses
        return request.points[[0, len(request.points) - 1]]


class TowardsX(Principal):
    """Signs its direction by the x axis of the scene."""

    def generate(self, request: AxisRequest) -> SurfacePoints:
        axis = super().generate(request)
        at = axis.positions(request.mesh)
        return axis if at[-1, 0] >= at[0, 0] else axis[::-1]


class InMetres(Principal):
    """Has a length in metres in it."""

    def generate(self, request: AxisRequest) -> SurfacePoints:
        axis = super().generate(request)
        at = axis.positions(request.mesh)
        return axis if np.linalg.norm(at[-1] - at[0]) > 0.1 else axis[::-1]


@dataclass(frozen=True)
class Unchecked(Principal):
    """Declares a setting and takes any value for it."""

    longer: float = setting(1.5, low=1.0, high=2.0, help="how much longer it is made")


class BackAndForth(Principal):
    """Returns to the middle before it goes to the end."""

    def generate(self, request: AxisRequest) -> SurfacePoints:
        axis = super().generate(request)
        return axis[[1, 0, 2]] if len(axis) == 3 else axis


class Careless(Principal):
    """Lets an internal error out where a patch is too small."""

    def generate(self, request: AxisRequest) -> SurfacePoints:
        request.points.faces[1]
        return super().generate(request)


class ToTheLeft(Principal):
    """Runs to the left of its bone, seen from outside, as guided once did: on left hands towards the thumb."""

    def generate(self, request: AxisRequest) -> SurfacePoints:
        axis = super().generate(request)
        if request.bones is None:
            return axis
        left = np.cross(
            request.points.normals(request.mesh).mean(axis=0), request.bones[0, 1] - request.bones[0, 0]
        )
        at = axis.positions(request.mesh)
        return axis if (at[-1] - at[0]) @ left >= 0.0 else axis[::-1]


class GeneratorMutant(Mutant, AxisGeneratorContract):
    made: type[Principal]

    @pytest.fixture
    def generator(self) -> Principal:
        return self.made()


class TestOffTheMesh(GeneratorMutant):
    made, breaks = OffTheMesh, "A02"
    consequences = ("A03", "A05", "A06", "A07", "A08", "A09", "A10", "A14")  # nothing can be measured off the mesh


class TestOnePoint(GeneratorMutant):
    made, breaks = OnePoint, "A03"
    consequences = ("A12", "A13")  # they count points too


class TestFickle(GeneratorMutant):
    made, breaks = Fickle, "A04"
    consequences = ("A05", "A06", "A07", "A14")  # they compare two runs


class TestFirstAndLast(GeneratorMutant):
    made, breaks = FirstAndLast, "A05"


class TestTowardsX(GeneratorMutant):
    made, breaks = TowardsX, "A06"
    consequences = ("A14",)  # a mirror turns x round, too


class TestInMetres(GeneratorMutant):
    made, breaks = InMetres, "A07"


class TestUnchecked(GeneratorMutant):
    made, breaks = Unchecked, "A15"


class TestBackAndForth(GeneratorMutant):
    made, breaks = BackAndForth, "A10"


class TestCareless(GeneratorMutant):
    made, breaks = Careless, "A12"


class TestToTheLeft(GeneratorMutant):
    made, breaks = ToTheLeft, "A14"


# -- brushes -------------------------------------------------------------------------------------------------------


class Twice(DiskBrush):
    """Marks every point two times."""

    def mark(self, gesture: BrushGesture) -> BrushMark:
        mark = super().mark(gesture)
        return BrushMark(SurfacePoints.concatenate([mark.points, mark.points]), np.tile(mark.strength, 2))


class Unseeded(DiskBrush):
    """Ignores the gesture's seed."""

    def mark(self, gesture: BrushGesture) -> BrushMark:
        return super().mark(replace(gesture, seed=int(np.random.default_rng().integers(2**31))))


class Wide(DiskBrush):
    """Takes the radius for a diameter."""

    def mark(self, gesture: BrushGesture) -> BrushMark:
        return super().mark(replace(gesture, radius=2.0 * gesture.radius))


class Sparse(DiskBrush):
    """Leaves gaps."""

    def mark(self, gesture: BrushGesture) -> BrushMark:
        return super().mark(replace(gesture, spacing=3.0 * gesture.spacing))


@dataclass(frozen=True)
class Helpless(DiskBrush):
    """Has a setting that no artist understands."""

    q: float = setting(1.0, low=0.0, help="q factor")


class Crowded(DiskBrush):
    """Makes the spacing less than half of what was asked for."""

    def mark(self, gesture: BrushGesture) -> BrushMark:
        return super().mark(replace(gesture, spacing=0.45 * gesture.spacing))


class BrushMutant(Mutant, BrushContract):
    made: type[DiskBrush]

    @pytest.fixture
    def brush(self) -> DiskBrush:
        return self.made()


class TestTwice(BrushMutant):
    made, breaks = Twice, "B03"
    consequences = ("B11",)


class TestUnseeded(BrushMutant):
    made, breaks = Unseeded, "B04"
    consequences = ("B07",)


class TestWide(BrushMutant):
    made, breaks = Wide, "B08"


class TestSparse(BrushMutant):
    made, breaks = Sparse, "B10"


class TestCrowded(BrushMutant):
    made, breaks = Crowded, "B11"


class TestHelpless(BrushMutant):
    made, breaks = Helpless, "B13"


# -- formats -------------------------------------------------------------------------------------------------------


class Flipped(GltfFiles):
    """Turns every triangle round, after its surfaces were wound outwards."""

    def read(self, path: Path, *, sidecar: Path | None = None) -> Asset:
        asset = super().read(path, sidecar=sidecar)
        return replace(asset, mesh=type(asset.mesh)(asset.mesh.points, asset.mesh.faces[:, ::-1]))


class Unposed(GltfFiles):
    """Forgets the poses."""

    def write(self, path: Path, assets: Sequence[Asset], poses: Mapping[str, Pose]) -> None:
        super().write(path, assets, {})


class Traceback(GltfFiles):
    """Lets an error of its parser out."""

    def read(self, path: Path, *, sidecar: Path | None = None) -> Asset:
        if path.exists() and path.stat().st_size < 900:
            raise KeyError("meshes")
        return super().read(path, sidecar=sidecar)


class FormatMutant(Mutant, FormatContract):
    made: type[GltfFiles]

    @pytest.fixture
    def file_format(self) -> GltfFiles:
        return self.made()


class TestFlipped(FormatMutant):
    made, breaks = Flipped, "F03"


class TestUnposed(FormatMutant):
    made, breaks = Unposed, "F05"


class TestTraceback(FormatMutant):
    made, breaks = Traceback, "F09"
    consequences = ("F10",)
