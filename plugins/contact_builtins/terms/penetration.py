"""Penetration: skin inside a solid costs the square of its depth, by area."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.pose.body import uniform_scale
from contact_core.pose.skinning import Track, vertex_track
from contact_core.pose.state import PoseState
from contact_core.pose.terms import BoundTerm

if TYPE_CHECKING:
    from contact_core.geometry.distance_field import DistanceField
    from contact_core.pose.problem import PoseProblem


REFERENCE_AREA = 10.0  # in l^2


@dataclass(frozen=True, eq=False)
class PenetrationTerm:
    """sum a_v max(0, -s_v / l)^2 / (10 l^2) over skin vertices v, s the signed distance to the nearest solid.

    Ten l^2 are ten finger pads: skin of that area one l deep costs as much as all contacts one l apart,
    whatever else of the body's skin is in the air.
    solids: closed meshes per body, in the body's surface space; by default each rigid body's own surface. Give
    a filled proxy where walls are thin: depth in a cup's wall says nothing about a finger inside the cup.
    skins: which bodies' skin is looked at; by default every skinned one. samples: how many vertices stand for
    the skin of a body. resolution: of the distance field, built once per solid and kept on disk.
    """

    weight: float = 5.0
    solids: Mapping[str, Sequence[TriangleMesh]] | None = None
    skins: Sequence[str] | None = None
    samples: int = 1500
    resolution: int = 64
    name: str = field(default="penetration")

    def bind(self, problem: PoseProblem) -> BoundTerm:
        return _Penetration(self, problem)


@dataclass(frozen=True, eq=False)
class _Solid:
    """bone: of the rigid body. surface_from_joint: (4, 4). scale: world lengths per surface length."""

    bone: int
    surface_from_joint: FloatArray
    scale: float
    movable: bool
    fields: tuple[DistanceField, ...]
    low: FloatArray
    high: FloatArray


@dataclass(frozen=True, eq=False)
class _Touch:
    """The skin vertices of one skin inside one solid: rows, depths (negative), world normals, surface points."""

    rows: IntArray
    depth: FloatArray
    outward: FloatArray
    surface: FloatArray


class _Penetration:
    def __init__(self, term: PenetrationTerm, problem: PoseProblem) -> None:
        self.unit = problem.unit
        self.solids = {name: _solid(problem, name, term) for name in _solid_names(problem, term)}
        if not self.solids:
            raise InvalidInput("the penetration term needs a rigid body to stay out of, but the problem has none.")
        self.skins: list[tuple[str, Track, FloatArray]] = []
        for index, body in enumerate(problem.bodies):
            wanted = len(body.rig.joints) > 1 if term.skins is None else body.name in term.skins
            if wanted and (len(problem.free_of_body[index]) or any(s.movable for s in self.solids.values())):
                vertices, areas = thinned(body.rig.surface, term.samples)
                areas = areas * (uniform_scale(body.world_from_rig) / self.unit) ** 2  # in l^2
                track = vertex_track(body.rig, vertices, int(problem.bone_offsets[index]))
                self.skins.append((body.name, track, term.weight / REFERENCE_AREA * areas))

    def value(self, state: PoseState) -> float:
        return sum(float(w[t.rows] @ (t.depth / self.unit) ** 2) for _, w, _, t in self._touches(state))

    def gradient(self, state: PoseState) -> FloatArray:
        result = np.zeros(len(state.theta))
        for track, w, solid, touch in self._touches(state):
            forces = (2.0 / self.unit**2) * (w[touch.rows] * touch.depth)[:, None] * touch.outward
            result += state.pull(track.rows(touch.rows), forces)
            if solid.movable:  # action and reaction: the solid is pushed where it is touched
                result -= state.pull(_attached(solid, touch.surface), forces)
        return result

    def normal_matrix(self, state: PoseState) -> FloatArray:
        result = np.zeros((len(state.theta), len(state.theta)))
        for track, w, solid, touch in self._touches(state):
            moved = state.jacobian(track.rows(touch.rows))  # (k, 3, d)
            if solid.movable:
                moved = moved - state.jacobian(_attached(solid, touch.surface))
            along = np.einsum("ki,kid->kd", touch.outward, moved)
            result += (2.0 / self.unit**2) * along.T @ (w[touch.rows, None] * along)
        return result

    def _touches(self, state: PoseState) -> list[tuple[Track, FloatArray, _Solid, _Touch]]:
        """Per skin and solid with anything inside: track, weights, solid, touch; found once per state."""
        kept: list[tuple[Track, FloatArray, _Solid, _Touch]] | None = state.memory.get(self)
        if kept is None:
            kept = []
            for name, track, weights in self.skins:
                for body, solid in self.solids.items():
                    if body != name:
                        touch = _touch(state, track, solid)
                        if len(touch.rows):
                            kept.append((track, weights, solid, touch))
            state.memory[self] = kept
        return kept


def _touch(state: PoseState, track: Track, solid: _Solid) -> _Touch:
    surface_from_world = solid.surface_from_joint @ np.linalg.inv(state.world[solid.bone])
    points = state.vectors(track) @ surface_from_world[:3, :3].T + surface_from_world[:3, 3]
    rows = np.flatnonzero(((points > solid.low) & (points < solid.high)).all(axis=1))
    points = points[rows]
    depth = np.full(len(rows), np.inf)
    gradient = np.zeros((len(rows), 3))
    for distance_field in solid.fields:
        value, slope = distance_field.sample(points)
        nearer = value < depth
        depth, gradient = np.where(nearer, value, depth), np.where(nearer[:, None], slope, gradient)
    inside = depth < 0.0
    outward = solid.scale * gradient[inside] @ surface_from_world[:3, :3]
    return _Touch(rows[inside], solid.scale * depth[inside], outward, points[inside])


def _attached(solid: _Solid, surface: FloatArray) -> Track:
    """The track of points (k, 3) that ride on a solid, given in its surface space."""
    joint_from_surface = np.linalg.inv(solid.surface_from_joint)
    homogeneous = np.concatenate([surface, np.ones((len(surface), 1))], axis=1)
    return Track(np.array([solid.bone]), homogeneous @ joint_from_surface.T, 4)


def _solid_names(problem: PoseProblem, term: PenetrationTerm) -> list[str]:
    if term.solids is None:
        rigid = [body for body in problem.bodies if len(body.rig.joints) == 1 and body.black_box is None]
        return [body.name for body in rigid if len(body.rig.faces)]
    for name in term.solids:
        body = problem.bodies[problem.body_index(name)]
        if len(body.rig.joints) > 1 or body.black_box is not None:
            raise InvalidInput(f"a solid must be a rigid body, but {name!r} is skinned; self-collision handles it.")
    return list(term.solids)


def _solid(problem: PoseProblem, name: str, term: PenetrationTerm) -> _Solid:
    from contact_core.geometry.distance_field import DistanceField

    index = problem.body_index(name)
    body = problem.bodies[index]
    meshes = (body.rig.surface,) if term.solids is None else tuple(term.solids[name])
    if not meshes:
        raise InvalidInput(f"solids of {name!r} are empty; give at least one closed mesh or leave the body out.")
    bone = int(problem.bone_offsets[index])
    return _Solid(
        bone=bone,
        surface_from_joint=np.asarray(body.rig.bind_world[0]),
        scale=uniform_scale(problem.start_state.world[bone]),
        movable=len(problem.free_of_body[index]) > 0,
        fields=tuple(DistanceField.of(mesh, resolution=term.resolution) for mesh in meshes),
        low=np.min([mesh.points.min(axis=0) for mesh in meshes], axis=0),
        high=np.max([mesh.points.max(axis=0) for mesh in meshes], axis=0),
    )


def thinned(mesh: TriangleMesh, count: int) -> tuple[IntArray, FloatArray]:
    """At most about `count` vertices that stand for the surface, and the area (k,) that each stands for.

    One vertex per cell of a cubic grid, the one with the largest area; the cell's area goes to it.
    """
    areas: FloatArray = np.zeros(len(mesh.points))
    np.add.at(areas, mesh.faces, mesh.face_areas[:, None] / 3.0)
    used: IntArray = np.flatnonzero(areas > 0.0)
    if len(used) <= count:
        return used, areas[used]
    cell = np.sqrt(float(mesh.face_areas.sum()) / count)
    while True:
        keys = np.floor((mesh.points[used] - mesh.points[used].min(axis=0)) / cell).astype(np.int64)
        _, group = np.unique(keys, axis=0, return_inverse=True)
        group = group.ravel()
        if group.max() < count:
            break
        cell *= 1.1
    order = np.lexsort((areas[used], group))  # within a group the largest area comes last
    last = np.append(np.flatnonzero(np.diff(group[order])), len(order) - 1)
    return used[order[last]], np.add.reduceat(areas[used][order], np.insert(last[:-1] + 1, 0, 0))
