"""A hand as the closing sees it: a chain of bending bones for each digit, points of skin on each, pads and
capsules."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.geometry.transform import transform_points
from contact_core.hands.description import Digit, DigitBone, HandDescription, Pad
from contact_core.hands.pads import side_pad
from contact_core.rig.capsules import closest_on_segments, fit_capsules
from contact_core.rig.rig import JointFreedom, Pose, Rig
from contact_core.solve.body import manipulator_length

PROBES = 44  # points of skin on each bone
TESTED = 260  # points of the palm that an approach tests
RIG_ROOM = 0.85  # how near two capsules of different digits may come, of the sum of their radii
FREE = np.radians(100.0)  # how far joints without limits bend
STIFF = np.radians(5.0)  # a joint with less room than this does not bend
HINGED = (0.5, 0.75, 1.0, 0.25, 0.0)  # of its room, that a hinge turns a robot's thumb before the fingers
BENT = (0.3, 0.0, 0.6)  # of its room, that the first hinge of a robot's thumb is bent
SPREADS = np.radians([0.0, -10.0, 10.0])  # of fingers
SPREAD_PRICE = 0.004  # hand lengths for ten degrees
TWISTS, THUMB_SPREADS, THUMB_FLEXIONS = (
    np.linspace(0.05, 0.95, 3),
    np.linspace(0.1, 0.9, 4),
    np.linspace(0.1, 0.7, 3),
)
LOOKS = 4  # rounds in which a thumb looks about the best of these shares of its room, one way after the other
STRETCHED, STRETCH_PRICE = 1.3, 0.12  # skin that is stretched more costs so many hand lengths for as much again
WRIST = 0.12  # of the hand's length: skin this far behind the joint at which the digits part is no palm


@dataclass(frozen=True, eq=False)
class Hand:
    """One hand of a rig. Lengths are the rig's surface units, positions of bones are in their joints' frames.

    bones: (D + 1,) where each digit's bones begin, thumb first where there is one. joints: (B,) of the rig.
    links: (B, 3, 4) from the bone before, or rig space, at rest. axes: (B, 3) flexion axes; low, high: (B,).
    starts: (D, S, 3, 3) turns of a digit's first bone to try, with angles and prices (D, S); counts (D,).
    probes: points of skin, by digit; tested: palm and fingers for the approach; rest: skin that is neither.
    pads: (B, 3) their middles and normals. length: of the hand. leads: (B,) the bone with which each turns,
    `ratios` (B,) times as much, where a robot couples them, -1 for none. looks: (4,) how many of a thumb's starts
    each way (twist, spread, flexion), and rounds to look about the best; look_low, look_high: (3,) radians from the
    first to the last each way, in look_frame (3, 3) of its first bone that bends.
    """

    rig: Rig
    description: HandDescription
    bones: IntArray
    joints: IntArray
    links: FloatArray
    axes: FloatArray
    low: FloatArray
    high: FloatArray
    flexes: BoolArray
    starts: FloatArray
    start_counts: IntArray
    start_angles: FloatArray
    start_prices: FloatArray
    probes: FloatArray
    probe_bones: IntArray
    probe_starts: IntArray
    levers: FloatArray
    tested: FloatArray
    tested_bones: IntArray
    rest: FloatArray
    pads: FloatArray
    pad_normals: FloatArray
    has_pad: BoolArray
    capsules: FloatArray
    radii: FloatArray
    room: FloatArray
    length: float
    leads: IntArray
    ratios: FloatArray
    looks: IntArray
    look_frame: FloatArray
    look_low: FloatArray
    look_high: FloatArray
    thumb: int = field(default=-1)

    @cached_property
    def frame(self) -> FloatArray:
        """(3, 3) columns: out of the palm, along the fingers, and across, right-handed."""
        palm = self.description.palm
        forward = palm.fingers - (palm.fingers @ palm.normal) * palm.normal
        forward = forward if np.linalg.norm(forward) > 1e-6 else np.eye(3)[int(np.abs(palm.normal).argmin())]
        forward = forward - (forward @ palm.normal) * palm.normal
        forward = forward / np.linalg.norm(forward)
        return np.stack([palm.normal, forward, np.cross(palm.normal, forward)], axis=1)

    @cached_property
    def firsts(self) -> IntArray:
        """(D,) the first bone of each digit that bends; of a robot's thumb that which turns before it bends."""
        flexing = [np.flatnonzero(self.flexes[a:b]) for a, b in zip(self.bones[:-1], self.bones[1:], strict=True)]
        result = [a + (f[0] if len(f) else 0) for a, f in zip(self.bones[:-1], flexing, strict=True)]
        if self.thumb >= 0:
            digit = self.digits[self.thumb]
            if (turning := _turning(self.rig, digit)) is not _first_bending(self.rig, digit):
                result[self.thumb] = self.bones[self.thumb] + digit.bones.index(turning)
        return np.array(result, np.int64)

    @cached_property
    def bone_of_skin(self) -> IntArray:
        """(n,) by vertex of the rig's skin the bone that carries it, -1 for none."""
        return _carriers(self.rig, self.joints)

    @cached_property
    def skin_of_digits(self) -> tuple[IntArray, ...]:
        """Of each digit the vertices on bones that bend."""
        bends = np.append(self.flexes, False)[self.bone_of_skin]
        return tuple(
            np.flatnonzero(bends & (self.bone_of_skin >= a) & (self.bone_of_skin < b))
            for a, b in zip(self.bones[:-1], self.bones[1:], strict=True)
        )

    @cached_property
    def own_skin(self) -> IntArray:
        """Vertices of palm and digits: held strongest by the joint at which the digits part, or one below it."""
        rig = self.rig
        owner = rig.skin_joints[np.arange(len(rig.skin_joints)), rig.skin_weights.argmax(axis=1)]
        return np.flatnonzero(_below(rig, np.array([self.description.hub]))[owner])

    @property
    def is_in_body(self) -> bool:
        """Whether most of the rig's skin is another's than palm's and digits'."""
        return 2 * len(self.own_skin) < len(self.rig.surface.points)

    def angles_of(self, pose: Pose) -> FloatArray:
        """(B,) by how much each bone is bent about its axis in a pose of the rig."""
        order = [pose.joints.index(self.rig.joints[joint]) for joint in self.joints]
        turned = np.linalg.inv(self.rig.rest_local[self.joints]) @ pose.local[order]
        angles = np.zeros(len(self.joints))
        for b, axis in enumerate(self.axes):
            r = turned[b, :3, :3]
            twist = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
            angles[b] = np.arctan2(twist @ axis, np.trace(r) - 1.0)
        return angles

    @cached_property
    def digits(self) -> tuple[Digit, ...]:
        """In the order of the arrays: the thumb first."""
        return _ordered(self.description)

    @cached_property
    def first_finger(self) -> int:
        """The digit beside the thumb, -1 for a hand without a thumb or without fingers."""
        return 1 if self.thumb == 0 and len(self.bones) > 2 else -1

    @cached_property
    def thumbwards(self) -> FloatArray:
        """(3,) unit, rig space: across the palm to where the thumb is."""
        thumb, across = self.description.thumb, self.frame[:, 2]
        reach = 0.0 if thumb is None else float((thumb.tip - self.description.palm.point) @ across)
        return np.asarray(across * (1.0 if reach >= 0.0 else -1.0))

    @cached_property
    def side_pad(self) -> Pad | None:
        """On the side of the first finger, against which the thumb holds a thing as a key is held."""
        return (
            None if self.first_finger < 0 else side_pad(self.rig, self.digits[self.first_finger], self.thumbwards)
        )

    @cached_property
    def quick(self) -> Hand:
        """The same for a first look: one start for each finger, and of a thumb's two, spread far to either side."""
        counts, looks = np.ones_like(self.start_counts), self.looks.copy()
        looks[3] = 0
        arrays = {name: getattr(self, name).copy() for name in ("starts", "start_angles", "start_prices")}
        if looks[:3].min() > 1:
            counts[self.thumb] = 2
            twist, flexion = looks[0] // 2, looks[2] // 2
            for place, spread in enumerate((0, looks[1] - 1)):
                own = (twist * looks[1] + spread) * looks[2] + flexion
                for name, array in arrays.items():
                    array[self.thumb, place] = getattr(self, name)[self.thumb, own]
        return replace(self, start_counts=counts, looks=looks, **arrays)

    def pose(self, placed: FloatArray, angles: FloatArray, turns: FloatArray) -> Pose:
        """The pose of the whole rig with the hand at `placed` (4, 4) in rig space; angles (B,), turns (D, 3, 3)."""
        local = self.rig.rest_local.copy()
        for digit in range(len(self.bones) - 1):
            for b in range(self.bones[digit], self.bones[digit + 1]):
                turn = turn_about(self.axes[b], angles[b])
                if b == self.firsts[digit]:
                    turn = turns[digit] @ turn
                local[self.joints[b], :3, :3] = local[self.joints[b], :3, :3] @ turn
        roots = self.rig.parents < 0
        local[roots] = placed @ local[roots]
        return Pose(self.rig.joints, local)

    def frames(self, placed: FloatArray, angles: FloatArray, turns: FloatArray) -> FloatArray:
        """(N, B, 4, 4) of all bones of N hands at `placed` (N, 4, 4); angles (N, B), turns (N, D, 3, 3)."""
        n = len(placed)
        result = np.zeros((n, len(self.joints), 4, 4))
        for digit, (first, end) in enumerate(zip(self.bones[:-1], self.bones[1:], strict=True)):
            before = placed
            for b in range(first, end):
                turn = np.tile(np.eye(4), (n, 1, 1))
                turn[:, :3, :3] = turns_about(self.axes[b], angles[:, b])
                if b == self.firsts[digit]:
                    turn[:, :3, :3] = turns[:, digit] @ turn[:, :3, :3]
                link = np.vstack([self.links[b], [0.0, 0.0, 0.0, 1.0]])
                before = result[:, b] = before @ link @ turn
        return result

    def coupled(self, angles: FloatArray) -> FloatArray:
        """The angles (..., B) with every coupled bone where the one that leads it puts it."""
        follow = self.leads >= 0
        if not follow.any():
            return angles
        result = angles.copy()
        result[..., follow] = self.ratios[follow] * angles[..., self.leads[follow]]
        return result

    def turned(self, angles: FloatArray) -> FloatArray:
        """(D,) by how much each digit is bent in all."""
        bent = np.where(self.flexes, angles, 0.0)
        return np.add.reduceat(bent, self.bones[:-1])


def hand_of(rig: Rig, description: HandDescription, seed: int = 0) -> Hand:
    """The hand that a description names. Raises InvalidInput where no digit bends."""
    digits = _ordered(description)
    thumb = 0 if digits[0].is_thumb else -1
    bones = [bone for digit in digits for bone in digit.bones]
    joints = np.array([bone.joint for bone in bones], np.int64)
    counts = np.cumsum([0, *(len(digit.bones) for digit in digits)])
    bends = [_bend(rig.freedoms[bone.joint], bone) for bone in bones]
    flexes = np.array(
        [high - low > STIFF and bone.flexes for (_, low, high), bone in zip(bends, bones, strict=True)]
    )
    if not flexes.any():
        raise InvalidInput(f"no digit of {rig.name} can bend, so it cannot grasp; look at its limits.")
    digit_joints = _below(rig, joints)
    length = _length(rig, description, joints)
    carrier = _carriers(rig, joints)
    probes, probe_bones, probe_starts = _probes(rig, digits, counts, carrier, seed)
    tested, tested_bones, rest = _tested(rig, description, carrier, digit_joints, length, seed)
    starts = [_starts(rig, digit) for digit in digits]
    looks, *look = _looks(rig, digits[0])
    most = max(len(turns) for turns, _, _ in starts)
    pads = _pads(rig, description, joints)
    axes = np.array([axis for axis, _, _ in bends])
    leads, ratios = _coupling(rig, joints, axes)
    capsules, radii, room = _capsules(rig, joints, counts)
    return Hand(
        rig=rig, description=description, bones=counts, joints=joints, links=_links(rig, digits),
        axes=axes, low=np.array([low for _, low, _ in bends]),
        high=np.array([high for _, _, high in bends]), flexes=flexes,
        starts=np.array([_padded(turns, most) for turns, _, _ in starts]),
        start_counts=np.array([len(turns) for turns, _, _ in starts], np.int64),
        start_angles=np.array([_padded(angles, most) for _, angles, _ in starts]),
        start_prices=np.array([_padded(prices, most) for _, _, prices in starts]),
        probes=probes, probe_bones=probe_bones, probe_starts=probe_starts,
        levers=_levers(rig, probes, probe_bones, counts, joints), tested=tested, tested_bones=tested_bones,
        rest=rest, pads=pads[0], pad_normals=pads[1], has_pad=pads[2], capsules=capsules, radii=radii, room=room,
        length=length, thumb=thumb, leads=leads, ratios=ratios, looks=looks, look_frame=look[0], look_low=look[1],
        look_high=look[2],
    )  # fmt: skip


def _ordered(description: HandDescription) -> tuple[Digit, ...]:
    """The digits, the thumb first where there is one."""
    return tuple(sorted(description.digits, key=lambda digit: not digit.is_thumb))


def _bend(freedom: JointFreedom, bone: DigitBone) -> tuple[FloatArray, float, float]:
    """The axis (3,) about which a bone bends, in its joint's frame, and from where to where."""
    wanted = bone.frame[:, 2]
    if freedom.kind == "fixed" or not bone.flexes:
        return wanted, 0.0, 0.0
    columns = [0] if freedom.kind == "hinge" else ["XYZ".index(letter) for letter in freedom.order]
    if freedom.kind == "ball":
        columns = [0, 1, 2]
    along = np.array([freedom.frame[:, column] @ wanted for column in columns])
    dof = int(np.abs(along).argmax())
    if freedom.locked is not None and freedom.locked[dof]:
        return wanted, 0.0, 0.0
    assert freedom.lower is not None and freedom.upper is not None
    low, high = float(freedom.lower[dof]), float(freedom.upper[dof])
    if along[dof] < 0.0:
        low, high = -high, -low
    low, high = (low if np.isfinite(low) else -0.2), (high if np.isfinite(high) else FREE)
    return freedom.frame[:, columns[dof]] * np.sign(along[dof]), min(low, 0.0), max(high, 0.0)


def _coupling(rig: Rig, joints: IntArray, axes: FloatArray) -> tuple[IntArray, FloatArray]:
    """(B,) which bone leads each, -1 for none, and (B,) by how much; both bend positively towards the palm."""
    leads, ratios = np.full(len(joints), -1, np.int64), np.ones(len(joints))
    own = np.array([rig.freedoms[joint].frame[:, 0] for joint in joints])
    signs = np.where(np.einsum("bi,bi->b", own, axes) < 0.0, -1.0, 1.0)
    for b, joint in enumerate(joints):
        freedom = rig.freedoms[joint]
        if freedom.follows is None:
            continue
        for lead in np.flatnonzero(joints == rig.joints.index(freedom.follows)):
            leads[b], ratios[b] = lead, freedom.ratio * signs[b] * signs[lead]
    return leads, ratios


def _starts(rig: Rig, digit: Digit) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Turns (s, 3, 3) of a digit's first bending bone to try before it closes, with flexions and prices (s,)."""
    first = _first_bending(rig, digit)
    if digit.is_thumb and first is not (turning := _turning(rig, digit)):
        return _hinged_starts(rig.freedoms[turning.joint])
    freedom = rig.freedoms[first.joint]
    if freedom.kind not in ("euler", "ball"):
        bent = np.array(BENT if digit.is_thumb else (0.0,)) * _bend(freedom, first)[2]
        return np.tile(np.eye(3), (len(bent), 1, 1)), bent, np.zeros(len(bent))
    frame = first.frame
    lower, upper = _room(freedom, frame)
    if not digit.is_thumb:
        spreads = [s for s in SPREADS if lower[1] <= s <= upper[1]] or [0.0]
        turns = [frame @ turn_about(np.array([0.0, 1.0, 0.0]), s) @ frame.T for s in spreads]
        return np.array(turns), np.zeros(len(turns)), SPREAD_PRICE * np.abs(spreads) / np.radians(10.0)
    turns, angles, whole = [], [], []
    for shares in itertools.product(TWISTS, THUMB_SPREADS, THUMB_FLEXIONS):
        x, y, z = (a + f * (b - a) for a, b, f in zip(lower, upper, shares, strict=True))
        turns.append(frame @ turn_about(np.eye(3)[0], x) @ turn_about(np.eye(3)[1], y) @ frame.T)
        angles.append(z)
        whole.append(turns[-1] @ frame @ turn_about(np.eye(3)[2], z) @ frame.T)
    stretch = stretches(rig, first.joint, np.array(whole))
    return np.array(turns), np.array(angles), STRETCH_PRICE * np.maximum(stretch - STRETCHED, 0.0)


def _first_bending(rig: Rig, digit: Digit) -> DigitBone:
    return next((bone for bone in digit.bones if _bend(rig.freedoms[bone.joint], bone)[2] > STIFF), digit.bones[0])


def _turning(rig: Rig, digit: Digit) -> DigitBone:
    """The bone that turns before a digit bends: the first that bends, or of a robot's thumb the first on a hinge of
    its own across that, which brings it before the fingers."""
    for bone in digit.bones if digit.is_thumb else ():
        freedom = rig.freedoms[bone.joint]
        if bone.flexes:
            break
        if freedom.kind == "hinge" and freedom.follows is None and np.ptp(_hinge_room(freedom)) > STIFF:
            return bone
    return _first_bending(rig, digit)


def _hinge_room(freedom: JointFreedom) -> FloatArray:
    """(2,) from where to where a hinge turns, within a right angle of rest where it has no end; 0 if locked."""
    if freedom.locked is not None and freedom.locked[0]:
        return np.zeros(2)
    assert freedom.lower is not None and freedom.upper is not None
    return np.clip([freedom.lower[0], freedom.upper[0]], -0.5 * np.pi, 0.5 * np.pi)


def _hinged_starts(freedom: JointFreedom) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Turns (s, 3, 3) of a hinge over its room, the middle of it first, with flexions and prices (s,), all zero."""
    low, high = _hinge_room(freedom)
    angles = low + np.array(HINGED) * (high - low)
    turns = np.array([turn_about(freedom.frame[:, 0], angle) for angle in angles])
    return turns, np.zeros(len(angles)), np.zeros(len(angles))


def _looks(rig: Rig, digit: Digit) -> tuple[IntArray, FloatArray, FloatArray, FloatArray]:
    """How many starts a thumb has each way, and rounds beyond them (4,), in which frame (3, 3), from where to where
    (3,) (3,)."""
    shares, first = (TWISTS, THUMB_SPREADS, THUMB_FLEXIONS), _first_bending(rig, digit)
    freedom = rig.freedoms[first.joint]
    if not digit.is_thumb or freedom.kind not in ("euler", "ball"):
        return np.array([1, 1, 1, 0]), np.eye(3), np.zeros(3), np.zeros(3)
    lower, upper = _room(freedom, first.frame)
    low, high = (lower + np.array([each[k] for each in shares]) * (upper - lower) for k in (0, -1))
    return np.array([*map(len, shares), LOOKS], np.int64), np.ascontiguousarray(first.frame), low, high


def stretches(rig: Rig, joint: int, turns: FloatArray) -> FloatArray:
    """(k,) the 99th percentile of posed / rest length over the skin's edges when one joint turns by each of `turns`
    (k, 3, 3) in its own frame: what skin at a thumb's root can take decides how far it goes."""
    under = _below(rig, np.array([joint]))
    held = np.where(under[rig.skin_joints], rig.skin_weights, 0.0).sum(axis=1)  # (n,) by what turns
    rest = rig.surface.points
    ends = np.sort(rig.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    ends = np.unique(ends[(held[ends[:, 0]] != held[ends[:, 1]])], axis=0)  # others keep their length
    count = int(0.01 * 1.5 * len(rig.faces))
    before = np.linalg.norm(rest[ends[:, 1]] - rest[ends[:, 0]], axis=1)
    ends, before = ends[before > 0.0], before[before > 0.0]
    if len(ends) <= count:
        return np.ones(len(turns))
    result = []
    frame = rig.rest_world[joint]
    for turn in turns:
        moved = frame[:3, :3] @ turn @ frame[:3, :3].T
        away = (rest - frame[:3, 3]) @ moved.T + frame[:3, 3]
        posed = rest + held[:, None] * (away - rest)
        after = np.linalg.norm(posed[ends[:, 1]] - posed[ends[:, 0]], axis=1)
        result.append(float(np.partition(after / before, -count - 1)[-count - 1]))
    return np.maximum(result, 1.0)


def _room(freedom: JointFreedom, frame: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(3,) (3,) how far a joint may twist, spread and flex, in the frame of its bone."""
    lower, upper = np.radians([-35.0, -45.0, -30.0]), np.radians([35.0, 45.0, 50.0])
    assert freedom.lower is not None and freedom.upper is not None
    letters = "XYZ" if freedom.kind == "ball" else freedom.order
    for dof, letter in enumerate(letters):
        along = freedom.frame[:, "XYZ".index(letter)] @ frame
        column = int(np.abs(along).argmax())
        low, high = float(freedom.lower[dof]), float(freedom.upper[dof])
        low, high = (low, high) if along[column] > 0 else (-high, -low)
        lower[column], upper[column] = max(low, -1.2), min(high, 1.7)
    return lower, upper


def _links(rig: Rig, digits: tuple[Digit, ...]) -> FloatArray:
    """(B, 3, 4) each bone's joint at rest in that of the bone before, the first in rig space."""
    links = []
    for digit in digits:
        before = np.eye(4)
        for bone in digit.bones:
            here = rig.rest_world[bone.joint]
            links.append((np.linalg.inv(before) @ here)[:3])
            before = here
    return np.array(links)


def _below(rig: Rig, joints: IntArray) -> BoolArray:
    """(j,) which joints are these or below them."""
    under = np.zeros(len(rig.joints), bool)
    under[joints] = True
    for joint, parent in enumerate(rig.parents):
        under[joint] |= parent >= 0 and under[parent]
    return under


def _carriers(rig: Rig, joints: IntArray) -> IntArray:
    """(n,) by skin vertex: the bone that carries it, -1 for skin that is of no digit."""
    bone_of = np.full(len(rig.joints), -1)
    for joint, parent in enumerate(rig.parents):
        here = np.flatnonzero(joints == joint)
        bone_of[joint] = here[0] if len(here) else (bone_of[parent] if parent >= 0 else -1)
    owner = rig.skin_joints[np.arange(len(rig.skin_joints)), rig.skin_weights.argmax(axis=1)]
    return np.asarray(bone_of[owner])


def _length(rig: Rig, description: HandDescription, joints: IntArray) -> float:
    """That of a rig which is a hand; of a hand in a body, from the joint at which its digits part on."""
    under = _below(rig, np.array([description.hub]))
    above = ~under & (np.bincount(rig.skin_joints[rig.skin_weights > 0.5].ravel(), minlength=len(under)) > 0)
    parents = np.flatnonzero(above)
    return manipulator_length(rig) if len(parents) <= 2 else manipulator_length(rig, np.flatnonzero(under))


def spread_out(points: FloatArray, count: int, seed: int) -> IntArray:
    """Indices of at most `count` points far from one another (farthest point sampling)."""
    if len(points) <= count:
        return np.arange(len(points))
    chosen = [seed % len(points)]
    away = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < count:
        chosen.append(int(away.argmax()))
        away = np.minimum(away, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.array(chosen)


def _probes(
    rig: Rig, digits: tuple[Digit, ...], counts: IntArray, carrier: IntArray, seed: int
) -> tuple[FloatArray, IntArray, IntArray]:
    points, owners, starts = [], [], [0]
    for digit in range(len(digits)):
        for b in range(counts[digit], counts[digit + 1]):
            bone = [x for d in digits for x in d.bones][b]
            mine = np.flatnonzero(carrier == b)
            if bone.flexes and len(mine):
                own = transform_points(np.linalg.inv(rig.rest_world[bone.joint]), rig.surface.points[mine])
                own = own[spread_out(own, PROBES, seed)]
                points.append(own)
                owners.append(np.full(len(own), b))
        starts.append(sum(map(len, points)))
    if not points:
        raise InvalidInput(f"no skin of {rig.name} moves with its digits, so it cannot touch anything.")
    return np.concatenate(points), np.concatenate(owners), np.array(starts, np.int64)


def _levers(rig: Rig, probes: FloatArray, owners: IntArray, counts: IntArray, joints: IntArray) -> FloatArray:
    """(P,) how fast a point may move when all joints of its digit turn at one rate: the sum of its lever arms."""
    levers = np.zeros(len(probes))
    for p, (point, b) in enumerate(zip(probes, owners, strict=True)):
        digit = int(np.searchsorted(counts, b, side="right")) - 1
        here = transform_points(rig.rest_world[joints[b]], point[None])[0]
        for other in range(counts[digit], b + 1):
            levers[p] += np.linalg.norm(here - rig.rest_world[joints[other], :3, 3])
    return np.maximum(levers, 1e-9)


def _tested(
    rig: Rig, description: HandDescription, carrier: IntArray, digit_joints: BoolArray, length: float, seed: int
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Points of the palm, with -1 as their bone, and the rest of the skin that moves with neither."""
    points = rig.surface.points
    base = rig.rest_world[description.hub, :3, 3]
    under = _below(rig, np.array([description.hub]))
    owner = rig.skin_joints[np.arange(len(points)), rig.skin_weights.argmax(axis=1)]
    palm = description.palm
    ahead = (points - base) @ palm.fingers > -WRIST * length * (0.0 if palm.is_plane else -10.0)
    is_palm = (carrier < 0) | ~digit_joints[owner]
    is_palm |= np.isin(carrier, _stiff(rig, description, carrier))
    is_palm &= under[owner] & ahead
    others = (carrier < 0) & ~is_palm
    chosen = np.flatnonzero(is_palm)
    chosen = chosen[spread_out(points[chosen], TESTED, seed)] if len(chosen) else chosen
    left = np.flatnonzero(others)
    left = left[spread_out(points[left], TESTED, seed)] if len(left) else left
    return points[chosen], np.full(len(chosen), -1, np.int64), points[left]


def _stiff(rig: Rig, description: HandDescription, carrier: IntArray) -> list[int]:
    """Bones that do not bend: metacarpals carry skin of the palm."""
    bones = [bone for digit in _ordered(description) for bone in digit.bones]
    return [b for b, bone in enumerate(bones) if not bone.flexes]


def _pads(rig: Rig, description: HandDescription, joints: IntArray) -> tuple[FloatArray, FloatArray, BoolArray]:
    middles, normals, has = np.zeros((len(joints), 3)), np.zeros((len(joints), 3)), np.zeros(len(joints), bool)
    for pad in description.pads:
        for b in np.flatnonzero(joints == pad.joint):
            into = np.linalg.inv(rig.rest_world[pad.joint])
            middles[b] = transform_points(into, pad.centre.positions(rig.surface))[0]
            normals[b] = into[:3, :3] @ pad.normal
            has[b] = pad.role != "palm"
    return middles, normals, has


def _capsules(rig: Rig, joints: IntArray, counts: IntArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Ends (B, 2, 3), radii (B,) and how near those of different digits may come (B, B); 0: no matter how."""
    fitted = fit_capsules(rig)
    ends, radii = np.zeros((len(joints), 2, 3)), np.zeros(len(joints))
    for b, joint in enumerate(joints):
        for c in np.flatnonzero(fitted.joints == joint):
            ends[b], radii[b] = fitted.ends[c], fitted.radii[c] / 0.7
    world = np.array([transform_points(rig.rest_world[j], e) for j, e in zip(joints, ends, strict=True)])
    first, second = (index.ravel() for index in np.indices((len(joints), len(joints))))
    share = closest_on_segments(world[first], world[second])
    one = world[first, 0] + share[:, :1] * (world[first, 1] - world[first, 0])
    two = world[second, 0] + share[:, 1:] * (world[second, 1] - world[second, 0])
    apart = np.linalg.norm(one - two, axis=1).reshape(len(joints), -1)
    room = RIG_ROOM * np.minimum(radii[:, None] + radii[None], apart)
    digit = np.searchsorted(counts, np.arange(len(joints)), side="right")
    room[digit[:, None] == digit[None]] = 0.0
    room[(radii[:, None] <= 0.0) | (radii[None] <= 0.0)] = 0.0
    return ends, radii, room


def _padded(values: FloatArray, count: int) -> FloatArray:
    return np.concatenate([values, np.repeat(values[-1:], count - len(values), axis=0)])


def turn_about(axis: FloatArray, angle: float) -> FloatArray:
    """(3, 3) turn about a unit axis."""
    return turns_about(axis, np.array([angle]))[0]


def turns_about(axis: FloatArray, angles: FloatArray) -> FloatArray:
    """(n, 3, 3) turns about one unit axis by angles (n,) (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    bent = angles[:, None, None]
    return np.asarray(np.eye(3) + np.sin(bent) * cross + (1.0 - np.cos(bent)) * (cross @ cross))
