"""The Blender host: every capability in terms of ids, plain arrays and the core's values."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from contact_blender import bones as bone_choice
from contact_blender import choices, compat, curves, evaluation, exporter, fidelity, keys, poses, selection, storage
from contact_blender import mesh as meshes
from contact_blender import rig as rigs
from contact_blender.compat import bpy
from contact_blender.ids import ObjectIds
from contact_blender.lifetime import SceneEnd
from contact_blender.previews import PosePreviews
from contact_blender.undo import UndoBridge
from contact_core.arrays import FloatArray, IntArray
from contact_core.document.asset import Asset
from contact_core.errors import Cancelled, FileRefused, InvalidInput
from contact_core.geometry.polar import PolarDecomposition, split_world_from_local
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.pose_keys import PoseKeys
from contact_core.rig.rig import JointFreedom, Pose
from contact_core.scene.host import (
    BoneChoosing,
    CurveWriting,
    Display,
    DocumentStamp,
    DocumentStorage,
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
)
from contact_core.scene.picture import Picture
from contact_core.scene.reading import fit_to_scene, stretch_pose, stretch_rig, surface_of_polygons, unstretch_pose

if TYPE_CHECKING:
    from contact_blender.overlay import Overlay


@dataclass(frozen=True, eq=False)
class _KnownRig:
    """kept: (n,) cage vertex of each rig point. vertices: of the cage. unmoved: whether some belong to no bone."""

    kept: IntArray
    vertices: int
    unmoved: bool


class BlenderHost(
    SceneReading,
    SceneWriting,
    RigReading,
    BoneChoosing,
    CurveWriting,
    DocumentStorage,
    Undo,
    SceneLifetime,
    SelectionReading,
    Display,
    ProgressDisplay,
):
    """The scene of Blender's window, or of the bpy module. Ids are the names under which objects were first seen.

    path: a .blend to open first; None: the scene that is open. A process is one Blender, so opening a file
    replaces what was open. bones: which bones are posed where nobody chose (`choose_bones`). Raises FileRefused.
    """

    name = "blender"
    summary = "the scene that is open in Blender"
    suffixes = (".blend",)

    def __init__(self, path: Path | str | None = None, *, bones: str = bone_choice.AUTOMATIC) -> None:
        if compat.version() < compat.OLDEST:
            raise InvalidInput(
                f"Blender 4.2 or newer is needed, but this is {'.'.join(map(str, compat.version()))}."
            )
        if path is not None:
            storage.open_file(Path(path))
        self._ids = ObjectIds()
        self._undo = UndoBridge()
        self._overlay: Overlay | None = None
        self._cancel_asked = False
        self._shows_progress = False
        self._bones = bones
        self._known: dict[str, _KnownRig] = {}
        self._scene_uid = int(bpy.context.scene.session_uid)
        self._lifetime = SceneEnd()
        self._previews = PosePreviews()
        storage.restore_ids(bpy.context.scene, self._ids)

    @classmethod
    def open(cls, path: Path) -> Self:
        """The host on a .blend, which replaces what was open in this process."""
        return cls(path)

    def space(self) -> SceneSpace:
        scene = self._scene
        rate = scene.render.fps / scene.render.fps_base
        silenced = bpy.app.autoexec_fail_message if bpy.app.autoexec_fail else ""
        note = f"Blender did not run the scripts of this file ({silenced}), so what they drive stands still."
        return SceneSpace(float(scene.unit_settings.scale_length), "Z", float(rate), (note,) if silenced else ())

    # Scene reading and writing

    def objects(self) -> tuple[SceneObject, ...]:
        return tuple(
            SceneObject(self._ids.id_of(each), str(each.name), "rig" if rigs.armature_of(each) else "surface")
            for each in self._scene.objects
            if each.type == "MESH"
        )

    def read_surface(self, object_id: str) -> Asset:
        scene_object = self._mesh_object(object_id)
        if rigs.armature_of(scene_object) is not None:
            return self.read_rig(object_id)
        depsgraph = meshes.current_depsgraph()
        with meshes.evaluated_mesh(scene_object, depsgraph) as mesh:
            local = meshes.read_polygons(mesh)
        asset = surface_of_polygons(
            scene_object.name, local.points, local.sizes, local.corners, self._placement(scene_object), self.space()
        )
        if meshes.keeps_vertices(scene_object) or asset.source_vertices is None:
            return asset
        made_of = meshes.evaluated_vertices(scene_object)  # (n original,) evaluated vertex, -1: none
        sources = None if made_of is None else np.where(made_of >= 0, asset.source_vertices[made_of], -1)
        return replace(asset, source_vertices=sources)

    def placement(self, object_id: str, frame: float | None = None) -> FloatArray:
        check_frame(frame)
        scene_object = self._mesh_object(object_id)
        frame_holder = rigs.armature_of(scene_object) or scene_object
        return self._placement(frame_holder, frame).world_from_surface

    def add(self, asset: Asset, world_from_surface: Any = None) -> str:
        with self.step(f"Add {asset.name}"):
            world = fit_to_scene(asset, self.space(), world_from_surface)
            object_id = self._ids.id_of(exporter.add_asset(asset, world))
            self._undo.wrote(lambda: exporter.remove_object(self._ids.resolve(object_id)))
        return object_id

    # Rigs and poses

    def read_rig(self, object_id: str) -> Asset:
        scene_object, armature, placement = self._rigged(object_id)
        name, choice = str(scene_object.name), self._chosen(armature)
        reading = rigs.read_rig(scene_object, armature, meshes.current_depsgraph(), name, choice)
        self._known[object_id] = _KnownRig(reading.kept, len(reading.vertices), rigs.UNMOVED in reading.rig.joints)
        rig = stretch_rig(reading.rig, placement, self.space())
        beyond = fidelity.beyond_linear_skinning(scene_object, armature)
        difference = fidelity.largest_difference(scene_object, armature, reading)
        exact = not beyond and difference is not None and difference <= fidelity.TOLERANCE
        return Asset(
            name=name,
            mesh=rig.surface,
            rig=rig,
            source_vertices=reading.vertices,
            source_faces=reading.polygons,
            meters_per_unit=rig.meters_per_unit,
            up_axis=rig.up_axis,
            notes=(*reading.notes, *beyond),
            details={"linear skinning is exact": exact, "largest difference from Blender": difference},
        )

    def read_pose(self, object_id: str, frame: float | None = None) -> Pose:
        check_frame(frame)
        _, armature, placement = self._rigged(object_id)
        pose = poses.read_pose(armature, frame, self._known_rig(object_id).unmoved)
        return stretch_pose(pose, placement.surface_from_local)

    def bones_of(self, object_id: str) -> str:
        return self._chosen(self._armature(object_id))

    def bone_choices(self, object_id: str) -> list[tuple[str, str]]:
        """(choice, label) of what `choose_bones` takes for a rig."""
        return bone_choice.listed(self._armature(object_id))

    def choose_bones(self, object_id: str, choice: str) -> None:
        armature = self._armature(object_id)
        bone_choice.check_choice(armature, choice)
        with self.step("Choose bones"):
            take_back = choices.write(self._scene, armature, choice)
            self._undo.wrote(lambda: take_back(self._scene))

    def freedoms(self, object_id: str) -> tuple[JointFreedom, ...]:
        scene_object, armature, _ = self._rigged(object_id)
        return rigs.freedoms(scene_object, armature, self._chosen(armature), self._known_rig(object_id).unmoved)

    def skin_points(self, object_id: str, pose: Pose) -> FloatArray:
        scene_object, armature, placement = self._rigged(object_id)
        local = unstretch_pose(pose, placement.surface_from_local)
        bases = poses.bases_of(rigs.read_skeleton(armature), local, armature.name)
        kept = self._known_rig(object_id).kept
        with evaluation.posed(armature, bases):
            points = evaluation.skin_in_armature(scene_object, armature)
        return placement.surface_points(points[kept])

    def write_pose(self, object_id: str, pose: Pose, frame: float | None = None) -> None:
        check_frame(frame)
        scene_object, armature, placement = self._rigged(object_id)
        poses.check_local(armature)
        local = unstretch_pose(pose, placement.surface_from_local)
        armature_id = self._ids.id_of(armature)
        with self.step("Pose"):
            put_back = poses.remember(armature, pose.joints, frame)
            self._undo.wrote(lambda: put_back(self._ids.resolve(armature_id)))
            poses.write_pose(armature, local, frame, self._posed(scene_object, armature))

    def write_curves(self, object_id: str, pose_keys: PoseKeys) -> None:
        scene_object, armature, placement = self._rigged(object_id)
        poses.check_local(armature)
        rig, posed = self.read_rig(object_id).rig, self._posed(scene_object, armature)
        assert rig is not None
        armature_id, joints = self._ids.id_of(armature), pose_keys.poses[0].joints
        with self.step("Curves"):
            put_back = poses.remember(armature, joints, pose_keys.frames[0])
            self._undo.wrote(lambda: put_back(self._ids.resolve(armature_id)))
            curves.write(armature, rig, pose_keys, placement.surface_from_local, posed)

    def preview_pose(self, object_id: str, pose: Pose) -> None:
        """Show a pose on the bones while something is dragged or proposed: no step, no key. `end_previews` puts the
        channels back as they were before the first."""
        _, armature, placement = self._rigged(object_id)
        self._previews.show(self._ids.id_of(armature), armature, unstretch_pose(pose, placement.surface_from_local))

    def end_previews(self) -> None:
        """Put back what `preview_pose` showed, bit for bit; what has left the scene is forgotten."""
        self._previews.put_back(self._ids)

    def forget_previews(self) -> None:
        """After an undo of Blender's, which has put the channels where they belong."""
        self._previews.forget()

    def is_seen(self, object_id: str) -> bool:
        """Whether the object is visible in the view layer of the window; not, where it has gone."""
        try:
            return bool(self._ids.resolve(object_id).visible_get())
        except (InvalidInput, RuntimeError):  # gone, or not of this view layer
            return False

    def pose_keys(self, object_id: str) -> tuple[float, ...]:
        return keys.frames(self._rigged(object_id)[1])

    # The document

    def stored_stamp(self) -> DocumentStamp | None:
        return storage.read_stamp(self._scene)

    def stored_document(self) -> StoredDocument | None:
        return storage.read(self._scene)

    def store_document(self, stamp: DocumentStamp, put: Mapping[str, str], remove: Iterable[str] = ()) -> None:
        with self.step("Contact document"):
            take_back = storage.write(self._scene, stamp, put, remove, self._ids.pairs())
            self._undo.wrote(lambda: take_back(self._scene, self._ids))

    def save(self, path: Path | None = None) -> None:
        target = str(bpy.data.filepath) if path is None else str(Path(path).resolve())
        if not target:
            raise FileRefused("this scene came from no file; say where to save it.")
        if Path(target).suffix.lower() not in self.suffixes:
            raise FileRefused(f"cannot write {Path(target).name}: a scene of Blender is saved as .blend.")
        try:  # Blender writes a file beside the old one and renames it: whole or not at all
            bpy.ops.wm.save_as_mainfile(filepath=target, check_existing=False)
        except RuntimeError as error:
            raise FileRefused(f"Blender could not save {target}: {str(error).strip()}") from error

    # Undo

    def step(self, label: str) -> AbstractContextManager[None]:
        return self._undo.step(label)

    def step_of_operator(self) -> AbstractContextManager[None]:
        """Inside, the operator that runs is the owner of the undo step, see `UndoBridge.left_to_operator`."""
        return self._undo.left_to_operator()

    def undo(self) -> bool:
        return self._undo.undo()

    def redo(self) -> bool:
        return self._undo.redo()

    def on_undo(self, listener: Callable[[], None]) -> Callable[[], None]:
        return self._undo.on_undo(listener)

    def on_close(self, listener: Callable[[], None]) -> Callable[[], None]:
        return self._lifetime.on_close(listener)

    # Selections, display and progress

    def selections(self, object_id: str) -> tuple[str, ...]:
        return selection.names(self._mesh_object(object_id))

    def selected_points(self, object_id: str, selection_name: str) -> SurfacePoints:
        chosen = selection.vertices(self._mesh_object(object_id), selection_name)
        asset = self.read_surface(object_id)
        if asset.source_vertices is None:
            raise InvalidInput(
                f"{object_id} is linked from another file and its modifiers add vertices; make it local."
            )
        reached = np.unique(asset.source_vertices[chosen])
        return SurfacePoints.at_vertices(asset.mesh, reached[reached >= 0])

    def select_points(self, object_id: str, points: SurfacePoints, selection_name: str) -> int:
        """Let the selection, or a vertex group, be the vertices next to surface points; one step of undo.

        Each point is stood for by the nearest corner of its face. A vertex group that a bone or a modifier reads is
        not overwritten. Returns how many vertices. Raises InvalidInput.
        """
        scene_object = self._mesh_object(object_id)
        asset = self.read_surface(object_id)
        if asset.source_vertices is None:
            raise InvalidInput(f"the modifiers of {object_id} make vertices that stand for none of its own.")
        selection.check_writable(scene_object, selection_name)
        corners = asset.mesh.faces[points.faces, points.barycentric.argmax(axis=1)]
        wanted = np.flatnonzero(np.isin(asset.source_vertices, corners))
        with self.step("Select patch"):
            put_back = selection.choose(scene_object, wanted, selection_name)
            self._undo.wrote(lambda: put_back(self._ids.resolve(object_id)))
        return len(wanted)

    def show(self, picture: Picture | None) -> None:
        """Over every 3D view; without a window it waits for one."""
        if self._overlay is None:
            from contact_blender.overlay import Overlay  # Blender's gpu module, which a batch job never needs

            self._overlay = Overlay()
        self._overlay.show(picture)

    def tell(self, fraction: float | None, text: str) -> None:
        """Blender's progress cursor. Only a modal operator hears a key: it calls `cancel`."""
        asked, self._cancel_asked = self._cancel_asked, False
        manager = bpy.context.window_manager
        over = asked or (fraction is not None and fraction >= 1.0)
        if not self._shows_progress and not over:
            manager.progress_begin(0.0, 1.0)  # a part of a longer task begins above 0
            self._shows_progress = True
        if fraction is not None and self._shows_progress:
            manager.progress_update(min(max(fraction, 0.0), 1.0))
        if over and self._shows_progress:
            manager.progress_end()
            self._shows_progress = False
        if asked:
            raise Cancelled("it was cancelled in Blender.")

    def cancel(self) -> None:
        self._cancel_asked = True

    # Resolving: for the length of one call

    @property
    def _scene(self) -> Any:
        """The scene of this host, which need not be the one that the window shows. Where it was removed, or another
        file is open, its sessions end, and the host goes on with the scene that is open."""
        for scene in bpy.data.scenes:
            if scene.session_uid == self._scene_uid:
                return scene
        self._lifetime.closed()
        self._scene_uid = int(bpy.context.scene.session_uid)
        return bpy.context.scene

    def _mesh_object(self, object_id: str) -> Any:
        scene_object = self._ids.resolve(object_id)
        if scene_object.type != "MESH":
            raise InvalidInput(f"{object_id} is a {scene_object.type.lower()}; contacts lie on meshes.")
        if not scene_object.evaluated_get(meshes.current_depsgraph()).is_evaluated:
            raise InvalidInput(
                f"{object_id} is disabled in viewports or excluded from the view layer, so Blender evaluates"
                " neither its modifiers nor its place; enable it first."
            )
        return scene_object

    def _rigged(self, object_id: str) -> tuple[Any, Any, PolarDecomposition]:
        """Mesh object, armature object, placement of the armature."""
        scene_object, armature = self._mesh_object(object_id), self._armature(object_id)
        return scene_object, armature, self._placement(armature)

    def _armature(self, object_id: str) -> Any:
        """Found without an evaluation, so that a panel may ask while it draws."""
        armature = rigs.armature_of(self._ids.resolve(object_id))
        if armature is None:
            raise InvalidInput(f"{object_id} is a surface and has no rig: no armature deforms it.")
        return armature

    def _chosen(self, armature: Any) -> str:
        """Which bones of an armature are posed."""
        found = choices.read(self._scene, armature)
        return self._bones if found is None else found

    def _posed(self, scene_object: Any, armature: Any) -> frozenset[str]:
        return bone_choice.posed_bones(scene_object, armature, self._chosen(armature))

    def _known_rig(self, object_id: str) -> _KnownRig:
        """What the last reading of the rig found; read again when the mesh has another number of vertices."""
        known = self._known.get(object_id)
        if known is None or known.vertices != len(self._mesh_object(object_id).data.vertices):
            self.read_rig(object_id)
        return self._known[object_id]

    def _placement(self, scene_object: Any, frame: float | None = None) -> PolarDecomposition:
        with evaluation.graph_at(frame, scene_object) as depsgraph:
            return split_world_from_local(np.array(scene_object.evaluated_get(depsgraph).matrix_world, float))
