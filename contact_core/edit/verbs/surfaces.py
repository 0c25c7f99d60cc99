"""Surfaces of a session: the meshes and rigs behind the names in the document."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import numpy as np

from contact_core.document.document import Proxy, Surface
from contact_core.document.frozen_map import FrozenMap
from contact_core.edit.commands import (
    AddSurface,
    ClearPose,
    PlaceSurface,
    RebindSurface,
    RemoveSurface,
    RenameSurface,
    SetPose,
)
from contact_core.edit.verbs.group import VerbGroup
from contact_core.edit.verbs.proxying import carry, give_proxy
from contact_core.edit.verbs.rebinding import RebindReport, placed_tracks
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.topology import closed_manifold
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.rig.rig import Pose, Rig


class Surfaces(VerbGroup):
    """Add, rebind, rename, remove, place and pose surfaces, give broken ones proxies, and bring the meshes and rigs
    behind them."""

    @property
    def meshes(self) -> dict[str, TriangleMesh]:
        """The meshes that were brought, by the names of their surfaces in the document as it is now."""
        return self._editor.derived.meshes(self._document)

    def add(
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
        known = self._document.surfaces.get(name)
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
        self._editor.derived.bring(mesh)  # before the command: its listeners may ask for the mesh
        if rig is not None:
            self._editor.rigs[name] = rig
        if known is None:
            self._editor.do(AddSurface(wanted), origin="asset")
        elif known.digest != wanted.digest and known.proxy is not None:
            self._reshape(known, mesh)
        elif known.digest != wanted.digest:
            tracks = placed_tracks(self._editor, name, mesh, lambda root: root)
            same = replace(known, digest=wanted.digest)
            self._editor.do(RebindSurface(same, FrozenMap(), (), tracks), origin="asset")
        return self._document.surface(name)

    def _reshape(self, known: Surface, mesh: TriangleMesh) -> None:
        """The same triangles in another shape, which need another proxy."""
        if known.digest not in self._editor.derived.known_meshes:
            raise InvalidInput(
                f"{known.name!r} has another shape now than when its proxy was made: give the one before,"
                f" surfaces.rebind({known.name!r}, mesh, old_mesh=...)."
            )
        self.rebind(known.name, mesh)

    def rebind(self, name: str, mesh: TriangleMesh, *, old_mesh: TriangleMesh | None = None) -> RebindReport:
        """Put the contacts of a surface onto another mesh under the same name, and say how far they moved.

        The old mesh has to be known: brought before, or given. Undo goes back to it. A proxy is made anew, from the
        new mesh.
        """
        known = self._document.surface(name)
        if old_mesh is not None:
            if old_mesh.digest != known.digest:
                raise InvalidInput(f"the old mesh of {name!r} is not the one that its contacts were painted on.")
            self._editor.derived.bring(old_mesh)
        changed = replace(
            known,
            digest=mesh.digest,
            topology_digest=mesh.topology_digest,
            points=len(mesh.points),
            faces=len(mesh.faces),
        )
        carrier = mesh
        if known.proxy is not None:
            proxy, carrier = self._remade(known.proxy, mesh)
            changed = replace(changed, proxy=proxy)
        self._editor.derived.bring(mesh)
        return carry(self._editor, changed, carrier)

    def add_proxy(
        self,
        surface: str,
        maker: str | None = None,
        *,
        mesh: TriangleMesh | None = None,
        progress: Progress = NO_PROGRESS,
        **settings: Any,
    ) -> RebindReport:
        """Have the contacts of a surface run on a closed manifold near its mesh, and say how far they moved.

        Points are still picked and given on the surface's own mesh. maker: a proxy maker's name, with its settings;
        None is the default. mesh: a proxy of one's own instead, near the mesh. A surface that has one gets another.
        Raises InvalidInput for a mesh that is no closed manifold, MissingExtra, Cancelled.
        """
        if mesh is None:
            return give_proxy(self._editor, surface, maker, settings, progress)
        proxy = Proxy("", FrozenMap(), mesh.digest, len(mesh.faces))
        record = replace(self._document.surface(surface), proxy=proxy)
        return carry(self._editor, record, closed_manifold(mesh, surface))

    def remove_proxy(self, surface: str) -> RebindReport:
        """Have the contacts of a surface run on its own mesh again, and say how far they moved."""
        record = self._document.surface(surface)
        if record.proxy is None:
            raise InvalidInput(f"{surface!r} has no proxy.")
        return carry(self._editor, replace(record, proxy=None), self._editor.geometry.mesh(surface))

    def know_proxy(self, surface: str, mesh: TriangleMesh) -> None:
        """Bring the proxy mesh that the document names for a surface. Raises InvalidInput for any other."""
        proxy = self._document.surface(surface).proxy
        if proxy is None or proxy.digest != mesh.digest:
            raise InvalidInput(f"the contacts of {surface!r} do not run on that mesh.")
        self._editor.derived.bring(mesh)

    def _remade(self, proxy: Proxy, mesh: TriangleMesh) -> tuple[Proxy, TriangleMesh]:
        """A proxy like another, of another mesh."""
        if not proxy.maker:
            raise InvalidInput("the proxy was brought, and fits the old mesh only: remove it first (remove_proxy).")
        return self._editor.makers.proxy(mesh, proxy.maker, proxy.settings)

    def rename(self, surface: str, name: str) -> None:
        """Give a surface another name, everywhere."""
        self._keep_rig(surface, name)
        self._editor.do(RenameSurface(surface, name))

    def _keep_rig(self, surface: str, name: str) -> None:
        """The rig is known by both names: an undo brings the old one back."""
        if surface in self._editor.rigs:
            self._editor.rigs[name] = self._editor.rigs[surface]

    def remove(self, surface: str) -> None:
        """Take a surface out of the document. Raises CommandRejected where patches lie on it."""
        self._editor.do(RemoveSurface(surface))

    def place(self, surface: str, world_from_surface: Any) -> None:
        """Say where a surface stands in the scene: (4, 4), rigid."""
        self._editor.do(PlaceSurface(surface, np.asarray(world_from_surface, dtype=float)))

    def set_pose(self, surface: str, pose: Pose, *, title: str = "Pose") -> None:
        """Put a rig into a pose: the result of a solve, or the animator's own."""
        self._editor.do(SetPose(surface, pose, title))

    def clear_pose(self, surface: str) -> None:
        """Put a rig back to rest."""
        self._editor.do(ClearPose(surface))
