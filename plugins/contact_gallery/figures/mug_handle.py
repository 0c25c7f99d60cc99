"""Fingers curled round the handle of a mug (genus 1).

Pads of three fingers go to the inner side of the handle, between it and the wall, and to its outer side; the thumb
lies on top. The fingers curl through the hole because that is where their pads are wanted.
"""

import numpy as np

import contact_core as contact
from contact_core.geometry.raycast import Locator
from contact_core.rig.poses import set_angles
from contact_gallery.looks import deepest, paint_pad, view
from contact_gallery.sheet import Sheet, timed

Vector = tuple[float, float, float]
PAPER = "Figure 12a"
FINGERS = {"index": 68, "middle": 50, "ring": 32}  # heights on the handle, mm


def draw(sheet: Sheet) -> None:
    with contact.new(hand="sample:human_hand", mug="sample:mug", plugins=sheet.plugins) as session:
        rig, mug = session.rigs["hand"], Locator.of(session.geometry.mesh("mug"))
        degrees = {f"{finger}_{bone}.z": angle for finger in (*FINGERS, "little")
                   for bone, angle in (("proximal", 65), ("intermediate", 90), ("distal", 40))}  # fmt: skip
        degrees |= {"thumb_metacarpal.x": -15, "thumb_metacarpal.z": 10, "thumb_distal.z": 20}
        curled = set_angles(rig, contact.Pose.rest(rig), {dof: np.radians(a) for dof, a in degrees.items()})
        in_hand = np.array([[0, 1, 0, -0.04], [0, 0, -1, 0.085], [-1, 0, 0, 0.101], [0, 0, 0, 1]])

        def on_handle(
            name: str, bone: str, start: Vector, way: Vector, direction: Vector, radius: float = 0.0055
        ) -> None:
            paint_pad(session, "hand", name, bone, radius=radius)
            there = mug.cast([np.array(start) / 1000.0], [way]).points
            session.pairs.add(name, session.patches.transfer(name, "mug", there, direction=direction), name=name)

        with sheet.counting(session, "Hand on a mug's handle"):
            session.surfaces.place("mug", in_hand)
            session.surfaces.set_pose("hand", curled)
            for finger, height in FINGERS.items():
                on_handle(
                    f"{finger} inside", f"{finger}_intermediate", (54, height, 0), (1.0, 0, -0.2), (-0.6, 0, 1.0)
                )
                on_handle(f"{finger} outside", f"{finger}_proximal", (70, height, -60), (0, 0, 1), (-1, 0, 0))
            on_handle("thumb", "thumb_distal", (62, 130, 0), (0, -1, 0), (-1, 0, 0))
            before = view(
                session, "mug", camera_from=(0.2, 0.7, -0.9), up=(1, 0, 0), caption="(a) contacts, inside too"
            )
            proposal, spent = timed(lambda: session.solve(prior={"hand": curled}, terms=["penetration"]))
            session.accept(proposal)
        sides = {"(b) fingers through": (0.3, 0.8, -0.45), "(c)": (0.25, -1.0, -0.35)}
        sheet.show(
            before,
            *(view(session, camera_from=side, up=(1, 0, 0), caption=letter) for letter, side in sides.items()),
        )
        met = proposal.after.patches
        sheet.measure("mean distance of contacts", f"{1000 * np.mean([one.mean for one in met.values()]):.1f} mm")
        sheet.measure("deepest skin", f"{1000 * deepest(session, 'hand', 'mug'):.1f} mm", "without intersections")
        sheet.measure("solve", f"{spent:.2f} s")
