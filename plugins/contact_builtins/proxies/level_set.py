"""A proxy as a level set of the distance to a mesh, drawn back close to it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from contact_builtins.samples.fields import Field
from contact_builtins.samples.modelling import closed_surfaces
from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.settings import HasSettings, setting

_SIMPLER = 0.02  # cells that simplifying may move the surface: flat parts get large triangles
_GRAIN = 2.0**-20  # cells to which distances, then points, are rounded, so that machines agree
_MOST_LATTICE = 40_000_000  # points; each takes some 200 bytes


@dataclass(frozen=True)
class LevelSetProxy(HasSettings):
    """What lies within `offset` of the mesh is solid (manifold3d's level set, a closed manifold whatever the mesh
    is like); its outer surface is drawn back along the offset normals, so that lengths on it are those on the mesh.
    """

    name: ClassVar[str] = "level_set"
    summary: ClassVar[str] = "A closed offset surface, drawn back onto the mesh."
    default_for: ClassVar[str] = "repair"

    offset: float = setting(
        0.01,
        help="Gaps and holes narrower than twice this are closed.",
        unit="of the diagonal of the box round the surface",
        low=0.001,
        high=0.2,
    )
    cell: float | None = setting(
        None,
        help="Length of the cells it is made of; none: as the offset. Half of it takes eight times as long.",
        unit="of the diagonal",
        low=0.001,
        high=0.2,
    )
    lift: float = setting(
        0.25, help="Share of the offset that stays between the mesh and its proxy.", low=0.02, high=1.0
    )
    fill: bool = setting(False, help="Close wide holes, too: what is inside by the winding number counts as solid.")

    def make(self, mesh: TriangleMesh, progress: Progress = NO_PROGRESS) -> TriangleMesh:
        """The proxy of a mesh in its own units. Raises InvalidInput, MissingExtra, Cancelled."""
        if not mesh.bounding_box_diagonal > 0.0:
            raise InvalidInput("a proxy needs a mesh with faces and an extent, but it has none.")
        offset = self.offset * mesh.bounding_box_diagonal
        cell = (self.cell or self.offset) * mesh.bounding_box_diagonal
        used = mesh.points[mesh.used_points]
        margin = offset + 2.0 * cell
        low, high = used.min(axis=0) - margin, used.max(axis=0) + margin
        lattice = 2.2 * float(np.prod((high - low) / cell))
        if lattice > _MOST_LATTICE:
            raise InvalidInput(
                f"a proxy of cells of {cell / mesh.bounding_box_diagonal:g} of the diagonal needs {lattice:.2g}"
                " lattice points: take larger cells."
            )
        progress.tell(0.0, "Measuring distances")
        pieces = closed_surfaces(
            self._field(mesh, offset, cell), low, high, cell, ("A proxy", "proxies"),
            steep=2.5 if self.fill else 1.05, simpler=_SIMPLER,
        )  # fmt: skip
        progress.tell(0.8, "Drawing the surface back")
        return self._drawn_back(mesh, outer(pieces), _GRAIN * cell)

    def _field(self, mesh: TriangleMesh, offset: float, cell: float) -> Field:
        locator = Locator.of(mesh)

        def field(points: FloatArray) -> FloatArray:
            """(n,) negative within the offset of the mesh and, where it is filled, inside."""
            distance = locator.closest(points).distance
            value = distance - offset
            if self.fill:
                far = value > -0.5 * offset
                # distance times what lacks to "inside": 0 across the middle of a hole, and as steep as a distance
                outside = 2.0 * distance[far] * (0.5 - locator.winding_number(points[far]))
                value[far] = np.minimum(value[far], outside)
            return np.round(value / (_GRAIN * cell)) * (_GRAIN * cell)

        return field

    def _drawn_back(self, mesh: TriangleMesh, shell: TriangleMesh, grain: float) -> TriangleMesh:
        feet = Locator.of(mesh).closest(shell.points).points.positions(mesh)
        points = feet + self.lift * (shell.points - feet)
        return shell.with_points(np.round(points / grain) * grain)


def outer(pieces: list[TriangleMesh]) -> TriangleMesh:
    """Closed surfaces as one mesh, without the walls of hollows, which are wound inwards."""
    kept = [piece for piece in pieces if signed_volume(piece) > 0.0]
    starts = np.cumsum([0, *(len(piece.points) for piece in kept)])
    return TriangleMesh(
        np.concatenate([piece.points for piece in kept]),
        np.concatenate([piece.faces + start for piece, start in zip(kept, starts, strict=False)]),
    )


def signed_volume(mesh: TriangleMesh) -> float:
    """The volume that a closed mesh holds (cubic surface units), negative where it is wound inwards."""
    a, b, c = (mesh.points[mesh.faces[:, k]] for k in range(3))
    return float(np.einsum("mi,mi->", a, np.cross(b, c))) / 6.0
