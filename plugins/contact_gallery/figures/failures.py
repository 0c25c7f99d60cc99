"""Where it fails, and the cure.

Above: a ring with a gap goes from a plane onto a ball. With its axis across the gap, outside the patch, geodesics
run where the patch is not, and lengths shrink by a third; with the axis inside the ring they stay. Below: pads of a
hand on a ball, red where points are 3 mm from their partners, for fingertips and ball bend differently; `slide`
lets contacts and pose find one another.
"""

import numpy as np

import contact_core as contact
from contact_builtins.demos import demo_recipe
from contact_core.arrays import FloatArray
from contact_core.geometry.raycast import Locator
from contact_core.job.run import prepare
from contact_core.scene.picture import Picture
from contact_core.solve.penetration import PenetrationTerm
from contact_core.solve.terms import paper_terms
from contact_core.testing import meshes
from contact_gallery.looks import heat_of, in_world, view
from contact_gallery.sheet import Sheet

PAPER = "Figure 18"
FAR = 0.003  # metres: this far apart is red


def draw(sheet: Sheet) -> None:
    with contact.new(plane=meshes.plane(40, 2.0), ball=meshes.icosphere(5, 0.8), plugins=sheet.plugins) as session:
        plane, ball = Locator.of(session.geometry.mesh("plane")), Locator.of(session.geometry.mesh("ball"))
        angle = np.linspace(0.7, 2.0 * np.pi - 0.7, 40)
        ring = plane.closest(circle(angle)).points
        across = plane.closest(circle(np.array([-0.6, 0.6]))).points
        pictures: list[Picture] = []
        for name, axis, claim in (
            ("axis across the gap", across, "large distortion"),
            ("axis inside", ring, "desired result"),
        ):
            with sheet.counting(session):
                session.patches.brush("disk", name, surface="plane", at=ring, radius=0.1, spacing=0.035, axis=axis)
                copy = session.patches.transfer(
                    name, "ball", ball.closest([(0.8, -0.2, 0.8)]).points, direction=(0, 1, 0)
                )
            found = session.geometry.distortion(name, copy)
            heat = heat_of(found.length_ratio)
            heat[found.folded] = 0.0
            letter = "ab"[len(pictures) // 2]
            pictures.append(
                view(session, "plane", patches=[name], camera_from=(0, 0.3, 1), caption=f"({letter}) {name}")
            )
            middle = session.geometry.points(copy).positions(session.geometry.mesh("ball")).mean(axis=0)
            side = (float(middle[0]), float(middle[1]), float(middle[2]))
            pictures.append(
                view(session, "ball", patches=[copy], camera_from=side, heat={copy: heat}, caption="transferred")
            )
            low, high = np.nanpercentile(found.length_ratio, [2.5, 97.5])
            sheet.measure(f"{name}: folds, change of length", f"{found.folds}, {low:.2f} to {high:.2f}", claim)
        sheet.show(*pictures)
    mismatch(sheet)


def mismatch(sheet: Sheet) -> None:
    """A hand's pads on a ball: how far each point is from its partner, before and after a slide."""
    session = prepare(demo_recipe("baseball"), sheet.plugins).session
    session.accept(session.solve(terms=["penetration"]))
    pictures = []
    for caption in ("(c) distance of contacts, as painted", "(d) after slide"):
        apart = distances(session)
        shown = {f"{name} on object": heat_of(2.0 ** (each / FAR)) for name, each in apart.items()}
        pictures.append(
            view(
                session,
                patches=shown,
                heat=shown,
                camera_from=(0.9, 0.2, 0.5),
                caption=caption,
                see_through=["manipulator"],
                axes=False,
            )
        )
        mean = 1000.0 * np.mean(np.concatenate(list(apart.values())))
        sheet.measure(
            f"pads on a ball{'' if len(pictures) == 1 else ', after slide'}: mean distance",
            f"{mean:.1f} mm",
            "edit by hand",
        )
        if len(pictures) == 1:
            session.accept(
                session.slide(
                    settings=contact.SolveSettings(
                        objective=contact.Objective(terms=(*paper_terms(), PenetrationTerm()))
                    )
                )
            )
    sheet.show(*pictures, aspect=1.3)


def distances(session: contact.Session) -> dict[str, FloatArray]:
    """By pair, how far each point of it is from its partner in the pose as it is, in metres."""
    here, there = (in_world(session, name) for name in ("manipulator", "object"))
    return {
        pair.pair.name: np.linalg.norm(
            pair.manipulator_points.positions(here) - pair.object_points.positions(there), axis=1
        )
        for pair in session.geometry.pairs()
    }


def circle(angle: FloatArray) -> FloatArray:
    """(n, 3) points of a circle on the plane."""
    return np.stack([1.0 + 0.5 * np.cos(angle), 1.0 + 0.5 * np.sin(angle), 0.0 * angle], axis=1)
