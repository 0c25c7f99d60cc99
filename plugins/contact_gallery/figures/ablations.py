"""What each term of the objective is for, in two forms: as the paper wrote it, and as it is solved here.

First, the paper's own: distances and angles not squared, bounds of 0 to 2 pi, LD_MMA, 100 evaluations, no limits of
the joints. Then the form that this package solves by default: squares, the rig's limits, Levenberg-Marquardt.
Without distance nothing arrives, in either. The paper's form contorts the fingers with and without the prior,
because rest lies on the lower bound of every joint; with the rig's own limits the prior is hardly missed. Without
normals a hand goes deeper in, ours by another hundredth of its length: no catastrophe, where patches are dense and
it starts on the right side. The paper's own case stands below, a tentacle round a pole: in its form the strip loses
its side, more of it so without normals; added contact by contact, as here, it wraps with and without them.
"""

from typing import Any

import numpy as np

import contact_core as contact
from contact_builtins.demos import demo_recipe
from contact_core.geometry.raycast import Locator
from contact_core.job.run import prepare
from contact_core.scene.picture import Picture
from contact_core.solve.solver import patch_residuals
from contact_core.solve.terms import paper_terms
from contact_gallery.looks import deepest, rotation, view
from contact_gallery.sheet import Sheet

PAPER = "Figure 13"
WITHOUT = {
    "all terms": (1.0, 1.0, 10.0),
    "no distance": (0.0, 1.0, 10.0),
    "no normals": (1.0, 0.0, 10.0),
    "no prior": (1.0, 1.0, 0.0),
}
CLAIMS = {"no distance": "does not reach", "no normals": "inside the object", "no prior": "contorted fingers"}
FORMS: dict[str, dict[str, Any]] = {
    "paper": {"solver": "nlopt", "solver_settings": {"preset": "paper"}, "limits": "paper"},
    "here": {"solver": "levenberg-marquardt", "limits": "rig"},
}


def draw(sheet: Sheet) -> None:
    job = prepare(demo_recipe("baseball"), sheet.plugins)
    session = job.session
    start = session.revision
    for form, how in FORMS.items():
        pictures = []
        for letter, (left_out, weights) in zip("abcd", WITHOUT.items(), strict=True):
            session.goto(start)
            proposal = session.solve(terms=paper_terms(*weights), **how)
            session.accept(proposal)
            pictures.append(
                view(
                    session,
                    caption=f"({letter}) {form}: {left_out}",
                    camera_from=(0.9, 0.2, 0.5),
                    frame=["manipulator"],
                    axes=False,
                )
            )
            full = session.problem()
            met = (
                patch_residuals(full, full.theta_of(proposal.after.poses))
                if form == "here"
                else proposal.after.patches
            )
            apart = 100.0 * np.mean([one.mean for one in met.values()]) / job.length("manipulator")
            deep = 100.0 * deepest(session, "manipulator", "object") / job.length("manipulator")
            turned = np.degrees(
                np.abs(
                    proposal.after.theta[~(proposal.after.problem.is_root | proposal.after.problem.is_translation)]
                )
            ).max()
            told = f"contacts {apart:.1f} % of the hand apart, {deep:.1f} % deep, largest angle {turned:.0f}°"
            sheet.measure(f"{form}: {left_out}", told, CLAIMS.get(left_out, ""))
        sheet.show(*pictures)
    sheet.show(*wraps(sheet), aspect=0.9)


def wraps(sheet: Sheet) -> list[Picture]:
    """A tentacle's strip goes round a pole, in both forms, with normals and without."""
    pictures = []
    with contact.new(tentacle="sample:tentacle", pole="sample:pole", plugins=sheet.plugins) as session:
        rig, skin, pole = session.rigs["tentacle"], session.geometry.mesh("tentacle"), session.geometry.mesh("pole")
        along = Locator.of(skin).closest(rig.rest_world[5:20, :3, 3] + [0.0, 0.0, 0.05]).points
        strokes = [
            contact.BrushGesture(skin, along[k : k + 2], radius=width, spacing=0.35 * width)
            for k, width in enumerate(np.linspace(0.014, 0.004, 14))
        ]
        session.patches.brush("disk", "strip", *strokes, surface="tentacle", axis=along)
        session.surfaces.place("tentacle", rotation((0, 1, 0), 90.0, (0.3, 0.05, 0.0)))
        root = Locator.of(pole).closest([(0.05, 0.3, 0.0)]).points
        copy = session.patches.transfer("strip", "pole", root, direction=(0.0, 0.5, 1.0))
        session.patches.scale(copy, along=0.8)
        session.pairs.add("strip", copy, name="strip")
        start, near = session.revision, np.array([(-0.1, 0.02, -0.1), (0.16, 0.5, 0.2)])
        for form, how in {"paper": FORMS["paper"], "here": {"solver": "progressive"}}.items():
            for left_out in ("all terms", "no normals"):
                session.goto(start)
                proposal = session.solve(terms=paper_terms(*WITHOUT[left_out]), **how)
                session.accept(proposal)
                caption, met = f"{form}: {left_out}", proposal.after.patches["strip"]
                deep = 1000.0 * deepest(session, "tentacle", "pole")
                told = f"contacts {1000 * met.mean:.0f} mm apart, skin {deep:.0f} mm deep"
                told += f", {100 * (1 - met.opposed):.0f} % of the normals on the wrong side"
                sheet.measure(f"tentacle, {caption}", told, CLAIMS.get(left_out, ""))
                pictures.append(view(session, camera_from=(1.0, 0.3, 0.7), caption=caption, focus=near, axes=False))
    return pictures
