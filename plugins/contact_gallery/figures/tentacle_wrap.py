"""One tentacle, one strip, three wraps: the angle at which the axis starts.

The strip is painted once along the tentacle's flat side with its axis in the middle. On the pole only the direction
of the axis at its first point changes: steep, halfway, flat. The contacts join one by one along the chain when the
pose is solved (solver `progressive`), so that the tail follows where the tentacle went. The pole is thin, 36 mm,
for many turns: each joint bends by 60 degrees at most, so that all of them come to three turns.
"""

from functools import partial

import numpy as np

import contact_core as contact
from contact_core.arrays import FloatArray
from contact_core.geometry.raycast import Locator
from contact_core.plugins.reading import read_asset
from contact_gallery.looks import in_world, rotation, view
from contact_gallery.sheet import Sheet, timed

PAPER = "Figure 5"


def draw(sheet: Sheet) -> None:
    pole_of_60_mm = read_asset("sample:pole", sheet.plugins).mesh
    thin = pole_of_60_mm.with_points(pole_of_60_mm.points * [0.6, 1.0, 0.6])
    with contact.new(tentacle="sample:tentacle", pole=thin, plugins=sheet.plugins) as session:
        rig, skin, pole = (
            session.rigs["tentacle"],
            session.geometry.mesh("tentacle"),
            Locator.of(session.geometry.mesh("pole")),
        )
        middle = rig.rest_world[3:20, :3, 3] + [0.0, 0.0, 0.05]  # over its flat side
        along = Locator.of(skin).closest(middle).points
        strokes = [
            contact.BrushGesture(skin, along[k : k + 2], radius=width, spacing=0.35 * width)
            for k, width in enumerate(np.linspace(0.015, 0.004, 16))
        ]
        with sheet.counting(session):
            session.patches.brush("disk", "strip", *strokes, surface="tentacle", axis=along)
            session.surfaces.place("tentacle", rotation((0, 1, 0), 90.0, (0.3, 0.05, 0.0)))
            root = pole.closest([(0.05, 0.3, 0.0)]).points
            copy = session.patches.transfer("strip", "pole", root, direction=(0.0, 0.3, 1.0))
            session.patches.scale(copy, along=0.75)  # the inner side of a bend is shorter than the skin at rest
            session.pairs.add("strip", copy)
        start = session.revision
        look = partial(view, session, camera_from=(1.0, 0.3, 0.7), patches=[copy])
        near = np.array([(-0.1, 0.1, -0.1), (0.16, 0.62, 0.2)])
        pictures = [look(caption="(a) the strip on the pole", frame=["tentacle"])]
        for letter, degrees in zip("bcd", (42.0, 33.0, 24.0), strict=True):
            session.goto(start)
            with sheet.counting(session, f"Tentacle round a pole, {degrees:.0f}°"):
                rise = np.tan(np.radians(degrees))
                session.patches.place(copy, root, direction=(0.0, rise, 1.0))
                proposal, spent = timed(lambda: session.solve(solver="progressive"))
                session.accept(proposal)
            pictures.append(look(caption=f"({letter}) start angle {degrees:.0f}°", focus=near))
            met = proposal.after.patches["strip - " + copy]
            turns = np.ptp(angle_round(session)) / (2.0 * np.pi)
            wrap = f"{turns:.1f} turns, {100 * met.opposed:.0f} % of the normals opposed"
            cost = f"contacts {1000 * met.mean:.1f} mm apart, {spent:.2f} s"
            sheet.measure(f"start angle {degrees:.0f}°", f"{wrap}, {cost}", "the start angle changes the wrap")
        sheet.show(*pictures, aspect=0.8)


def angle_round(session: contact.Session) -> FloatArray:
    """The angle round the pole at each point of the strip's axis on the posed skin, unwrapped."""
    x, _, z = session.geometry.axis("strip").points.positions(in_world(session, "tentacle")).T
    return np.asarray(np.unwrap(np.arctan2(z, x)))
