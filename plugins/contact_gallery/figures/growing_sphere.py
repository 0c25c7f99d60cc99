"""A grip that follows a sphere as it grows, over four keys.

The hand's contacts are one tree. At each key it is carried to the same point of a larger sphere, in the same
direction, and the pose is solved with that of the key before as its prior.
"""

from functools import partial

import numpy as np

import contact_core as contact
from contact_core.geometry.raycast import Locator
from contact_core.testing import meshes
from contact_gallery.looks import deepest, paint_pad, view
from contact_gallery.sheet import Sheet, timed

PAPER = "Figure 11"
RADII = {"r42": 0.042, "r50": 0.05, "r60": 0.06, "r74": 0.074}  # metres
TIPS = ("thumb_distal", "index_distal", "middle_distal", "ring_distal", "little_distal")


def draw(sheet: Sheet) -> None:
    with contact.new(hand="sample:human_hand", plugins=sheet.plugins) as session:
        for name, radius in RADII.items():
            session.surfaces.add(name, meshes.icosphere(4, radius))
        rig = session.rigs["hand"]
        knuckles = [rig.rest_world[rig.joint_index(f"{f}_proximal"), :3, 3] for f in ("index", "little")]
        near = np.array([(-0.1, -0.1, -0.15), (0.1, 0.1, 0.1)])
        pictures, prior = [], contact.Pose.rest(rig)
        with sheet.counting(session, "Six contacts, one tree"):
            over = np.array(knuckles) + np.array([0.0, -0.016, 0.02])
            session.patches.brush("disk", "palm", surface="hand", at=over, radius=0.009, spacing=0.0016)
            for tip in TIPS:
                paint_pad(session, "hand", tip, tip)
                session.patches.link(tip, "palm", parent_point=len(session.geometry.axis("palm")) // 2)
        for letter, (ball, radius) in zip("abcd", RADII.items(), strict=True):
            with sheet.counting(session, f"Sphere of {200 * radius:.1f} cm"):
                start = Locator.of(session.geometry.mesh(ball)).closest([(0.035, 0.0, -1.0)]).points
                copies = session.patches.transfer_tree("palm", ball, start, direction=(-1.0, 0.0, 0.0))
                pairs = [session.pairs.add(patch, copy) for patch, copy in copies.items()]
                proposal, spent = timed(
                    partial(session.solve, pairs=pairs, prior={"hand": prior}, terms=["penetration"])
                )
                session.accept(proposal)
            prior = proposal.poses["hand"]
            caption = f"({letter}) {200 * radius:.1f} cm"
            pictures.append(view(session, "hand", ball, caption=caption, camera_from=(1.0, 0.35, 0.5), focus=near))
            mean = 1000.0 * np.mean([pair.mean for pair in proposal.after.patches.values()])
            deep = 1000.0 * deepest(session, "hand", ball)
            told = f"contacts {mean:.1f} mm apart, skin {deep:.1f} mm deep, {spent:.2f} s"
            sheet.measure(f"sphere of {200 * radius:.1f} cm", told, "one key of four, in under 45 minutes")
        sheet.show(*pictures, aspect=0.85)
