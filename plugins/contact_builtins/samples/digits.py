"""Digits that hands are made of: joints, flesh with pads, knuckles and nails, and which bone warms which skin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from contact_builtins.samples.binding import bone_heat_weights, strongest
from contact_builtins.samples.fields import Field, ball, chain, common, ellipsoid, half_space, union, without
from contact_builtins.samples.modelling import Sizing
from contact_builtins.samples.skeleton import Bone, bone_frame, fixed, limits, rig_of, root
from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.rig.rig import Rig

MM = 1e-3
Triple = tuple[float, float, float]
Segment = tuple[str, FloatArray, FloatArray, float]  # bone, its two ends, how thick the flesh on it is

# Degrees of the joints, by segment: twist, spread, flexion from and to.
FINGER_PARTS = ("metacarpal", "proximal", "intermediate", "distal", "tip")
FINGER_FREEDOMS = (fixed(), limits(8, 20, -15, 95), limits(4, 2, -5, 105), limits(4, 2, -8, 80), fixed())
THUMB_PARTS = ("metacarpal", "proximal", "distal", "tip")
THUMB_FREEDOMS = (limits(35, 45, -30, 50), limits(8, 8, -10, 70), limits(5, 2, -15, 85), fixed())


@dataclass(frozen=True, eq=False)
class Digit:
    """One digit, in metres.

    joints: (k + 1, 3) metacarpal base, knuckle, further joints, and last the centre of the tip's ball.
    frames: (k, 3, 3) of the k bones: along, palmar, flexion axis. radii: (k,) at knuckle, joints and tip.
    """

    name: str
    joints: FloatArray
    frames: FloatArray
    radii: FloatArray

    @property
    def parts(self) -> tuple[str, ...]:
        return THUMB_PARTS if len(self.frames) == 3 else FINGER_PARTS

    def bones(self, parent: str) -> list[Bone]:
        """The joints as a chain below `parent`, with anatomical limits."""
        freedoms = THUMB_FREEDOMS if len(self.frames) == 3 else FINGER_FREEDOMS
        chained = []
        for k, (part, freedom) in enumerate(zip(self.parts, freedoms, strict=True)):
            frame = self.frames[min(k, len(self.frames) - 1)]
            name = f"{self.name}_{part}"
            chained.append(Bone(name, parent, self.joints[k], frame[:, 0], frame[:, 1], freedom))
            parent = name
        return chained


def digit(
    name: str,
    base: Triple,
    knuckle: Triple,
    along: Triple,
    palmar: Triple,
    lengths: Sequence[float],
    curls: Sequence[float],
    radii: Sequence[float],
) -> Digit:
    """A digit whose bones leave the knuckle along `along`, each flexed by its curl (millimetres and degrees in)."""
    joints = [np.array(base) * MM, np.array(knuckle) * MM]
    frames = [bone_frame(joints[1] - joints[0], palmar)]
    frame = bone_frame(along, palmar)
    for length, curl in zip(lengths, curls, strict=True):
        c, s = np.cos(np.radians(curl)), np.sin(np.radians(curl))
        frame = frame @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        frames.append(frame)
        joints.append(joints[-1] + frame[:, 0] * length * MM)
    return Digit(name, np.array(joints), np.array(frames), np.array(radii) * MM)


def digit_flesh(d: Digit, knobbly: float = 1.0, nail: float = 1.0) -> Field:
    """Phalanges with knuckles on the back, pads on the palm side, a round tip, and a flat nail bed.

    knobbly: how far joints stand out against the waists between (1: a young hand). nail: 0 leaves the nail out.
    """
    joints, radii = d.joints[1:], d.radii
    core, thickness = [joints[0]], [radii[0]]
    flesh: list[Field] = []
    for k, (a, b) in enumerate(pairwise(joints)):
        frame, last = d.frames[k + 1], k == len(joints) - 2
        waist = 0.5 * (radii[k] + radii[k + 1]) * (1.0 - 0.05 * knobbly)
        core += [0.5 * (a + b), b]
        thickness += [waist, radii[k + 1]]
        length = float(np.linalg.norm(b - a))
        reach, deep = (0.64, 0.18) if last else (0.5, 0.15)
        pad = a + reach * (b - a) + frame[:, 1] * deep * waist
        flesh.append(
            ellipsoid(pad, [0.46 * length + (0.4 * radii[-1] if last else 0.0), 0.94 * waist, waist], frame)
        )
        if k > 0:
            flesh.append(ball(a - frame[:, 1] * 0.09 * knobbly * radii[k], (0.95 + 0.02 * knobbly) * radii[k]))
    body = union([chain(core, thickness), *flesh], 2.5 * MM)
    return without(body, _nail_bed(d, nail), 1.2 * MM) if nail > 0 else body


def _nail_bed(d: Digit, size: float) -> Field:
    """What is carved off the back of the last bone."""
    frame, tip, r = d.frames[-1], d.joints[-1], d.radii[-1]
    outwards = -frame[:, 1] + 0.12 * frame[:, 0]
    bed = tip - frame[:, 1] * (1.0 - 0.17 * size) * r
    return common(half_space(bed, -outwards), ball(tip + 0.05 * r * frame[:, 0], 1.7 * r))


def heat_sources(
    points: FloatArray, bones: Sequence[Bone], segments: Sequence[Segment]
) -> tuple[IntArray, FloatArray]:
    """The bone that warms each point, and its distance.

    The bone with the nearest flesh wins.
    Returns (n,) indices into bones, and (n,) distances to the bone's segment.
    """
    from_bone = np.empty((len(points), len(segments)))
    for k, (_, a, b, _) in enumerate(segments):
        along = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        from_bone[:, k] = np.linalg.norm(points - a - along[:, None] * (b - a), axis=1)
    nearest = (from_bone - np.array([segment[3] for segment in segments])).argmin(axis=1)
    index = {bone.name: i for i, bone in enumerate(bones)}
    owner = np.array([index[segment[0]] for segment in segments])[nearest]
    return owner, from_bone[np.arange(len(points)), nearest]


def digit_segments(d: Digit, palm_radius: float) -> list[Segment]:
    """The segments of a digit's bones for `heat_sources`; the tip belongs to the last bone."""
    thick = np.concatenate([[palm_radius], d.radii])
    reach = d.joints.copy()
    reach[-1] += d.frames[-1][:, 0] * d.radii[-1]
    return [
        (f"{d.name}_{part}", reach[k], reach[k + 1], 0.5 * (thick[k] + thick[k + 1]))
        for k, part in enumerate(d.parts[:-1])
    ]


def hand_rig(name: str, mesh: TriangleMesh, digits: Sequence[Digit], wrist: Segment, palm_radius: float) -> Rig:
    """A rig with a free wrist and `digits` on it, its skin bound by bone heat. wrist: the palm's own segment."""
    bones = [Bone("wrist", "", [0, 0, 0], [0, 1, 0], [0, 0, 1], root())]
    segments = [wrist]
    for d in digits:
        bones += d.bones("wrist")
        segments += digit_segments(d, palm_radius)
    weights = bone_heat_weights(mesh, *heat_sources(mesh.points, bones, segments), len(bones))
    return rig_of(name, bones, mesh, *strongest(weights, 4))


def finer_at_tips(digits: Sequence[Digit], lengths: tuple[float, float, float]) -> Sizing:
    """Edge lengths that grow from the fingertips over the palm to the wrist."""
    tips = np.array([d.joints[-1] for d in digits])  # (d, 3)
    longest = max(float(np.linalg.norm(d.joints[-1])) for d in digits)

    def sizing(points: FloatArray) -> FloatArray:
        away = np.linalg.norm(points[:, None, :] - tips, axis=2).min(axis=1)
        return np.interp(away, [0.06 * longest, 0.35 * longest, 0.8 * longest], lengths)

    return sizing
