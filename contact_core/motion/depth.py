"""How deep skin is in what is solid, at one frame."""

from __future__ import annotations

from contact_core.geometry.transform import transform_points
from contact_core.rig.skinning import vertex_track
from contact_core.solve.penetration import Solid, Solids, solids_of, thinned
from contact_core.solve.problem import PoseProblem
from contact_core.solve.state import PoseState

HELD = 0.99  # gain from which a contact counts as on
SAMPLES = 1500  # skin vertices whose depth is measured


def deepest_skin(problem: PoseProblem, state: PoseState, solids: Solids | None = None) -> float:
    """Of the deepest skin vertex in any solid, world units. solids: as of the penetration term."""
    found = solids_of(problem, solids).items()
    return max((_deepest_in(problem, state, name, solid) for name, solid in found), default=0.0)


def _deepest_in(problem: PoseProblem, state: PoseState, name: str, solid: Solid) -> float:
    """Of all skinned bodies in one solid."""
    deepest, into = 0.0, solid.surface_from_world(state)
    for index, body in enumerate(problem.bodies):
        if body.name == name or len(body.rig.joints) < 2:
            continue
        vertices, _ = thinned(body.rig.surface, SAMPLES)
        world = state.vectors(vertex_track(body.rig, vertices, int(problem.bone_offsets[index])))
        points = transform_points(into, world)
        near = ((points > solid.low) & (points < solid.high)).all(axis=1)
        if near.any():
            deepest = max(deepest, solid.scale * float(solid.depths(points[near]).max()))
    return deepest
