"""The reference host: a scene in memory, its own undo, one file. It is also how scripts run without any DCC.

Every promise of `adapters/README.md` is kept here in the plainest way: the scene is one immutable value
(`memory_scene`), so a step of undo is the value before and the value after.
"""

from __future__ import annotations

import contextlib
import difflib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from contact_core.arrays import FloatArray, IntArray, frozen
from contact_core.document.asset import Asset
from contact_core.document.frozen_map import FrozenMap
from contact_core.errors import Cancelled, FileRefused, InvalidInput
from contact_core.geometry.polar import PolarDecomposition, split_world_from_local
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import Pose, forward_kinematics, skin
from contact_core.scene.camera import camera_of
from contact_core.scene.host import (
    Display,
    DocumentStamp,
    DocumentStorage,
    Picking,
    PoseWriting,
    ProgressDisplay,
    RigReading,
    SceneLifetime,
    SceneObject,
    SceneReading,
    SceneSpace,
    SceneWriting,
    SelectionReading,
    StoredDocument,
    Undo,
    check_frame,
    check_overwrite,
)
from contact_core.scene.memory_scene import MemoryObject, MemoryScene, Polygons, load_scene, save_scene
from contact_core.scene.picture import Picture
from contact_core.scene.reading import fit_to_scene, stretch_pose, stretch_rig, surface_of_polygons, unstretch_pose


class MemoryHost(
    SceneReading,
    SceneWriting,
    RigReading,
    PoseWriting,
    DocumentStorage,
    Undo,
    SceneLifetime,
    SelectionReading,
    Display,
    Picking,
    ProgressDisplay,
):
    """A scene in memory: of the file at `path`, or `scene`, or empty of `space`. Raises FileRefused."""

    name = "memory"
    summary = "a scene in memory, for tests and for scripts without a host"
    suffixes = (".contactscene",)
    viewport = (1280, 720)  # pixels

    def __init__(
        self, path: Path | str | None = None, *, scene: MemoryScene | None = None, space: SceneSpace | None = None
    ) -> None:
        self._path = None if path is None else Path(path)
        self._scene = scene or MemoryScene(space or SceneSpace(1.0, "Y"))
        if self._path is not None:
            self._scene = load_scene(self._path)
        self._states: list[tuple[str, MemoryScene]] = [("open", self._scene)]  # the scene after each step
        self._at = 0
        self._depth = 0  # of open steps
        self._listeners: list[Callable[[], None]] = []
        self._closing: list[Callable[[], None]] = []
        self.picture: Picture | None = None
        self.told: list[tuple[float | None, str]] = []  # progress so far
        self._cancel_asked = False

    @classmethod
    def open(cls, path: Path) -> Self:
        return cls(path)

    @property
    def scene(self) -> MemoryScene:
        """The scene as it stands: a value that later edits do not change."""
        return self._scene

    def space(self) -> SceneSpace:
        return self._scene.space

    # Scene reading and writing

    def objects(self) -> tuple[SceneObject, ...]:
        return tuple(SceneObject(key, item.name, item.kind) for key, item in self._scene.objects.items())

    def read_surface(self, object_id: str) -> Asset:
        item = self._object(object_id)
        if isinstance(item.shape, Polygons):
            mesh = item.shape
            return surface_of_polygons(
                item.name, mesh.points, mesh.face_sizes, mesh.face_indices, _placement(item), self.space()
            )
        return self.read_rig(object_id)

    def placement(self, object_id: str, frame: float | None = None) -> FloatArray:
        check_frame(frame)
        return _placement(self._object(object_id)).world_from_surface

    def add(self, asset: Asset, world_from_surface: Any = None) -> str:
        world = fit_to_scene(asset, self.space(), world_from_surface)
        faces = asset.mesh.faces
        flat = Polygons(asset.mesh.points, np.full(len(faces), 3), faces.ravel())
        return self._put_new(MemoryObject(asset.name, asset.rig or flat, world))

    def add_polygons(
        self, name: str, points: Any, face_sizes: Any, face_indices: Any, world_from_local: Any = None
    ) -> str:
        """Create a surface of polygons, as a modelling tool would; its id."""
        world = np.eye(4) if world_from_local is None else world_from_local
        mesh = Polygons(
            frozen(points, np.float64, (None, 3), "points"),
            frozen(face_sizes, np.int64, (None,), "face_sizes"),
            frozen(face_indices, np.int64, (None,), "face_indices"),
        )
        return self._put_new(MemoryObject(name, mesh, frozen(world, np.float64, (4, 4), "world_from_local")))

    def move(self, object_id: str, world_from_local: Any) -> None:
        """What a user does with the host's own tools: an edit that is none of ours, in the same undo."""
        world = frozen(world_from_local, np.float64, (4, 4), "world_from_local")
        self._put("Move", object_id, replace(self._object(object_id), world=world))

    def rename(self, object_id: str, name: str) -> None:
        """Another name; the id stays."""
        self._put("Rename", object_id, replace(self._object(object_id), name=name))

    def remove(self, object_id: str) -> None:
        """Delete an object."""
        self._object(object_id)
        self._put("Delete", object_id, None)

    # Rigs and poses

    def read_rig(self, object_id: str) -> Asset:
        item = self._object(object_id)
        rig = stretch_rig(item.rig.in_tree_order, _placement(item), self.space())
        return Asset(
            item.name,
            rig.surface,
            rig,
            source_vertices=np.arange(len(rig.bind_points)),
            source_faces=np.arange(len(rig.faces)),
            meters_per_unit=rig.meters_per_unit,
            up_axis=rig.up_axis,
        )

    def read_pose(self, object_id: str, frame: float | None = None) -> Pose:
        check_frame(frame)
        item = self._object(object_id)
        pose = item.pose_at(frame).in_tree_order(item.rig.parents)
        return stretch_pose(pose, _placement(item).surface_from_local)

    def skin_points(self, object_id: str, pose: Pose) -> FloatArray:
        item = self._object(object_id)
        local = unstretch_pose(pose, _placement(item).surface_from_local)
        posed = item.with_pose(local, None).pose_at(None)
        world = forward_kinematics(item.rig.parents, posed.local)
        return _placement(item).surface_points(skin(item.rig, world))

    def write_pose(self, object_id: str, pose: Pose, frame: float | None = None) -> None:
        check_frame(frame)
        item = self._object(object_id)
        local = unstretch_pose(pose, _placement(item).surface_from_local)
        self._put("Pose", object_id, item.with_pose(local, frame))

    def pose_keys(self, object_id: str) -> tuple[float, ...]:
        return tuple(frame for frame, _ in self._object(object_id).keys)

    # The document

    def stored_stamp(self) -> DocumentStamp | None:
        return None if self._scene.document is None else self._scene.document.stamp

    def stored_document(self) -> StoredDocument | None:
        return self._scene.document

    def store_document(self, stamp: DocumentStamp, put: Mapping[str, str], remove: Iterable[str] = ()) -> None:
        check_overwrite(self.stored_stamp())
        stored = self._scene.document
        parts = FrozenMap[str]({} if stored is None else stored.parts).without(*remove).updated(put)
        self._replace("Document", replace(self._scene, document=StoredDocument(stamp, parts)))

    def save(self, path: Path | None = None) -> None:
        self._path = self._path if path is None else Path(path)
        if self._path is None:
            raise FileRefused("this scene came from no file; say where to save it.")
        save_scene(self._scene, self._path)

    # Undo

    @contextlib.contextmanager
    def step(self, label: str) -> Iterator[None]:
        before = self._scene
        self._depth += 1
        try:
            yield
        except BaseException:
            self._scene = before
            raise
        finally:
            self._depth -= 1
        if self._depth == 0 and self._scene is not self._states[self._at][1]:
            self._states[self._at + 1 :] = [(label, self._scene)]
            self._at += 1

    def undo(self) -> bool:
        return self._go(-1)

    def redo(self) -> bool:
        return self._go(+1)

    def on_undo(self, listener: Callable[[], None]) -> Callable[[], None]:
        self._listeners.append(listener)

        def stop() -> None:
            if listener in self._listeners:
                self._listeners.remove(listener)

        return stop

    def on_close(self, listener: Callable[[], None]) -> Callable[[], None]:
        self._closing.append(listener)
        return lambda: self._closing.remove(listener) if listener in self._closing else None

    def replace_scene(self, scene: MemoryScene) -> None:
        """Close the scene and go on with another, as File > Open does."""
        for listener in tuple(self._closing):
            listener()
        self._scene = scene
        self._states, self._at = [("open", scene)], 0

    # Selections, display, picking, progress

    def select(self, object_id: str, selection: str, vertices: Any) -> None:
        """Select vertices of the object's own mesh under a name; none removes the name."""
        item = self._object(object_id)
        chosen: IntArray = frozen(vertices, np.int64, (None,), "vertices")
        kept = {key: value for key, value in {**item.selections, selection: chosen}.items() if len(value)}
        self._put("Select", object_id, replace(item, selections=kept))

    def selections(self, object_id: str) -> tuple[str, ...]:
        return tuple(self._object(object_id).selections)

    def selected_points(self, object_id: str, selection: str) -> SurfacePoints:
        item = self._object(object_id)
        if selection not in item.selections:
            raise InvalidInput(f"{item.name} has no selection {selection!r}; it has {sorted(item.selections)}.")
        asset = self.read_surface(object_id)
        assert asset.source_vertices is not None  # our own reading fills it
        return SurfacePoints.at_vertices(asset.mesh, np.unique(asset.source_vertices[item.selections[selection]]))

    def show(self, picture: Picture | None) -> None:
        self.picture = picture

    def rays(self, pixels: Any) -> tuple[FloatArray, FloatArray]:
        if self.picture is None:
            raise InvalidInput("there is no view to pick in; call show() with a picture first.")
        screen = np.asarray(pixels, np.float64).reshape(-1, 2)
        width, height = self.viewport
        camera = camera_of(self.picture, width / height)
        half = np.tan(camera.field_of_view / 2)
        x = (2 * screen[:, 0] / width - 1) * half * width / height
        y = (1 - 2 * screen[:, 1] / height) * half
        toward = np.stack([x, y, np.full(len(screen), -1.0)], axis=1) @ camera.camera_from_world  # (k, 3)
        return np.tile(camera.eye, (len(screen), 1)), toward / np.linalg.norm(toward, axis=1, keepdims=True)

    def tell(self, fraction: float | None, text: str) -> None:
        self.told.append((fraction, text))
        asked, self._cancel_asked = self._cancel_asked, False
        if asked:
            raise Cancelled("it was cancelled in the host.")

    def cancel(self) -> None:
        self._cancel_asked = True

    def _object(self, object_id: str) -> MemoryObject:
        try:
            return self._scene.objects[object_id]
        except KeyError:
            near = difflib.get_close_matches(object_id, self._scene.objects, n=3) or list(self._scene.objects)[:5]
            raise InvalidInput(f"the scene has no object {object_id!r}; near ids: {', '.join(near)}.") from None

    def _put_new(self, item: MemoryObject) -> str:
        object_id, number = item.name, 2
        while object_id in self._scene.objects:
            object_id, number = f"{item.name}.{number}", number + 1
        self._put("Add", object_id, item)
        return object_id

    def _put(self, label: str, object_id: str, item: MemoryObject | None) -> None:
        self._replace(label, self._scene.with_object(object_id, item))

    def _replace(self, label: str, scene: MemoryScene) -> None:
        """Every write goes through here: what happens outside a step is a step of its own."""
        with self.step(label):
            self._scene = scene

    def _go(self, by: int) -> bool:
        if self._depth:
            raise InvalidInput("undo and redo wait until the step that is under way has ended.")
        if not 0 <= self._at + by < len(self._states):
            return False
        self._at += by
        self._scene = self._states[self._at][1]
        for listener in tuple(self._listeners):
            listener()
        return True


def _placement(item: MemoryObject) -> PolarDecomposition:
    return split_world_from_local(item.world)
