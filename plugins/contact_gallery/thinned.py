"""The same contacts as areas, as curves, or as single points: what the paper compares its areas with."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from contact_core.solve.body import PairedPoints
from contact_core.solve.problem import PoseProblem

Kind = Literal["area", "curve", "point"]
KINDS: tuple[Kind, ...] = ("area", "curve", "point")
PAPER_WEIGHTS = {"point": (3.5, 6.1, 10.0), "curve": (1.0, 1.2, 10.0), "area": (1.0, 1.0, 10.0)}  # its Table 2
CURVE_POINTS = 15


def thinned_to(problem: PoseProblem, kind: Kind, palm_angle: float = 0.0) -> PoseProblem:
    """The problem with single points, or with curves: the pairs nearest to a line through each patch.

    palm_angle: degrees by which the curve of a patch named "palm..." is turned away from its longest extent.
    """
    if kind == "area":
        return problem
    contacts = []
    for contact in problem.contacts:
        surface = problem.bodies[problem.body_index(contact.manipulator)].rig.surface
        offset = contact.manipulator_points.positions(surface)
        offset = offset - offset.mean(axis=0)
        u, v = np.linalg.svd(offset, full_matrices=False)[2][:2]
        turn = np.radians(palm_angle) if contact.name.startswith("palm") else 0.0
        across = offset @ (np.cos(turn) * v - np.sin(turn) * u)
        order = np.argsort(np.abs(across)) if kind == "curve" else np.argsort(np.linalg.norm(offset, axis=1))
        keep = np.sort(order[: CURVE_POINTS if kind == "curve" else 1])
        ends = contact.manipulator_points[keep], contact.object_points[keep]
        contacts.append(PairedPoints(contact.name, contact.manipulator, ends[0], contact.object, ends[1]))
    return replace(problem, contacts=tuple(contacts))
