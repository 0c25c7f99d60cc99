"""The chart of a pose: joint transforms as a vector of angles and translations, and how they move.

A pose is local joint transforms; a solver needs numbers. `Chart` turns one into the other for one rig:
theta (d,) holds every dof of every joint in joint order, rotations before translations, as offsets from
rest. What a freedom cannot express (a hinge bent sideways by hand, a scaled joint) is kept as a constant
`leftover` behind the joint's own motion, so a pose goes into the chart and comes back unchanged.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.rig.rig import ROTATION_DOFS, Pose, Rig
from contact_core.rig.rotations import axis_numbers, nearest_rotations

_AXIS_LETTERS = "xyz"


@dataclass(frozen=True, eq=False)
class Motion:
    """Where the joints of a rig are at one theta, and how each dof moves them.

    world: (j, 4, 4) world_from_joint. generators: (d, 3, 4) velocity fields: when dof q grows, every point p
    that moves with its joint (or with a joint below it) moves by generators[q] @ (p, 1).
    """

    world: FloatArray
    generators: FloatArray


class Chart:
    """theta <-> local transforms of one rig. Immutable after construction.

    joint_of_dof: (d,) which joint. is_translation: (d,). lower, upper: (d,) limits, offsets from rest.
    dof_names: "index_1.x" (hinge, ball, Euler turns), "wrist.tx" (translations).
    leaders, followers, ratios: (f,) dofs of which the second turn by so many times as much as the first. A
    follower is locked, for no solve chooses it; what it may bend limits its leader.
    """

    def __init__(self, rig: Rig, world_from_rig: FloatArray | None = None) -> None:
        self.rig = rig
        self.world_from_rig = np.eye(4) if world_from_rig is None else np.asarray(world_from_rig, float)
        rotations = np.array([ROTATION_DOFS[f.kind] for f in rig.freedoms], np.int64)
        translations = np.array([3 * f.translates for f in rig.freedoms], np.int64)
        starts = np.concatenate([[0], np.cumsum(rotations + translations)])
        self.rotation_slices = [slice(int(s), int(s + r)) for s, r in zip(starts[:-1], rotations, strict=True)]
        self.translation_slices = [
            slice(int(s + r), int(s + r + t)) for s, r, t in zip(starts[:-1], rotations, translations, strict=True)
        ]
        self.size = int(starts[-1])
        self.joint_of_dof: IntArray = np.repeat(np.arange(len(rig.joints)), rotations + translations)
        self._lay_out_dofs()
        self.frames = np.array([f.frame for f in rig.freedoms]).reshape(-1, 3, 3)
        depths = _depths(rig.parents)
        self._order: IntArray = np.argsort(depths, kind="stable")
        self._lay_out_turns()
        self.is_rigid = _is_rigid(rig.rest_local) and _is_rigid(self.world_from_rig[None])

    def _lay_out_dofs(self) -> None:
        names: list[str] = []
        lower: list[float] = []
        upper: list[float] = []
        prior_weight: list[float] = []
        locked: list[bool] = []
        rotvec_rows: list[tuple[int, int, int]] = []  # dof, joint, component: hinges and balls
        euler_joints: list[int] = []
        for j, (joint, freedom) in enumerate(zip(self.rig.joints, self.rig.freedoms, strict=True)):
            count = ROTATION_DOFS[freedom.kind]
            letters = freedom.order.lower() if freedom.kind == "euler" else _AXIS_LETTERS
            if freedom.kind in ("hinge", "ball"):
                rotvec_rows += [(len(names) + i, j, i) for i in range(count)]
            elif freedom.kind == "euler":
                euler_joints.append(j)
            names += [f"{joint}.{letters[i]}" for i in range(count)]
            lower += list(freedom.lower if freedom.lower is not None else [])
            upper += list(freedom.upper if freedom.upper is not None else [])
            prior_weight += list(freedom.prior_weight if freedom.prior_weight is not None else [])
            locked += list(freedom.locked if freedom.locked is not None else [])
            if freedom.translates:
                names += [f"{joint}.t{letter}" for letter in _AXIS_LETTERS]
                lower += 3 * [-np.inf]
                upper += 3 * [np.inf]
                prior_weight += 3 * [0.0]
                locked += list(freedom.locked_translation if freedom.locked_translation is not None else [])
        self.dof_names = tuple(names)
        self.lower, self.upper = np.array(lower, float), np.array(upper, float)
        self.prior_weight: FloatArray = np.array(prior_weight, float)
        self.locked: BoolArray = np.array(locked, bool)
        self._couple()
        self.is_translation: BoolArray = np.zeros(self.size, bool)
        for moved in self.translation_slices:
            self.is_translation[moved] = True
        rows = np.array(rotvec_rows, np.int64).reshape(-1, 3)
        self._rotvec_dof, self._rotvec_joint, self._rotvec_component = rows.T
        self._rotvec_joints = np.unique(self._rotvec_joint)
        self._hinges = [j for j, freedom in enumerate(self.rig.freedoms) if freedom.kind == "hinge"]
        self._euler_by_order = {
            order: (
                np.array([j for j in euler_joints if self.rig.freedoms[j].order == order]),
                np.array([np.arange(3) + self.rotation_slices[j].start for j in euler_joints
                          if self.rig.freedoms[j].order == order]),
            )
            for order in sorted({self.rig.freedoms[j].order for j in euler_joints})
        }  # fmt: skip
        movers = [(s.start, j) for j, s in enumerate(self.translation_slices) if s.stop > s.start]
        self._moving_joints = np.array([j for _, j in movers], np.int64)
        self._moving_dofs = np.array([[s, s + 1, s + 2] for s, _ in movers], np.int64).reshape(-1, 3)

    def _lay_out_turns(self) -> None:
        """What kernels take of each joint (see chart_kernels)."""
        kinds = {"hinge": 1, "ball": 1, "euler": 2}  # its VECTOR and EULER, without importing numba here
        freedoms = self.rig.freedoms
        euler = [axis_numbers(f.order) if f.kind == "euler" else (0, 0, 0) for f in freedoms]
        self._turning = (
            np.array([kinds.get(freedom.kind, 0) for freedom in freedoms], np.int64),
            np.array([s.stop - s.start for s in self.rotation_slices], np.int64),
            np.array([s.start for s in self.rotation_slices], np.int64),
            np.array([s.start if s.stop > s.start else -1 for s in self.translation_slices], np.int64),
            np.array(euler, np.int64).reshape(-1, 3),
            self.frames,
        )
        # Copies that may be written: kernels are compiled again for arrays that may not.
        self._standing = tuple(
            np.array(each) for each in (self.rig.parents, self.world_from_rig, self.rig.rest_local)
        )

    def _couple(self) -> None:
        """Followers are no dofs of their own, and limits are kept on both ends."""
        place = {name: slice_.start for name, slice_ in zip(self.rig.joints, self.rotation_slices, strict=True)}
        pairs = [
            (place[freedom.follows], place[joint], freedom.ratio)
            for joint, freedom in zip(self.rig.joints, self.rig.freedoms, strict=True)
            if freedom.follows is not None
        ]
        self.leaders: IntArray = np.array([leader for leader, _, _ in pairs], np.int64)
        self.followers: IntArray = np.array([follower for _, follower, _ in pairs], np.int64)
        self.ratios: FloatArray = np.array([ratio for _, _, ratio in pairs], float)
        self.locked[self.followers] = True
        for leader, follower, ratio in pairs:
            if ratio != 0.0:
                ends = sorted((float(self.lower[follower]) / ratio, float(self.upper[follower]) / ratio))
                self.lower[leader] = max(self.lower[leader], min(ends[0], 0.0))
                self.upper[leader] = min(self.upper[leader], max(ends[1], 0.0))

    def coupled(self, theta: FloatArray) -> FloatArray:
        """theta (d,) with every follower where its leader puts it."""
        result = np.array(theta, dtype=np.float64)
        result[self.followers] = self.ratios * result[self.leaders]
        return result

    @cached_property
    def is_root(self) -> BoolArray:
        """(d,) the dofs that place the whole manipulator: those of root joints and of joints that translate."""
        roots = (self.rig.parents < 0) | np.array([f.translates for f in self.rig.freedoms], bool)
        return roots[self.joint_of_dof]

    @cached_property
    def moves(self) -> BoolArray:
        """(d, j) whether a dof moves a joint: its own joint and all below it, for a leader its followers' too."""
        moves = self.moves_alone.copy()
        for leader, follower in zip(self.leaders, self.followers, strict=True):
            moves[leader] |= moves[follower]
        return moves

    @cached_property
    def moves_alone(self) -> BoolArray:
        """(d, j) the same for each dof by itself, without what follows it."""
        below = np.eye(len(self.rig.joints), dtype=bool)  # below[a, b]: b is a or below a
        for joint, parent in enumerate(self.rig.parents):
            if parent >= 0:
                below[:, joint] |= below[:, parent]
        return below[self.joint_of_dof]

    def turns(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Motions (j, 4, 4) of the joints within their rest frames, turning axes (d, 3).

        Axes are in the joint's rest frame: how the joint turns, in that frame, when a dof grows.
        """
        from contact_core.rig import chart_kernels

        motion, axes = np.empty((len(self.rig.joints), 4, 4)), np.zeros((self.size, 3))
        scratch = np.empty((2, 3, 3))
        chart_kernels.turns(self.coupled(theta), *self._turning, scratch[0], scratch[1], motion, axes)
        return motion, axes

    def local(self, theta: FloatArray, leftover: FloatArray | None = None) -> FloatArray:
        """(j, 4, 4) parent_from_joint at theta (d,); followers go where their leaders put them."""
        local = self.rig.rest_local @ self.turns(theta)[0]
        return local if leftover is None else local @ leftover

    def motion(self, theta: FloatArray, leftover: FloatArray | None = None) -> Motion:
        """World transforms and generators at theta (d,); the generator of a leader does not move its followers."""
        from contact_core.rig import chart_kernels

        motion, axes = self.turns(theta)
        world, generators, scratch = np.empty_like(motion), np.zeros((self.size, 3, 4)), np.empty((2, 4, 4))
        _, count, first, moving, _, _ = self._turning
        parents, world_from_rig, rest = self._standing
        left = np.empty((0, 4, 4)) if leftover is None else leftover
        chart_kernels.move(
            count, first, moving, self._order, parents, world_from_rig, rest, motion, left, axes,
            self.is_rigid and leftover is None, scratch[0], scratch[1], world, generators,
        )  # fmt: skip
        return Motion(world, generators)

    def theta_of(self, pose: Pose) -> tuple[FloatArray, FloatArray | None]:
        """theta (d,) of a pose, and the leftover (j, 4, 4) that the freedoms cannot express (None: nothing).

        Raises InvalidInput when the pose is of another rig.
        """
        local = pose_on(self.rig, pose)
        relative = np.linalg.inv(self.rig.rest_local) @ local
        theta = np.zeros(self.size)
        theta[self._moving_dofs] = relative[self._moving_joints, :3, 3]
        turned = self.frames.transpose(0, 2, 1) @ nearest_rotations(relative[:, :3, :3]) @ self.frames
        vectors = np.zeros((len(self.frames), 3))
        vectors[self._rotvec_joints] = _rotation_vectors(turned[self._rotvec_joints])
        for j in self._hinges:  # the turn about x that comes nearest
            r = turned[j]
            vectors[j, 0] = np.arctan2(r[2, 1] - r[1, 2], r[1, 1] + r[2, 2])
        theta[self._rotvec_dof] = vectors[self._rotvec_joint, self._rotvec_component]
        for order, (joints, dofs) in self._euler_by_order.items():
            theta[dofs] = _euler_angles(turned[joints], order)
        theta = self.coupled(theta)  # what a pose bends a follower otherwise is left over
        leftover = np.linalg.inv(self.turns(theta)[0]) @ relative
        scale = max(1.0, float(np.abs(self.rig.rest_local[:, :3, 3]).max(initial=0.0)))
        plain = np.abs(leftover - np.eye(4)).max(initial=0.0) < 1e-9 * scale
        return theta, None if plain else leftover


def pose_on(rig: Rig, pose: Pose) -> FloatArray:
    """(j, 4, 4) parent_from_joint of a pose in the rig's joint order; joints it does not name stay at rest."""
    if pose.joints == rig.joints:
        return pose.local
    unknown = sorted(set(pose.joints) - set(rig.joints))
    if unknown:
        raise InvalidInput(
            f"a pose for {rig.name} may name its {len(rig.joints)} joints, but names"
            f" {', '.join(map(repr, unknown[:3]))}; is it a pose of another rig?"
        )
    local = rig.rest_local.copy()
    local[[rig.joint_index(name) for name in pose.joints]] = pose.local
    return local


def _depths(parents: IntArray) -> IntArray:
    """(j,) of joints in their tree, 0 for roots."""
    depth = np.zeros(len(parents), np.int64)
    for joint, parent in enumerate(parents):
        depth[joint] = 0 if parent < 0 else depth[parent] + 1
    return depth


def _is_rigid(transforms: FloatArray) -> bool:
    linear = transforms[:, :3, :3]
    orthogonal = np.abs(linear.transpose(0, 2, 1) @ linear - np.eye(3)).max(initial=0.0) < 1e-9
    return bool(orthogonal and (np.linalg.det(linear) > 0).all())


def _rotation_vectors(rotations: FloatArray) -> FloatArray:
    """(k, 3) of rotations (k, 3, 3)."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(rotations).as_rotvec()) if len(rotations) else np.zeros((0, 3))


def _euler_angles(rotations: FloatArray, order: str) -> FloatArray:
    """(k, 3) intrinsic Euler angles of rotations (k, 3, 3); in gimbal lock any split of two turns is right."""
    from scipy.spatial.transform import Rotation

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return np.asarray(Rotation.from_matrix(rotations).as_euler(order))
