"""Three pitches: knuckleball, two-seam fastball, curveball.

Four pads on the hand, four on the ball, painted once. From one pitch to the next only contacts on the ball move,
two translations and a rotation first, then three translations, and the pose is solved again from where it is.
"""

from functools import partial

import numpy as np

import contact_core as contact
from contact_core.geometry.raycast import Locator
from contact_core.rig.poses import set_angles
from contact_core.scene.picture import Picture
from contact_gallery.looks import deepest, paint_pad, view
from contact_gallery.sheet import Sheet, timed

PAPER = "Figure 9"
PADS = {  # pad: how far along the last bone, and where on the ball it starts: to the thumb, up, to the fingers
    "thumb_distal": (0.4, (0.25, -0.95, 0.2)),
    "index_distal": (0.75, (0.32, 0.85, -0.15)),
    "middle_distal": (0.75, (-0.2, 0.9, -0.15)),
    "ring_distal": (0.4, (-0.9, -0.25, 0.35)),
}
TRIES = 5  # of each solve, the quickest of which is told: a busy machine shows in the others
AHEAD = (0.0, 0.0, 1.0)  # the way the fingers point


def draw(sheet: Sheet) -> None:
    with contact.new(hand="sample:human_hand", ball="sample:baseball", plugins=sheet.plugins) as session:
        rig, ball = session.rigs["hand"], Locator.of(session.geometry.mesh("ball"))
        folded = {
            "ring_proximal.z": 40,
            "ring_intermediate.z": 60,
            "little_proximal.z": 50,
            "little_intermediate.z": 70,
        }
        bent = {"proximal.z": 25, "intermediate.z": 60, "distal.z": 25}
        knuckles = {f"{finger}_{bone}": a for finger in ("index", "middle") for bone, a in bent.items()}
        relaxed, curled = (
            set_angles(rig, contact.Pose.rest(rig), {dof: np.radians(a) for dof, a in degrees.items()})
            for degrees in (folded, folded | knuckles)
        )

        def on_ball(direction: tuple[float, float, float]) -> contact.SurfacePoints:
            return ball.closest([0.05 * np.array(direction)]).points

        def solved(caption: str) -> None:
            prior, spent = {"hand": curled if "knuckle" in caption else relaxed}, []
            for _ in range(TRIES):
                proposal, seconds = timed(partial(session.solve, prior=prior, terms=["penetration"]))
                spent.append(1000.0 * seconds)
            cost = f"solved in {min(spent):.0f} ms of a processor"
            session.accept(proposal)
            pictures.append(view(session, caption=caption, camera_from=(0.45, 0.8, 1.0), frame=["hand", "ball"]))
            mean = 1000.0 * np.mean([pair.mean for pair in proposal.after.patches.values()])
            deep = 1000.0 * deepest(session, "hand", "ball")
            sheet.measure(
                caption[4:], f"{mean:.1f} mm apart, {deep:.1f} mm deep, {cost}", claims[len(pictures) - 1]
            )

        pictures: list[Picture] = []
        claims = ("", "2 translations, 1 rotation", "3 translations")
        with sheet.counting(session, "Knuckleball"):
            for pad, (along, start) in PADS.items():
                paint_pad(session, "hand", pad, pad, along=along)
                copy = session.patches.transfer(pad, "ball", on_ball(start), name=f"{pad} there", direction=AHEAD)
                session.pairs.add(pad, copy, name=pad)
            solved("(a) knuckleball")
        with sheet.counting(session, "Two-seam fastball, from it"):
            session.patches.translate("index_distal there", on_ball((0.3, 0.85, 0.45)))
            session.patches.translate("middle_distal there", on_ball((-0.15, 0.9, 0.45)))
            session.patches.rotate("thumb_distal there", np.radians(20.0))
            solved("(b) two-seam fastball")
        with sheet.counting(session, "Curveball, from that"):
            session.patches.translate("index_distal there", on_ball((-0.05, 0.95, 0.4)))
            session.patches.translate("middle_distal there", on_ball((-0.45, 0.8, 0.45)))
            session.patches.translate("thumb_distal there", on_ball((0.7, -0.7, 0.0)))
            solved("(c) curveball")
        sheet.show(*pictures)
