"""What an artist does first, done once on a finger and a ball, so that every kernel is there. It needs no bpy."""

from __future__ import annotations

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.warm_up import warm_up
from contact_core.interaction.events import Pointer
from contact_core.interaction.interaction import Interaction
from contact_core.interaction.view import Perspective
from contact_core.rig.rig import JointFreedom, Rig
from contact_core.session import Session

VIEW = Perspective.looking_at((3.0, 0.0, -1.0), (3.0, -16.0, -1.0), (0.0, 0.0, 1.0), viewport=(800, 600))
_AROUND = 20


def revolved(along: FloatArray, radii: FloatArray) -> TriangleMesh:
    """A closed surface about x: rings at places (k,) with radii (k,), and a point at each end."""
    angle = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
    circle = np.stack([np.zeros(_AROUND), np.cos(angle), np.sin(angle)], axis=1)
    rings = radii[:, None, None] * circle + along[:, None, None] * np.array([1.0, 0.0, 0.0])
    caps = 0.5 * radii[[0, -1]] * [-1.0, 1.0] + along[[0, -1]]
    points = np.concatenate([rings.reshape(-1, 3), np.stack([caps, 0.0 * caps, 0.0 * caps], axis=1)])
    here, beside = np.arange(_AROUND), (np.arange(_AROUND) + 1) % _AROUND
    first, last, faces = len(points) - 2, len(points) - 1, []
    for ring in range(len(along) - 1):
        low, high = ring * _AROUND, (ring + 1) * _AROUND
        faces += [np.stack([low + here, high + beside, high + here], 1)]
        faces += [np.stack([low + here, low + beside, high + beside], 1)]
    top = (len(along) - 1) * _AROUND
    faces += [np.stack([np.full(_AROUND, first), beside, here], 1)]
    faces += [np.stack([np.full(_AROUND, last), top + here, top + beside], 1)]
    return TriangleMesh(points, np.concatenate(faces))


def finger() -> Rig:
    """Three joints along x, two units each, as thick as a finger is."""
    along = np.linspace(0.2, 5.8, 29)
    skin = revolved(along, 0.6 * np.sqrt(1.0 - np.clip(np.abs(along - 3.0) - 2.2, 0.0, None) ** 2 / 0.4))
    x = np.clip(skin.points[:, 0], 0.0, 6.0)
    joint = np.clip((x // 2.0).astype(int), 0, 2)
    own = np.where(joint > 0, np.clip(0.5 + (x - 2.0 * joint), 0.0, 1.0), 1.0)
    local = np.tile(np.eye(4), (3, 1, 1))
    local[1:, 0, 3] = 2.0
    bind = np.tile(np.eye(4), (3, 1, 1))
    bind[:, 0, 3] = [0.0, 2.0, 4.0]
    return Rig(
        "finger", ("base", "middle", "tip"), np.array([-1, 0, 1]), local, bind, skin.points, skin.faces,
        np.stack([joint, np.maximum(joint - 1, 0)], 1), np.stack([own, 1.0 - own], 1),
        tuple(JointFreedom("ball", translates=number == 0) for number in range(3)), up_axis="Z",
    )  # fmt: skip


def ball() -> TriangleMesh:
    """A ball of radius 1.5 about the origin."""
    angle = np.linspace(0.15, np.pi - 0.15, 19)
    return revolved(-1.5 * np.cos(angle), 1.5 * np.sin(angle))


def rehearse() -> None:
    """Paint, transfer with the hand following, move, and solve beside the window."""
    warm_up()
    session = Session()
    rig, there = finger(), np.eye(4)
    there[:3, 3] = 5.0, 0.0, -2.6
    session.surfaces.add("finger", rig.surface, rig=rig, meters_per_unit=1.0)
    session.surfaces.add("ball", ball(), meters_per_unit=1.0, world_from_surface=there)
    hands = Interaction(session)
    try:
        _drag(hands, "paint", (4.8, -0.6, -0.1), (5.1, -0.6, -0.1))
        _drag(hands, "transfer", (4.9, -1.4, -2.4), (5.3, -1.4, -2.4))
        hands.select(next(iter(reversed(list(session.document.patches)))))
        _drag(hands, "move", (4.9, -1.4, -2.4), (5.1, -1.4, -2.2))
        if session.document.pairs:
            hands.do("pose.solve")
            hands.worker.wait(120.0)
            hands.advance()
    finally:
        hands.close()


def _drag(hands: Interaction, tool: str, start: tuple[float, ...], end: tuple[float, ...]) -> None:
    hands.take_up(tool)
    pixels = [(float(x), float(y)) for x, y, _ in VIEW.project(np.linspace(start, end, 4))]
    hands.handle(Pointer("move", *pixels[0]), VIEW)
    hands.handle(Pointer("press", *pixels[0], "left"), VIEW)
    for x, y in pixels[1:]:
        hands.handle(Pointer("move", x, y), VIEW)
        hands.advance()
    hands.handle(Pointer("release", *pixels[-1], "left"), VIEW)
