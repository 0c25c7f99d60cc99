"""No deeper than before: what keeps a slide from buying shorter distances with skin inside the object."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.geometry.inside import Sunk
from contact_core.geometry.transform import transform_points
from contact_core.solve.penetration import Allowance, NoDeeperTerm, Solid, Solids, solids_of
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import posed_mesh
from contact_core.solve.state import PoseState

REACH = 2.5  # in l: vertices that start farther outside are not watched until they get inside
MARGIN = 0.005  # in l, a twentieth of a millimetre on a hand: how far on the safe side vertices have to stay
ROUNDING = 1e-9  # of the same pose measured twice


@dataclass(frozen=True, eq=False)
class DepthBound:
    """No vertex of a posed skin gets deeper into solids than its deepest vertex at the start, and what was outside
    stays outside: then neither the deepest penetration nor the area inside grows.

    The term is a wall of finite stiffness over interpolated distances, so a solve ends a little beyond it. What
    counts is measured on the true surfaces (as reports measure it, `geometry.inside`): where that has grown, each
    vertex's wall is moved by as much as the vertex went beyond (Powell's shifts, 1969), for the solve to go on.

    start: per skin. allowed: (n,) world units per skin, -inf where a vertex is not watched.
    """

    solids: Mapping[str, Solid]
    start: Mapping[str, Sunk]
    allowed: Mapping[str, FloatArray]
    unit: float

    @classmethod
    def of(cls, problem: PoseProblem, solids: Solids | None) -> DepthBound:
        """The bound at the start of a problem. Raises InvalidInput for solids of what bends."""
        skins, state = _skins(problem), problem.start_state
        found, allowed = solids_of(problem, solids) if skins else {}, {}
        for name in skins:
            points = posed_mesh(problem, state, name).points
            inside = [-solid.scale * solid.distances(_into(solid, state, points)) for solid in found.values()]
            depth = np.max(inside, axis=0, initial=-np.inf)  # (n,) below 0 outside
            deepest = max(float(depth.max(initial=0.0)), 0.0)
            wall = np.where(depth > 0.0, deepest, 0.0) - MARGIN * problem.unit
            allowed[name] = np.where(depth > -REACH * problem.unit, wall, -np.inf)
        return cls(found, measured(problem, problem.start, found), allowed, problem.unit)

    def term(self) -> NoDeeperTerm:
        """For the problem that slides."""
        allowed = {}
        for name, depths in self.allowed.items():
            watched = np.flatnonzero(np.isfinite(depths))
            allowed[name] = Allowance(watched, depths[watched] / self.unit)
        return NoDeeperTerm(allowed, solids={name: solid.meshes for name, solid in self.solids.items()})

    def holds(self, now: Mapping[str, Sunk]) -> bool:
        """Whether no skin has its deepest vertex deeper, nor more of its area inside, than at the start."""
        return all(
            now[name].deepest <= was.deepest * (1.0 + ROUNDING) and now[name].share <= was.share * (1.0 + ROUNDING)
            for name, was in self.start.items()
        )

    def tightened(self, now: Mapping[str, Sunk]) -> DepthBound:
        """Walls moved by what vertices went beyond."""
        allowed = {}
        for name, was in self.start.items():
            ceiling = np.where(was.depths > 0.0, was.deepest, 0.0)
            beyond = np.maximum(now[name].depths - ceiling, 0.0)
            watched = np.isfinite(self.allowed[name])
            wall = np.where(watched, self.allowed[name], ceiling)
            allowed[name] = np.where(watched | (beyond > 0.0), wall - beyond - MARGIN * self.unit, -np.inf)
        return replace(self, allowed=allowed)


def measured(problem: PoseProblem, theta: FloatArray, solids: Mapping[str, Solid]) -> dict[str, Sunk]:
    """How each skin that moves is truly sunk into the solids at theta (d,), world units."""
    state, result = problem.state(theta), {}
    for name in _skins(problem):
        skin = posed_mesh(problem, state, name)
        inside = [solid.scale * solid.depths(_into(solid, state, skin.points)) for solid in solids.values()]
        result[name] = Sunk.of(skin, np.max(inside, axis=0, initial=0.0))
    return result


def _into(solid: Solid, state: PoseState, points: FloatArray) -> FloatArray:
    """World points (n, 3) in a solid's surface space."""
    surface_from_world = solid.surface_from_world(state)
    return transform_points(surface_from_world, points)


def _skins(problem: PoseProblem) -> list[str]:
    """The skinned bodies that a solve may move."""
    return [
        body.name
        for index, body in enumerate(problem.bodies)
        if len(body.rig.joints) > 1 and body.black_box is None and len(problem.free_of_body[index])
    ]
