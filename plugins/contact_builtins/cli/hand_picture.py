"""The picture of a hand's description: palm arrow, digits in colours, pads with their axes, flexion arrows."""

from __future__ import annotations

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset
from contact_core.hands.description import Digit, HandDescription, Pad
from contact_core.rig.rig import Rig
from contact_core.scene.picture import Picture, PictureMesh

COLORS = ((0.86, 0.24, 0.20), (0.95, 0.60, 0.10), (0.20, 0.62, 0.30), (0.15, 0.45, 0.85), (0.58, 0.30, 0.75))
SKIN, PALM, INK, CURL = (0.86, 0.80, 0.74), (0.05, 0.55, 0.60), (0.10, 0.10, 0.12), (0.75, 0.05, 0.45)
FLEXED = np.radians(35.0)  # how far a flexion arrow turns
SEEN_THROUGH = 0.55

Line = tuple[FloatArray, tuple[float, float, float]]


def pictures_of_hand(asset: Asset, hand: HandDescription) -> list[Picture]:
    """The hand seen from its palm and from its thumb's side."""
    rig = asset.rig
    assert rig is not None
    across = np.cross(hand.palm.fingers, hand.palm.normal)
    if not hand.palm.is_plane:
        across = np.cross(hand.palm.normal, np.eye(3)[int(np.abs(hand.palm.normal).argmin())])
    if hand.thumb is not None:
        across = across * (1.0 if across @ (hand.thumb.tip - hand.palm.point) >= 0 else -1.0)
    views = (
        ("from the palm", hand.palm.normal + 0.15 * across, hand.palm.fingers),
        ("from the side", across + 0.25 * hand.palm.normal, hand.palm.fingers),
    )
    return [_picture(rig, hand, caption, eye, up) for caption, eye, up in views]


def hand_pictures(asset: Asset) -> list[Picture]:
    """The pictures of a rig's most hand-like hand. Raises InvalidInput where it has none."""
    from contact_builtins.formats.inspection import hands_of
    from contact_core.hands.describe import describe_hand

    hands = hands_of(asset)
    return pictures_of_hand(asset, hands[0] if hands or asset.rig is None else describe_hand(asset.rig))


def _picture(rig: Rig, hand: HandDescription, caption: str, eye: FloatArray, up: FloatArray) -> Picture:
    position = rig.rest_world[:, :3, 3]
    joints = [joint for digit in hand.digits for joint in digit.joints]
    corners = np.concatenate([position[[hand.hub, *joints]], [d.tip for d in hand.digits], hand.palm.point[None]])
    size = float(np.linalg.norm(np.ptp(corners, axis=0)))
    margin = 0.12 * size * np.concatenate([np.eye(3), -np.eye(3)])
    lines: list[Line] = []
    points: list[Line] = []
    legend = []
    for place, digit in enumerate(hand.digits):
        color = COLORS[place % len(COLORS)]
        legend.append((digit.role, color))
        chain = np.array([*(position[bone.joint] for bone in digit.bones), digit.tip])
        lines.append((np.stack([chain[:-1], chain[1:]], axis=1), color))
        points.append((chain[:-1], color))
        lines.append((_flexion_arrows(rig, digit), CURL))
    for pad in hand.pads:
        lines += _pad_lines(rig, pad)
    lines.append((_arrow(hand.palm.point, 0.35 * size * hand.palm.normal, hand.palm.fingers), PALM))
    lines.append((_arrow(hand.palm.point, 0.25 * size * hand.palm.fingers, hand.palm.normal), PALM))
    side = hand.side or ("claw" if not hand.palm.is_plane else "side unknown")
    return Picture(
        meshes=(PictureMesh(rig.surface, SKIN, SEEN_THROUGH),),
        points=tuple(points),
        lines=tuple(lines),
        camera_from=tuple(eye.tolist()),
        up=tuple(up.tolist()),
        caption=f"{rig.joints[hand.hub]}: {side}, {caption}",
        focus=(corners[:, None] + margin).reshape(-1, 3),
        legend=(("palm: normal, fingers", PALM), ("flexion", CURL), *legend),
    )


def _flexion_arrows(rig: Rig, digit: Digit) -> FloatArray:
    """(k, 2, 3) arcs along which the end of each bone goes when its joint flexes."""
    ends = [rig.rest_world[bone.joint, :3, 3] for bone in digit.bones[1:]] + [digit.tip]
    arcs = []
    for bone, end in zip(digit.bones, ends, strict=True):
        if not bone.flexes:
            continue
        world = rig.rest_world[bone.joint]
        x, y = ((world[:3, :3] @ bone.frame)[:, k] for k in (0, 1))
        radius = float(np.linalg.norm(end - world[:3, 3]))
        angle = np.linspace(0.0, FLEXED, 7)[:, None]
        arc = world[:3, 3] + 0.9 * radius * (np.cos(angle) * x + np.sin(angle) * y)
        head = _arrow(arc[-2], arc[-1] - arc[-2], x, head=0.12 * radius)
        arcs.append(np.concatenate([np.stack([arc[:-1], arc[1:]], axis=1), head]))
    return np.concatenate(arcs) if arcs else np.zeros((0, 2, 3))


def _pad_lines(rig: Rig, pad: Pad) -> list[Line]:
    """A pad's rim, and its axis with an arrow head."""
    centre = pad.centre.positions(rig.surface)[0]
    start, end = pad.axis.positions(rig.surface)
    along = (end - start) / max(float(np.linalg.norm(end - start)), 1e-12)
    lift = 0.06 * pad.radius * pad.normal
    beside = np.cross(pad.normal, along)
    angle = np.linspace(0.0, 2.0 * np.pi, 25)[:, None]
    rim = centre + lift + pad.radius * (np.cos(angle) * along + np.sin(angle) * beside)
    axis = np.array([[start + lift, centre + lift], [centre + lift, end + lift]])
    head = _arrow(centre + lift, end - centre, beside)
    return [(np.stack([rim[:-1], rim[1:]], axis=1), INK), (np.concatenate([axis, head]), INK)]


def _arrow(start: FloatArray, along: FloatArray, beside: FloatArray, head: float | None = None) -> FloatArray:
    """(3, 2, 3) a line and the two barbs of its head, spread towards `beside`."""
    end = start + along
    length = float(np.linalg.norm(along))
    size = 0.25 * length if head is None else head
    back = size * along / max(length, 1e-12)
    barbs = [np.stack([end, end - back + s * 0.5 * size * beside]) for s in (1.0, -1.0)]
    return np.stack([np.stack([start, end]), *barbs])
