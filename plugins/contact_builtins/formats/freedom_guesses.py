"""Degrees of freedom for rigs that say nothing about them: anatomical for digits, open for the rest.

A digit's angles are measured in a frame with x along the bone, y to the palm side and z = x cross y, the
flexion axis. The joint's own axes are taken where one lies near the bone and one near the knuckle line;
guessing from the curl of the rest pose was 8 to 76 degrees off on a real hand, the knuckle line 0 to 11.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contact_builtins.formats.joint_names import Side, digit_chains, digit_joint
from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.rig.rig import JointFreedom

# Degrees: twist, spread, flexion from, flexion to.
FINGER_LIMITS = {"proximal": (8, 20, -15, 95), "intermediate": (4, 2, -5, 105), "distal": (4, 2, -8, 80)}
THUMB_LIMITS = {"metacarpal": (35, 45, -30, 50), "proximal": (8, 8, -10, 70), "distal": (5, 2, -15, 85)}
OPEN_PRIOR = (3.0, 1.0, 1.0)  # twist about the bone is dearer than swing
SNAP = np.cos(np.radians(25.0))


def guess_freedoms(
    names: Sequence[str], parents: IntArray, world: FloatArray, weighted: BoolArray
) -> tuple[tuple[JointFreedom, ...], list[str]]:
    """One freedom per joint, and notes. world: (j, 4, 4) rest. weighted: (j,) whether a joint moves any skin."""
    root = _main_root(parents, weighted)
    leaf = np.ones(len(names), bool)
    leaf[parents[parents >= 0]] = False
    moves = _moves_skin(parents, weighted)
    anatomical = _digit_freedoms(names, parents, world)
    result = []
    for index in range(len(names)):
        if index == root:
            result.append(JointFreedom(kind="ball", translates=True))
        elif not moves[index]:
            result.append(JointFreedom(kind="fixed"))
        elif index in anatomical:
            result.append(anatomical[index])
        else:
            x = _snapped(world[index, :3, :3], _bone(index, parents, world))
            result.append(JointFreedom(kind="ball", frame=_frame_along(x), prior_weight=np.array(OPEN_PRIOR)))
    notes = []
    if anatomical:
        notes.append(
            f"Limits of {len(anatomical)} digit joints were guessed from their names; a rig.toml overrides."
        )
    still = int((~moves).sum())
    if still:
        notes.append(f"{still} joints that move no skin are held still.")
    return tuple(result), notes


def _digit_freedoms(names: Sequence[str], parents: IntArray, world: FloatArray) -> dict[int, JointFreedom]:
    chains = digit_chains(names, parents)
    result: dict[int, JointFreedom] = {}
    for side in dict.fromkeys(side for _, side in chains):
        hand = {digit: chain for (digit, s), chain in chains.items() if s == side}
        result |= _hand_freedoms(names, hand, side, parents, world)
    return result


def _hand_freedoms(
    names: Sequence[str], hand: dict[str, list[int]], side: Side, parents: IntArray, world: FloatArray
) -> dict[int, JointFreedom]:
    """Freedoms of one hand's digits; empty when it has too few fingers to tell the palm."""
    segments = {digit: _segments(names, digit, chain, world) for digit, chain in hand.items()}
    knuckles = [
        (digit, segments[digit]["proximal"])
        for digit in ("index", "middle", "ring", "little")
        if "proximal" in segments.get(digit, {})
    ]
    if len(knuckles) < 2:
        return {}
    position = world[:, :3, 3]
    line = position[knuckles[-1][1]] - position[knuckles[0][1]]  # index towards little
    if side == "left":
        line = -line
    elif side == "":
        line = line * _palm_vote(hand, knuckles, parents, position, line)
    result: dict[int, JointFreedom] = {}
    habits: list[tuple[int, int, float]] = []  # own axes that served as bone and flexion axis
    for digit, _ in knuckles:
        for segment, index in segments[digit].items():
            if segment == "metacarpal":
                result[index] = JointFreedom(kind="fixed")
                continue
            frame, habit = _finger_frame(world[index, :3, :3], _bone(index, parents, world), -line)
            habits.append(habit)
            result[index] = _limited(frame, FINGER_LIMITS[segment])
    habit = max(set(habits), key=habits.count)
    if habit[0] >= 0 and habits.count(habit) > len(habits) // 2:
        for segment, index in segments.get("thumb", {}).items():
            x = _snapped(world[index, :3, :3], _bone(index, parents, world))
            z = np.eye(3)[habit[1]] * habit[2]
            if abs(x @ z) < 0.5:
                result[index] = _limited(_orthonormal(x, z), THUMB_LIMITS[segment])
    return result


def _segments(names: Sequence[str], digit: str, chain: list[int], world: FloatArray) -> dict[str, int]:
    """Segment name -> joint of a digit's chain, tips left out."""
    bones = [index for index in chain if (joint := digit_joint(names[index])) and joint.rank < 99.0]
    if digit == "thumb":
        return dict(zip(("distal", "proximal", "metacarpal"), reversed(bones), strict=False))
    first = digit_joint(names[bones[0]]) if bones else None
    has_metacarpal = len(bones) >= 4 or (first is not None and first.segment == "metacarpal")
    order = ("metacarpal", "proximal", "intermediate", "distal")[0 if has_metacarpal else 1 :]
    return dict(zip(order, bones, strict=False))


def _finger_frame(
    own: FloatArray, bone: FloatArray, flexion: FloatArray
) -> tuple[FloatArray, tuple[int, int, float]]:
    """(3, 3) frame in joint axes, and the own axes it came from: bone axis, flexion axis, its sign; -1: none."""
    local_bone, local_flexion = own.T @ bone, own.T @ flexion
    across = local_flexion - (local_flexion @ local_bone) * local_bone
    across /= max(float(np.linalg.norm(across)), 1e-12)
    x_axis, z_axis = int(np.abs(local_bone).argmax()), int(np.abs(across).argmax())
    near = abs(local_bone[x_axis]) > SNAP and abs(across[z_axis]) > SNAP and x_axis != z_axis
    if not near:
        return _orthonormal(local_bone, across), (-1, -1, 0.0)
    sign = float(np.sign(across[z_axis]))
    return _orthonormal(np.eye(3)[x_axis] * np.sign(local_bone[x_axis]), np.eye(3)[z_axis] * sign), (
        x_axis, z_axis, sign,
    )  # fmt: skip


def _palm_vote(
    hand: dict[str, list[int]],
    knuckles: list[tuple[str, int]],
    parents: IntArray,
    position: FloatArray,
    line: FloatArray,
) -> float:
    """+1 when index-to-little is the line of a right hand, -1 of a left: by where thumb and curl point."""
    outwards = np.mean([position[hand[d][-1]] - position[i] for d, i in knuckles], axis=0)
    palm = np.cross(outwards, line)  # the palm side of a right hand
    curl = np.sum([position[hand[d][-1]] - 2 * position[hand[d][-2]] + position[i] for d, i in knuckles], axis=0)
    vote = float(palm @ curl)
    if "thumb" in hand:
        middle = np.mean([position[i] for _, i in knuckles], axis=0)
        base = position[max(int(parents[hand["thumb"][0]]), 0)]
        vote += 2.0 * float(palm @ (position[hand["thumb"][-1]] - 0.5 * (middle + base)))
    return 1.0 if vote >= 0 else -1.0


def _limited(frame: FloatArray, degrees: tuple[float, float, float, float]) -> JointFreedom:
    twist, spread, flex_from, flex_to = np.radians(degrees)
    return JointFreedom(
        kind="euler",
        frame=frame,
        lower=np.array([-twist, -spread, flex_from]),
        upper=np.array([twist, spread, flex_to]),
    )


def _bone(index: int, parents: IntArray, world: FloatArray) -> FloatArray:
    """(3,) unit direction to the (mean of the) children; for a leaf, from the parent."""
    here = world[index, :3, 3]
    children = np.flatnonzero(parents == index)
    if len(children):
        way = world[children, :3, 3].mean(axis=0) - here
    elif parents[index] >= 0:
        way = here - world[parents[index], :3, 3]
    else:
        way = world[index, :3, 0]
    length = float(np.linalg.norm(way))
    return np.asarray(way / length if length > 1e-12 else world[index, :3, 0])


def _snapped(own: FloatArray, bone: FloatArray) -> FloatArray:
    """(3,) the bone direction in joint axes, snapped to the nearest own axis when one is near."""
    local = own.T @ bone
    local = local / max(float(np.linalg.norm(local)), 1e-12)
    axis = int(np.abs(local).argmax())
    return np.eye(3)[axis] * np.sign(local[axis]) if abs(local[axis]) > SNAP else np.asarray(local)


def _frame_along(x: FloatArray) -> FloatArray:
    return _orthonormal(x, np.eye(3)[(int(np.abs(x).argmax()) + 2) % 3])


def _orthonormal(x: FloatArray, z: FloatArray) -> FloatArray:
    """(3, 3) right-handed columns x, y, z with x kept and z made orthogonal to it."""
    x = x / np.linalg.norm(x)
    z = z - (z @ x) * x
    z = z / np.linalg.norm(z)
    return np.stack([x, np.cross(z, x), z], axis=1)


def _main_root(parents: IntArray, weighted: BoolArray) -> int:
    """The root above the most joints that move skin."""
    top = np.arange(len(parents))
    for index, parent in enumerate(parents):
        if parent >= 0:
            top[index] = top[parent]
    return int(np.bincount(top, weights=weighted + 1e-6).argmax())


def _moves_skin(parents: IntArray, weighted: BoolArray) -> BoolArray:
    """(j,) whether a joint or anything below it moves skin."""
    moves = weighted.copy()
    for index in range(len(parents) - 1, -1, -1):
        if parents[index] >= 0:
            moves[parents[index]] |= moves[index]
    return moves
