"""From the pairs of a document to what a solver takes, wherever bodies come from: a document, a stage, a job."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from contact_core.edit.verbs.organising import PairGeometry
from contact_core.solve.body import Body, PairedPoints
from contact_core.solve.problem import Limits, PoseProblem
from contact_core.solve.terms import PoseTerm, paper_terms


def surfaces_of(pairs: Sequence[PairGeometry]) -> list[str]:
    """The surfaces that pairs lie on, each once, in the order in which the pairs name them."""
    return list(dict.fromkeys(name for pair in pairs for name in (pair.manipulator_surface, pair.object_surface)))


def pose_problem(
    pairs: Sequence[PairGeometry],
    body_of: Callable[[str], Body],
    terms: tuple[PoseTerm, ...] = paper_terms(),
    *,
    limits: Limits = "rig",
) -> PoseProblem:
    """All pairs as contacts. body_of: the body of a surface, named like it, posed and placed as it starts."""
    contacts = tuple(
        PairedPoints(
            pair.pair.name,
            pair.manipulator_surface,
            pair.manipulator_points,
            pair.object_surface,
            pair.object_points,
            pair.weights,
        )
        for pair in pairs
    )
    return PoseProblem(tuple(map(body_of, surfaces_of(pairs))), contacts, terms, limits=limits)
