"""What people do with poses: look at the skin, set angles, blend, mirror."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.transform import transform_points
from contact_core.rig.chart import Chart, pose_on
from contact_core.rig.rig import Pose, Rig, forward_kinematics, skin
from contact_core.rig.rotations import exponential, nearest_rotations


def posed_world(rig: Rig, pose: Pose) -> FloatArray:
    """(j, 4, 4) world_from_joint in rig space of a pose; joints that it does not name stay at rest."""
    return forward_kinematics(rig.parents, pose_on(rig, pose))


def posed_points(rig: Rig, pose: Pose) -> FloatArray:
    """(n, 3) the skin in a pose, rig space; joints that the pose does not name stay at rest."""
    return skin(rig, posed_world(rig, pose))


def curled(rig: Rig, degrees: Mapping[str, Sequence[float]]) -> Pose:
    """The rest pose with some joints turned, within their limits.

    degrees: by name or pattern ("index*") of joints: one angle curls (the last rotation dof), several are all
    rotation dofs in order (twist, spread, flexion). Raises InvalidInput for joints or angles that do not exist.
    """
    chart = Chart(rig)
    theta = np.zeros(chart.size)
    for pattern, angles in degrees.items():
        joints = [j for j, name in enumerate(rig.joints) if fnmatchcase(name, pattern)]
        if not joints:
            raise InvalidInput(f"no joint of {rig.name} matches {pattern!r}.")
        for joint in joints:
            dofs = np.arange(chart.size)[chart.rotation_slices[joint]]
            chosen = dofs[-1:] if len(angles) == 1 else dofs
            if len(chosen) != len(angles):
                raise InvalidInput(
                    f"joint {rig.joints[joint]!r} has {len(dofs)} angles, but got {len(angles)} of them."
                )
            theta[chosen] = np.clip(np.radians(angles), chart.lower[chosen], chart.upper[chosen])
    return Pose(rig.joints, chart.local(theta))


def moved_roots(rig: Rig, pose: Pose, move: FloatArray) -> Pose:
    """The pose of all joints with its roots moved, by (4, 4) in rig space."""
    local = pose_on(rig, pose).copy()
    roots = rig.parents < 0
    local[roots] = move @ local[roots]
    return Pose(rig.joints, local)


def backed_off(
    rig: Rig, objects: Sequence[tuple[FloatArray, TriangleMesh]], direction: FloatArray, clear: float
) -> tuple[Pose, float]:
    """The open hand (rest pose), backed off along `direction` (rig space) until `clear` of all objects; and how
    clear it is (surface units).

    objects: each with object_from_rig (4, 4). Closest distances are 1-Lipschitz, so each step of what is missing is
    safe.
    """
    back = direction / np.linalg.norm(direction)
    locators = [(into, Locator.of(mesh)) for into, mesh in objects]
    travelled, nearest = 0.0, 0.0
    for _ in range(200):
        points = rig.surface.points + travelled * back
        nearest = min(
            (float(locator.closest(transform_points(into, points)).distance.min()) for into, locator in locators),
            default=clear,
        )
        if nearest >= clear * (1.0 - 1e-6):
            break
        travelled += max(clear - nearest, 1e-3 * clear)
    local = rig.rest_local.copy()
    local[rig.parents < 0, :3, 3] += travelled * back
    return Pose(rig.joints, local), nearest


def set_angles(rig: Rig, pose: Pose, angles: Mapping[str, float]) -> Pose:
    """The pose with some dofs set by name (as in `Chart.dof_names`): offsets from rest, radians or units.

    Raises InvalidInput for an unknown name, a number that is not finite, and a value beyond its limit.
    """
    chart = Chart(rig)
    theta, leftover = chart.theta_of(pose)
    for name, value in angles.items():
        if name not in chart.dof_names:
            near = [known for known in chart.dof_names if known.split(".")[0] == name.split(".")[0]]
            raise InvalidInput(
                f"{rig.name} has no dof {name!r}; near are {', '.join(near or chart.dof_names[:5])}."
            )
        dof = chart.dof_names.index(name)
        if dof in chart.followers:
            leader = chart.dof_names[int(chart.leaders[chart.followers == dof][0])]
            raise InvalidInput(f"{name} of {rig.name} turns with {leader}; set that one.")
        if not (math.isfinite(value) and chart.lower[dof] <= value <= chart.upper[dof]):
            raise InvalidInput(
                f"{name} of {rig.name} is limited to {chart.lower[dof]:.4g} .. {chart.upper[dof]:.4g}, but got"
                f" {value:.4g}."
            )
        theta[dof] = value
    return Pose(rig.joints, chart.local(theta, leftover))


def blend(rig: Rig, first: Pose, second: Pose, share: float) -> Pose:
    """The pose between two: rotations along the shortest arc, all else linearly. share: 0 is first, 1 second."""
    if not math.isfinite(share):
        raise InvalidInput(f"a blend needs a finite share, but got {share}.")
    one, two = pose_on(rig, first), pose_on(rig, second)
    turn_one, rest_one = _split(one)
    turn_two, rest_two = _split(two)
    between = (1.0 - share) * rest_one + share * rest_two
    vectors = _rotation_vectors(turn_one.transpose(0, 2, 1) @ turn_two)
    turn = turn_one @ exponential(share * vectors)[0]
    local = between.copy()
    local[:, :3, :3] = turn @ between[:, :3, :3]
    return Pose(rig.joints, local)


def mirrored_pose(rig: Rig, pose: Pose, *, onto: Rig | None = None, axis: int = 0) -> Pose:
    """The pose seen in the mirror plane through the origin across `axis` of rig space, left and right by names.

    What a joint turns away from its rest direction, its partner turns in the mirror, so the frames of the joints
    need not mirror one another. onto: another rig that takes the pose (a left hand's pose for a right hand).
    A joint whose partner does not exist keeps its own name; raises InvalidInput when none of the joints is found.
    """
    target = onto or rig
    source_of = {mirrored_name(name): name for name in rig.joints} | {
        name: name for name in rig.joints if mirrored_name(name) not in target.joints
    }
    if not any(name in source_of for name in target.joints):
        raise InvalidInput(f"none of the joints of {target.name} mirrors one of {rig.name}; are they partners?")
    flip = np.diag([-1.0 if k == axis else 1.0 for k in range(3)])
    local = pose_on(rig, pose)
    world, rest = forward_kinematics(rig.parents, local), rig.rest_world
    answer = np.empty((len(target.joints), 4, 4))  # world_from_joint
    answer_local = target.rest_local.copy()
    for j, name in enumerate(target.joints):
        parent = int(target.parents[j])
        above = answer[parent] if parent >= 0 else np.eye(4)
        rest_above = target.rest_world[parent] if parent >= 0 else np.eye(4)
        if name in source_of:
            s = rig.joint_index(source_of[name])
            turned = _turn(world[s]) @ _turn(rest[s]).T
            answer_turn = flip @ turned @ flip @ _turn(target.rest_world[j])
            local_turn = _turn(above).T @ answer_turn
            stretch = _turn(target.rest_local[j]).T @ target.rest_local[j, :3, :3]
            answer_local[j, :3, :3] = local_turn @ stretch
            source_parent = int(rig.parents[s])
            source_rest_above = rest[source_parent] if source_parent >= 0 else np.eye(4)
            moved = _turn(source_rest_above) @ (local[s, :3, 3] - rig.rest_local[s, :3, 3])
            answer_local[j, :3, 3] = target.rest_local[j, :3, 3] + _turn(rest_above).T @ flip @ moved
        answer[j] = above @ answer_local[j]
    return Pose(target.joints, answer_local)


_WORDS = (("left", "right"), ("Left", "Right"), ("LEFT", "RIGHT"))
_LETTERS = (("l", "r"), ("L", "R"))  # set apart by anything but letters and digits


def mirrored_name(name: str) -> str:
    """The partner's name: "hand_l" of "hand_r", "LeftArm" of "RightArm"; the same name where no side is told."""
    for pair in _WORDS:
        for side, other in (pair, pair[::-1]):
            if side in name:
                return name.replace(side, other)
    for pair in _LETTERS:
        for side, other in (pair, pair[::-1]):
            found = re.sub(rf"(?<![A-Za-z0-9]){side}(?![A-Za-z0-9])", other, name)
            if found != name:
                return found
    return name


def _turn(transform: FloatArray) -> FloatArray:
    """(3, 3) the rotation part of (4, 4)."""
    return nearest_rotations(transform[None, :3, :3])[0]


def _split(local: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rotations (j, 3, 3), and the transforms (j, 4, 4) with them taken out of the linear part."""
    turn = nearest_rotations(local[:, :3, :3])
    rest = local.copy()
    rest[:, :3, :3] = turn.transpose(0, 2, 1) @ local[:, :3, :3]
    return turn, rest


def _rotation_vectors(rotations: FloatArray) -> FloatArray:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(rotations).as_rotvec())
