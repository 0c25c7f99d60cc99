"""Skin and solids: a term by which depth costs, and one that lets no vertex go deeper than it may.

Both read the depth of skin vertices from distance fields of the solids, built once per solid and kept on disk.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.geometry.inside import depth_inside
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.transform import transform_points
from contact_core.rig.skinning import joint_track, vertex_track
from contact_core.rig.track import Track
from contact_core.settings import HasSettings, setting
from contact_core.solve.bare_problem import BareProblem
from contact_core.solve.body import Body, uniform_scale
from contact_core.solve.state import PoseState
from contact_core.solve.term import BoundTerm

if TYPE_CHECKING:
    from contact_core.geometry.distance_field import DistanceField

Solids = Mapping[str, Sequence[TriangleMesh]]  # closed meshes per rigid body, in the body's surface space

REFERENCE_AREA = 10.0  # in l^2
RESOLUTION = 64  # nodes along the longest side of a field


@dataclass(frozen=True, eq=False)
class PenetrationTerm(HasSettings):
    """sum a_v max(0, -s_v / l)^2 / (10 l^2) over skin vertices v, s the signed distance to the nearest solid.

    Ten l^2 are ten finger pads: skin of that area one l deep costs as much as all contacts one l apart,
    whatever else of the body's skin is in the air.
    solids: closed meshes per body, in the body's surface space; by default each rigid body's own surface. Give
    a filled proxy where walls are thin: depth in a cup's wall says nothing about a finger inside the cup.
    skins: which bodies' skin is looked at; by default every skinned one. samples: how many vertices stand for
    the skin of a body. resolution: of the distance field.
    """

    summary: ClassVar[str] = "skin stays out of what is solid"
    reads_contacts: ClassVar[bool] = False
    default_for: ClassVar[str] = "depth"
    weight: float = setting(5.0, low=0.0, help="how much it counts beside the other terms")
    samples: int = setting(1500, low=10, high=1_000_000, help="how many vertices stand for the skin of a body")
    resolution: int = setting(
        RESOLUTION, low=4, high=512, unit="nodes", help="nodes of the distance field along the solid's longest side"
    )
    solids: Solids | None = None
    skins: Sequence[str] | None = None
    name: str = field(default="penetration")

    def bind(self, problem: BareProblem) -> BoundTerm:
        solids = self.solids_in(problem)
        if not solids:
            raise InvalidInput("the penetration term needs a rigid body to stay out of, but the problem has none.")
        skins = []
        for index, body in enumerate(problem.bodies):
            wanted = len(body.rig.joints) > 1 if self.skins is None else body.name in self.skins
            if wanted and (len(problem.free_of_body[index]) or any(s.movable for s in solids.values())):
                vertices, areas = self.samples_of(body)
                areas = areas * (uniform_scale(body.world_from_rig) / problem.unit) ** 2  # in l^2
                track = vertex_track(body.rig, vertices, int(problem.bone_offsets[index]))
                weights = self.weight / REFERENCE_AREA * areas
                skins.append(_Skin(body.name, track, weights, np.zeros(len(vertices))))
        return _Depths(problem.unit, skins, solids)

    def samples_of(self, body: Body) -> tuple[IntArray, FloatArray]:
        """The vertices (k,) that stand for the skin of a body, and the area (k,) that each stands for."""
        return thinned(body.rig.surface, self.samples)

    def solids_in(self, problem: BareProblem) -> dict[str, Solid]:
        """What is solid, by body."""
        return solids_of(problem, self.solids, self.resolution)


class Allowance(NamedTuple):
    """How deep skin vertices may be: vertices (k,), depths (k,) in l, below 0 for a distance to keep."""

    vertices: IntArray
    depths: FloatArray


@dataclass(frozen=True, eq=False)
class NoDeeperTerm(HasSettings):
    """sum max(0, -s_v / l - allowed_v)^2 over skin vertices v: a wall rather than a price.

    One vertex an l deeper than it may be costs as much as all contacts one l apart, whatever its area, for it is
    the deepest that matters. allowed: by name of the skinned body. solids, resolution: as for penetration.
    """

    summary: ClassVar[str] = "no skin vertex goes deeper than it may"
    allowed: Mapping[str, Allowance]
    weight: float = setting(1.0, low=0.0, help="how much it counts beside the other terms")
    solids: Solids | None = None
    resolution: int = RESOLUTION
    name: str = field(default="no deeper")

    def bind(self, problem: BareProblem) -> BoundTerm:
        skins = []
        for name, (vertices, depths) in self.allowed.items():
            index = problem.body_index(name)
            track = vertex_track(problem.bodies[index].rig, vertices, int(problem.bone_offsets[index]))
            weights = np.full(len(vertices), self.weight)
            skins.append(_Skin(name, track, weights, problem.unit * depths))
        return _Depths(problem.unit, skins, solids_of(problem, self.solids, self.resolution))


class _Skin(NamedTuple):
    """Vertices of one body: their track, weights (k,), and depths (k,) that cost nothing, world units."""

    body: str
    track: Track
    weights: FloatArray
    allowed: FloatArray


@dataclass(frozen=True, eq=False)
class Solid:
    """What is solid of a rigid body. bone: of the body. surface_from_joint: (4, 4). scale: world lengths per
    surface length. meshes: closed, surface space. fields: their signed distances. low, high: (3,) their box."""

    bone: int
    surface_from_joint: FloatArray
    scale: float
    movable: bool
    meshes: tuple[TriangleMesh, ...]
    fields: tuple[DistanceField, ...]
    low: FloatArray
    high: FloatArray

    def surface_from_world(self, state: PoseState) -> FloatArray:
        """(4, 4)"""
        return np.asarray(self.surface_from_joint @ np.linalg.inv(state.world[self.bone]))

    def distances(self, points: FloatArray) -> FloatArray:
        """(k,) signed distances of points (k, 3) to the nearest solid, negative inside; surface units and space."""
        return np.asarray(np.min([field.distances(points) for field in self.fields], axis=0))

    def sample(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The same, and their gradients (k, 3), at three times the cost."""
        distance, gradient = np.full(len(points), np.inf), np.zeros((len(points), 3))
        for distance_field in self.fields:
            value, slope = distance_field.sample(points)
            nearer = value < distance
            distance, gradient = np.where(nearer, value, distance), np.where(nearer[:, None], slope, gradient)
        return distance, gradient

    def depths(self, points: FloatArray) -> FloatArray:
        """(k,) how deep points (k, 3) truly are in the deepest solid, 0 outside; surface units and space. The
        fields, off by less than a cell, say which points are worth asking about."""
        result = np.zeros(len(points))
        for mesh, distance_field in zip(self.meshes, self.fields, strict=True):
            near = np.flatnonzero(distance_field.distances(points) < distance_field.spacing)
            result[near] = np.maximum(result[near], depth_inside(points[near], mesh))
        return result


@dataclass(frozen=True, eq=False)
class _Touch:
    """The vertices of one skin that are too deep in one solid: rows, by how much (negative), world normals, surface
    points."""

    skin: _Skin
    solid: Solid
    rows: IntArray
    depth: FloatArray
    outward: FloatArray
    surface: FloatArray

    @cached_property
    def track(self) -> Track:
        """The track of those vertices."""
        return self.skin.track.rows(self.rows)

    @cached_property
    def weights(self) -> FloatArray:
        """(k,) theirs."""
        return self.skin.weights[self.rows]


class _Depths:
    """Weighted squares of depths, in units of l, beyond what is allowed."""

    def __init__(self, unit: float, skins: Sequence[_Skin], solids: Mapping[str, Solid]) -> None:
        self.unit, self.skins, self.solids = unit, skins, solids

    def value(self, state: PoseState) -> float:
        return sum(float(touch.weights @ (touch.depth / self.unit) ** 2) for touch in self._touches(state))

    def gradient(self, state: PoseState) -> FloatArray:
        result = np.zeros(len(state.theta))
        for touch in self._touches(state):
            forces = (2.0 / self.unit**2) * (touch.weights * touch.depth)[:, None] * touch.outward
            result += state.pull(touch.track, forces)
            if touch.solid.movable:  # action and reaction: the solid is pushed where it is touched
                result -= state.pull(_attached(touch.solid, touch.surface), forces)
        return result

    def normal_matrix(self, state: PoseState) -> FloatArray:
        result = np.zeros((len(state.theta), len(state.theta)))
        for touch in self._touches(state):
            moved = state.jacobian(touch.track)  # (k, 3, d)
            if touch.solid.movable:
                moved = moved - state.jacobian(_attached(touch.solid, touch.surface))
            along = np.einsum("ki,kid->kd", touch.outward, moved)
            result += (2.0 / self.unit**2) * along.T @ (touch.weights[:, None] * along)
        return result

    def _touches(self, state: PoseState) -> list[_Touch]:
        """Per skin and solid with anything too deep, what is; found once per state."""
        kept: list[_Touch] | None = state.memory.get(self)
        if kept is None:
            pairs = (
                (skin, solid) for skin in self.skins for body, solid in self.solids.items() if body != skin.body
            )
            found = (_touch(state, skin, solid) for skin, solid in pairs)
            kept = state.memory[self] = [touch for touch in found if len(touch.rows)]
        return kept


def _touch(state: PoseState, skin: _Skin, solid: Solid) -> _Touch:
    surface_from_world = solid.surface_from_world(state)
    points = transform_points(surface_from_world, state.vectors(skin.track))
    away = max(-float(skin.allowed.min(initial=0.0)), 0.0) / solid.scale  # vertices that have to keep a distance
    rows = np.flatnonzero(((points > solid.low - away) & (points < solid.high + away)).all(axis=1))
    rows = rows[solid.scale * solid.distances(points[rows]) + skin.allowed[rows] < 0.0]
    distance, gradient = solid.sample(points[rows])
    depth = solid.scale * distance + skin.allowed[rows]
    return _Touch(skin, solid, rows, depth, solid.scale * gradient @ surface_from_world[:3, :3], points[rows])


def _attached(solid: Solid, surface: FloatArray) -> Track:
    """The track of points (k, 3) that ride on a solid, given in its surface space."""
    joint_from_surface = np.linalg.inv(solid.surface_from_joint)
    return joint_track(np.full(len(surface), solid.bone), transform_points(joint_from_surface, surface))


def solids_of(problem: BareProblem, solids: Solids | None, resolution: int = RESOLUTION) -> dict[str, Solid]:
    """The solids of a problem by body, their fields built: those given, else the surface of each rigid body.

    Raises InvalidInput for solids of what bends.
    """
    from contact_core.geometry.distance_field import DistanceField

    if solids is None:
        rigid = [body for body in problem.bodies if len(body.rig.joints) == 1 and body.black_box is None]
        solids = {body.name: (body.rig.surface,) for body in rigid if len(body.rig.faces)}
    result = {}
    for name, meshes in solids.items():
        index = problem.body_index(name)
        body, bone = problem.bodies[index], int(problem.bone_offsets[index])
        if len(body.rig.joints) > 1 or body.black_box is not None:
            raise InvalidInput(f"a solid must be a rigid body, but {name!r} is skinned; self-collision handles it.")
        if not meshes:
            raise InvalidInput(
                f"solids of {name!r} are empty; give at least one closed mesh or leave the body out."
            )
        result[name] = Solid(
            bone=bone,
            surface_from_joint=np.asarray(body.rig.bind_world[0]),
            scale=uniform_scale(problem.start_state.world[bone]),
            movable=len(problem.free_of_body[index]) > 0,
            meshes=tuple(meshes),
            fields=tuple(DistanceField.of(mesh, resolution=resolution) for mesh in meshes),
            low=np.min([mesh.points.min(axis=0) for mesh in meshes], axis=0),
            high=np.max([mesh.points.max(axis=0) for mesh in meshes], axis=0),
        )
    return result


def thinned(mesh: TriangleMesh, count: int) -> tuple[IntArray, FloatArray]:
    """At most about `count` vertices that stand for the surface, and the area (k,) that each stands for.

    One vertex per cell of a cubic grid, the one with the largest area; the cell's area goes to it. Read-only, and
    kept with the mesh.
    """
    kept = _thinned.setdefault(mesh, {})
    if count not in kept:
        kept[count] = _thin(mesh, count)
        for array in kept[count]:
            array.setflags(write=False)
    return kept[count]


_thinned: WeakKeyDictionary[TriangleMesh, dict[int, tuple[IntArray, FloatArray]]] = WeakKeyDictionary()


def thinned_among(mesh: TriangleMesh, chosen: IntArray, count: int) -> tuple[IntArray, FloatArray]:
    """`thinned` for a part of a surface: chosen (k,) are its vertices."""
    return _thin(mesh, count, np.isin(np.arange(len(mesh.points)), chosen))


def _thin(mesh: TriangleMesh, count: int, chosen: BoolArray | None = None) -> tuple[IntArray, FloatArray]:
    areas: FloatArray = np.zeros(len(mesh.points))
    np.add.at(areas, mesh.faces, mesh.face_areas[:, None] / 3.0)
    used: IntArray = np.flatnonzero((areas > 0.0) if chosen is None else (areas > 0.0) & chosen)
    if len(used) <= count:
        return used, areas[used]
    cell = np.sqrt(float(areas[used].sum()) / count)
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
