"""Points on skin as linear maps of the bones, which is what linear-blend skinning is.

A point at fixed barycentric coordinates of a skinned face is a weighted sum of bone matrices times constant
vectors: p_i = sum_b W_b h_ib, with W_b the world_from_joint of bone b and h_ib homogeneous in that joint.
So a set of k points is one constant matrix H (k, 4b), and

    points = H @ bones,   dp/dtheta = H @ dbones,   sum_i w_i |dp_i|^2 = dbones^T (H^T W H) dbones,

exact for the interpolated skin, with no loop over points anywhere. Points on a rigid or fixed body are the
same with one bone. The difference of two tracks is a track: a pair of contacts with gradients at both ends.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import Rig


@dataclass(frozen=True, eq=False)
class Gram:
    """What a weighted sum of squares needs of a track: sum_i w_i h_i h_i^T (width b, width b), and, where rows are
    watched, the weights w (k,) themselves."""

    matrix: FloatArray
    weights: FloatArray


@dataclass(frozen=True, eq=False)
class Track:
    """k vectors that the bones carry: points (`width` 4) or normals (`width` 3), not normalised.

    bones: (b,) which bones of the problem (columns over all its bodies). matrix: (k, width * b).
    watched: (k, m) sparse, what is added of the points or normals that black boxes evaluate; None: nothing.
    """

    bones: IntArray
    matrix: FloatArray
    width: int
    watched: Any = None

    def __len__(self) -> int:
        return len(self.matrix)

    @cached_property
    def columns(self) -> IntArray:
        """(width b,) the columns of the stacked bones that the matrix multiplies."""
        return (self.bones[:, None] * self.width + np.arange(self.width)).ravel()

    @property
    def blocks(self) -> FloatArray:
        """(k, b, width) the matrix by bones."""
        return self.matrix.reshape(len(self), len(self.bones), self.width)

    def combined(self, other: Track, factor: float = 1.0) -> Track:
        """The track of self + factor * other, row by row."""
        if len(self) != len(other) or self.width != other.width:
            raise InvalidInput(
                f"tracks add row by row, but one has {len(self)} rows of {self.width} and the other"
                f" {len(other)} of {other.width}."
            )
        bones = np.union1d(self.bones, other.bones)
        blocks = np.zeros((len(self), len(bones), self.width))
        blocks[:, np.searchsorted(bones, self.bones)] += self.blocks
        blocks[:, np.searchsorted(bones, other.bones)] += factor * other.blocks
        parts = [part for part in (self.watched, _times(factor, other.watched)) if part is not None]
        watched = None if not parts else parts[0] if len(parts) == 1 else parts[0] + parts[1]
        return Track(bones, blocks.reshape(len(self), len(bones) * self.width), self.width, watched)

    def rows(self, index: IntArray) -> Track:
        """The track of some of the rows, in the order of `index`."""
        watched = None if self.watched is None else self.watched[index]
        return Track(self.bones, self.matrix[index], self.width, watched)

    def scaled(self, factors: FloatArray) -> Track:
        """The track with each row times its factor (k,)."""
        watched = None if self.watched is None else self.watched.multiply(factors[:, None]).tocsr()
        return Track(self.bones, self.matrix * factors[:, None], self.width, watched)

    def gram(self, weights: FloatArray) -> Gram:
        """Of weights (k,): all that a weighted sum of squares needs of k rows."""
        return Gram(self.matrix.T @ (weights[:, None] * self.matrix), weights)

    @classmethod
    def empty(cls, width: int) -> Track:
        """The track of nothing."""
        return cls(np.zeros(0, np.int64), np.zeros((0, 0)), width)

    @classmethod
    def stacked(cls, tracks: list[Track]) -> Track:
        """Several tracks below one another."""
        bones = np.unique(np.concatenate([t.bones for t in tracks]))
        width = tracks[0].width
        blocks = np.zeros((sum(map(len, tracks)), len(bones), width))
        row = 0
        for track in tracks:
            blocks[row : row + len(track), np.searchsorted(bones, track.bones)] = track.blocks
            row += len(track)
        return cls(bones, blocks.reshape(row, len(bones) * width), width, _stacked_watched(tracks))


def watched_track(first: int, count: int, total: int, width: int) -> Track:
    """The track of `count` points or normals that a black box evaluates, the `first`.. of all `total`."""
    from scipy.sparse import csr_matrix

    shares = csr_matrix((np.ones(count), (np.arange(count), np.arange(first, first + count))), shape=(count, total))
    return Track(np.zeros(0, np.int64), np.zeros((count, 0)), width, shares)


def _times(factor: float, watched: Any) -> Any:
    return None if watched is None else factor * watched


def _stacked_watched(tracks: list[Track]) -> Any:
    total = next((track.watched.shape[1] for track in tracks if track.watched is not None), None)
    if total is None:
        return None
    from scipy.sparse import csr_matrix, vstack

    parts = [csr_matrix((len(t), total)) if t.watched is None else t.watched for t in tracks]
    return vstack(parts, format="csr")


def point_track(rig: Rig, points: SurfacePoints, first_bone: int = 0) -> Track:
    """The track of points on the skin of a rig; `first_bone` is the column of its first joint."""
    check_points(rig, points)
    corners = rig.bind_points[rig.faces[points.faces].ravel()]
    homogeneous = np.concatenate([corners, np.ones((len(corners), 1))], axis=1)  # (3k, 4)
    return _blend(rig, points, homogeneous, joint_from_bind(rig), first_bone)


def normal_track(rig: Rig, points: SurfacePoints, first_bone: int = 0) -> Track:
    """The track of the rigidly skinned normals at points on the skin.

    Each bone carries the interpolated vertex normal of the bound skin; within 7-17 degrees of the normal of
    the deformed mesh where the skin bends, equal to it elsewhere.
    """
    check_points(rig, points)
    normals = rig.bound_surface.normals_at(rig.faces[points.faces].ravel())  # (3k, 3)
    return _blend(rig, points, normals, outward_carrier(joint_from_bind(rig)), first_bone)


def vertex_track(rig: Rig, vertices: IntArray, first_bone: int = 0) -> Track:
    """The track of skin vertices (k,), exact also for vertices that no face uses."""
    homogeneous = np.concatenate([rig.bind_points[vertices], np.ones((len(vertices), 1))], axis=1)
    rows = np.repeat(np.arange(len(vertices)), rig.skin_joints.shape[1])
    weights = rig.skin_weights[vertices].ravel()
    joints = rig.skin_joints[vertices].ravel()
    return _gather(rows, joints, weights, homogeneous[rows], joint_from_bind(rig), len(vertices), first_bone)


def joint_track(joints: IntArray, local_points: FloatArray, first_bone: int = 0) -> Track:
    """The track of points (k, 3) fixed in the frames of joints (k,)."""
    bones = np.unique(joints)
    blocks = np.zeros((len(joints), len(bones), 4))
    columns = np.searchsorted(bones, joints)
    blocks[np.arange(len(joints)), columns, :3] = local_points
    blocks[np.arange(len(joints)), columns, 3] = 1.0
    return Track(bones + first_bone, blocks.reshape(len(joints), 4 * len(bones)), 4)


def joint_from_bind(rig: Rig) -> FloatArray:
    """(j, 4, 4) takes the bound skin into each joint's frame."""
    return np.asarray(np.linalg.inv(rig.bind_world), np.float64)


def outward_carrier(transforms: FloatArray) -> FloatArray:
    """(j, 3, 3) what carries outward normals under transforms (j, 4, 4): |det| times the inverse transpose.

    Equal to the rotation for rigid transforms; right under shear, and under mirroring by the geometry
    (the outside stays outside, although the winding flips).
    """
    x, y, z = (transforms[:, :3, i] for i in range(3))
    cofactor = np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)], axis=-1)  # (j, 3, 3)
    sign = np.sign(np.einsum("ja,ja->j", x, cofactor[:, :, 0]))
    return cofactor * sign[:, None, None]


def check_points(rig: Rig, points: SurfacePoints) -> None:
    """Raises InvalidInput for points on faces that the rig's skin does not have."""
    if len(points) and (points.faces.min() < 0 or points.faces.max() >= len(rig.faces)):
        raise InvalidInput(
            f"contacts on {rig.name} must lie on its {len(rig.faces)} faces, but got face"
            f" {int(points.faces.max())}; were they painted on another surface?"
        )


def _blend(rig: Rig, points: SurfacePoints, values: FloatArray, inverse_bind: FloatArray, first_bone: int) -> Track:
    """Rows sum_c barycentric_c sum_k weight_ck (inverse_bind_k @ value_c) of values (3k, width) at face corners."""
    influences = rig.skin_joints.shape[1]
    corners = rig.faces[points.faces].ravel()  # (3k,)
    weights = points.barycentric.ravel()[:, None] * rig.skin_weights[corners]  # (3k, K)
    rows = np.repeat(np.arange(len(points)), 3 * influences)
    spread = np.repeat(values, influences, axis=0)  # (3kK, width)
    joints = rig.skin_joints[corners].ravel()
    return _gather(rows, joints, weights.ravel(), spread, inverse_bind, len(points), first_bone)


def _gather(
    rows: IntArray,
    joints: IntArray,
    weights: FloatArray,
    values: FloatArray,
    inverse_bind: FloatArray,
    count: int,
    first_bone: int,
) -> Track:
    used = weights > 0.0
    rows, joints, weights, values = rows[used], joints[used], weights[used], values[used]
    bones = np.unique(joints)
    width = values.shape[1]
    carried = np.einsum("eab,eb->ea", inverse_bind[joints], values) * weights[:, None]  # (e, width)
    blocks = np.zeros((count, len(bones), width))
    np.add.at(blocks, (rows, np.searchsorted(bones, joints)), carried)
    return Track(bones + first_bone, blocks.reshape(count, len(bones) * width), width)
