"""What a brush is: it turns a gesture into points on a surface, chosen by a plugin (hook `contact_brushes`).

A brush never sees a window. What it needs of one arrives as data: the points that the pointer passed over, or
screen positions with a callable that turns them into rays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from contact_core.arrays import FloatArray, frozen
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.transform import transform_points

ScreenToRays = Callable[[FloatArray], tuple[FloatArray, FloatArray]]  # (k, 2) -> origins (k, 3), directions (k, 3)


@dataclass(frozen=True, eq=False)
class Screen:
    """A surface that may hide what is painted on. mesh: in any space. mesh_from_rays: (4, 4) takes the space of a
    gesture's rays there, affine; so its tree serves wherever it stands."""

    mesh: TriangleMesh
    mesh_from_rays: FloatArray

    def distances(self, origins: FloatArray, directions: FloatArray) -> FloatArray:
        """(k,) along rays (k, 3) of the gesture's space to the surface, inf where they miss."""
        move = self.mesh_from_rays
        cast = Locator.of(self.mesh).cast(transform_points(move, origins), directions @ move[:3, :3].T)
        return cast.distance


@dataclass(frozen=True, eq=False)
class BrushGesture:
    """One gesture over one mesh.

    path: the k surface points that the pointer passed over, in order. screen: (c, 2) positions of the pointer, or
    control points, in the host's screen units (pixels), and rays: the callable that turns screen positions into
    rays in surface space. A gesture drawn on the screen may leave its path empty: `contact_core.contact.pointer`
    then finds what the pointer passed over. seen: the same faces where the artist sees them, when the surface is
    posed (`mesh.with_points(posed)`; keep it over a stroke, it holds the tree that rays ask), in the space of the
    rays; None: as at rest. before: other surfaces in that space, or screens, which hide what lies behind. radius,
    spacing: surface units; 0 leaves the choice to the brush. seed: for brushes that sample; equal gestures give
    equal points. Raises InvalidInput where `seen` has other faces.
    """

    mesh: TriangleMesh
    path: SurfacePoints
    radius: float = 0.0
    spacing: float = 0.0
    screen: FloatArray | None = None
    rays: ScreenToRays | None = None
    seed: int = 0
    seen: TriangleMesh | None = None
    before: tuple[TriangleMesh | Screen, ...] = ()

    def __post_init__(self) -> None:
        if self.seen is None or self.seen.faces is self.mesh.faces:
            return
        if len(self.seen.points) != len(self.mesh.points) or not np.array_equal(self.seen.faces, self.mesh.faces):
            raise InvalidInput(
                f"a posed surface has the faces of the mesh ({self.mesh}), but {self.seen} has others; make it with"
                " mesh.with_points(posed)."
            )

    @property
    def is_drawn(self) -> bool:
        """Whether it says only on the screen where the pointer was."""
        return not len(self.path) and self.screen is not None and self.rays is not None


@dataclass(frozen=True, eq=False)
class BrushMark:
    """What a brush leaves. points: n surface points. strength: (n,) 0..1, 1 where a brush has no falloff."""

    points: SurfacePoints
    strength: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "strength", frozen(self.strength, float, (len(self.points),), "strength"))
        if len(self.strength) and not (self.strength.min() >= 0.0 and self.strength.max() <= 1.0):
            raise InvalidInput(f"the strength of a brush lies in 0..1, but got {float(self.strength.max())}.")


@runtime_checkable
class Brush(Protocol):
    """Turns a gesture into a mark. `erases`: the mark removes what lies under it instead of adding.

    Settings of its own are fields, see `contact_core.settings`.
    """

    @property
    def name(self) -> str: ...

    @property
    def summary(self) -> str: ...

    @property
    def erases(self) -> bool: ...

    def mark(self, gesture: BrushGesture) -> BrushMark: ...
