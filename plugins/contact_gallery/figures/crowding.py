"""Parts of a patch that land on one another, and are told.

A transfer keeps lengths and angles along a surface and knows nothing of what else lies there. A strip that is
longer than a pole is round runs over its own start when it sets out level: no triangle folds, every length is
right, and yet two parts of the hand are sent to one place. The transfer says so; a little rise, or transferring
part by part, is the cure.
"""

import numpy as np

import contact_core as contact
from contact_core.contact.crowding import crowded_points
from contact_core.geometry.raycast import Locator
from contact_core.testing import meshes
from contact_gallery.looks import view
from contact_gallery.sheet import Sheet

PAPER = "Section 8, not pictured"


def draw(sheet: Sheet) -> None:
    with contact.new(
        sheet=meshes.plane(40, 2.0), pole=meshes.cylinder(64, 80, 0.14, 1.6), plugins=sheet.plugins
    ) as session:
        flat, pole = (Locator.of(session.geometry.mesh(name)) for name in ("sheet", "pole"))
        ends = flat.closest([(0.3, 1.0, 0.0), (1.7, 1.0, 0.0)]).points
        with sheet.counting(session):
            session.patches.brush("disk", "strip", surface="sheet", at=ends, radius=0.09, spacing=0.025, axis=ends)
        pictures = [view(session, "sheet", camera_from=(0, -0.3, 1), up=(0, 1, 0), caption="(a) a strip")]
        here = session.geometry.points("strip").positions(session.geometry.mesh("sheet"))
        start = pole.closest([(0.14, 0.0, 0.5)]).points
        for caption, rise in (("(b) level", 0.0), ("(c) rising", 0.28)):
            with sheet.counting(session):
                copy = session.patches.transfer("strip", "pole", start, direction=(0, 1, rise), name=caption)
            there = session.geometry.points(copy).positions(session.geometry.mesh("pole"))
            told = crowded_points(here, there)
            heat = np.where(told[:, None], [[0.8, 0.07, 0.1]], [[0.95, 0.84, 0.35]])
            pictures.append(
                view(session, "pole", patches=[copy], heat={copy: heat}, camera_from=(1, 0.5, 0.35), up=(0, 0, 1),
                     caption=caption, focus=np.array([(-0.14, -0.14, 0.35), (0.14, 0.14, 1.1)]))
            )  # fmt: skip
            share = 100.0 * session.geometry.crowded([copy])[copy]
            folds = session.geometry.distortion("strip", copy).folds
            sheet.measure(
                f"{caption[4:]}: points on another part, folds",
                f"{share:.0f} %, {folds}",
                "keeping parts apart proved challenging",
            )
        sheet.show(*pictures)
