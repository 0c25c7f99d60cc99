"""Posing by areas, by curves, by single points.

The same contacts of a hand on a mug, thinned to a curve along each patch and to one point of each, solved from the
same start with the paper's weights for each. Above in the form that this package solves: curves and points lie
close to the areas, because the solver starts from rigid fits of the contacts and the rig has limits. Below in the
paper's own form, without either: distances and angles not squared, bounds of 0 to 2 pi, LD_MMA, 100 evaluations.
From this start, an open hand a length away, it ends with the palm in the mug by curves and by points, as the paper
shows, and by areas as well, which the paper does not.
"""

from dataclasses import replace

import numpy as np

import contact_core as contact
from contact_builtins.demos import demo_recipe
from contact_builtins.solvers.nlopt_solver import NLoptSolver
from contact_core.job.run import prepare
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import PoseSolver, patch_residuals
from contact_core.solve.terms import paper_terms
from contact_gallery.looks import deepest, view
from contact_gallery.sheet import Sheet
from contact_gallery.thinned import KINDS, PAPER_WEIGHTS, thinned_to

PAPER = "Figures 16 and 17, Table 2"
CLAIMS = {"area": "the reference", "curve": "palm goes in", "point": "unnatural fingers"}


def draw(sheet: Sheet) -> None:
    job = prepare(demo_recipe("mug"), sheet.plugins)
    session, full = job.session, job.session.problem()
    forms: dict[str, tuple[PoseSolver, PoseProblem]] = {
        "here": (LevenbergMarquardt(), full),
        "paper": (NLoptSolver(preset="paper"), session.problem(contact.Objective(limits="paper"))),
    }
    for form, (solver, problem) in forms.items():
        pictures, skins = [], {}
        for letter, kind in zip("abc", KINDS, strict=True):
            weights = PAPER_WEIGHTS[kind]
            found = solver.solve(replace(thinned_to(problem, kind), terms=paper_terms(*weights)))
            session.surfaces.set_pose("manipulator", found.poses["manipulator"])
            skins[kind] = session.geometry.posed_mesh("manipulator").points
            met = patch_residuals(full, full.theta_of(found.poses)).values()
            apart = 100.0 * np.mean([one.mean for one in met]) / job.length("manipulator")
            deep = 100.0 * deepest(session, "manipulator", "object") / job.length("manipulator")
            away = 100.0 * np.linalg.norm(skins[kind] - skins["area"], axis=1).mean() / job.length("manipulator")
            told = f"areas {apart:.1f} % of the hand apart, skin {deep:.1f} % deep, {away:.1f} % from that by areas"
            sheet.measure(
                f"{form}: {kind}, weights {weights[0]:g}, {weights[1]:g}, {weights[2]:g}", told, CLAIMS[kind]
            )
            caption = f"({letter}) {form}: by {kind}"
            pictures.append(view(session, caption=caption, camera_from=(0.8, 0.35, 0.5), up=(1, 0, 0), axes=False))
        sheet.show(*pictures)
