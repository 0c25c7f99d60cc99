"""Posing by areas, by curves, by single points.

The same contacts of a hand on a mug, thinned to a curve along each patch and to one point of each, solved from the
same start with the paper's weights for each. The paper's curves and points fail on the palm; here they lie close to
the areas, because the solver starts from rigid fits of the contacts and the rig has limits. All three meet the
whole areas equally well.
"""

from dataclasses import replace

import numpy as np

from contact_builtins.demos import demo_recipe
from contact_core.job.run import prepare
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.solver import patch_residuals
from contact_core.solve.terms import paper_terms
from contact_gallery.looks import deepest, view
from contact_gallery.sheet import Sheet
from contact_gallery.thinned import KINDS, PAPER_WEIGHTS, thinned_to

PAPER = "Figures 16 and 17, Table 2"
CLAIMS = {"area": "the reference", "curve": "palm goes in", "point": "unnatural fingers"}


def draw(sheet: Sheet) -> None:
    job = prepare(demo_recipe("mug"), sheet.plugins)
    session, problem = job.session, job.session.problem()
    pictures, skins = [], {}
    for letter, kind in zip("abc", KINDS, strict=True):
        weights = PAPER_WEIGHTS[kind]
        thin = replace(thinned_to(problem, kind), terms=paper_terms(*weights))
        found = LevenbergMarquardt().solve(thin)
        session.surfaces.set_pose("manipulator", found.poses["manipulator"])
        skins[kind] = session.geometry.posed_mesh("manipulator").points
        met = patch_residuals(problem, problem.theta_of(found.poses)).values()
        apart = 100.0 * np.mean([one.mean for one in met]) / job.length("manipulator")
        deep = 100.0 * deepest(session, "manipulator", "object") / job.length("manipulator")
        away = 100.0 * np.linalg.norm(skins[kind] - skins["area"], axis=1).mean() / job.length("manipulator")
        told = f"areas {apart:.1f} % of the hand apart, skin {deep:.1f} % deep, {away:.1f} % from the pose by areas"
        sheet.measure(f"{kind}, weights {weights[0]:g}, {weights[1]:g}, {weights[2]:g}", told, CLAIMS[kind])
        pictures.append(
            view(session, caption=f"({letter}) by {kind}", camera_from=(0.8, 0.35, 0.5), up=(1, 0, 0), axes=False)
        )
    sheet.show(*pictures)
