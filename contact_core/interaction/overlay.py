"""What is drawn over the scene, as data: arrays in the world, colours, and sizes in pixels.

Nothing here is a widget: a front end draws each kind in its own way, and asks the interaction what is under the
pointer. Sizes in pixels are of a plain screen: multiply by the view's `pixel_ratio`. Colours are RGB, 0 to 1.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, fields, replace
from typing import Literal, TypeAlias

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.document.document import Color
from contact_core.interaction.view import View

WHITE: Color = (1.0, 1.0, 1.0)
ACCENT: Color = (1.0, 0.78, 0.25)
HandleRole: TypeAlias = Literal["root", "bend", "end", "joint", "move", "turn", "centre"]


@dataclass(frozen=True, eq=False)
class Decal:
    """A filled patch. points: (n, 3) world. triangles: (t, 3) rows of points; the same array as long as the patch
    keeps its shape, so that only points have to be sent again. A patch without triangles is drawn as dots."""

    patch: str
    surface: str
    points: FloatArray
    triangles: IntArray
    color: Color
    selected: bool = False
    opacity: float = 0.9


@dataclass(frozen=True, eq=False)
class AxisLine:
    """A line on a surface: the axis of a patch, a link, what is being drawn. points: (k, 3) world, in order.
    surface: that on which it lies alone."""

    points: FloatArray
    color: Color = WHITE
    width: float = 2.0
    patch: str | None = None
    arrow: bool = False
    surface: str | None = None


@dataclass(frozen=True, eq=False)
class Handle:
    """Something to take hold of. name: unique among the handles shown. position: (3,) world. radius: pixels, within
    which a press takes it. axis: (3,) world, the direction along which (role "move") or about which ("turn") it
    works."""

    name: str
    role: HandleRole
    position: FloatArray
    radius: float = 7.0
    color: Color = ACCENT
    axis: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class PairLine:
    """Which patch meets which, and how well. starts, ends: (k, 3) world, points that are to touch. middle: the line
    between the roots, (2, 3)."""

    pair: str
    starts: FloatArray
    ends: FloatArray
    middle: FloatArray
    color: Color
    selected: bool = False


@dataclass(frozen=True, eq=False)
class BrushRing:
    """The brush under the pointer. centre, normal: (3,) world. radius: world units."""

    centre: FloatArray
    normal: FloatArray
    radius: float
    color: Color = WHITE


@dataclass(frozen=True, eq=False)
class Ghost:
    """Something that is not there yet: a posed hand that is proposed, a copy before it is made. points: (n, 3)
    world. triangles: (t, 3); a ghost without is drawn as dots. surface: which it is a ghost of, and which hides it
    where both are in one place."""

    points: FloatArray
    triangles: IntArray
    color: Color
    opacity: float = 0.35
    surface: str | None = None


@dataclass(frozen=True, eq=False)
class Label:
    """Text at a place. position: (3,) world. surface: on which that is."""

    text: str
    position: FloatArray
    color: Color = WHITE
    surface: str | None = None


@dataclass(frozen=True, eq=False)
class StrokeTint:
    """What a stroke has covered so far: colour the surface where distances are within the radius.

    surface: its name. distances: (n,) per vertex, surface units, inf where far. changed: (k,) the vertices that the
    last sample lowered: all that has to be sent. Interpolate the distances, not colours: then the rim is sharp.
    """

    surface: str
    distances: FloatArray
    changed: IntArray
    radius: float
    color: Color
    erases: bool = False


@dataclass(frozen=True, eq=False)
class SkinHeat:
    """How far a skin is from what it may touch. distances: (n,) per vertex, metres, depth below zero. colors:
    (n, 3) of the same vertices, to be drawn in place of the surface's own."""

    surface: str
    distances: FloatArray
    colors: FloatArray


@dataclass(frozen=True, eq=False)
class Overlay:
    """Everything that is drawn over the scene. tint: while a stroke is painted."""

    decals: tuple[Decal, ...] = ()
    axes: tuple[AxisLine, ...] = ()
    handles: tuple[Handle, ...] = ()
    pair_lines: tuple[PairLine, ...] = ()
    rings: tuple[BrushRing, ...] = ()
    ghosts: tuple[Ghost, ...] = ()
    labels: tuple[Label, ...] = ()
    heats: tuple[SkinHeat, ...] = ()
    tint: StrokeTint | None = None

    def joined(self, other: Overlay) -> Overlay:
        """Both; of two tints that of the other."""
        kinds = [each.name for each in fields(self) if each.name != "tint"]
        return Overlay(**{name: getattr(self, name) + getattr(other, name) for name in kinds},
                       tint=other.tint or self.tint)  # fmt: skip

    def on(self, surfaces: Collection[str], *, pointed: bool) -> Overlay:
        """What is drawn in a view that shows these surfaces alone: no pairs, and what belongs to no surface (the
        brush, handles) only where the pointer is."""

        def here(each: Decal | AxisLine | Ghost | Label) -> bool:
            return pointed if each.surface is None else each.surface in surfaces

        return replace(
            self,
            decals=tuple(filter(here, self.decals)),
            axes=tuple(filter(here, self.axes)),
            ghosts=tuple(filter(here, self.ghosts)),
            labels=tuple(filter(here, self.labels)),
            pair_lines=(),
            handles=self.handles if pointed else (),
            rings=self.rings if pointed else (),
        )


NOTHING = Overlay()


def handle_under(handles: tuple[Handle, ...], view: View, pixel: FloatArray) -> Handle | None:
    """The handle that a press at a pixel (2,) takes: the nearest on the screen within its own radius."""
    if not handles:
        return None
    seen = view.project(np.stack([handle.position for handle in handles]))  # (h, 3)
    away = np.linalg.norm(seen[:, :2] - pixel, axis=1)
    reach = np.array([handle.radius for handle in handles]) * view.pixel_ratio
    away = np.where((seen[:, 2] > 0.0) & (away <= reach), away, np.inf)
    best = int(away.argmin())
    return handles[best] if np.isfinite(away[best]) else None
