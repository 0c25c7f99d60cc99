"""A patch as geodesics from its axis, and its mirror image elsewhere.

Each painted point keeps one geodesic from its closest axis point: a length and an angle to the axis. The axis
itself is lengths and turning angles. Traced again on the ball, mirrored because the two surfaces will face each
other, they give the patch back, as long and as wide as the ball's curvature allows.
"""

from dataclasses import replace

import numpy as np

import contact_core as contact
from contact_core.geometry.raycast import Locator
from contact_core.testing import meshes
from contact_gallery.looks import spokes, view
from contact_gallery.sheet import Sheet

PAPER = "Figure 3"


def draw(sheet: Sheet) -> None:
    with contact.new(hand="sample:human_hand", ball=meshes.icosphere(5, 0.042), plugins=sheet.plugins) as session:
        rig, hand, ball = (
            session.rigs["hand"],
            session.geometry.mesh("hand"),
            Locator.of(session.geometry.mesh("ball")),
        )
        at = {name: rig.rest_world[rig.joint_index(name), :3, 3] for name in rig.joints}
        palm = [
            at["index_proximal"],
            at["ring_proximal"],
            0.55 * at["little_metacarpal"] + 0.45 * at["little_proximal"],
        ]
        with sheet.counting(session):
            over = np.array(palm) + np.array([0.0, -0.012, 0.02])
            session.patches.brush("disk", "palm", surface="hand", at=over, radius=0.011, spacing=0.0016)
            session.patches.set_axis("palm", Locator.of(hand).closest(over).points)
            root = ball.closest([(-0.025, 0.02, 0.05)]).points
            copy = session.patches.transfer("palm", "ball", root, direction=(1.0, -0.2, 0.0))
        lines = ((spokes(session, "palm", 3), (0.15, 0.2, 0.25)),), ((spokes(session, copy, 3), (0.15, 0.2, 0.25)),)
        here = view(session, "hand", camera_from=(0.1, 0.1, 1.0), caption="(a) parameterised on the palm")
        there = view(session, "ball", camera_from=(0.0, 0.3, 1.0), caption="(b) transferred, mirrored")
        near = session.geometry.points("palm").positions(hand)
        sheet.show(
            replace(here, lines=lines[0], focus=np.concatenate([near - 0.02, near + 0.02])),
            replace(there, lines=lines[1]),
            aspect=1.2,
        )
        found, home = session.geometry.distortion("palm", copy), session.geometry.root("palm")
        back = session.patches.transfer(copy, "hand", home.point(), heading=home.heading)
        lost = np.linalg.norm(session.geometry.points(back).positions(hand) - near, axis=1).max()
        sheet.measure("points, axis points", f"{len(near)}, {len(session.geometry.axis('palm'))}")
        sheet.measure("folds on the ball", f"{found.folds}", "approximately isometric")
        sheet.measure("largest change of length on the ball", f"{found.worst_length_ratio:.2f} times")
        sheet.measure("there and back, farthest point", f"{1e9 * lost:.2g} nm", "exact in the polyhedral sense")
