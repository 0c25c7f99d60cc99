"""Memory hosts that are broken on purpose, each in one way; `test_host_mutants.py` sees them caught.

Each fails first at the clause that it `breaks`, and beyond that only at declared consequences.
"""

from __future__ import annotations

import importlib.util
import os
import sys
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
import pytest

from contact_core.document.asset import Asset
from contact_core.errors import Cancelled, FileRefused
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.polar import split_world_from_local
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.pose_keys import PoseKeys
from contact_core.rig.rig import Pose
from contact_core.scene.host import DocumentStamp, SceneObject, SceneSpace
from contact_core.scene.memory_host import MemoryHost
from contact_core.testing.host_contract import Build, HostContract
from contact_core.testing.host_scenes import HostScene
from contact_core.testing.mutants import Mutant


def _loaded(name: str, file: str) -> Any:
    """A test module beside this one; test folders are no packages where mutants are judged."""
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(file))
        assert spec is not None and spec.loader is not None
        sys.modules[name] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[name])
    return sys.modules[name]


_subject = _loaded("memory_subject", "test_memory_host.py")
_animated = _loaded("animated_subject", "test_animated_host.py")


class OnMemory(HostContract):
    """A subject that builds the nested class `Host`."""

    Host: ClassVar[type[MemoryHost]] = MemoryHost
    cannot = _subject.NO_ANIMATION

    @pytest.fixture
    def build(self) -> Build:
        return lambda scene: _subject.build_in_memory(scene, self.Host)

    foreign_edit = _subject.TestMemoryHost.foreign_edit

    def scene_state(self, host: MemoryHost) -> Any:
        """As much as the mutants get wrong, without reading surfaces each time."""
        items = host.scene.objects.values()
        poses = [host.read_pose(item.id).local.tobytes() for item in host.objects() if item.kind == "rig"]
        return [(item.name, item.world.tobytes(), item.keys) for item in items], poses, host.stored_document()


class TestTakesEverythingForMetres(Mutant, OnMemory):
    breaks = "H01"

    class Host(MemoryHost):
        def space(self) -> SceneSpace:
            return replace(super().space(), meters_per_unit=1.0)


class TestListsSkinsAgain(Mutant, OnMemory):
    breaks = "H02"
    consequences = ("H20", "H36")

    class Host(MemoryHost):
        def objects(self) -> tuple[SceneObject, ...]:
            rigs = [item for item in super().objects() if item.kind == "rig"]
            return (*super().objects(), *(SceneObject(item.id, f"{item.name}_skin", "surface") for item in rigs))


class TestTurnsThePointOrderRound(Mutant, OnMemory):
    breaks = "H03"
    consequences = ("H06", "H07", "H08", "H30", "H34")

    class Host(MemoryHost):
        def read_surface(self, object_id: str) -> Asset:
            asset = super().read_surface(object_id)
            if asset.rig is not None:
                return asset
            mesh = TriangleMesh(asset.mesh.points[::-1], len(asset.mesh.points) - 1 - asset.mesh.faces)
            return replace(asset, mesh=mesh)


class TestCutsPolygonsIntoFans(Mutant, OnMemory):
    breaks = "H04"
    consequences = ("H06", "H07")  # a fan over a concave cap encloses another volume

    class Host(MemoryHost):
        def read_surface(self, object_id: str) -> Asset:
            asset = super().read_surface(object_id)
            if asset.rig is not None:
                return asset
            polygons = self.scene.objects[object_id].shape
            corners = np.split(polygons.face_indices, np.cumsum(polygons.face_sizes)[:-1])
            fans = [[c[0], c[k], c[k + 1]] for c in corners for k in range(1, len(c) - 1)]
            sources = [f for f, c in enumerate(corners) for _ in range(len(c) - 2)]
            faces = np.array(fans)
            if split_world_from_local(self.scene.objects[object_id].world).mirrored:
                faces = faces[:, ::-1]
            return replace(asset, mesh=TriangleMesh(asset.mesh.points, faces), source_faces=np.array(sources))


class TestBakesTheMotionIn(Mutant, OnMemory):
    breaks = "H05"
    consequences = ("H14", "H34")

    class Host(MemoryHost):
        def read_surface(self, object_id: str) -> Asset:
            asset = super().read_surface(object_id)
            place = super().placement(object_id)
            points = asset.mesh.points @ place[:3, :3].T + place[:3, 3]
            return replace(asset, mesh=asset.mesh.with_points(points))

        def placement(self, object_id: str, frame: float | None = None) -> Any:
            return np.eye(4)


class TestLosesTheScale(Mutant, OnMemory):
    breaks = "H06"
    consequences = ("H07", "H08", "H34")

    class Host(MemoryHost):
        def read_surface(self, object_id: str) -> Asset:
            asset = super().read_surface(object_id)
            stretch = split_world_from_local(self.scene.objects[object_id].world).surface_from_local
            if asset.rig is not None:
                return asset
            return replace(asset, mesh=asset.mesh.with_points(asset.mesh.points @ np.linalg.inv(stretch).T))


class TestTurnsMirroredSurfacesInsideOut(Mutant, OnMemory):
    breaks = "H07"

    class Host(MemoryHost):
        def read_surface(self, object_id: str) -> Asset:
            asset = super().read_surface(object_id)
            if not split_world_from_local(self.scene.objects[object_id].world).mirrored:
                return asset
            return replace(asset, mesh=TriangleMesh(asset.mesh.points, asset.mesh.faces[:, ::-1]))


class TestForgetsParents(Mutant, OnMemory):
    breaks = "H08"

    @pytest.fixture
    def build(self) -> Build:
        def orphaned(scene: HostScene) -> MemoryHost:
            meshes = tuple(replace(mesh, parent=None) for mesh in scene.meshes)
            return _subject.build_in_memory(replace(scene, meshes=meshes), self.Host)

        return orphaned


class TestGivesNewIdsAtEachOpening(Mutant, OnMemory):
    breaks = "H09"
    consequences = ("H20",)

    class Host(MemoryHost):
        def __init__(self, *arguments: Any, **options: Any) -> None:
            super().__init__(*arguments, **options)
            tag = uuid.uuid4().hex
            objects = {f"{key}-{tag}": item for key, item in self._scene.objects.items()}
            self._scene = replace(self._scene, objects=objects)
            self._states = [("open", self._scene)]

    def foreign_edit(self, host: MemoryHost) -> None:
        plain = next(item.id for item in host.objects() if item.name == "plain")
        farther = host.placement(plain).copy()
        farther[0, 3] += 1.0
        host.move(plain, farther)


class TestInventsObjects(Mutant, OnMemory):
    breaks = "H10"

    class Host(MemoryHost):
        def read_surface(self, object_id: str) -> Asset:
            known = object_id if object_id in self.scene.objects else next(iter(self.scene.objects))
            return super().read_surface(known)


class TestWantsAScreen(Mutant, OnMemory):
    breaks = "H11"

    @pytest.fixture(autouse=True)
    def screen(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("DISPLAY", ":0")

    class Host(MemoryHost):
        def objects(self) -> tuple[SceneObject, ...]:
            if "DISPLAY" not in os.environ:
                raise RuntimeError("cannot open display")
            return super().objects()


class TestTransposesRestFrames(Mutant, OnMemory):
    breaks = "H12"
    consequences = ("H13", "H14", "H16", "H34", "H38")

    class Host(MemoryHost):
        def read_rig(self, object_id: str) -> Asset:
            asset = super().read_rig(object_id)
            assert asset.rig is not None
            rest = np.array(asset.rig.rest_local)
            rest[:, :3, :3] = rest[:, :3, :3].transpose(0, 2, 1)
            return replace(asset, rig=replace(asset.rig, rest_local=rest))


class TestBindsInTheWrongPose(Mutant, OnMemory):
    breaks = "H13"
    consequences = ("H16", "H38")  # another rest surface

    class Host(MemoryHost):
        def read_rig(self, object_id: str) -> Asset:
            asset = super().read_rig(object_id)
            assert asset.rig is not None
            bind = np.array(asset.rig.bind_world)
            bind[1:, :3, 3] += 0.01
            return replace(asset, rig=replace(asset.rig, bind_world=bind))


class TestLosesTheScaleOfRigs(Mutant, OnMemory):
    breaks = "H14"

    class Host(MemoryHost):
        def __init__(self, *arguments: Any, **options: Any) -> None:
            super().__init__(*arguments, **options)
            objects = {key: self._unscaled(item) for key, item in self._scene.objects.items()}
            self._scene = replace(self._scene, objects=objects)
            self._states = [("open", self._scene)]

        @staticmethod
        def _unscaled(item: Any) -> Any:
            if item.kind == "surface":
                return item
            return replace(item, world=split_world_from_local(item.world).world_from_surface)


class TestLeavesThePoseItSkinned(Mutant, OnMemory):
    breaks = "H15"

    class Host(MemoryHost):
        def skin_points(self, object_id: str, pose: Pose) -> Any:
            self.write_pose(object_id, pose)
            return super().skin_points(object_id, pose)


class TestForgetsTheScaleInPoses(Mutant, OnMemory):
    breaks = "H16"

    class Host(MemoryHost):
        def write_pose(self, object_id: str, pose: Pose, frame: float | None = None) -> None:
            item = self.scene.objects[object_id]
            self._put("Pose", object_id, item.with_pose(pose, frame))


class TestResetsOtherJoints(Mutant, OnMemory):
    breaks = "H17"

    class Host(MemoryHost):
        def write_pose(self, object_id: str, pose: Pose, frame: float | None = None) -> None:
            with self.step("Pose"):
                super().write_pose(object_id, Pose.rest(self.read_rig(object_id).rig), frame)  # type: ignore[arg-type]
                super().write_pose(object_id, pose, frame)


class TestKeysTheNextFrame(Mutant, OnMemory):
    breaks = "H18"
    consequences = ("H20", "H36")

    class Host(MemoryHost):
        def write_pose(self, object_id: str, pose: Pose, frame: float | None = None) -> None:
            super().write_pose(object_id, pose, None if frame is None else frame + 1.0)


class TestKeysEveryFrameBefore(Mutant, OnMemory):
    breaks = "H18"
    consequences = ("H20", "H36")

    class Host(MemoryHost):
        def write_pose(self, object_id: str, pose: Pose, frame: float | None = None) -> None:
            with self.step("Pose"):
                super().write_pose(object_id, pose, frame)
                if frame is not None:
                    super().write_pose(object_id, pose, 0.0)


class TestStripsTexts(Mutant, OnMemory):
    breaks = "H19"
    consequences = ("H37",)

    class Host(MemoryHost):
        def store_document(self, stamp: DocumentStamp, put: Mapping[str, str], remove: Iterable[str] = ()) -> None:
            super().store_document(stamp, {key: text.strip() for key, text in put.items()}, remove)


class TestKeepsTheNewPartsAlone(Mutant, OnMemory):
    breaks = "H19"
    consequences = ("H37",)

    class Host(MemoryHost):
        def store_document(self, stamp: DocumentStamp, put: Mapping[str, str], remove: Iterable[str] = ()) -> None:
            stored = self.stored_document()
            super().store_document(stamp, put, () if stored is None else stored.parts)


class TestRemovesNoPart(Mutant, OnMemory):
    breaks = "H19"

    class Host(MemoryHost):
        def store_document(self, stamp: DocumentStamp, put: Mapping[str, str], remove: Iterable[str] = ()) -> None:
            super().store_document(stamp, put)


class TestKeepsAStaleStampAfterUndo(Mutant, OnMemory):
    breaks = "H25"
    consequences = ("H26", "H36", "H37")

    class Host(MemoryHost):
        known: DocumentStamp | None = None

        def store_document(self, stamp: DocumentStamp, put: Mapping[str, str], remove: Iterable[str] = ()) -> None:
            super().store_document(stamp, put, remove)
            self.known = stamp

        def stored_stamp(self) -> DocumentStamp | None:
            return self.known or super().stored_stamp()


class TestSavesWithoutTheDocument(Mutant, OnMemory):
    breaks = "H20"
    consequences = ("H22",)

    class Host(MemoryHost):
        def save(self, path: Path | None = None) -> None:
            whole, self._scene = self._scene, replace(self._scene, document=None)
            try:
                super().save(path)
            finally:
                self._scene = whole


class TestEatsDocumentsOfTheFuture(Mutant, OnMemory):
    breaks = "H21"

    class Host(MemoryHost):
        def store_document(self, stamp: DocumentStamp, put: Mapping[str, str], remove: Iterable[str] = ()) -> None:
            with self.step("Document"):
                whole = self._scene.document
                if whole is not None:
                    known = replace(whole, stamp=replace(whole.stamp, schema=1))
                    self._scene = replace(self._scene, document=known)
                super().store_document(stamp, put, remove)


class TestDropsDocumentsOfTheFutureOnSave(Mutant, OnMemory):
    breaks = "H22"

    class Host(MemoryHost):
        def save(self, path: Path | None = None) -> None:
            whole = self._scene
            if whole.document is not None and whole.document.stamp.schema > 1:
                self._scene = replace(whole, document=None)
            try:
                super().save(path)
            finally:
                self._scene = whole


class TestOpensHalfAFile(Mutant, OnMemory):
    breaks = "H23"

    class Host(MemoryHost):
        @classmethod
        def open(cls, path: Path) -> Self:
            try:
                return super().open(path)
            except FileRefused:
                return cls()


class TestMakesTwoStepsOfOne(Mutant, OnMemory):
    breaks = "H24"
    consequences = ("H25", "H26", "H28", "H29")

    class Host(MemoryHost):
        @contextmanager
        def step(self, label: str) -> Iterator[None]:
            if not label.startswith("Step"):
                with super().step(label):
                    yield
                return
            yield  # what is written inside makes steps of its own


class TestKeepsAStalePoseAfterUndo(Mutant, OnMemory):
    breaks = "H24"
    consequences = ("H28", "H29", "H36")

    class Host(MemoryHost):
        def __init__(self, *arguments: Any, **options: Any) -> None:
            super().__init__(*arguments, **options)
            self.cached: dict[str, Pose] = {}

        def write_pose(self, object_id: str, pose: Pose, frame: float | None = None) -> None:
            super().write_pose(object_id, pose, frame)
            self.cached[object_id] = super().read_pose(object_id, None)

        def read_pose(self, object_id: str, frame: float | None = None) -> Pose:
            if frame is None and object_id in self.cached and self._depth == 0 and self._at < self.last:
                return self.cached[object_id]
            return super().read_pose(object_id, frame)

        @property
        def last(self) -> int:
            return len(self._states) - 1


class TestTellsBeforeItUndoes(Mutant, OnMemory):
    breaks = "H25"
    consequences = ("H36", "H37")

    class Host(MemoryHost):
        def _go(self, by: int) -> bool:
            listeners, self._listeners = self._listeners, []
            if 0 <= self._at + by < len(self._states):
                for listener in listeners:
                    listener()
            moved = super()._go(by)
            self._listeners = listeners
            return moved


class TestKeepsWhatFailed(Mutant, OnMemory):
    breaks = "H26"

    class Host(MemoryHost):
        @contextmanager
        def step(self, label: str) -> Iterator[None]:
            failure: BaseException | None = None
            with super().step(label):
                try:
                    yield
                except ZeroDivisionError as error:
                    failure = error
            if failure is not None:
                raise failure


class TestMakesStepsOfReading(Mutant, OnMemory):
    breaks = "H27"
    consequences = ("H31",)

    class Host(MemoryHost):
        def read_surface(self, object_id: str) -> Asset:
            with self.step("Read"):
                self._scene = replace(self._scene)
            return super().read_surface(object_id)


class TestLeavesForeignEditsOut(Mutant, OnMemory):
    breaks = "H28"
    consequences = ("H29",)

    class Host(MemoryHost):
        def move(self, object_id: str, world_from_local: Any) -> None:
            super().move(object_id, world_from_local)
            _, scene = self._states.pop()  # into the step before it
            self._at -= 1
            self._states[self._at] = (self._states[self._at][0], scene)


class TestForgetsOldSteps(Mutant, OnMemory):
    breaks = "H29"

    class Host(MemoryHost):
        @contextmanager
        def step(self, label: str) -> Iterator[None]:
            with super().step(label):
                yield
            if self._depth == 0 and len(self._states) > 5:
                del self._states[0]
                self._at -= 1


class TestSelectsTheNeighbour(Mutant, OnMemory):
    breaks = "H30"

    class Host(MemoryHost):
        def selected_points(self, object_id: str, selection: str) -> SurfacePoints:
            asset = self.read_surface(object_id)
            super().selected_points(object_id, selection)
            chosen = self.scene.objects[object_id].selections[selection] + 1
            return SurfacePoints.at_vertices(asset.mesh, chosen)


class TestDrawsIntoTheScene(Mutant, OnMemory):
    breaks = "H31"
    consequences = ("H32",)

    class Host(MemoryHost):
        def show(self, picture: Any) -> None:
            super().show(picture)
            if picture is not None:
                self.add_polygons("overlay", picture.meshes[0].mesh.points, [3], [0, 1, 2])


class TestCountsPixelsFromTheBottom(Mutant, OnMemory):
    breaks = "H32"

    class Host(MemoryHost):
        def rays(self, pixels: Any) -> Any:
            return super().rays(np.asarray(pixels, float) * [1, -1] + [0, self.viewport[1]])


class TestCancelsUnasked(Mutant, OnMemory):
    breaks = "H33"
    consequences = ("H35",)

    class Host(MemoryHost):
        def tell(self, fraction: float | None, text: str) -> None:
            super().tell(fraction, text)
            raise Cancelled("nobody asked.")


class TestKnowsNoUnknownFraction(Mutant, OnMemory):
    breaks = "H33"
    consequences = ("H35",)

    class Host(MemoryHost):
        def tell(self, fraction: float | None, text: str) -> None:
            super().tell(round(fraction, 2), text)  # type: ignore[arg-type]


class TestDoesNotCancel(Mutant, OnMemory):
    breaks = "H35"

    class Host(MemoryHost):
        def cancel(self) -> None:
            pass


class TestCancelsForEver(Mutant, OnMemory):
    breaks = "H35"

    class Host(MemoryHost):
        def tell(self, fraction: float | None, text: str) -> None:
            try:
                super().tell(fraction, text)
            except Cancelled:
                self.cancel()
                raise


class TestWritesWithoutUnits(Mutant, OnMemory):
    breaks = "H34"

    class Host(MemoryHost):
        def add(self, asset: Asset, world_from_surface: Any = None) -> str:
            return super().add(replace(asset, meters_per_unit=None), world_from_surface)


class TestKeysOutliveUndo(Mutant, OnMemory):
    breaks = "H36"

    class Host(MemoryHost):
        def undo(self) -> bool:
            keys = {item.id: self._object(item.id).keys for item in self.objects()}
            undone = super().undo()
            for object_id, kept in keys.items():
                if object_id in self._scene.objects:
                    back = replace(self._object(object_id), keys=kept)
                    self._scene = self._scene.with_object(object_id, back)
            return undone


class TestKnowsOneListener(Mutant, OnMemory):
    breaks = "H37"

    class Host(MemoryHost):
        def on_undo(self, listener: Callable[[], None]) -> Callable[[], None]:
            self._listeners.clear()
            return super().on_undo(listener)


class TestGivesJointsInItsOwnOrder(Mutant, OnMemory):
    breaks = "H38"

    class Host(MemoryHost):
        def read_pose(self, object_id: str, frame: float | None = None) -> Pose:
            pose = super().read_pose(object_id, frame)
            order = [pose.joints.index(name) for name in self.scene.objects[object_id].rig.joints]
            return Pose(tuple(pose.joints[k] for k in order), pose.local[order])


class OnAnimated(OnMemory):
    """A subject that builds the nested class `Host` with curves and a choice of bones."""

    Host: ClassVar[type[MemoryHost]] = _animated.AnimatedHost
    cannot: ClassVar[Mapping[str, str]] = {}
    choice_of = _animated.TestAnimatedHost.choice_of

    @pytest.fixture
    def build(self) -> Build:
        return lambda scene: _animated.build_animated(scene, self.Host)

    def scene_state(self, host: MemoryHost) -> Any:
        curves = [getattr(item, "curves", None) for item in host.scene.objects.values()]
        return super().scene_state(host), curves, [host.pose_keys(item.id) for item in _rigs(host)]


def _rigs(host: MemoryHost) -> list[SceneObject]:
    return [item for item in host.objects() if item.kind == "rig"]


class TestBlendsCubicKeysStraight(Mutant, OnAnimated):
    breaks = "H39"
    consequences = ("H40", "H42")  # which look between the keys, too

    class Host(_animated.AnimatedHost):  # type: ignore[misc, name-defined]
        def write_curves(self, object_id: str, pose_keys: PoseKeys) -> None:
            still = tuple(np.zeros_like(each) for each in pose_keys.speeds)
            super().write_curves(object_id, replace(pose_keys, speeds=still))


class TestForgetsTheScaleInCurves(Mutant, OnAnimated):
    breaks = "H39"

    class Host(_animated.AnimatedHost):  # type: ignore[misc, name-defined]
        def write_curves(self, object_id: str, pose_keys: PoseKeys) -> None:
            self._put("Curves", object_id, self._animated(object_id).with_curves(pose_keys))


class TestLetsCurvesTakeAllKeys(Mutant, OnAnimated):
    breaks = "H40"

    class Host(_animated.AnimatedHost):  # type: ignore[misc, name-defined]
        def write_curves(self, object_id: str, pose_keys: PoseKeys) -> None:
            with self.step("Curves"):
                self._put("Clear", object_id, replace(self._animated(object_id), keys=(), curves={}))
                super().write_curves(object_id, pose_keys)


class TestLeavesKeysUnderCurves(Mutant, OnAnimated):
    breaks = "H40"

    class Host(_animated.AnimatedHost):  # type: ignore[misc, name-defined]
        def write_curves(self, object_id: str, pose_keys: PoseKeys) -> None:
            with self.step("Curves"):
                keys = self._animated(object_id).keys
                super().write_curves(object_id, pose_keys)
                self._put("Keep", object_id, replace(self._animated(object_id), keys=keys))


class TestBakesOtherJointsIntoCurves(Mutant, OnAnimated):
    breaks = "H40"

    class Host(_animated.AnimatedHost):  # type: ignore[misc, name-defined]
        def write_curves(self, object_id: str, pose_keys: PoseKeys) -> None:
            with self.step("Curves"):
                for frame in pose_keys.frames:
                    self.write_pose(object_id, self.read_pose(object_id, None), frame)
                super().write_curves(object_id, pose_keys)


class TestMakesAStepOfEachJoint(Mutant, OnAnimated):
    breaks = "H41"

    class Host(_animated.AnimatedHost):  # type: ignore[misc, name-defined]
        def write_curves(self, object_id: str, pose_keys: PoseKeys) -> None:
            for row, name in enumerate(pose_keys.poses[0].joints):
                poses = tuple(Pose((name,), pose.local[row : row + 1]) for pose in pose_keys.poses)
                speeds = tuple(each[row : row + 1] for each in pose_keys.speeds)
                super().write_curves(object_id, replace(pose_keys, poses=poses, speeds=speeds))


class TestDropsCurvesOnSave(Mutant, OnAnimated):
    breaks = "H42"

    class Host(_animated.AnimatedHost):  # type: ignore[misc, name-defined]
        def save(self, path: Path | None = None) -> None:
            whole = self._scene
            objects = {key: replace(item, curves={}) for key, item in whole.objects.items()}
            self._scene = replace(whole, objects=objects)
            try:
                super().save(path)
            finally:
                self._scene = whole


class TestKeepsChoicesOutOfItsUndo(Mutant, OnAnimated):
    breaks = "H43"
    consequences = ("H45",)  # nor are they in what is saved

    class Host(_animated.AnimatedHost):  # type: ignore[misc, name-defined]
        def __init__(self, *arguments: Any, **options: Any) -> None:
            super().__init__(*arguments, **options)
            self.chosen: dict[str, str] = {}

        def choose_bones(self, object_id: str, choice: str) -> None:
            super().choose_bones(object_id, choice)
            self.undo()
            self.chosen[object_id] = choice

        def bones_of(self, object_id: str) -> str:
            return self.chosen.get(object_id, "all")

        def freedoms(self, object_id: str) -> Any:
            chosen = replace(self._animated(object_id), chosen=self.bones_of(object_id))
            return _animated.AnimatedHost(scene=self.scene.with_object(object_id, chosen)).freedoms(object_id)


class TestTakesAnyWordForAChoice(Mutant, OnAnimated):
    breaks = "H43"

    class Host(_animated.AnimatedHost):  # type: ignore[misc, name-defined]
        def choose_bones(self, object_id: str, choice: str) -> None:
            self._put("Choose bones", object_id, replace(self._animated(object_id), chosen=choice))


class TestDoesNotTellTheRigWhatIsChosen(Mutant, OnAnimated):
    breaks = "H44"

    class Host(_animated.AnimatedHost):  # type: ignore[misc, name-defined]
        def read_rig(self, object_id: str) -> Asset:
            return MemoryHost.read_rig(self, object_id)


class TestFreesWhatIsChosenOfItsLimits(Mutant, OnAnimated):
    breaks = "H44"

    class Host(_animated.AnimatedHost):  # type: ignore[misc, name-defined]
        def freedoms(self, object_id: str) -> Any:
            known = super().freedoms(object_id)
            if self.bones_of(object_id) == "all":
                return known
            return tuple(each if each.kind == "fixed" else replace(each, translates=True) for each in known)


class TestForgetsTheChoiceOnSave(Mutant, OnAnimated):
    breaks = "H45"

    class Host(_animated.AnimatedHost):  # type: ignore[misc, name-defined]
        def save(self, path: Path | None = None) -> None:
            whole = self._scene
            objects = {key: replace(item, chosen="all") for key, item in whole.objects.items()}
            self._scene = replace(whole, objects=objects)
            try:
                super().save(path)
            finally:
                self._scene = whole
