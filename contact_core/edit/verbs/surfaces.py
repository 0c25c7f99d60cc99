"""Surfaces of a session: the meshes and rigs behind the names in the document."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import numpy as np

from contact_core.contact.axis_generator import AxisRequest
from contact_core.document.document import Surface
from contact_core.document.frozen_map import FrozenMap
from contact_core.edit.commands import AddSurface, RebindSurface
from contact_core.edit.verbs.editor import Editor
from contact_core.edit.verbs.rebinding import RebindReport, plan_rebind
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.bones import bones_of
from contact_core.rig.rig import Rig


class SurfaceVerbs(Editor):
    """Bring, rebind and pose the meshes behind surfaces.

    rigs: by surface. known_meshes: by content digest, those of earlier revisions among them.
    """

    rigs: dict[str, Rig]
    known_meshes: dict[str, TriangleMesh]

    @property
    def meshes(self) -> dict[str, TriangleMesh]:
        """The meshes that were brought, by the names of their surfaces in the document as it is now."""
        surfaces, known = self.document.surfaces.values(), self.known_meshes
        return {surface.name: known[surface.digest] for surface in surfaces if surface.digest in known}

    def add_surface(
        self,
        name: str,
        mesh: TriangleMesh,
        *,
        meters_per_unit: float = 1.0,
        up_axis: Literal["X", "Y", "Z"] = "Y",
        rig: Rig | None = None,
        world_from_surface: Any = None,
    ) -> Surface:
        """Bring the mesh of a surface; a name new to the document is added to it.

        A known name with the same content only brings the mesh. The same topology in another shape is bound
        silently. Another topology raises InvalidInput: `rebind` projects the contacts onto it.
        """
        known = self.document.surfaces.get(name)
        wanted = Surface(
            name,
            mesh.digest,
            mesh.topology_digest,
            len(mesh.points),
            len(mesh.faces),
            meters_per_unit,
            up_axis,
            None if rig is None else rig.name,
            np.eye(4) if world_from_surface is None else world_from_surface,
        )
        if known is not None and known.topology_digest != wanted.topology_digest:
            raise InvalidInput(
                f"{name!r} is another mesh now ({known.points} points and {known.faces} faces before,"
                f" {wanted.points} and {wanted.faces} now): use rebind to project its contacts onto the new one."
            )
        self.known_meshes[mesh.digest] = mesh  # before the command: who is told of it may ask for the mesh
        if rig is not None:
            self.rigs[name] = rig
        if known is None:
            self.submit(AddSurface(wanted), origin="asset")
        elif known.digest != wanted.digest:
            self.submit(RebindSurface(replace(known, digest=wanted.digest), FrozenMap(), ()), origin="asset")
        return self.document.surface(name)

    def rebind(self, name: str, mesh: TriangleMesh, *, old_mesh: TriangleMesh | None = None) -> RebindReport:
        """Put the contacts of a surface onto another mesh under the same name, and say how far they moved.

        The old mesh has to be known: brought before, or given. Undo goes back to it.
        """
        known = self.document.surface(name)
        if old_mesh is not None:
            if old_mesh.digest != known.digest:
                raise InvalidInput(f"the old mesh of {name!r} is not the one that its contacts were painted on.")
            self.known_meshes[old_mesh.digest] = old_mesh
        changed = replace(
            known,
            digest=mesh.digest,
            topology_digest=mesh.topology_digest,
            points=len(mesh.points),
            faces=len(mesh.faces),
        )
        command, report = plan_rebind(self, changed, mesh)
        self.known_meshes[mesh.digest] = mesh
        self.submit(command)
        return report

    def axis_request(self, surface: str, patch: str, points: SurfacePoints) -> AxisRequest:
        """What an axis generator gets for a patch: bones of the rig, and the axes drawn on the surface so far."""
        others = {
            other.name: self.axis(other.name).points
            for other in self.document.patches.values()
            if other.surface == surface and other.name != patch and other.original
        }
        rig = self.rigs.get(surface)
        bones, owner = bones_of(rig, points) if rig is not None else (None, None)
        return AxisRequest(self.mesh(surface), points, bones, owner, others)
