"""Scissors: two fingers through one loop, the thumb through the other (genus 2).

Each pad goes to the inner rim of its loop, on the side where the blades meet. That is all an artist says; which way
the fingers thread through the holes follows from the pads and the hand's half-closed pose, and the palm goes where
it must.
"""

import numpy as np

import contact_core as contact
from contact_core.geometry.raycast import Locator
from contact_core.rig.poses import set_angles
from contact_gallery.looks import deepest, paint_pad, view
from contact_gallery.sheet import Sheet, timed

PAPER = "Figure 12b"
PADS = {  # pad: its bone, how far along it, from where in the loop (mm), and which way to its rim
    "index": ("index_intermediate", 0.5, (26, -52, 0), (-1, 0, 0)),
    "middle": ("middle_intermediate", 0.5, (28, -72, 0), (-1, 0, 0)),
    "thumb": ("thumb_distal", 0.35, (-25, -56, 0), (1, 0, 0)),
}


def draw(sheet: Sheet) -> None:
    with contact.new(hand="sample:human_hand", scissors="sample:scissors", plugins=sheet.plugins) as session:
        rig, scissors = session.rigs["hand"], Locator.of(session.geometry.mesh("scissors"))
        degrees = {"index_proximal.z": 50, "middle_proximal.z": 50, "ring_proximal.z": 65, "little_proximal.z": 65}
        degrees |= {f"{finger}_intermediate.z": 30 for finger in ("index", "middle", "ring", "little")}
        degrees |= {"thumb_metacarpal.x": -29, "thumb_metacarpal.y": -34, "thumb_metacarpal.z": 17}
        half_closed = set_angles(rig, contact.Pose.rest(rig), {dof: np.radians(a) for dof, a in degrees.items()})
        in_hand = np.array([[0, 1, 0, 0.09], [0, 0, -1, 0.12], [-1, 0, 0, 0.09], [0, 0, 0, 1]])
        with sheet.counting(session, "Hand in scissors"):
            session.surfaces.place("scissors", in_hand)
            session.surfaces.set_pose("hand", half_closed)
            for name, (bone, along, inside, way) in PADS.items():
                paint_pad(session, "hand", name, bone, along=along, radius=0.0055)
                rim = scissors.cast([np.array(inside) / 1000.0], [way]).points
                copy = session.patches.transfer(name, "scissors", rim, direction=(0, 0, -1))
                session.pairs.add(name, copy, name=name)
            before = view(
                session, camera_from=(0.9, -0.3, -0.6), see_through=["hand"], caption="(a) three pads, three rims"
            )
            proposal, spent = timed(lambda: session.solve(prior={"hand": half_closed}, terms=["penetration"]))
            session.accept(proposal)
        sides = {"(b) solved": (1.0, 0.3, 0.3), "(c)": (-0.6, -0.6, 0.6)}
        sheet.show(before, *(view(session, camera_from=side, caption=letter) for letter, side in sides.items()))
        met = proposal.after.patches
        sheet.measure("mean distance of contacts", f"{1000 * np.mean([one.mean for one in met.values()]):.1f} mm")
        sheet.measure(
            "deepest skin", f"{1000 * deepest(session, 'hand', 'scissors'):.1f} mm", "without intersections"
        )
        sheet.measure("solve", f"{spent:.2f} s")
