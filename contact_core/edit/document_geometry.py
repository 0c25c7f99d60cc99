"""The geometry of a document as it stands: where surfaces, patches, axes and pairs are. It never edits."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, frozen
from contact_core.contact.area import PatchArea, measure_area
from contact_core.contact.axis import Axis
from contact_core.contact.axis_generator import AxisRequest
from contact_core.contact.crowding import crowded_points
from contact_core.contact.distortion import Distortion, measure_distortion
from contact_core.contact.pairing import correspond
from contact_core.contact.patch import PatchPoints
from contact_core.contact.placement import Root
from contact_core.contact.proximity import patches_of_vertices, touching_vertices
from contact_core.document.document import ContactDocument, ContactPair, named
from contact_core.edit.derived import Derived
from contact_core.errors import CommandRejected, InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_map import SurfaceMap
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import direction_to_heading, heading_to_direction
from contact_core.geometry.transform import transform_points
from contact_core.rig.bones import bones_of
from contact_core.rig.poses import posed_points
from contact_core.rig.rig import Rig


@dataclass(frozen=True, eq=False)
class PairGeometry:
    """One contact pair as a solver takes it: k points that are to touch k others.

    manipulator_points on manipulator_surface, object_points on object_surface (names); weights: (k,), the point
    weights times the weight of the pair, in square meters.
    """

    pair: ContactPair
    manipulator_surface: str
    object_surface: str
    manipulator_points: SurfacePoints
    object_points: SurfacePoints
    weights: FloatArray


class DocumentGeometry:
    """Reads a document with its meshes and rigs.

    document: returns the document to read, at every question. rigs: by surface. Names that the document does not
    have raise InvalidInput, as do surfaces whose mesh was not brought.
    """

    def __init__(self, document: Callable[[], ContactDocument], derived: Derived, rigs: Mapping[str, Rig]) -> None:
        self._current = document
        self._derived = derived
        self._rigs = rigs

    @property
    def document(self) -> ContactDocument:
        """The document that is read."""
        return self._current()

    def of(self, document: ContactDocument) -> DocumentGeometry:
        """The same for another document of these surfaces: a preview, a ghost, an earlier revision."""
        return DocumentGeometry(lambda: document, self._derived, self._rigs)

    # -- surfaces ------------------------------------------------------------------------------------------------

    @property
    def loaded(self) -> tuple[str, ...]:
        """The surfaces of the document whose mesh was brought."""
        return tuple(self._derived.meshes(self.document))

    def mesh(self, surface: str) -> TriangleMesh:
        """The mesh of a surface."""
        return self._derived.mesh(self.document, surface)

    def posed_mesh(self, surface: str) -> TriangleMesh:
        """The surface in the pose that the document holds; at rest without one."""
        pose, rig = self.document.poses.get(surface), self._rigs.get(surface)
        if pose is None:
            return self.mesh(surface)
        if rig is None:
            raise InvalidInput(f"the rig of {surface!r} is not loaded: give it to the session by surfaces.add.")
        return self.mesh(surface).with_points(posed_points(rig, pose))

    def surface_from_surface(self, there: str, here: str) -> FloatArray:
        """(4, 4) from the space of a surface, at rest, into that of another, each in its own units."""
        one, other = self.document.surface(here), self.document.surface(there)
        scale = np.diag([*[one.meters_per_unit / other.meters_per_unit] * 3, 1.0])
        return np.asarray(np.linalg.inv(other.world_from_surface) @ scale @ one.world_from_surface)

    def touching(
        self, surface: str, other: str, distance: float, *, facing: bool = True, smallest: int = 3
    ) -> list[SurfacePoints]:
        """Vertices of a surface in its pose within `distance` (its own units) of another, part by part.

        What to paint when a coarse pose came first (workflow (e) of the paper). facing: nothing reaches through
        the far wall of a cup. smallest: parts of fewer vertices are left out.
        """
        ratio = self.document.surface(surface).meters_per_unit / self.document.surface(other).meters_per_unit
        move = self.surface_from_surface(other, surface)
        vertices, _ = touching_vertices(
            self.posed_mesh(surface), self.mesh(other), distance * ratio, other_from_posed=move, facing=facing
        )
        mesh = self.mesh(surface)
        return [SurfacePoints.at_vertices(mesh, part) for part in patches_of_vertices(mesh, vertices, smallest)]

    def root_at(
        self, surface: str, point: SurfacePoints, heading: complex | None = None, direction: Any = None
    ) -> Root:
        """A root from one point of a surface and either a heading there or a direction in surface space (3,)."""
        if (heading is None) == (direction is None):
            raise InvalidInput("a root needs either a heading or a direction in space.")
        carried = self.on_carrier(surface, point)
        if heading is not None and carried is point:
            return Root.at(point, heading)
        if heading is not None:
            direction = heading_to_direction(self.mesh(surface), point, np.array([heading]))[0]
        wanted = frozen(direction, np.float64, (3,), "a direction in space")[None]
        return Root.at(carried, complex(direction_to_heading(self.carrier(surface), carried, wanted)[0]))

    def carrier(self, surface: str) -> TriangleMesh:
        """The mesh that the contacts of a surface run on: its proxy where it has one, else its own."""
        return self._derived.carrier(self.document, surface)

    def posed_carrier(self, surface: str, posed: TriangleMesh) -> TriangleMesh:
        """The same as it follows a posed mesh of the surface: the proxy posed, or that mesh itself."""
        found = self._derived.map(self.document, surface)
        return posed if found is None else found.followed(posed)

    @property
    def proxies(self) -> dict[str, SurfaceMap]:
        """By name of a surface whose contacts run on a proxy: the map to it."""
        maps = ((name, self._derived.map(self.document, name)) for name in self.document.surfaces)
        return {name: found for name, found in maps if found is not None}

    def on_carrier(self, surface: str, points: SurfacePoints) -> SurfacePoints:
        """Points of a surface, checked, on the mesh that its contacts run on. Raises InvalidInput."""
        self.check_points(surface, points)
        found = self._derived.map(self.document, surface)
        return points if found is None else found.to_proxy(points)

    def seen(self, surface: str, carried: SurfacePoints) -> SurfacePoints:
        """Points of the mesh that contacts run on, on the surface's own."""
        return self._derived.seen(self.document, surface, carried)

    def check_points(self, surface: str, points: SurfacePoints, *, on_carrier: bool = False) -> None:
        """There are points, and all of them lie on the mesh of a surface, or on the one that its contacts run on.
        Raises InvalidInput."""
        count = len((self.carrier(surface) if on_carrier else self.mesh(surface)).faces)
        if not len(points):
            raise InvalidInput(f"expected a surface point or several on {surface!r}, but got none.")
        outside = (points.faces < 0) | (points.faces >= count)  # (k,)
        if outside.any():
            bad = int(points.faces[np.argmax(outside)])
            raise InvalidInput(f"{surface!r} has the faces 0..{count - 1}, but got a point in face {bad}.")

    def axis_request(self, surface: str, patch: str, points: SurfacePoints) -> AxisRequest:
        """What an axis generator gets for a patch: bones of the rig, and the axes drawn on the surface so far.

        points, and all points in the request: on the mesh that contacts of the surface run on (`carrier`).
        """
        others = {
            other.name: self.axis(other.name).points
            for other in self.document.patches.values()
            if other.surface == surface and other.name != patch and other.original
        }
        rig = self._rigs.get(surface)
        bones, owner = bones_of(rig, self.seen(surface, points)) if rig is not None else (None, None)
        return AxisRequest(self.carrier(surface), points, bones, owner, others)

    # -- patches -------------------------------------------------------------------------------------------------

    def mesh_of(self, patch: str) -> TriangleMesh:
        """The mesh that a patch lies on."""
        return self.mesh(self.document.patch(patch).surface)

    def carrier_of(self, patch: str) -> TriangleMesh:
        """The mesh that a patch runs on: that of its root, its axis and its reconstruction."""
        return self.carrier(self.document.patch(patch).surface)

    def axis(self, patch: str) -> Axis:
        """The axis of a patch where it is now, on the mesh that it runs on (`carrier_of`)."""
        return self._derived.axis(self.document, patch)

    def axis_points(self, patch: str) -> SurfacePoints:
        """The points of the axis of a patch on the mesh that it lies on (`mesh_of`)."""
        return self._derived.axis_points(self.document, patch)

    def root(self, patch: str) -> Root:
        """Where the axis of a patch starts now, whether it is the child of another or not; on `carrier_of`."""
        return self._derived.root(self.document, patch)

    def reconstruction(self, patch: str) -> PatchPoints:
        """A patch where it is now, with what ran off a boundary; on the mesh that it runs on (`carrier_of`)."""
        return self._derived.patch(self.document, patch)

    def points(self, patch: str) -> SurfacePoints:
        """The points of a patch where they are now, on the mesh that it lies on (`mesh_of`)."""
        return self._derived.points(self.document, patch)

    def area(self, patch: str) -> PatchArea:
        """The patch triangulated: area on its surface, boundary loops."""
        positions = self.points(patch).positions(self.mesh_of(patch))
        return measure_area(self.document.shape_of(patch), positions)

    def distortion(self, patch: str, other: str) -> Distortion:
        """How a patch that shares its shape with another is stretched against it."""
        here, there = self.document.patch(patch), self.document.patch(other)
        if here.shape != there.shape:
            raise CommandRejected(
                f"{patch!r} and {other!r} do not share a shape, so no point of one is a point of the other."
            )
        mesh, mesh_there = self.mesh_of(patch), self.mesh_of(other)
        points, points_there = self.points(patch), self.points(other)
        ratio = self.document.surface(there.surface).meters_per_unit
        ratio /= self.document.surface(here.surface).meters_per_unit
        return measure_distortion(
            self.area(patch).triangles,
            points.positions(mesh),
            points.normals(mesh),
            points_there.positions(mesh_there) * ratio,
            points_there.normals(mesh_there),
            mirrored=here.mirrored != there.mirrored,
        )

    def crowded(self, copies: Iterable[str]) -> dict[str, float]:
        """By copy, the share of its points that lie on a part of these copies which is elsewhere where they come
        from (`contact.crowding`). Copies whose original is gone, or not loaded, are left out."""
        chosen: list[str] = []
        here: list[FloatArray] = []
        there: list[FloatArray] = []
        for name in copies:
            original = self._original_of(name)
            if original is not None:
                chosen.append(name)
                here.append(self._in_world(original))
                there.append(self._in_world(name))
        if not chosen:
            return {}
        found = crowded_points(np.concatenate(here), np.concatenate(there))
        parts = np.split(found, np.cumsum([len(part) for part in there])[:-1])
        return {name: float(part.mean()) for name, part in zip(chosen, parts, strict=True)}

    def _original_of(self, patch: str) -> str | None:
        """The patch that a copy was made of, where its mesh is loaded."""
        for name in self.document.partners(patch):
            other = self.document.patch(name)
            if other.original and other.surface in self._derived.meshes(self.document):
                return name
        return None

    def _in_world(self, patch: str) -> FloatArray:
        """(n, 3) points of a patch at rest where its surface stands, in metres."""
        surface = self.document.surface(self.document.patch(patch).surface)
        at = self.points(patch).positions(self.mesh_of(patch))
        return surface.meters_per_unit * transform_points(surface.world_from_surface, at)

    # -- pairs ---------------------------------------------------------------------------------------------------

    def pairs(self) -> tuple[PairGeometry, ...]:
        """Every pair with its points, in the order of the document."""
        return tuple(self.pair(name) for name in self.document.pairs)

    def pair(self, name: str) -> PairGeometry:
        """One pair with its points: as many on either side, those that ran off a boundary with weight 0."""
        pair = named(self.document.pairs, name, "pair")
        ends = [self.document.patch(end) for end in (pair.manipulator, pair.object)]
        here, there = (self.reconstruction(end.name) for end in ends)
        points, points_there = (self.points(end.name) for end in ends)
        shape = self.document.shapes[ends[0].shape]
        other = np.arange(len(shape))
        if ends[0].shape != ends[1].shape:
            other = correspond(shape, self.document.shapes[ends[1].shape])
        fits = ~(here.ran_off | there.ran_off[other])  # (k,)
        weights = shape.weights * shape.meters_per_unit**2 * pair.weight * fits
        return PairGeometry(
            pair, ends[0].surface, ends[1].surface, points, points_there[other], weights
        )  # fmt: skip
