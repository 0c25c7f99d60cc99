"""The scene as an artist sees it: every surface posed and placed, and what a ray meets there first.

A value: a gesture keeps the scene of its press while the hand moves on under it. The tree of a posed surface is
that of its rest shape, refitted.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.document.document import ContactDocument
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.transform import transform_points
from contact_core.interaction.view import View, shows
from contact_core.rig.rig import Pose, Rig, forward_kinematics, skin
from contact_core.scene.problem import world_from_surface


@dataclass(frozen=True, eq=False)
class SeenSurface:
    """One surface where it is seen.

    rest: the mesh that contacts are painted on. mesh: the same faces as posed, in surface space; `rest` itself
    where nothing is posed. world: (4, 4) world_from_surface, units included. pose: that of the rig.
    """

    name: str
    rest: TriangleMesh
    mesh: TriangleMesh
    world: FloatArray
    pose: Pose | None = None

    @cached_property
    def surface(self) -> FloatArray:
        """(4, 4) surface_from_world."""
        return np.asarray(np.linalg.inv(self.world))

    @cached_property
    def points(self) -> FloatArray:
        """(n, 3) world positions of the vertices."""
        return transform_points(self.world, self.mesh.points)

    @property
    def scale(self) -> float:
        """World units per surface unit."""
        return float(np.linalg.norm(self.world[:3, 0]))

    def positions(self, points: SurfacePoints) -> FloatArray:
        """(k, 3) world, of points of the surface."""
        return transform_points(self.world, points.positions(self.mesh))

    def normals(self, points: SurfacePoints) -> FloatArray:
        """(k, 3) world, of the faces that points lie in."""
        corners = self.mesh.points[self.mesh.faces[points.faces]]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) @ self.world[:3, :3].T
        length = np.linalg.norm(cross, axis=1, keepdims=True)
        return np.divide(cross, length, out=np.zeros_like(cross), where=length > 0.0)

    def rays_of(self, view: View, pixels: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The rays through pixels (k, 2) in surface space. Distances along them are still in world units."""
        origins, directions = view.rays(pixels)
        return transform_points(self.surface, origins), directions @ self.surface[:3, :3].T


@dataclass(frozen=True, eq=False)
class Hit:
    """What is under the pointer. point: one point of the surface. position, normal: (3,) world; the normal looks
    towards the eye. distance: along the ray, world units."""

    surface: str
    point: SurfacePoints
    position: FloatArray
    normal: FloatArray
    distance: float


@dataclass(frozen=True, eq=False)
class SeenScene:
    """All surfaces whose meshes are loaded, by name. meters_per_unit: of the world."""

    surfaces: Mapping[str, SeenSurface]
    meters_per_unit: float = 1.0

    def following(
        self,
        document: ContactDocument,
        meshes: Mapping[str, TriangleMesh],
        rigs: Mapping[str, Rig],
        hidden: Collection[str] = (),
    ) -> SeenScene:
        """The scene of another document; what did not move is the same object, its trees with it.

        meshes: by content digest. rigs: by surface. hidden: surfaces that are not seen.
        """
        surfaces = {}
        for name, surface in document.surfaces.items():
            rest = meshes.get(surface.digest)
            if rest is None or name in hidden:
                continue
            pose, known = document.poses.get(name), self.surfaces.get(name)
            world = world_from_surface(document, name, self.meters_per_unit)
            if known is not None and known.rest is rest and known.pose is pose:
                same = np.array_equal(known.world, world)
                surfaces[name] = known if same else SeenSurface(name, rest, known.mesh, world, pose)
            else:
                mesh = posed(rest, rigs[name], pose) if pose is not None and name in rigs else rest
                surfaces[name] = SeenSurface(name, rest, mesh, world, pose)
        if surfaces.keys() == self.surfaces.keys() and all(surfaces[n] is s for n, s in self.surfaces.items()):
            return self
        return replace(self, surfaces=surfaces)

    def moved_since(self, other: SeenScene) -> frozenset[str]:
        """The surfaces that are not where they are in another scene, those that only one of them has among them."""
        names = {*self.surfaces, *other.surfaces}
        return frozenset(n for n in names if self.surfaces.get(n) is not other.surfaces.get(n))

    def pick(self, view: View, pixel: FloatArray, among: Iterable[str] | None = None) -> Hit | None:
        """What the ray through a pixel (2,) meets first, on some of the surfaces that the view shows: through all
        others."""
        best: Hit | None = None
        for name in self.surfaces if among is None else among:
            seen = self.surfaces.get(name)
            if seen is None or not len(seen.mesh.faces) or not shows(view, name):
                continue
            found = Locator.of(seen.mesh).cast(*seen.rays_of(view, pixel[None]))
            distance = float(found.distance[0])
            if found.found[0] and (best is None or distance < best.distance):
                normal = seen.normals(found.points)[0]
                _, direction = view.rays(pixel[None])
                normal = -normal if float(normal @ direction[0]) > 0.0 else normal
                best = Hit(name, found.points, seen.positions(found.points)[0], normal, distance)
        return best

    def hits(self, view: View, pixels: FloatArray, surface: str) -> tuple[SurfacePoints, IntArray]:
        """The points of one surface that rays through pixels (k, 2) meet, and which of them do (indices)."""
        seen = self.surfaces[surface]
        found = Locator.of(seen.mesh).cast(*seen.rays_of(view, pixels))
        rows = np.flatnonzero(found.found)
        return found.points[rows], rows


def posed(rest: TriangleMesh, rig: Rig, pose: Pose) -> TriangleMesh:
    """The mesh of a rig in a pose, rig space; its tree is that of the rest shape, refitted when it is asked for."""
    local = rig.rest_local.copy()
    index = {name: number for number, name in enumerate(rig.joints)}
    for joint, matrix in zip(pose.joints, pose.local, strict=True):
        if joint in index:
            local[index[joint]] = matrix
    return rest.posed(skin(rig, forward_kinematics(rig.parents, local)))
