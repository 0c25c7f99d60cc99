"""Paint a contact on a tube, give it to a pole, turn it so that it winds round, and go back. No files needed."""

import numpy as np

from contact_core.contact.brush import BrushGesture
from contact_core.geometry.raycast import Locator
from contact_core.session import Session
from contact_core.testing import meshes

finger = meshes.cylinder(around=32, along=40, radius=0.5, height=4.0)
pole = meshes.cylinder(around=48, along=80, radius=0.8, height=12.0)

with Session() as session:
    session.surfaces.add("finger", finger)
    session.surfaces.add("pole", pole)

    # A stroke along the finger's side, painted by the disk brush: even points, whatever the mesh's density.
    stroke = Locator.of(finger).closest([(0.5, 0.0, z) for z in np.linspace(0.8, 3.2, 7)]).points
    gesture = BrushGesture(finger, stroke, radius=0.25, spacing=0.08)
    session.patches.brush("disk", "pad", gesture, surface="finger", axis=stroke)

    # The same contact on the pole, first along it and then turned, so that it winds round like a helix.
    root = Locator.of(pole).closest([(0.8, 0.0, 5.0)]).points
    on_pole = session.patches.transfer("pad", "pole", root, direction=(0.0, 0.0, 1.0))
    heights = [np.ptp(session.geometry.points(on_pole).positions(pole)[:, 2])]
    session.patches.rotate(on_pole, np.radians(60.0))
    heights.append(np.ptp(session.geometry.points(on_pole).positions(pole)[:, 2]))
    print(f"{len(session.geometry.points('pad'))} points, {heights[0]:.2f} high along the pole")
    print(f"{heights[1]:.2f} high after a turn by 60 degrees")

    session.undo()
    session.undo()
    print("after two undos there are:", ", ".join(sorted(session.document.patches)))
