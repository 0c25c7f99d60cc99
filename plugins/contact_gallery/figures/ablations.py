"""What each term of the objective is for, in two forms: as the paper wrote it, and as it is solved here.

Above, the paper's own: distances and angles not squared, bounds of 0 to 2 pi, LD_MMA, 100 evaluations, no limits of
the joints. Below, the form that this package solves by default: squares, the rig's limits, Levenberg-Marquardt.
Without distance nothing arrives, in either. The paper's form contorts the fingers with and without the prior,
because rest lies on the lower bound of every joint; with the rig's own limits the prior is hardly missed. Without
normals both go deeper in, ours by another hundredth of a hand: no catastrophe, where patches are dense and the hand
starts on the right side.
"""

from typing import Any

import numpy as np

from contact_builtins.demos import demo_recipe
from contact_core.job.run import prepare
from contact_core.solve.solver import patch_residuals
from contact_core.solve.terms import paper_terms
from contact_gallery.looks import deepest, view
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
