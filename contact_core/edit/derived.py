"""Derived geometry: where patches are on their meshes, reconstructed when asked for and kept in a bounded cache.

Nothing of it is in the document. The cache is keyed by values (digests, roots, angles), so undo and redo find what
was there, and equal patches share it.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Mapping
from dataclasses import replace
from typing import TypeVar, cast

from contact_core.contact.axis import Axis, reconstruct_axis, root_from_point
from contact_core.contact.linkage import follow_link, follow_walk
from contact_core.contact.patch import PatchPoints, points_from_axis
from contact_core.contact.placement import Link, Root, Walk
from contact_core.document.document import ContactDocument, Surface
from contact_core.errors import InvalidInput
from contact_core.geometry.engine import EXACT, GeodesicEngine
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_map import SurfaceMap
from contact_core.geometry.surface_point import SurfacePoints

MOST_POINTS = 1_000_000  # about 60 MB
T = TypeVar("T")


class Derived:
    """Roots, axes and points of patches on the meshes of a session.

    Contacts run on the mesh of their surface, or on its proxy where it has one (`carrier`): roots, axes and patches
    are there. `points` and `axis_points` are on the surface's own mesh, which people see.

    computed: how many axes and point sets were traced so far; tests guard the cost by counting. engine: measures
    the coordinates of points on their patches; what is reconstructed here is walked by the exact tracer alone.
    known_meshes: by content digest, those of earlier revisions among them. proxy_of: makes the proxy that the
    record of a surface names, of its mesh, where that proxy is not known.
    """

    def __init__(
        self, engine: GeodesicEngine = EXACT, known_meshes: Mapping[str, TriangleMesh] | None = None
    ) -> None:
        self.engine = engine
        self.known_meshes = dict(known_meshes or {})  # after a rebind, undo finds the old one
        self.proxy_of: Callable[[Surface, TriangleMesh], TriangleMesh] = _no_proxy
        self._kept: OrderedDict[Hashable, tuple[object, int]] = OrderedDict()
        self._points = 0
        self.computed = 0

    def apart(self) -> Derived:
        """The same meshes and engine with a cache of its own, for another thread."""
        found = Derived(self.engine, self.known_meshes)
        found.proxy_of = self.proxy_of
        return found

    def bring(self, mesh: TriangleMesh) -> None:
        """Know a mesh from now on, for every surface of every document that has its content."""
        self.known_meshes[mesh.digest] = mesh

    def meshes(self, document: ContactDocument) -> dict[str, TriangleMesh]:
        """The meshes that were brought, by the names of their surfaces in a document."""
        known = self.known_meshes
        return {s.name: known[s.digest] for s in document.surfaces.values() if s.digest in known}

    def mesh(self, document: ContactDocument, surface: str) -> TriangleMesh:
        """The mesh of a surface. Raises InvalidInput where the session was not given it."""
        try:
            return self.known_meshes[document.surface(surface).digest]
        except KeyError:
            raise InvalidInput(
                f"the mesh of {surface!r} is not loaded: give it to the session by surfaces.add({surface!r}, mesh)."
            ) from None

    def carrier(self, document: ContactDocument, surface: str) -> TriangleMesh:
        """The mesh that the contacts of a surface run on: its proxy, where it has one. Raises InvalidInput."""
        record, mesh = document.surface(surface), self.mesh(document, surface)
        if record.proxy is None:
            return mesh
        if record.proxy.digest not in self.known_meshes:
            self.known_meshes[record.proxy.digest] = self.proxy_of(record, mesh)
        return self.known_meshes[record.proxy.digest]

    def map(self, document: ContactDocument, surface: str) -> SurfaceMap | None:
        """The map between a surface and its proxy, None where it has none."""
        if document.surface(surface).proxy is None:
            return None
        return SurfaceMap.of(self.mesh(document, surface), self.carrier(document, surface))

    def seen(self, document: ContactDocument, surface: str, points: SurfacePoints) -> SurfacePoints:
        """Points of the carrier on the surface's own."""
        found = self.map(document, surface)
        return points if found is None else found.to_source(points)

    def points(self, document: ContactDocument, name: str) -> SurfacePoints:
        """The points of a patch on its surface's own mesh."""
        surface, carried = document.patch(name).surface, self.patch(document, name).points
        if document.surface(surface).proxy is None:
            return carried
        coordinates = document.shape_of(name).coordinates.digest
        key = ("seen", document.surface(surface).digest, self._axis_key(document, name), coordinates)
        return self._cached(key, len(carried), lambda: self.seen(document, surface, carried))

    def axis_points(self, document: ContactDocument, name: str) -> SurfacePoints:
        """The points of the axis of a patch on its surface's own mesh."""
        return self.seen(document, document.patch(name).surface, self.axis(document, name).points)

    def root(self, document: ContactDocument, name: str) -> Root:
        """Where the axis of a patch starts, for a child as its parent's axis leads there."""
        self._trace_ancestors(document, name)
        return self._root_and_cut(document, name)[0]

    def walked(self, mesh: TriangleMesh, digest: str, walk: Walk) -> Root:
        """Where a walk ends on a mesh with that content digest."""
        return self._cached(("walk", digest, walk), 1, lambda: follow_walk(mesh, walk))

    def axis(self, document: ContactDocument, name: str) -> Axis:
        """The axis of a patch on the mesh that contacts of its surface run on."""
        self._trace_ancestors(document, name)
        return self._axis(document, name)

    def _trace_ancestors(self, document: ContactDocument, name: str) -> None:
        """Those not traced yet, from the top down: a child finds its parent's axis, however deep the tree is."""
        missing: list[str] = []
        for ancestor in document.ancestors(name):
            if ("axis", self._axis_key(document, ancestor)) in self._kept:
                break
            missing.append(ancestor)
        for ancestor in reversed(missing):
            self._axis(document, ancestor)

    def _axis(self, document: ContactDocument, name: str) -> Axis:
        surface, shape = document.patch(name).surface, document.surface_axis(name)

        def trace() -> Axis:
            self.computed += 1
            root, cut = self._root_and_cut(document, name)
            axis = reconstruct_axis(self.carrier(document, surface), shape, root)
            return axis if cut == 0.0 else replace(axis, remaining=axis.remaining + cut)

        return self._cached(("axis", self._axis_key(document, name)), shape.point_count, trace)

    def patch(self, document: ContactDocument, name: str) -> PatchPoints:
        """A patch on the mesh that contacts of its surface run on."""
        patch = document.patch(name)
        coordinates = document.shapes[patch.shape].coordinates

        def trace() -> PatchPoints:
            axis = self.axis(document, name)
            self.computed += 1
            carrier = self.carrier(document, patch.surface)
            return points_from_axis(carrier, coordinates, axis, document.surface_axis(name))

        return self._cached(("points", *self.key(document, name)), len(coordinates), trace)

    def key(self, document: ContactDocument, name: str) -> tuple[Hashable, ...]:
        """All that the axis and points of a patch depend on, by value: where it is the same, so are they."""
        return self._axis_key(document, name), document.shape_of(name).coordinates.digest

    def _root_and_cut(self, document: ContactDocument, name: str) -> tuple[Root, float]:
        """The root, and the length that boundaries cut off on the way to it from the parents (0 without)."""
        link = document.patch(name).placement
        if isinstance(link, Root):
            return link, 0.0
        if isinstance(link, Walk):
            carrier = self.carrier(document, document.patch(name).surface)
            return self.walked(carrier, document.surface(document.patch(name).surface).carrier_digest, link), 0.0
        key = ("root", self._axis_key(document, link.parent), link, self._shape_key(document, name))
        return self._cached(key, 1, lambda: self._linked_root(document, name, link))

    def _linked_root(self, document: ContactDocument, name: str, link: Link) -> tuple[Root, float]:
        mesh = self.carrier(document, document.patch(name).surface)
        parent = self._axis(document, link.parent)
        point, tangent, cut = follow_link(mesh, parent, link)
        root, cut_off = root_from_point(mesh, document.surface_axis(name), link.own_point, point, tangent)
        return root, cut + cut_off + float(parent.remaining[link.parent_point])

    def _axis_key(self, document: ContactDocument, name: str) -> Hashable:
        """All that the axis of a patch depends on, by value: its own placement and shape, and those above it."""
        line = (name, *document.ancestors(name))
        return tuple((document.patch(each).placement, self._shape_key(document, each)) for each in line)

    def _shape_key(self, document: ContactDocument, name: str) -> Hashable:
        patch = document.patch(name)
        own = (patch.turns, patch.along, patch.spread, patch.mirrored)
        carrier = document.surface(patch.surface).carrier_digest
        return carrier, document.shapes[patch.shape].axis.digest, own, document.unit(name)

    def _cached(self, key: Hashable, size: int, make: Callable[[], T]) -> T:
        kept = self._kept.get(key)
        if kept is not None:
            self._kept.move_to_end(key)
            return cast("T", kept[0])
        value = make()
        self._kept[key] = (value, size)
        self._points += size
        while self._points > MOST_POINTS and len(self._kept) > 1:
            self._points -= self._kept.popitem(last=False)[1][1]
        return value


def _no_proxy(surface: Surface, mesh: TriangleMesh) -> TriangleMesh:
    raise InvalidInput(f"the proxy of {surface.name!r} is made by a session with its plugins, not here.")
