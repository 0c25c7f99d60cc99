"""The pose problem: bodies, contact pairs, what may move within which limits, near which prior, and the terms."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.rig.chart import Chart
from contact_core.solve.bare_problem import BareProblem
from contact_core.solve.body import Body, PairedPoints
from contact_core.solve.state import PoseState
from contact_core.solve.term import BoundTerm, PoseTerm
from contact_core.solve.terms import paper_terms


@dataclass(frozen=True, eq=False)
class PoseProblem(BareProblem):
    """What a solver gets. Immutable; everything derived is made when first asked for.

    terms: the objective; the paper's three by default.
    """

    _: KW_ONLY
    terms: tuple[PoseTerm, ...] = paper_terms()

    def at(self, theta: FloatArray) -> PoseProblem:
        """The same problem, objective and all, starting at theta (d,)."""
        poses, prior = self.poses(theta), self.prior
        if prior == "current":
            prior = {body.name: body.pose for body in self.bodies}
        bodies = tuple(replace(body, pose=poses[body.name]) for body in self.bodies)
        return replace(self, bodies=bodies, prior=prior, length=self.manipulator_length)

    def continued(
        self,
        theta: FloatArray,
        contacts: tuple[PairedPoints, ...],
        terms: tuple[PoseTerm, ...],
        bodies: tuple[Body, ...] | None = None,
    ) -> PoseProblem:
        """The problem with other contacts, terms or places, starting at theta (d,), at the cost of what is new.

        For a drag: bodies are those of this one, moved at most, and so are charts, limits and lengths. Contacts
        whose points are the same objects keep their tracks; a term that is the same object, and whose class says
        `reads_contacts = False`, stays bound. The prior stays where it was; "current" is the new start. Raises
        InvalidInput for black boxes, which know their contacts, and for other bodies.
        """
        moved = self.bodies if bodies is None else bodies
        same = len(moved) == len(self.bodies) and all(
            new.rig is old.rig and new.name == old.name and new.black_box is None
            for new, old in zip(moved, self.bodies, strict=True)
        )
        if not same:
            raise InvalidInput("a problem is continued with the same bodies, none of them a black box.")
        result = replace(self, contacts=contacts, terms=terms, bodies=moved, length=self.manipulator_length)
        kept = {name: getattr(self, name) for name in _KEPT}
        stays = [
            np.array_equal(a.world_from_rig, b.world_from_rig) for a, b in zip(moved, self.bodies, strict=True)
        ]
        if not all(stays):
            kept["charts"] = tuple(
                chart if stay else Chart(body.rig, body.world_from_rig)
                for chart, stay, body in zip(self.charts, stays, moved, strict=True)
            )
            del kept["_still"]
        if self.prior == "current":
            del kept["prior_theta"]
        ends = {id(end) for each in contacts for end in (each.manipulator_points, each.object_points)}
        kept["kept_tracks"] = {key: made for key, made in self.kept_tracks.items() if key[0] in ends}
        kept["kept_ends"] = {k: made for k, made in self.kept_ends.items() if all(end in ends for _, end in k[1])}
        bound = tuple((t, self.bound_terms[t.name]) for t in self.terms if not getattr(t, "reads_contacts", True))
        vars(result).update(kept, start=np.clip(theta, *self.limits_of_theta), _bound_before=bound)
        return result

    @cached_property
    def bound_terms(self) -> dict[str, BoundTerm]:
        """The terms made ready, by name."""
        if len({term.name for term in self.terms}) != len(self.terms):
            raise InvalidInput(f"terms need unique names, but got {[term.name for term in self.terms]}.")
        return {term.name: self._kept_term(term) or term.bind(self) for term in self.terms}

    def _kept_term(self, term: PoseTerm) -> BoundTerm | None:
        """The term as it was bound to the problem that this one continues."""
        return next((bound for known, bound in self._bound_before if known is term), None)

    @cached_property
    def _bound_before(self) -> tuple[tuple[PoseTerm, BoundTerm], ...]:
        return ()

    def term_values(self, state: PoseState) -> dict[str, float]:
        """Weighted value of every term."""
        return {name: term.value(state) for name, term in self.bound_terms.items()}

    def value(self, state: PoseState) -> float:
        """The objective."""
        return sum(term.value(state) for term in self.bound_terms.values())

    def gradient(self, state: PoseState) -> FloatArray:
        """(d,) its derivative."""
        return sum((term.gradient(state) for term in self.bound_terms.values()), np.zeros(len(state.theta)))

    def normal_matrix(self, state: PoseState) -> FloatArray:
        """(d, d) the Gauss-Newton model of its second derivative."""
        d = len(state.theta)
        return sum((term.normal_matrix(state) for term in self.bound_terms.values()), np.zeros((d, d)))


_KEPT = (  # by problems that continue another: all that neither contacts nor the start change
    "charts", "is_rigid", "free_of_body", "dof_slices", "dof_names", "limits_of_theta", "is_translation", "is_root",
    "scale", "prior_weights", "_charted", "_leftovers", "prior_theta", "bone_offsets", "watched_offsets",
    "watched_dofs", "moves", "fields_of_body", "field_moves", "coupling", "_still", "_moved_bones", "kept_tracks",
    "kept_ends",
)  # fmt: skip
