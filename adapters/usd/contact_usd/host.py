"""The USD host: reads any stage, writes one layer of its own. `adapters/README.md` says what it promises."""

from __future__ import annotations

import contextlib
import difflib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any, Self

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.document.asset import Asset
from contact_core.errors import InvalidInput, MissingExtra
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import Pose
from contact_core.scene.host import (
    DocumentStamp,
    DocumentStorage,
    LossTelling,
    PoseWriting,
    RigReading,
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
from contact_core.scene.reading import fit_to_scene, stretch_pose, unstretch_pose

try:
    from pxr import Sdf, Tf, Usd, UsdGeom, UsdSkel
except ImportError as error:
    raise MissingExtra("The USD host", "usd") from error

from contact_usd import export, mesh, poses, registration, skel, stage_io, storage
from contact_usd.layer import LayerUndo
from contact_usd.primitives import is_primitive, silent_losses, unchosen_variants

registration.register()

Binding = tuple[UsdSkel.Cache, UsdSkel.Binding]


class UsdHost(
    SceneReading, LossTelling, SceneWriting, RigReading, PoseWriting, DocumentStorage, Undo, SelectionReading
):
    """A USD stage. path: a file; without one an empty stage of `space`; `on` takes a stage that is open.

    Object ids are prim paths: of a Mesh, or of a Skeleton for a rig. Raises FileRefused.
    """

    name = "usd"
    summary = "a USD stage with an own layer for contacts"
    suffixes = stage_io.SUFFIXES

    def __init__(
        self,
        path: Path | str | None = None,
        *,
        space: SceneSpace | None = None,
        owned: stage_io.OwnedStage | None = None,
    ) -> None:
        self.schema_problem = registration.problem()
        if owned is None and path is not None:
            owned = stage_io.open_stage(Path(path))
        self._owned = owned or stage_io.new_stage(space or SceneSpace(1.0, "Y"))
        self._bindings: dict[str, Binding] | None = None
        with stage_io.refusing(self._owned.source or Path(self._owned.layer.identifier)):
            self._undo = LayerUndo(self._owned.layer)  # copies it: what a damaged binary layer holds is read now
        # Any layer may change what is bound to what, not only ours: a DCC edits its own at any time.
        self._key = Tf.Notice.Register(Usd.Notice.ObjectsChanged, self._forget, self._owned.stage)

    @classmethod
    def open(cls, path: Path) -> Self:
        return cls(path)

    @classmethod
    def on(cls, stage: Usd.Stage) -> UsdHost:
        """The host on a stage that a DCC has open; nothing is written to its files."""
        return cls(owned=stage_io.on_stage(stage))

    @property
    def stage(self) -> Usd.Stage:
        return self._owned.stage

    @property
    def layer(self) -> Sdf.Layer:
        """The one layer that this host writes."""
        return self._owned.layer

    def space(self) -> SceneSpace:
        space = stage_io.space_of(self.stage)
        problems = () if self.schema_problem is None else (self.schema_problem,)
        return SceneSpace(
            space.meters_per_unit,
            space.up_axis,
            space.frames_per_second,
            (*space.notes, *self._owned.notes, *problems),
        )

    # Scene reading and writing

    def objects(self) -> tuple[SceneObject, ...]:
        skinned = {str(q.GetPrim().GetPath()) for _, b in self._rigs().values() for q in skel.influenced_meshes(b)}
        found = []
        for prim in _drawn_prims(self.stage):
            path = str(prim.GetPath())
            if path in self._rigs():
                found.append(SceneObject(path, prim.GetName(), "rig"))
            elif (prim.IsA(UsdGeom.Mesh) or is_primitive(prim)) and path not in skinned:
                found.append(SceneObject(path, prim.GetName(), "surface"))
        return tuple(found)

    def losses(self) -> list[str]:
        """Notes on shapes of the stage that are no objects here, or not all that they could be."""
        rigs = [binding for _, binding in self._rigs().values()]
        influenced = {str(q.GetPrim().GetPath()) for b in rigs for q in skel.influenced_meshes(b)}
        return [
            *(note for b in rigs for note in skel.losses(b)),
            *silent_losses(self.stage, influenced),
            *unchosen_variants(self.stage),
        ]

    def read_surface(self, object_id: str) -> Asset:
        if object_id in self._rigs():
            return self.read_rig(object_id)
        return mesh.read_surface(self._mesh(object_id), self.space())

    def placement(self, object_id: str, frame: float | None = None) -> FloatArray:
        check_frame(frame)
        prim = self._prim(object_id)
        return mesh.placement_of(prim, frame).world_from_surface

    def add(self, asset: Asset, world_from_surface: Any = None) -> str:
        world = fit_to_scene(asset, self.space(), world_from_surface)
        with self.step(f"Add {asset.name}"), self._editing():
            if asset.rig is None:
                path = export.add_surface(self.stage, asset, world)
            else:
                path = export.add_rig(self.stage, asset, asset.rig, world)
            if not self.stage.HasDefaultPrim() and self.stage.GetRootLayer() == self.layer:
                self.stage.SetDefaultPrim(self.stage.GetPrimAtPath(Sdf.Path(path).GetPrefixes()[0]))
            return path

    # Rigs and poses

    def read_rig(self, object_id: str) -> Asset:
        asset, _ = skel.read_rig(*self._rig(object_id), self.space())
        return asset

    def read_pose(self, object_id: str, frame: float | None = None) -> Pose:
        check_frame(frame)
        cache, binding = self._rig(object_id)
        skeleton = binding.GetSkeleton()
        rest = skel.rest_local(cache, skeleton)
        local = Pose(skel.joint_names(skeleton), poses.local_pose(cache, skeleton, rest, frame))
        local = local.in_tree_order(skel.parents_of(cache, skeleton))
        return stretch_pose(local, mesh.placement_of(skeleton.GetPrim()).surface_from_local)

    def skin_points(self, object_id: str, pose: Pose) -> FloatArray:
        # UsdSkel evaluates a stage of its own on top of ours, so that nothing here is touched.
        scratch = self._scratch_stage()
        cache, binding = skel.bindings(scratch)[object_id]
        _, parts = skel.read_rig(cache, binding, self.space())
        skeleton = binding.GetSkeleton()
        placement = mesh.placement_of(skeleton.GetPrim())
        poses.write(scratch, cache, skeleton, self._whole_pose(object_id, pose, None), None)
        cache, binding = skel.bindings(scratch)[object_id]
        return placement.surface_points(skel.skin_of_stage(cache, binding, parts, Usd.TimeCode.Default()))

    def write_pose(self, object_id: str, pose: Pose, frame: float | None = None) -> None:
        check_frame(frame)
        local = self._whole_pose(object_id, pose, frame)
        cache, binding = self._rig(object_id)
        with self.step("Pose"), self._editing():
            poses.write(self.stage, cache, binding.GetSkeleton(), local, frame)

    def pose_keys(self, object_id: str) -> tuple[float, ...]:
        cache, binding = self._rig(object_id)
        return poses.key_frames(cache, binding.GetSkeleton())

    # The document

    def stored_stamp(self) -> DocumentStamp | None:
        return storage.read_stamp(self.stage)

    def stored_document(self) -> StoredDocument | None:
        return storage.read(self.stage)

    def store_document(self, stamp: DocumentStamp, put: Mapping[str, str], remove: Iterable[str] = ()) -> None:
        check_overwrite(self.stored_stamp())
        gone = tuple(remove)
        with contextlib.ExitStack() as stack:
            if not storage.is_in(self.layer):
                stack.enter_context(self.step("Document"))
                storage.take_over(self.stage, self.layer)
            stack.enter_context(self._undo.writing("Document", storage.attributes(put, gone)))
            storage.write(self.layer, stamp, put, gone)

    def save(self, path: Path | None = None, folder: Path | None = None) -> None:
        """folder: where the file will be brought to, if it does not stay: relative paths in it start there."""
        target = stage_io.default_target(self._owned) if path is None else Path(path)
        stage_io.save(self._owned, target, folder)

    # Undo

    def step(self, label: str) -> AbstractContextManager[None]:
        return self._undo.step(label)

    def undo(self) -> bool:
        return self._undo.go(-1)

    def redo(self) -> bool:
        return self._undo.go(+1)

    def on_undo(self, listener: Callable[[], None]) -> Callable[[], None]:
        return self._undo.listen(listener)

    # Selections

    def selections(self, object_id: str) -> tuple[str, ...]:
        return tuple(
            f"{prefix}{name}" for prefix, prim, _ in self._parts(object_id) for name in mesh.subset_names(prim)
        )

    def selected_points(self, object_id: str, selection: str) -> SurfacePoints:
        asset = self.read_surface(object_id)
        assert asset.source_vertices is not None  # our own reading fills it
        for prefix, prim, start in self._parts(object_id):
            if selection.startswith(prefix) and selection.removeprefix(prefix) in mesh.subset_names(prim):
                own: IntArray = mesh.selected_points_of(prim, selection.removeprefix(prefix)) + start
                return SurfacePoints.at_vertices(asset.mesh, np.unique(asset.source_vertices[own]))
        raise InvalidInput(
            f"{object_id} has no selection {selection!r}; its GeomSubsets are {list(self.selections(object_id))}."
        )

    def _parts(self, object_id: str) -> Iterator[tuple[str, Usd.Prim, int]]:
        """Prefix of selection names, prim, and number of the first own point, of each mesh behind an object."""
        if object_id not in self._rigs():
            yield "", self._mesh(object_id), 0
            return
        meshes = [query.GetPrim() for query in skel.skinned_meshes(self._rig(object_id)[1])]
        start = 0
        for prim in meshes:
            yield ("" if len(meshes) == 1 else f"{prim.GetName()}/"), prim, start
            start += len(UsdGeom.Mesh(prim).GetPointsAttr().Get(mesh.AS_IT_STANDS))

    def _whole_pose(self, object_id: str, pose: Pose, frame: float | None) -> FloatArray:
        """(j, 4, 4) in skeleton space: the pose that stands, with the joints of `pose` in it."""
        cache, binding = self._rig(object_id)
        skeleton = binding.GetSkeleton()
        names = skel.joint_names(skeleton)
        whole = poses.local_pose(cache, skeleton, skel.rest_local(cache, skeleton), frame).copy()
        local = unstretch_pose(pose, mesh.placement_of(skeleton.GetPrim()).surface_from_local)
        for name, matrix in zip(local.joints, local.local, strict=True):
            if name not in names:
                near = ", ".join(difflib.get_close_matches(name, names, n=3) or names[:5])
                raise InvalidInput(f"{object_id} has no joint {name!r}; near names: {near}.")
            whole[names.index(name)] = matrix
        return whole

    def _scratch_stage(self) -> Usd.Stage:
        """A stage of its own over the layers of ours, those of its session among them, as it has them."""
        session, root = self.stage.GetSessionLayer(), self.stage.GetRootLayer()
        layer = Sdf.Layer.CreateAnonymous()
        layer.subLayerPaths = [item.identifier for item in (session, root) if item is not None]
        scratch = Usd.Stage.Open(layer, self.stage.GetPathResolverContext())
        scratch.MuteAndUnmuteLayers(self.stage.GetMutedLayers(), [])
        return scratch

    def _rigs(self) -> dict[str, Binding]:
        if self._bindings is None:
            self._bindings = skel.bindings(self.stage)
        return self._bindings

    def _forget(self, notice: object, sender: object) -> None:
        self._bindings = None

    def _rig(self, object_id: str) -> Binding:
        if object_id in self._rigs():
            return self._rigs()[object_id]
        self._prim(object_id)
        raise InvalidInput(f"{object_id} is no skeleton that drives a mesh; rigs here: {', '.join(self._rigs())}.")

    def _mesh(self, object_id: str) -> Usd.Prim:
        prim = self._prim(object_id)
        if not (prim.IsA(UsdGeom.Mesh) or is_primitive(prim)):
            raise InvalidInput(f"{object_id} is a {prim.GetTypeName() or 'prim without a type'}, not a Mesh.")
        return prim

    def _prim(self, object_id: str) -> Usd.Prim:
        valid = Sdf.Path.IsValidPathString(object_id) and Sdf.Path(object_id).IsAbsolutePath()
        prim = self.stage.GetPrimAtPath(object_id) if valid else None
        if not prim:
            ids = [item.id for item in self.objects()]
            near = ", ".join(difflib.get_close_matches(object_id, ids, n=3) or ids[:5])
            raise InvalidInput(f"the stage has no prim {object_id!r}; near paths: {near}.")
        return prim

    @contextmanager
    def _editing(self) -> Iterator[None]:
        """Edits go to our layer."""
        with Usd.EditContext(self.stage, Usd.EditTarget(self.layer)):
            yield


def _drawn_prims(stage: Usd.Stage) -> Iterator[Usd.Prim]:
    """Prims that stand where they are drawn: instances by proxies, without the prototypes of point instancers."""
    walk = iter(Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()))
    prototypes: set[str] = set()
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        if prim.IsA(UsdGeom.PointInstancer):
            prototypes |= {
                str(path) for path in UsdGeom.PointInstancer(prim).GetPrototypesRel().GetForwardedTargets()
            }
    for prim in walk:
        if prim.IsA(UsdGeom.PointInstancer) or str(prim.GetPath()) in prototypes:
            walk.PruneChildren()
        else:
            yield prim
