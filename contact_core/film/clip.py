"""The film of a session as a file with an animation, and the animation of a file as keys."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset
from contact_core.document.document import ContactDocument
from contact_core.document.timeline import PoseKey, cubic_keys
from contact_core.errors import FileRefused, InvalidInput
from contact_core.plugins.registry import FORMATS
from contact_core.plugins.slots import ClipFormat
from contact_core.rig.clip import Clip
from contact_core.rig.pose_keys import PoseKeys
from contact_core.rig.poses import moved_roots
from contact_core.rig.rig import Pose, Rig

if TYPE_CHECKING:
    from contact_core.plugins.manager import PluginManager
    from contact_core.session import Session

STILL = 1e-9  # up to which a place counts as the same


def read_clips(path: Path | str, plugins: PluginManager, *, rate: float | None = None) -> tuple[Clip, ...]:
    """The animations in a file. rate: frames per second; None: what the file says, or 24.

    Raises FileRefused, also for formats without animations.
    """
    return _format(Path(path), plugins).read_clips(Path(path), rate=rate)


def write_clip(session: Session, frames: Sequence[float], path: Path | str) -> Path:
    """Everything in the scene with its film as one animation, in the format of the path (.glb, .usda).

    Rigs whose keys are cubic and that stand still keep those keys, as curves with tangents; what else moves is
    written at every one of the frames. Raises FileRefused, InvalidInput.
    """
    if not len(frames):
        raise InvalidInput("a film needs frames, at least one.")
    writer = _format(Path(path), session.plugins)
    film = [session.scene_at(frame) for frame in frames]
    assets, poses = standing_scene(session, film[0])
    moving = list[PoseKeys]()
    for asset in assets:
        found = _exact(session, film, asset.name, asset.rig) or _baked(frames, film, asset.name, asset.rig)
        if found is not None:
            moving.append(found)
    rate = session.timeline.settings.frames_per_second
    writer.write_clip(Path(path), assets, poses, Clip("film", rate, tuple(moving)) if moving else None)
    return Path(path)


def standing_scene(session: Session, document: ContactDocument) -> tuple[list[Asset], dict[str, Pose]]:
    """Everything whose mesh is loaded, and by name how it stands in a document without time: a rig by its roots, an
    object as one joint, in world space."""
    assets, poses = list[Asset](), dict[str, Pose]()
    for name, surface in document.surfaces.items():
        mesh = session.derived.known_meshes.get(surface.digest)
        if mesh is not None:
            rig, units = session.rigs.get(name), surface.meters_per_unit
            assets.append(Asset(name, mesh, rig, meters_per_unit=units, up_axis=surface.up_axis))
            poses[name] = _standing(document, name, rig)
    return assets, poses


def _format(path: Path, plugins: PluginManager) -> ClipFormat:
    offered = plugins.offers(FORMATS).values()
    found = [kind for kind in offered if isinstance(kind, ClipFormat) and path.suffix.lower() in kind.suffixes]
    if not found:
        known = sorted({suffix for kind in offered if isinstance(kind, ClipFormat) for suffix in kind.suffixes})
        raise FileRefused(
            f"{path.name}: animations are kept in {', '.join(known) or 'no format here'}, but"
            f" {path.suffix or 'a name without suffix'} was asked for."
        )
    return found[0]


def _standing(document: ContactDocument, name: str, rig: Rig | None) -> Pose:
    """A rig by its roots, an object as one joint, in world space."""
    world = document.surface(name).world_from_surface
    if rig is None:
        return Pose((name,), world[None])
    return moved_roots(rig, document.poses.get(name, Pose.rest(rig)), world)


def _exact(session: Session, film: Sequence[ContactDocument], name: str, rig: Rig | None) -> PoseKeys | None:
    """The document's own cubic keys of a rig that stands still and is posed by them alone."""
    track = session.timeline.track("pose", name)
    places = np.array([document.surface(name).world_from_surface for document in film])
    if rig is None or track is None or np.abs(places - places[0]).max() > STILL or _is_bound(session, name):
        return None
    keys = cubic_keys(name, track.of(PoseKey))
    if keys is None:
        return None
    world = places[0]
    return PoseKeys(
        name,
        keys.frames,
        tuple(moved_roots(rig, pose, world) for pose in keys.poses),
        tuple(_on_rig(rig, pose, speeds, world) for pose, speeds in zip(keys.poses, keys.speeds, strict=True)),
    )


def _is_bound(session: Session, name: str) -> bool:
    """Whether a scene says how a rig is posed."""
    return session.binding.has_scene and bool(session.binding.pose_keys(name))


def _on_rig(rig: Rig, pose: Pose, speeds: FloatArray, world: FloatArray) -> FloatArray:
    """(j, 6) speeds of all joints, of roots in world space: turning is in the joint's own frame and stays."""
    result = np.zeros((len(rig.joints), 6))
    result[[rig.joint_index(joint) for joint in pose.joints]] = speeds
    roots = rig.parents < 0
    result[roots, :3] = result[roots, :3] @ world[:3, :3].T
    return result


def _baked(frames: Sequence[float], film: Sequence[ContactDocument], name: str, rig: Rig | None) -> PoseKeys | None:
    """A key at every frame; None for what does not move."""
    poses = tuple(_standing(document, name, rig) for document in film)
    if all(np.abs(pose.local - poses[0].local).max() <= STILL for pose in poses):
        return None
    return PoseKeys(name, tuple(map(float, frames)), poses)
