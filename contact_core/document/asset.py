"""What a reader brings out of a file and a sample generator makes: a mesh, perhaps with a rig."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

from contact_core.arrays import IntArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.rig.rig import Rig


@dataclass(frozen=True, eq=False)
class Asset:
    """One mesh or one skinned manipulator, welded and triangulated, with the way back to its source.

    mesh: the surface (a rig's rest pose). source_vertices: (n_source,) index of the mesh vertex that each of
    the file's own vertices became (-1: unused). source_faces: (m,) index of the file's own face (polygon) that
    each triangle came from. notes: sentences on what was repaired, guessed or left out. details: JSON-able
    facts for `contact inspect`. meters_per_unit: None where the format does not say.
    """

    name: str
    mesh: TriangleMesh
    rig: Rig | None = None
    source_vertices: IntArray | None = None
    source_faces: IntArray | None = None
    meters_per_unit: float | None = None
    up_axis: Literal["X", "Y", "Z"] = "Y"
    notes: tuple[str, ...] = ()
    details: dict[str, Any] = field(default_factory=dict)
