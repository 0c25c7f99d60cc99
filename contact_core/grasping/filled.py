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

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.distance_field import DistanceField
from contact_core.solve.bare_problem import BareProblem
from contact_core.solve.body import Body, PairedPoints
from contact_core.solve.penetration import PenetrationTerm, Solid

REACH = 3.6  # l, a fifth of a hand: what a ball of this radius does not reach is filled
ABOVE = 0.6  # l: over a contact in a hollow it is hollow
_FILLED: WeakKeyDictionary[DistanceField, dict[float, DistanceField]] = WeakKeyDictionary()


def filled(open_field: DistanceField, radius: float) -> DistanceField:
    """The signed distance to what a ball of `radius` outside does not reach, negative inside; field units.

    A ball wider than the field's longest side counts as one of that radius. Distances outside the field are upper
    bounds, so that a wider one would be told to reach where it cannot; and memory would grow with the cube of hand
    over object (a hand in centimetres that is read as metres).
    """
    radius = min(radius, open_field.spacing * (max(open_field.values.shape) - 1))
    margin = int(np.ceil(radius / open_field.spacing)) + 1
    values = np.pad(open_field.values, margin, mode="edge")
    outer = np.pad(np.ones(np.array(values.shape) - 2 * margin), margin)
    beyond = open_field.spacing * distance_transform_edt(outer == 0.0)  # the padding lies so far out
    reached = values + beyond >= radius
    away = open_field.spacing * distance_transform_edt(~reached)
    closed = np.minimum(values + beyond, radius - away)[(slice(margin, -margin),) * 3]
    return DistanceField(open_field.origin, open_field.spacing, np.where(closed > 0.0, open_field.values, closed))


def beyond(whole: DistanceField, part: DistanceField) -> DistanceField:
    """A field of all of an object with nothing solid where a finer one of a part is, so that the lesser of both is
    right everywhere; both in one space. It is wider by a cell, by which a coarse field may be off."""
    low = np.floor((part.origin - whole.origin) / whole.spacing).astype(int)
    high = np.ceil((part.origin - whole.origin + part.spacing * (np.array(part.values.shape) - 1)) / whole.spacing)
    values = whole.values - whole.spacing
    known = tuple(slice(max(a, 0), max(b + 1, 0)) for a, b in zip(low, high.astype(int), strict=True))
    values[known] = np.maximum(values[known], whole.spacing)
    return DistanceField(whole.origin, whole.spacing, values)


@dataclass(frozen=True, eq=False)
class KeepOutTerm(PenetrationTerm):
    """Penetration by fields that are given, one or more by rigid body, in its surface units and space: skin keeps
    out of each of them. stand_in: by skinned body the vertices (k,) that are looked at, and their areas (k,)."""

    fields: dict[str, tuple[DistanceField, ...]] = field(default_factory=dict)
    stand_in: dict[str, tuple[IntArray, FloatArray]] = field(default_factory=dict)

    def samples_of(self, body: Body) -> tuple[IntArray, FloatArray]:
        """The vertices that are given, else some of all."""
        return self.stand_in.get(body.name) or super().samples_of(body)

    def solids_in(self, problem: BareProblem) -> dict[str, Solid]:
        """The solids of the problem with the given fields."""
        solids = super().solids_in(problem)
        for name, given in self.fields.items():
            low = np.min([each.origin for each in given], axis=0)
            ends = [each.origin + each.spacing * (np.array(each.values.shape) - 1) for each in given]
            mesh, *_ = solids[name].meshes
            solids[name] = replace(
                solids[name], meshes=(mesh,) * len(given), fields=given, low=low, high=np.max(ends, axis=0)
            )
        return solids


@dataclass(frozen=True, eq=False)
class KeepOutOfHollowsTerm(PenetrationTerm):
    """Penetration with hollows filled, so that no finger is drawn through a thin wall. Where a contact lies in a
    hollow of an object (in a cup, through its handle) the hand is to reach into it, and nothing there is filled.
    While a contact is dragged (`PoseProblem.continued`) what is filled stays so."""

    summary: ClassVar[str] = "skin stays out of what is solid, and of hollows without a contact"
    default_for: ClassVar[str] = ""

    def solids_in(self, problem: BareProblem) -> dict[str, Solid]:
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


def _lies_in(contact: PairedPoints, problem: BareProblem, solid: Solid, closed: Solid) -> bool:
    """Whether most of a contact's points on an object have air above them that is filled."""
    mesh = problem.bodies[problem.body_index(contact.object)].rig.surface
    points, normals = contact.object_points.positions(mesh), contact.object_points.normals(mesh)
    above = points + ABOVE * problem.unit / solid.scale * normals
    return bool(np.mean((solid.distances(above) > 0.0) & (closed.distances(above) < 0.0)) > 0.5)
