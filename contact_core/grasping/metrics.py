"""What a posed contact is worth: distances, normals, depth, bones and skin, each with its definition.

Everything is measured on the TRUE deformed skin (its own normals, not rigidly skinned ones) in the object's
surface space. Lengths come out as fractions of the manipulator's length. Which number sees which failure:
distance to the paired point sees a wrong transfer; the worst patch at 45 degrees sees a fingertip that points
the wrong way, to which the mean of n.n' < 0 is blind; bones that cross the surface see a finger through a thin
wall, to which depth is blind; skin stretch sees a rig that was read without its hierarchy.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.geometry.inside import Sunk, depth_inside
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints

OPPOSED_45 = -np.sqrt(0.5)  # n.n' below this: normals opposed within 45 degrees


@dataclass(frozen=True, eq=False)
class Contact:
    """One pair of patches, point by point. source: (n,) points on the skin. target: (n,) points on the object."""

    source: SurfacePoints
    target: SurfacePoints


@dataclass(frozen=True, eq=False)
class PosedScene:
    """A posed manipulator and an object, in the object's surface space.

    rest, skin: the manipulator's surface at rest and posed, same faces. bones: (b, 2, 3) segments from joint
    to child joint, posed. rest_local, local: (j, 4, 4) parent_from_joint at rest and posed; moving: (j,) which
    joints count as joints (not the root). solids: closed surfaces whose inside counts for depth (the object
    itself, and a filled proxy where its walls are thin); none where the object has no inside to speak of.
    length: the manipulator's, surface units.
    """

    rest: TriangleMesh
    skin: TriangleMesh
    bones: FloatArray
    rest_local: FloatArray
    local: FloatArray
    moving: BoolArray
    object_mesh: TriangleMesh
    solids: tuple[TriangleMesh, ...]
    contacts: Mapping[str, Contact]
    length: float


def measure(scene: PosedScene) -> dict[str, Any]:
    """The metrics of `report.json`, JSON-able; lengths as fractions of the manipulator's length.

    Without contacts the contact metrics are None, without solids the depth metrics are.
    """
    per_patch = {name: _Patch.of(scene, contact) for name, contact in scene.contacts.items()}
    return {
        **_contact_metrics(list(per_patch.values()), scene.length),
        **_depth_metrics(scene),
        "bones_through": int(bones_through(scene.bones, scene.object_mesh).sum()),
        "skin_stretch_p99": skin_stretch(scene.rest, scene.skin, 99.0),
        "max_joint_change_deg": float(
            np.degrees(joint_changes(scene.rest_local, scene.local)[scene.moving].max(initial=0.0))
        ),
        "contacts": sum(len(contact.source) for contact in scene.contacts.values()),
        "patches": {
            name: _contact_metrics([patch], scene.length, whole=False) for name, patch in per_patch.items()
        },
    }


@dataclass(frozen=True, eq=False)
class _Patch:
    """Per point of one patch: distance to the paired point, to the surface, and n.n'."""

    paired: FloatArray
    gap: FloatArray
    cosine: FloatArray

    @classmethod
    def of(cls, scene: PosedScene, contact: Contact) -> _Patch:
        points = contact.source.positions(scene.skin)  # (n, 3)
        paired = np.linalg.norm(points - contact.target.positions(scene.object_mesh), axis=1)
        normals, others = contact.source.normals(scene.skin), contact.target.normals(scene.object_mesh)
        gap = Locator.of(scene.object_mesh).closest(points).distance
        return cls(paired, gap, np.einsum("ni,ni->n", normals, others))


def _contact_metrics(patches: list[_Patch], length: float, *, whole: bool = True) -> dict[str, Any]:
    """Metrics of all points of some patches together; `whole` adds what only a set of patches has."""
    names = ("mean_contact_distance", "p95_contact_distance", "gap", "opposed_normals", "opposed_normals_45")
    extra = ("worst_patch_opposed_45",) if whole else ("points",)
    if not patches:
        return dict.fromkeys(names + extra)
    paired, gap, cosine = (
        np.concatenate([getattr(p, key) for p in patches]) for key in ("paired", "gap", "cosine")
    )
    values = (
        float(paired.mean() / length),
        float(np.percentile(paired, 95) / length),
        float(gap.mean() / length),
        float((cosine < 0).mean()),
        float((cosine < OPPOSED_45).mean()),
    )
    worst = min(float((patch.cosine < OPPOSED_45).mean()) for patch in patches)
    return {**dict(zip(names, values, strict=True)), extra[0]: worst if whole else len(paired)}


def _depth_metrics(scene: PosedScene) -> dict[str, float | None]:
    """Deepest skin vertex, and the fraction of skin area, inside any solid (winding number > 0.5)."""
    if not scene.solids:
        return {"max_penetration": None, "skin_inside": None}
    depths = np.max([depth_inside(scene.skin.points, solid) for solid in scene.solids], axis=0)  # (n,)
    found = Sunk.of(scene.skin, depths)
    return {"max_penetration": found.deepest / scene.length, "skin_inside": found.share}


def bones_through(bones: FloatArray, mesh: TriangleMesh) -> BoolArray:
    """(b,) which segments (b, 2, 3) cross a surface."""
    along = bones[:, 1] - bones[:, 0]
    crossed = np.zeros(len(bones), bool)
    real = along.any(axis=1)
    if real.any():
        crossed[real] = Locator.of(mesh).cast(bones[real, 0], along[real], max_distance=1.0).found
    return crossed


def skin_stretch(rest: TriangleMesh, skin: TriangleMesh, percentile: float) -> float:
    """A percentile of posed / rest length over the edges of the skin (1: nothing stretches)."""
    a, b, before = _edges(rest)
    after = np.linalg.norm(skin.points[b] - skin.points[a], axis=1)
    return float(np.percentile(after / before, percentile)) if len(a) else 1.0


def _edges(mesh: TriangleMesh) -> tuple[IntArray, IntArray, FloatArray]:
    """Both ends (e,) of every edge that has a length, and that; found once for a mesh."""
    if _edges not in mesh.kept:
        ends = np.sort(mesh.faces.astype(np.int64)[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        codes = np.unique(ends[:, 0] * len(mesh.points) + ends[:, 1])
        a, b = codes // max(len(mesh.points), 1), codes % max(len(mesh.points), 1)
        size = np.linalg.norm(mesh.points[b] - mesh.points[a], axis=1)
        real = size > 1e-6 * mesh.bounding_box_diagonal
        mesh.kept[_edges] = a[real], b[real], size[real]
    kept: tuple[IntArray, IntArray, FloatArray] = mesh.kept[_edges]
    return kept


def joint_changes(rest_local: FloatArray, local: FloatArray) -> FloatArray:
    """(j,) angle of each joint's rotation away from rest, radians, 0..pi, whatever its chart.

    By the chord between unit axes, which stays exact for small angles where the trace does not.
    """
    frames = [m[:, :3, :3] / np.linalg.norm(m[:, :3, :3], axis=1, keepdims=True) for m in (rest_local, local)]
    chord = np.linalg.norm(frames[1] - frames[0], axis=(1, 2)) / (2.0 * np.sqrt(2.0))  # sin(angle / 2)
    return np.asarray(2.0 * np.arcsin(np.clip(chord, 0.0, 1.0)))
