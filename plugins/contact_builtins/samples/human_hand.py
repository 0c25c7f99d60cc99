"""A right human hand, 18 cm from wrist to middle fingertip, open and relaxed.

Rig space: fingers along +y, palm towards +z, thumb towards +x, wrist joint at the origin. Bone lengths and
widths follow the averages of hand anthropometry (Garrett 1971; Buryanov and Kotiuk 2010), rounded.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contact_builtins.samples.binding import bone_heat_weights, strongest
from contact_builtins.samples.fields import (
    Field,
    ball,
    chain,
    common,
    ellipsoid,
    half_space,
    round_cone,
    slab,
    union,
    without,
)
from contact_builtins.samples.modelling import surface_of
from contact_builtins.samples.skeleton import Bone, bone_frame, fixed, limits, rig_of, root
from contact_core.arrays import FloatArray, IntArray
from contact_core.document.asset import Asset
from contact_core.pose.rig import JointFreedom

MM = 1e-3
EDGE = 4.0 * MM


@dataclass(frozen=True, eq=False)
class Digit:
    """One digit: where its joints are and how thick it is there. Lengths in metres, angles in degrees.

    joints: (4, 3) metacarpal base, knuckle and the two further joints, then the centre of the tip's ball at [4].
    frames: (4, 3, 3) of metacarpal, proximal, middle and last bone. radii: (4,) at knuckle, joints, tip.
    """

    name: str
    joints: FloatArray
    frames: FloatArray
    radii: FloatArray


def digit(
    name: str,
    base: tuple[float, float, float],
    knuckle: tuple[float, float, float],
    along: tuple[float, float, float],
    palmar: tuple[float, float, float],
    lengths: tuple[float, ...],
    curls: tuple[float, ...],
    radii: tuple[float, ...],
) -> Digit:
    """A digit whose bones after the knuckle leave along `along`, each flexed by its curl (mm and degrees in)."""
    joints = [np.array(base) * MM, np.array(knuckle) * MM]
    frames = [bone_frame(joints[1] - joints[0], palmar)]
    frame = bone_frame(along, palmar)
    for length, curl in zip(lengths, curls, strict=True):
        turn = np.radians(curl)
        c, s = np.cos(turn), np.sin(turn)
        frame = frame @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        frames.append(frame)
        joints.append(joints[-1] + frame[:, 0] * length * MM)
    return Digit(name, np.array(joints), np.array(frames), np.array(radii) * MM)


FINGERS = (
    digit(
        "index",
        (14, 22, -2),
        (25, 85, -4),
        (0.10, 1, 0),
        (0.06, 0, 1),
        (41, 24, 17),
        (9, 12, 7),
        (9.6, 8.4, 7.4, 6.3),
    ),
    digit(
        "middle",
        (3, 24, -4),
        (3, 88, -7),
        (0.0, 1, 0),
        (0.0, 0, 1),
        (45, 28, 18),
        (10, 14, 8),
        (9.9, 8.6, 7.6, 6.4),
    ),
    digit(
        "ring",
        (-8, 22, -3),
        (-18, 82, -5),
        (-0.09, 1, 0),
        (-0.08, 0, 1),
        (42, 26, 18),
        (12, 16, 9),
        (9.3, 8.1, 7.2, 6.1),
    ),
    digit(
        "little",
        (-18, 19, 0),
        (-36, 72, 0),
        (-0.24, 1, 0),
        (-0.2, 0, 1),
        (33, 19, 16),
        (12, 16, 10),
        (8.3, 7.1, 6.3, 5.4),
    ),
)
THUMB = digit(
    "thumb", (19, 16, 8), (46, 48, 22), (0.50, 0.85, 0.20), (-0.62, 0.10, 0.72), (33, 24), (4, 8), (10.6, 9.4, 7.4)
)


# Limits of the joints in degrees: twist, spread, flexion from and to.
THUMB_PARTS = ("metacarpal", "proximal", "distal", "tip")
THUMB_FREEDOMS = (limits(35, 45, -30, 50), limits(8, 8, -10, 70), limits(5, 2, -15, 85), fixed())
FINGER_PARTS = ("metacarpal", "proximal", "intermediate", "distal", "tip")
FINGER_FREEDOMS = (fixed(), limits(8, 20, -15, 95), limits(4, 2, -5, 105), limits(4, 2, -8, 80), fixed())


def finger_flesh(d: Digit) -> Field:
    """Phalanges with dorsal knuckles, palmar pads, a round fingertip and a flattened nail."""
    joints, radii = d.joints[1:], d.radii
    parts: list[Field] = []
    for k in range(len(joints) - 1):
        a, b, frame = joints[k], joints[k + 1], d.frames[k + 1]
        ra, rb = radii[k], radii[k + 1]
        palmar, length = frame[:, 1], float(np.linalg.norm(b - a))
        waist = 0.5 * (ra + rb) * 0.95
        parts.append(chain([a, 0.5 * (a + b), b], [ra, waist, rb], 0.0))
        last = k == len(joints) - 2
        # the pad: soft flesh on the palm side between the creases
        reach = 0.62 if last else 0.5
        pad = a + reach * (b - a) + palmar * (0.30 if last else 0.26) * waist
        parts.append(
            ellipsoid(pad, [0.42 * length + (0.35 * rb if last else 0.0), 0.86 * waist, 0.92 * waist], frame)
        )
        if k > 0:  # knuckles stand out on the back
            parts.append(ball(a - palmar * 0.16 * ra, 0.97 * ra))
    flesh = union(parts, 2.5 * MM)
    # the nail bed: the back of the last bone is flat
    frame, tip, r = d.frames[-1], joints[-1], radii[-1]
    bed = tip - frame[:, 1] * 0.80 * r
    tilt = -frame[:, 1] + 0.10 * frame[:, 0]
    nail = common(half_space(bed, -tilt), ball(tip + 0.05 * r * frame[:, 0], 1.9 * r))
    return without(flesh, nail, 1.2 * MM)


def palm_flesh() -> Field:
    """Metacarpals under a common skin, the balls of thumb and little finger, the hollow between, the webs."""
    index, middle, ring, little = FINGERS
    body = union([round_cone(d.joints[0], d.joints[1], 12.5 * MM, 1.08 * d.radii[0]) for d in FINGERS], 9 * MM)
    for one, two in ((index, middle), (middle, ring), (ring, little)):
        ends = [d.joints[1] + 0.36 * (d.joints[2] - d.joints[1]) + 1.5 * MM * d.frames[1][:, 1] for d in (one, two)]
        body = union([body, slab(ends[0], ends[1], 0.5 * (one.joints[1] + two.joints[1]), 7.0 * MM)], 5 * MM)
    cmc, mcp = THUMB.joints[0], THUMB.joints[1]
    thenar = chain(
        [cmc + np.array([-4, -4, 2]) * MM, 0.5 * (cmc + mcp) + np.array([-4, 1, 3]) * MM, mcp],
        [13 * MM, 14.5 * MM, 11.2 * MM],
        4 * MM,
    )
    web = slab(
        cmc + np.array([0, 8, -3]) * MM,
        mcp + np.array([-2, -4, -4]) * MM,
        index.joints[1] + np.array([-4, -18, 2]) * MM,
        6.5 * MM,
    )
    hypothenar = chain(
        [np.array([-20, 10, 6]) * MM, np.array([-29, 36, 6]) * MM, np.array([-35, 62, 4]) * MM],
        [12 * MM, 13 * MM, 10 * MM],
        4 * MM,
    )
    mounts = round_cone(np.array([25, 76, 3]) * MM, np.array([-33, 66, 4]) * MM, 8.0 * MM, 7.0 * MM)
    body = union([body, thenar, hypothenar, web, mounts], 8 * MM)
    body = union(
        [body, *(ball(d.joints[1] - d.frames[1][:, 1] * 2.4 * MM, 0.93 * d.radii[0]) for d in FINGERS)], 4 * MM
    )
    forearm = union(
        [
            round_cone(np.array([10, 14, 0]) * MM, np.array([10, -40, 0]) * MM, 18 * MM, 17.5 * MM),
            round_cone(np.array([-10, 14, 0]) * MM, np.array([-11, -40, 0]) * MM, 17 * MM, 16.5 * MM),
        ],
        8 * MM,
    )
    body = union([body, forearm], 14 * MM)
    return common(body, half_space(np.array([0, -26, 0]) * MM, [0, -1, 0]), 6 * MM)


def bones() -> list[Bone]:
    """25 joints, in the order and with the names of WebXR hands."""
    out = [Bone("wrist", "", [0, 0, 0], [0, 1, 0], [0, 0, 1], root())]
    _add(out, THUMB, THUMB_PARTS, THUMB_FREEDOMS)
    for d in FINGERS:
        _add(out, d, FINGER_PARTS, FINGER_FREEDOMS)
    return out


def _add(out: list[Bone], d: Digit, parts: tuple[str, ...], freedoms: tuple[JointFreedom, ...]) -> None:
    parent = "wrist"
    for k, (part, freedom) in enumerate(zip(parts, freedoms, strict=True)):
        frame = d.frames[min(k, len(d.frames) - 1)]
        name = f"{d.name}_{part}"
        out.append(Bone(name, parent, d.joints[k], frame[:, 0], frame[:, 1], freedom))
        parent = name


def build() -> Asset:
    digits = (THUMB, *FINGERS)
    flesh = union([finger_flesh(d) for d in digits], 1.5 * MM)
    body = union([palm_flesh(), flesh], 5 * MM)
    mesh = surface_of(body, np.array([-75, -30, -30]) * MM, np.array([90, 195, 60]) * MM, EDGE)
    skeleton = bones()
    names = [b.name for b in skeleton]
    owner, distance = heating(mesh.points, digits, names)
    weights = bone_heat_weights(mesh, owner, distance, len(skeleton))
    rig = rig_of("human_hand", skeleton, mesh, *strongest(weights, 4))
    return Asset(name="human_hand", mesh=rig.surface, rig=rig, meters_per_unit=1.0, up_axis="Y")


def heating(points: FloatArray, digits: tuple[Digit, ...], names: list[str]) -> tuple[IntArray, FloatArray]:
    """The bone that each vertex belongs to, and the distance to it."""
    segments = [("wrist", np.array([0, -40, 0]) * MM, np.array([0, 12, 0]) * MM, 17 * MM)]
    for d in digits:
        parts = (
            ("metacarpal", "proximal", "distal")
            if d.name == "thumb"
            else ("metacarpal", "proximal", "intermediate", "distal")
        )
        r = np.concatenate([[12 * MM], d.radii])
        segments += [
            (f"{d.name}_{p}", d.joints[k], d.joints[k + 1], 0.5 * (r[k] + r[k + 1])) for k, p in enumerate(parts)
        ]
    far = np.empty((len(points), len(segments)))
    near = np.empty((len(points), len(segments)))
    for k, (_, a, b, radius) in enumerate(segments):
        t = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        near[:, k] = np.linalg.norm(points - a - t[:, None] * (b - a), axis=1)
        far[:, k] = near[:, k] - radius
    best = far.argmin(axis=1)
    return np.array([names.index(s[0]) for s in segments])[best], near[np.arange(len(points)), best]
