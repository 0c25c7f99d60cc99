"""What an axis generator is: the default axis of a patch, chosen by a plugin (hook `contact_axis_generators`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints


@dataclass(frozen=True, eq=False)
class AxisRequest:
    """What a generator gets.

    points: the n patch points on `mesh`. bones: (b, 2, 3) heads and tails of a manipulator's bones in the rest
    pose, surface units, and bone_of_point: (n,) the bone that owns each point (-1: none); None without a rig.
    other_axes: by patch name, axes already drawn on the same surface, for generators that keep a direction
    consistent.
    """

    mesh: TriangleMesh
    points: SurfacePoints
    bones: FloatArray | None = None
    bone_of_point: IntArray | None = None
    other_axes: Mapping[str, SurfacePoints] = field(default_factory=dict)


@runtime_checkable
class AxisGenerator(Protocol):
    """Chooses an axis for a patch.

    The result is an ordered sequence of at least two distinct points of the mesh, on the component that holds
    the patch. Neighbours are joined by shortest geodesics afterwards (`contact.axis.draw_axis`), so two points
    are enough for a straight axis. It depends on the set of patch points and not on their order, and it moves
    with the mesh under rigid motion. Raises InvalidInput with a sentence where a patch has no axis.
    Settings of its own are fields, see `contact_core.settings`.
    """

    @property
    def name(self) -> str: ...

    @property
    def summary(self) -> str: ...

    def generate(self, request: AxisRequest) -> SurfacePoints: ...
