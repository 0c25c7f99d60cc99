"""What every verb has at hand: the document, the meshes, the reconstructed patches, and where commands go."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np

from contact_core.contact.axis import Axis
from contact_core.contact.linkage import link_to
from contact_core.contact.patch import PatchPoints
from contact_core.contact.placement import Link, Placement, Root
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
        if heading is None:
            wanted = np.asarray(direction, dtype=float).reshape(1, 3)
            heading = complex(direction_to_heading(self.mesh(surface), point, wanted)[0])
        return Root.at(point, heading)

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
        from contact_core.contact.axis import reconstruct_axis

        return reconstruct_axis(
            self.mesh_of(patch),
            self.document.effective_axis(patch),
            root,
            mirrored=self.document.patch(patch).mirrored,
            unit=self.derived.unit(self.document, patch),
        )
