"""Hollow things filled: what a hand that stays outside a cup has to keep out of, though its wall is thin.

Inside a wall of four millimetres no depth is more than two, so skin that is drawn through it costs next to
nothing and comes out on the other side. A ball as large as the hand's grip cannot roll into a cup: what it does
not reach is solid (a morphological closing), and a hand that has not reached into it stays out of all of it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar
from weakref import WeakKeyDictionary

import numpy as np
from scipy.ndimage import distance_transform_edt

from contact_core.geometry.distance_field import DistanceField
from contact_core.solve.body import PairedPoints
from contact_core.solve.penetration import PenetrationTerm, Solid
from contact_core.solve.problem import PoseProblem

REACH = 3.6  # l, a fifth of a hand: what a ball of this radius does not reach is filled
ABOVE = 0.6  # l: over a contact in a hollow it is hollow
_FILLED: WeakKeyDictionary[DistanceField, dict[float, DistanceField]] = WeakKeyDictionary()


def filled(open_field: DistanceField, radius: float) -> DistanceField:
    """The signed distance to what a ball of `radius` outside does not reach, negative inside; field units."""
    margin = int(np.ceil(radius / open_field.spacing)) + 1
    values = np.pad(open_field.values, margin, mode="edge")
    outer = np.pad(np.ones(np.array(values.shape) - 2 * margin), margin)
    beyond = open_field.spacing * distance_transform_edt(outer == 0.0)  # the padding lies so far out
    reached = values + beyond >= radius
    away = open_field.spacing * distance_transform_edt(~reached)
    closed = np.minimum(values + beyond, radius - away)[(slice(margin, -margin),) * 3]
    return DistanceField(open_field.origin, open_field.spacing, np.where(closed > 0.0, open_field.values, closed))


@dataclass(frozen=True, eq=False)
class KeepOutTerm(PenetrationTerm):
    """Penetration by fields that are given, by rigid body, in its surface units and space."""

    fields: dict[str, DistanceField] = field(default_factory=dict)

    def solids_in(self, problem: PoseProblem) -> dict[str, Solid]:
        """The solids of the problem with the given fields."""
        solids = super().solids_in(problem)
        for name, given in self.fields.items():
            size = given.spacing * (np.array(given.values.shape) - 1)
            solids[name] = replace(solids[name], fields=(given,), low=given.origin, high=given.origin + size)
        return solids


@dataclass(frozen=True, eq=False)
class KeepOutOfHollowsTerm(PenetrationTerm):
    """Penetration with hollows filled, so that no finger is drawn through a thin wall. Where a contact lies in a
    hollow of an object (in a cup, through its handle) the hand is to reach into it, and nothing there is filled.
    While a contact is dragged (`PoseProblem.continued`) what is filled stays so."""

    summary: ClassVar[str] = "skin stays out of what is solid, and of hollows without a contact"
    default_for: ClassVar[str] = ""

    def solids_in(self, problem: PoseProblem) -> dict[str, Solid]:
        """The solids of the problem, those without contacts in a hollow filled."""
        solids = super().solids_in(problem)
        for name, solid in solids.items():
            radius = round(REACH * problem.unit / solid.scale, 9)
            fields = tuple(_kept(each, radius) for each in solid.fields)
            closed = replace(solid, fields=fields)
            if not any(c.object == name and _lies_in(c, problem, solid, closed) for c in problem.contacts):
                solids[name] = closed
        return solids


def _kept(open_field: DistanceField, radius: float) -> DistanceField:
    """`filled`, made once."""
    known = _FILLED.setdefault(open_field, {})
    if radius not in known:
        known[radius] = filled(open_field, radius)
    return known[radius]


def _lies_in(contact: PairedPoints, problem: PoseProblem, solid: Solid, closed: Solid) -> bool:
    """Whether most of a contact's points on an object have air above them that is filled."""
    mesh = problem.bodies[problem.body_index(contact.object)].rig.surface
    points, normals = contact.object_points.positions(mesh), contact.object_points.normals(mesh)
    above = points + ABOVE * problem.unit / solid.scale * normals
    return bool(np.mean((solid.distances(above) > 0.0) & (closed.distances(above) < 0.0)) > 0.5)
