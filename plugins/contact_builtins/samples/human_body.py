"""A full human body, 1.76 m, standing relaxed with its arms a little out; it can sit.

Rig space: metres, y up, looking along +z, its left side at +x, feet on y = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from contact_builtins.samples.binding import bone_heat_weights, strongest
from contact_builtins.samples.digits import Segment, heat_sources
from contact_builtins.samples.fields import Field, ball, chain, ellipsoid, round_cone, slab, union
from contact_builtins.samples.modelling import surface_of
from contact_builtins.samples.skeleton import Bone, limits, rig_of, root
from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset
from contact_core.rig.rig import JointFreedom


@dataclass(frozen=True)
class Link:
    """One joint of the centre or of the left side: parent, position, where its bone ends, palm side of its frame,
    freedom, and how thick the flesh on it is. Names of the left side end in "_l"; the right side is its mirror."""

    name: str
    parent: str
    at: tuple[float, float, float]
    to: tuple[float, float, float]
    palmar: tuple[float, float, float]
    freedom: JointFreedom
    thick: float


HIP, KNEE, ANKLE, BALL, TOE = (
    (0.092, 0.925, 0.0),
    (0.105, 0.495, 0.008),
    (0.115, 0.085, -0.02),
    (0.128, 0.028, 0.11),
    (0.13, 0.024, 0.185),
)
SHOULDER, ELBOW, WRIST = (0.178, 1.425, -0.015), (0.335, 1.185, -0.03), (0.475, 0.97, 0.02)
KNUCKLES, FINGERTIPS = (0.530, 0.885, 0.05), (0.578, 0.79, 0.082)
THUMB, THUMB_END = (0.478, 0.935, 0.048), (0.500, 0.852, 0.108)

# Frames: x along the bone, y to the side that closes, z = x cross y the flexion axis. Degrees are anatomical
# averages: twist, spread, flexion.
LINKS = (
    Link("hips", "", (0, 0.95, 0), (0, 1.06, 0), (0, 0, 1), root(), 0.12),
    Link("spine_1", "hips", (0, 1.06, 0), (0, 1.18, -0.005), (0, 0, 1), limits(15, 15, -15, 30), 0.12),
    Link("spine_2", "spine_1", (0, 1.18, -0.005), (0, 1.31, -0.02), (0, 0, 1), limits(15, 15, -15, 30), 0.12),
    Link("chest", "spine_2", (0, 1.31, -0.02), (0, 1.47, -0.03), (0, 0, 1), limits(15, 15, -15, 25), 0.12),
    Link("neck", "chest", (0, 1.47, -0.03), (0, 1.565, -0.005), (0, 0, 1), limits(40, 30, -35, 35), 0.12),
    Link("head", "neck", (0, 1.565, -0.005), (0, 1.74, 0.005), (0, 0, 1), limits(40, 20, -30, 30), 0.12),
    Link("clavicle_l", "chest", (0.025, 1.44, -0.005), SHOULDER, (0, 0, 1), limits(10, 25, -15, 25), 0.05),
    Link("upperarm_l", "clavicle_l", SHOULDER, ELBOW, (0.1, 0, 1), limits(90, 90, -60, 150), 0.05),
    Link("lowerarm_l", "upperarm_l", ELBOW, WRIST, (-0.35, 0, 1), limits(85, 5, -2, 150), 0.04),
    Link("hand_l", "lowerarm_l", WRIST, KNUCKLES, (-1, -0.5, 0.3), limits(10, 25, -70, 80), 0.03),
    Link("fingers_l", "hand_l", KNUCKLES, FINGERTIPS, (-1, -0.5, 0.3), limits(5, 10, -15, 95), 0.02),
    Link("thumb_l", "hand_l", THUMB, THUMB_END, (-0.8, -0.5, -0.4), limits(20, 40, -25, 60), 0.018),
    Link("thigh_l", "hips", HIP, KNEE, (0, 0, 1), limits(40, 50, -30, 125), 0.08),
    Link("calf_l", "thigh_l", KNEE, ANKLE, (0, 0, -1), limits(15, 3, -2, 150), 0.055),
    Link("foot_l", "calf_l", ANKLE, BALL, (0, 1, 0.4), limits(20, 25, -50, 30), 0.04),
    Link("toes_l", "foot_l", BALL, TOE, (0, 1, 0), limits(3, 5, -30, 60), 0.025),
)  # fmt: skip


def build() -> Asset:
    """The body as a rig of 26 joints."""
    flesh = mirrored_field(union([_torso(), _head()], 0.03), [_arm(), _leg()], 0.035)
    mesh = surface_of(flesh, [-0.66, -0.02, -0.22], [0.66, 1.80, 0.26], 0.0135, edge_length)
    links = [*LINKS, *(_mirrored(link) for link in LINKS if link.name.endswith("_l"))]
    bones = [Bone(k.name, k.parent, k.at, np.subtract(k.to, k.at), k.palmar, k.freedom) for k in links]
    segments: list[Segment] = [(k.name, np.array(k.at), np.array(k.to), k.thick) for k in links]
    owner, distance = heat_sources(mesh.points, bones, segments)
    # the trunk is thick: heat as far as its bones are from the skin would smear arms over the belly
    weights = bone_heat_weights(mesh, owner, np.minimum(distance, 0.05), len(bones))
    rig = rig_of("human_body", bones, mesh, *strongest(weights, 8))
    return Asset(name=rig.name, mesh=rig.surface, rig=rig, meters_per_unit=1.0, up_axis="Y")


def edge_length(points: FloatArray) -> FloatArray:
    """(n,) finer at hands, face and feet."""
    hand = np.linalg.norm(np.abs(points) * [1, 1, 1] - KNUCKLES, axis=1)
    rest = np.minimum(np.abs(points[:, 1] - 1.66), np.abs(points[:, 1] - 0.03))
    return np.interp(np.minimum(hand, rest), [0.06, 0.25], [0.0125, 0.024])


def _mirrored(link: Link) -> Link:
    """The same joint on the right side; its frame keeps its flexion axis, so that the same angles mirror."""

    def across(v: tuple[float, float, float]) -> tuple[float, float, float]:
        return (-v[0], v[1], v[2])

    def right(name: str) -> str:
        return name[:-2] + "_r" if name.endswith("_l") else name

    return Link(
        right(link.name),
        right(link.parent),
        across(link.at),
        across(link.to),
        across(link.palmar),
        link.freedom,
        link.thick,
    )


def mirrored_field(centre: Field, sides: list[Field], blend: float) -> Field:
    """The centre with the sides at +x and, mirrored, at -x."""
    whole = union([centre, *sides], blend)

    def field(p: FloatArray) -> FloatArray:
        return whole(np.abs(p) * [1, 0, 0] + p * [0, 1, 1])

    return field


def by(point: Any, x: float, y: float, z: float) -> FloatArray:
    """A point moved by (x, y, z)."""
    return np.asarray(point) + np.array([x, y, z])


def _torso() -> Field:
    """Pelvis, belly, rib cage, chest, shoulders, seat."""
    pelvis = ellipsoid([0, 0.955, -0.005], [0.165, 0.115, 0.105])
    seat = ellipsoid([0.075, 0.925, -0.065], [0.085, 0.095, 0.075])
    waist = ellipsoid([0, 1.10, 0.0], [0.135, 0.15, 0.095])
    ribs = ellipsoid([0, 1.285, -0.015], [0.158, 0.20, 0.112])
    breast = ellipsoid([0.07, 1.335, 0.055], [0.085, 0.07, 0.05])
    back = ellipsoid([0.075, 1.35, -0.075], [0.085, 0.11, 0.05])
    shoulders = round_cone([0, 1.445, -0.025], [0.165, 1.43, -0.02], 0.055, 0.052)
    slope = round_cone([0, 1.52, -0.03], [0.13, 1.445, -0.025], 0.05, 0.04)
    return union([pelvis, seat, waist, ribs, breast, back, shoulders, slope], 0.05)


def _head() -> Field:
    """Neck, skull, jaw, nose, brow, ears."""
    neck = round_cone([0, 1.45, -0.03], [0, 1.60, -0.005], 0.062, 0.055)
    skull = ellipsoid([0, 1.675, -0.008], [0.074, 0.092, 0.094])
    jaw = chain([[0.035, 1.625, 0.03], [0, 1.592, 0.072]], [0.038, 0.026])
    face = ellipsoid([0, 1.64, 0.045], [0.055, 0.07, 0.05])
    nose = round_cone([0, 1.672, 0.088], [0, 1.642, 0.106], 0.009, 0.0125)
    brow = round_cone([0, 1.69, 0.078], [0.034, 1.692, 0.068], 0.014, 0.012)
    ear = ellipsoid([0.076, 1.655, -0.012], [0.011, 0.031, 0.018])
    return union([union([neck, skull, jaw, face, brow], 0.022), nose, ear], 0.01)


def _arm() -> Field:
    """Deltoid, upper arm, forearm, hand with four joined fingers and a thumb."""
    shoulder, elbow, wrist = (np.array(v) for v in (SHOULDER, ELBOW, WRIST))
    deltoid = ball(by(shoulder, 0.012, -0.02, 0), 0.058)
    upper = chain([shoulder, shoulder + 0.45 * (elbow - shoulder), elbow], [0.052, 0.05, 0.039])
    fore = chain([elbow, elbow + 0.25 * (wrist - elbow), wrist], [0.039, 0.043, 0.0265])
    return union([union([deltoid, upper, fore], 0.03), _mitten()], 0.02)


def _mitten() -> Field:
    """Palm and fingers: flat, the fingers held together and marked by shallow grooves, the thumb apart."""
    wrist, knuckles, tips = (np.array(v) for v in (WRIST, KNUCKLES, FINGERTIPS))
    across = np.cross(knuckles - wrist, [-1, -0.5, 0.3])
    across /= np.linalg.norm(across)  # towards the little finger or the thumb, in the palm's plane
    palm = [slab(wrist, knuckles + 0.03 * across, knuckles - 0.03 * across, 0.0165)]
    fingers = []
    for place, reach in ((0.034, 0.86), (0.0115, 0.98), (-0.0115, 1.0), (-0.034, 0.80)):
        start = knuckles + place * across
        middle = knuckles + 0.5 * (tips - knuckles) + 0.94 * place * across
        end = knuckles + reach * (tips - knuckles) + 0.82 * place * across
        fingers.append(chain([start, middle, end], [0.0148, 0.0135, 0.0115]))
    thumb = chain(
        [wrist + 0.3 * (np.array(THUMB) - wrist), np.array(THUMB), np.array(THUMB_END)], [0.018, 0.0175, 0.0125]
    )
    return union([union([*palm, union(fingers, 0.006)], 0.015), thumb], 0.014)


def _leg() -> Field:
    """Thigh, knee, calf, ankle, foot."""
    hip, knee, ankle = (np.array(v) for v in (HIP, KNEE, ANKLE))
    thigh = chain(
        [by(hip, 0.004, -0.02, 0), 0.55 * hip + 0.45 * knee + by(np.zeros(3), 0, 0, 0.012), knee],
        [0.092, 0.077, 0.053],
    )
    patella = ball(by(knee, 0, 0.005, 0.018), 0.042)
    shin = chain([knee, 0.5 * (knee + ankle), ankle], [0.05, 0.044, 0.033])
    calf = ellipsoid(by(knee, 0.002, -0.13, -0.032), [0.044, 0.115, 0.043])
    heel = ball(by(ankle, 0, -0.047, -0.028), 0.037)
    instep = chain([by(ankle, 0, -0.008, 0.01), by(BALL, 0, 0.012, 0)], [0.037, 0.03])
    sole = slab(
        by(ankle, 0, -0.058, -0.03),
        by(BALL, 0.028, -0.001, 0),
        by(BALL, -0.03, -0.001, 0.005),
        0.026,
    )
    outer, inner = (
        slab(by(BALL, 0.026, -0.003, 0), by(BALL, -0.03, -0.003, 0), by(TOE, x, -0.002, z), 0.0215)
        for x, z in _TOES
    )
    foot = union([heel, instep, sole, outer, inner], 0.02)
    return union([union([thigh, patella, shin, calf], 0.035), foot], 0.025)


_TOES = ((-0.024, 0.006), (0.016, -0.02))  # where big and little toe end, from the middle of the toes
