"""What every verb has at hand: the document, the meshes, the reconstructed patches, and where commands go."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np

from contact_core.arrays import IntArray, frozen
from contact_core.contact.axis import Axis, reconstruct_axis
from contact_core.contact.linkage import link_to
from contact_core.contact.patch import PatchPoints, parameterize_patch
from contact_core.contact.placement import Link, Placement, Root
from contact_core.contact.shape import PatchCoordinates
from contact_core.document.document import ContactDocument
from contact_core.edit.command import Command
from contact_core.edit.derived import Derived
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import direction_to_heading


class Editor(ABC):
    """Reads a document with its geometry, and submits commands."""

    @property
    @abstractmethod
    def document(self) -> ContactDocument:
        """The document that verbs start from."""

    @property
    @abstractmethod
    def derived(self) -> Derived:
        """Reconstructed geometry, cached."""

    @abstractmethod
    def submit(self, command: Command, *, origin: str = "user") -> int:
        """Take a command; answers the revision. Raises CommandRejected."""

    def mesh(self, surface: str) -> TriangleMesh:
        """The mesh of a surface. Raises InvalidInput when the session was not given it."""
        return self.derived.mesh(self.document, surface)

    def mesh_of(self, patch: str) -> TriangleMesh:
        """The mesh that a patch lies on."""
        return self.mesh(self.document.patch(patch).surface)

    def axis(self, patch: str) -> Axis:
        """The axis of a patch where it is now."""
        return self.derived.axis(self.document, patch)

    def root(self, patch: str) -> Root:
        """Where the axis of a patch starts now, whether it hangs on a parent or not."""
        return self.derived.root(self.document, patch)

    def reconstruction(self, patch: str) -> PatchPoints:
        """The points of a patch where they are now, with what ran off a boundary."""
        return self.derived.patch(self.document, patch)

    def points(self, patch: str) -> SurfacePoints:
        """The points of a patch where they are now."""
        return self.reconstruction(patch).points

    def root_at(
        self, surface: str, point: SurfacePoints, heading: complex | None = None, direction: Any = None
    ) -> Root:
        """A root from one surface point and either a heading or a direction in surface space (3,)."""
        if (heading is None) == (direction is None):
            raise InvalidInput("a root needs either a heading or a direction in space.")
        self.check_points(surface, point)
        if heading is None:
            wanted = frozen(direction, np.float64, (3,), "a direction in space")[None]
            heading = complex(direction_to_heading(self.mesh(surface), point, wanted)[0])
        return Root.at(point, heading)

    def measured(self, patch: str, points: SurfacePoints, anchors: IntArray | None = None) -> PatchCoordinates:
        """Coordinates of points relative to the axis of a patch as it lies now, as they are before its scaling and
        mirroring. anchors: as for `parameterize_patch`."""
        return parameterize_patch(
            self.mesh_of(patch),
            self.axis(patch),
            points,
            anchors=anchors,
            shape=self.document.effective_axis(patch),
            mirrored=self.document.patch(patch).mirrored,
            unit=self.derived.unit(self.document, patch),
            engine=self.derived.engine,
        )

    def check_points(self, surface: str, points: SurfacePoints) -> None:
        """There are points, and all of them lie on the mesh of a surface. Raises InvalidInput."""
        count = len(self.mesh(surface).faces)
        if not len(points):
            raise InvalidInput(f"a surface point or several were wanted on {surface!r}, but none came.")
        outside = (points.faces < 0) | (points.faces >= count)  # (k,)
        if outside.any():
            bad = int(points.faces[np.argmax(outside)])
            raise InvalidInput(f"{surface!r} has the faces 0..{count - 1}, but a point in face {bad} came.")

    def check_axis_point(self, patch: str, point: int) -> None:
        """A patch has this axis point. Raises InvalidInput."""
        count = self.document.shape_of(patch).axis.point_count
        if not 0 <= point < count:
            raise InvalidInput(f"the axis of {patch!r} has the points 0..{count - 1}, but {point} came.")

    def point_indices(self, patch: str, indices: Any) -> IntArray:
        """(k,) rising, each once, of points that the patch has, k >= 1. Raises InvalidInput for any other."""
        count = len(self.document.shape_of(patch))
        if np.asarray(indices).dtype == bool:
            raise InvalidInput("point indices are whole numbers, but a mask came: pass numpy.flatnonzero(mask).")
        chosen = np.unique(frozen(indices, np.int64, (None,), "point indices"))
        if not len(chosen):
            raise InvalidInput(f"indices of points of {patch!r} were wanted, but none came.")
        if not 0 <= chosen[0] <= chosen[-1] < count:
            bad = int(chosen[0] if chosen[0] < 0 else chosen[-1])
            raise InvalidInput(f"{patch!r} has the points 0..{count - 1}, but {bad} came.")
        return chosen

    def relinked(self, child: str, link: Link, point: SurfacePoints, tangent: complex) -> Link:
        """The link that puts the child's linked axis point at `point` with `tangent` there."""
        return link_to(
            self.mesh_of(child),
            link.parent,
            self.axis(link.parent),
            point,
            tangent,
            parent_point=link.parent_point,
            own_point=link.own_point,
        )

    def placement_at(self, patch: str, root: Root) -> Placement:
        """The placement of the patch's own kind that puts its first axis point at `root`."""
        link = self.document.patch(patch).placement
        if not isinstance(link, Link):
            return root
        if link.own_point == 0:
            return self.relinked(patch, link, root.point(), root.heading)
        axis = self.axis_from(patch, root)
        point = axis.points[link.own_point]
        return self.relinked(patch, link, point, complex(axis.tangents[link.own_point]))

    def axis_from(self, patch: str, root: Root) -> Axis:
        """The axis that the patch would have at another root."""
        return reconstruct_axis(
            self.mesh_of(patch),
            self.document.effective_axis(patch),
            root,
            mirrored=self.document.patch(patch).mirrored,
            unit=self.derived.unit(self.document, patch),
        )
