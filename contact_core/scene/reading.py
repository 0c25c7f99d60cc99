"""From a host's polygons and rigs to surface space: one code for every host, so that all give the same numbers.

Surface space is the object's own space with the stretch of its world matrix applied (`geometry.polar`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import numpy as np

from contact_core.arrays import FloatArray, frozen
from contact_core.document.asset import Asset
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.polar import PolarDecomposition
from contact_core.geometry.sound import sound_polygons
from contact_core.geometry.triangulate import triangulate
from contact_core.rig.rig import JointFreedom, Pose, Rig
from contact_core.scene.host import SceneSpace


def surface_of_polygons(
    name: str,
    points: Any,
    face_sizes: Any,
    face_indices: Any,
    placement: PolarDecomposition,
    space: SceneSpace,
    *,
    clockwise: bool = False,
    notes: tuple[str, ...] = (),
) -> Asset:
    """The surface of a polygon mesh in its own space: points (n, 3), corners per face, indices face after face.

    Open edges at bit-equal positions (texture seams) are joined, closed surfaces turned outwards, doubled faces
    dropped (`geometry.sound`). The cut into triangles is chosen in the object's own
    space, so it does not depend on where the object stands. clockwise: the host winds faces the other way round.
    """
    local = np.asarray(points, np.float64).reshape(-1, 3)
    sound = sound_polygons(local, face_sizes, face_indices, exact=True, clockwise=clockwise)
    kept = local[sound.first]
    faces, cut, cut_notes = triangulate(sound.sizes, sound.indices, kept)
    if clockwise != placement.mirrored:
        faces = faces[:, [0, 2, 1]]
    return Asset(
        name=name,
        mesh=TriangleMesh(placement.surface_points(kept), faces),
        source_vertices=sound.point_of,
        source_faces=sound.face_of[cut],
        meters_per_unit=space.meters_per_unit,
        up_axis=space.up_axis,
        notes=(*notes, *sound.notes, *cut_notes),
    )


def fit_to_scene(asset: Asset, space: SceneSpace, world_from_surface: Any = None) -> FloatArray:
    """(4, 4) world_from_local that puts an asset into a scene: its units scaled to the scene's.

    world_from_surface: where to; None: at the origin, with the asset's up axis turned to the scene's. Raises
    InvalidInput where it is no matrix of numbers.
    """
    scale = 1.0 if asset.meters_per_unit is None else asset.meters_per_unit / space.meters_per_unit
    if world_from_surface is None:
        world = turn_up(asset.up_axis, space.up_axis)
    else:
        world = np.array(frozen(world_from_surface, np.float64, (4, 4), "world_from_surface"))
    world[:3, :3] *= scale
    return world


def turn_up(source: Literal["X", "Y", "Z"], target: Literal["X", "Y", "Z"]) -> FloatArray:
    """(4, 4) rotation that takes one up axis to another, about the third axis (nothing when they are equal)."""
    matrix = np.eye(4)
    if source != target:
        a, b = "XYZ".index(source), "XYZ".index(target)
        c = 3 - a - b
        matrix[:3, :3] = 0.0
        matrix[b, a] = matrix[c, c] = 1.0
        matrix[a, b] = -1.0
    return matrix


def stretch_rig(rig: Rig, placement: PolarDecomposition, space: SceneSpace) -> Rig:
    """A rig in surface space. Raises InvalidInput where its scale is not uniform: joints could not turn rigidly."""
    if placement.uniform_scale == 1.0 and (rig.meters_per_unit, rig.up_axis) == (
        space.meters_per_unit,
        space.up_axis,
    ):
        return rig
    stretch = placement.surface_from_local
    scale = float(np.cbrt(abs(np.linalg.det(stretch))))
    if not np.allclose(stretch.T @ stretch, scale**2 * np.eye(3), atol=1e-5 * scale**2):
        raise InvalidInput(
            f"the rig {rig.name} is scaled unevenly ({np.linalg.norm(stretch, axis=0).tolist()}), so its joints"
            " would shear when they turn. Apply the scale in the host first."
        )
    return replace(
        rig,
        rest_local=conjugate(rig.rest_local, stretch),
        bind_world=conjugate(rig.bind_world, stretch),
        bind_points=placement.surface_points(rig.bind_points),
        faces=rig.faces[:, [0, 2, 1]] if placement.mirrored else rig.faces,
        freedoms=tuple(map(_mirror_freedom, rig.freedoms)) if placement.mirrored else rig.freedoms,
        meters_per_unit=space.meters_per_unit,
        up_axis=space.up_axis,
    )


def stretch_pose(pose: Pose, stretch: FloatArray) -> Pose:
    """A pose of a rig in local space as a pose of the stretched rig."""
    return pose if np.array_equal(stretch, np.eye(3)) else Pose(pose.joints, conjugate(pose.local, stretch))


def unstretch_pose(pose: Pose, stretch: FloatArray) -> Pose:
    """The way back."""
    return stretch_pose(pose, np.asarray(np.linalg.inv(stretch), np.float64))


def conjugate(matrices: FloatArray, stretch: FloatArray) -> FloatArray:
    """(j, 4, 4) transforms expressed after a stretch (3, 3) of space: S M S^-1; rigid stays rigid for uniform S."""
    if np.array_equal(stretch, np.eye(3)):
        return matrices
    whole = np.eye(4)
    whole[:3, :3] = stretch
    return whole @ matrices @ np.linalg.inv(whole)


def _mirror_freedom(freedom: JointFreedom) -> JointFreedom:
    """The freedom seen in a mirror along x: turns about x keep their sense, turns about y and z reverse."""
    mirror = np.diag([-1.0, 1.0, 1.0])
    assert freedom.lower is not None and freedom.upper is not None  # filled by JointFreedom itself
    axes = freedom.order if freedom.kind == "euler" else "XYZ"[: len(freedom.lower)]
    turned = np.array([axis != "X" for axis in axes], dtype=bool)
    return replace(
        freedom,
        frame=mirror @ freedom.frame @ mirror,
        lower=np.where(turned, -freedom.upper, freedom.lower),
        upper=np.where(turned, -freedom.lower, freedom.upper),
    )
