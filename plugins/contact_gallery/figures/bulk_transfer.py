"""A hand's contacts carried onto a rabbit's head and back, in one go each.

Four finger pads and the thumb's hang on the palm: one geodesic each, from axis to axis. One click and one direction
carry the whole tree, and every pad lies down on what it meets: the crown and cheeks of the head, the flanks of the
body.
"""

import numpy as np

import contact_core as contact
from contact_core.geometry.raycast import Locator
from contact_gallery.looks import view
from contact_gallery.sheet import Sheet

PAPER = "Figure 10"
PADS = ("thumb_distal", "index_intermediate", "middle_intermediate", "ring_intermediate", "little_intermediate")


def draw(sheet: Sheet) -> None:
    with contact.new(hand="sample:human_hand", rabbit="sample:rabbit", plugins=sheet.plugins) as session:
        rig, rabbit = session.rigs["hand"], Locator.of(session.geometry.mesh("rabbit"))
        at = {name: rig.rest_world[rig.joint_index(name), :3, 3] for name in rig.joints}
        with sheet.counting(session):
            knuckles = np.array([at["index_proximal"], at["little_proximal"]]) + np.array([0.0, -0.017, 0.02])
            session.patches.brush("disk", "palm", surface="hand", at=knuckles, radius=0.010, spacing=0.0015)
            for name in PADS:
                session.patches.brush(
                    "disk", name, surface="hand", at=at[name] + [0.0, 0.009, 0.02], radius=0.006, spacing=0.0012
                )
                session.patches.link(name, "palm", parent_point=len(session.geometry.axis("palm")) // 2)
        pictures = [view(session, "hand", camera_from=(0.25, 0.1, 1.0), caption="(a) six contacts, one tree")]
        places = {"(b) onto the head": ((0.028, 0.178, -0.024), (0.0, 0.0, 1.0), (1.0, 0.1, -0.15)),
                  "(c) onto the back": ((-0.03, 0.12, 0.04), (0.0, 0.0, -1.0), (-0.9, 1.0, 0.5))}  # fmt: skip
        for caption, (where, direction, camera) in places.items():
            with sheet.counting(session) as log:
                copies = session.patches.transfer_tree(
                    "palm", "rabbit", rabbit.closest([where]).points, direction=direction
                )
            for source, copy in copies.items():
                session.patches.recolor(copy, session.document.patch(source).color)
            shown = list(copies.values())
            pictures.append(view(session, "rabbit", patches=shown, camera_from=camera, caption=caption))
            found = [session.geometry.distortion(source, copy) for source, copy in copies.items()]
            off = sum(int(session.geometry.reconstruction(copy).ran_off.sum()) for copy in shown)
            stretch = np.concatenate([one.length_ratio for one in found])
            sheet.measure(
                f"{caption[4:]}: folds, points off the surface",
                f"{sum(one.folds for one in found)}, {off}",
                "adapts well",
            )
            low, high = np.nanpercentile(stretch, [2.5, 97.5])
            sheet.measure(
                f"{caption[4:]}: change of length, 95 % of all points",
                f"{low:.2f} to {high:.2f}",
                "as isometric as possible",
            )
            sheet.measure(f"{caption[4:]}: operations", f"{log.summary()['operations']}", "a few mouse clicks")
        sheet.show(*pictures)
