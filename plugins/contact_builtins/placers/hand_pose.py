"""A manipulator being posed by hand: angles of its dofs, a shift of the whole, and how clear its skin is."""

from __future__ import annotations

from fnmatch import fnmatchcase
from functools import lru_cache

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.geometry.distance_field import DistanceField
from contact_core.geometry.mesh import TriangleMesh
from contact_core.hands.describe import describe_hands
from contact_core.plugins.slots import PlacementRequest
from contact_core.rig.chart import Chart
from contact_core.rig.rig import ROTATION_DOFS, Pose, Rig, forward_kinematics
from contact_core.solve.body import manipulator_length

WRIST = 0.12  # hand lengths: skin that lies this far behind where the digits part is no palm


class HandPose:
    """The mutable workpiece of a placer; positions are in the object's surface space.

    theta: (d,) offsets from rest in the rig's chart. shift: (3,) move of the whole in rig space.
    clearance: signed distance of skin to the object, negative inside.
    """

    def __init__(self, request: PlacementRequest, resolution: int = 80) -> None:
        self.rig = request.rig
        self.object_from_rig = request.object_from_rig
        self.chart = Chart(request.rig)
        self.theta, self._leftover = self.chart.theta_of(request.pose)
        self.shift: FloatArray = np.zeros(3)
        bounds = [request.object_mesh, *(solid for solid in request.solids if solid is not request.object_mesh)]
        self.fields = tuple(DistanceField.of(mesh, resolution=resolution) for mesh in bounds)
        self.owner = dominant_joint(request.rig)  # (n,)
        rig = self.rig
        homogeneous = np.concatenate([rig.bind_points, np.ones((len(rig.bind_points), 1))], axis=1)  # (n, 4)
        from_bind = np.linalg.inv(rig.bind_world)[rig.skin_joints]  # (n, K, 4, 4)
        self._bound = np.einsum("nkij,nj,nk->nki", from_bind, homogeneous, rig.skin_weights)  # (n, K, 4)

    def local(self) -> FloatArray:
        """(j, 4, 4) parent_from_joint, the shift in it."""
        local = self.chart.local(self.theta, self._leftover).copy()
        local[self.rig.parents < 0, :3, 3] += self.shift
        return local

    def pose(self) -> Pose:
        return Pose(self.rig.joints, self.local())

    def points(self, vertices: IntArray | None = None) -> FloatArray:
        """(k, 3) skin vertices (all by default) in the object's space."""
        chosen = slice(None) if vertices is None else vertices
        moves = self.object_from_rig @ forward_kinematics(self.rig.parents, self.local())  # (j, 4, 4)
        return np.einsum("nkij,nkj->ni", moves[self.rig.skin_joints[chosen], :3, :], self._bound[chosen])

    def clearance(self, vertices: IntArray | None = None) -> FloatArray:
        """(k,) signed distances of skin vertices to the object."""
        return self.distance(self.points(vertices))

    def distance(self, points: FloatArray) -> FloatArray:
        """(k,) signed distances of points (k, 3) to the nearest of the object and its solids."""
        return np.asarray(np.min([field.distances(points) for field in self.fields], axis=0))

    def skin(self) -> TriangleMesh:
        """The posed skin in the object's space."""
        return TriangleMesh(self.points(), self.rig.faces)

    def vertices_of(self, joints: IntArray) -> IntArray:
        """Skin vertices that any of the joints holds strongest."""
        return np.flatnonzero(np.isin(self.owner, joints))


def dominant_joint(rig: Rig) -> IntArray:
    """(n,) the joint that holds each skin vertex strongest."""
    strongest = rig.skin_weights.argmax(axis=1)
    return np.asarray(rig.skin_joints[np.arange(len(strongest)), strongest])


@lru_cache(maxsize=8)
def palm_and_digits(rig: Rig) -> BoolArray:
    """(n,) which skin takes hold: that of digits and palm of every hand of a rig, without the wrist behind it and
    all else of a body; all of it where a rig has no hand."""
    held, owner = np.zeros(len(rig.bind_points), bool), dominant_joint(rig)
    for hand in describe_hands(rig):
        under = np.zeros(len(rig.joints), bool)
        under[hand.hub] = True
        for joint, parent in enumerate(rig.parents):
            under[joint] |= parent >= 0 and under[parent]
        ahead = (rig.surface.points - rig.rest_world[hand.hub, :3, 3]) @ hand.palm.fingers
        behind = WRIST * manipulator_length(rig, np.flatnonzero(under)) if hand.palm.is_plane else np.inf
        held |= under[owner] & (ahead > -behind)
    return held if held.any() else ~held


def matching(rig: Rig, patterns: tuple[str, ...], what: str) -> IntArray:
    """Joints whose names match any of the patterns (`thumb*`), in joint order. Raises InvalidInput for none."""
    found: BoolArray = np.zeros(len(rig.joints), bool)
    for pattern in patterns:
        hits = np.array([fnmatchcase(name, pattern) for name in rig.joints])
        if not hits.any():
            names = ", ".join(rig.joints[:8])
            raise InvalidInput(f"{what}: no joint of {rig.name} matches {pattern!r}; its joints are {names}, ...")
        found |= hits
    return np.flatnonzero(found)


def flexion_dof(chart: Chart, joint: int) -> int | None:
    """The dof that curls a joint: a hinge's only one, else the turn about the third axis of its frame.

    None for a joint that cannot curl: fixed, locked, or without room between its limits.
    """
    where = chart.rotation_slices[joint]
    if ROTATION_DOFS[chart.rig.freedoms[joint].kind] == 0:
        return None
    dof = where.stop - 1
    roomy = chart.upper[dof] - chart.lower[dof] > np.radians(5.0)
    return None if chart.locked[dof] or not roomy else dof
