"""Paint and erase with any brush, on the skin as it is seen.

While the pointer moves only what is new is measured: how far each vertex lies from the stroke. The brush itself
works once, at release, on the same gesture.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from contact_builtins.tools.drag import patch_under
from contact_core.arrays import BoolArray, FloatArray
from contact_core.contact.brush import Brush, BrushGesture, Screen
from contact_core.contact.pointer import gestures_along
from contact_core.contact.stroke_field import StrokeField
from contact_core.edit.verbs.painting import PALETTE
from contact_core.errors import CommandRejected, InvalidInput
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.interaction.desk import Desk
from contact_core.interaction.events import Pointer
from contact_core.interaction.overlay import NOTHING, WHITE, AxisLine, BrushRing, Overlay, StrokeTint
from contact_core.interaction.seen import Hit
from contact_core.interaction.tool import Gesture
from contact_core.interaction.view import shows
from contact_core.plugins.registry import BRUSHES
from contact_core.settings import HasSettings, setting

Shows: TypeAlias = Literal["area", "line"]
_ERASED = (0.15, 0.15, 0.15)
_STEP = 2.0  # pixels between samples of the preview
_PART = 0.04  # of the surface's size: the radius where none is set
_APART = 0.2  # of the radius: samples of the preview that are nearer to one before are left out


@dataclass(frozen=True)
class Paint(HasSettings):
    """On the active patch where the stroke begins on its surface, else on that which it begins on, or a new one.

    shows: how the stroke is previewed, by the area within the radius or by the line that was drawn.
    """

    name: str = "paint"
    key: str = "B"
    summary: str = "paint a patch with a brush"
    shows: Shows = "area"
    brush: str = setting("disk", help="which brush paints")
    radius: float | None = setting(
        None, above=0.0, unit="scene units", help="how far from the stroke; a 25th of the surface's size by default"
    )
    spacing: float = setting(
        0.0, low=0.0, unit="scene units", help="how far points lie apart; 0: as the brush likes"
    )
    pressure: bool = setting(False, help="a pen that is pressed less paints a narrower stroke")
    fresh: bool = setting(False, help="every stroke paints a patch of its own")
    generator: str | None = setting(None, help="which axis generator lays the axis of a new patch; any by default")

    @property
    def hint(self) -> str:
        """For the line of status."""
        return "paint; Ctrl erases, Shift begins a new patch, [ and ] change the radius"

    def hover(self, desk: Desk, pointer: Pointer) -> Overlay:
        hit = desk.pick(pointer)
        return NOTHING if hit is None else Overlay(rings=(self.ring(desk, hit),))

    def ring(self, desk: Desk, hit: Hit) -> BrushRing:
        """The brush round a hit."""
        return BrushRing(hit.position, hit.normal, self.radius_on(desk, hit.surface), WHITE)

    def radius_on(self, desk: Desk, surface: str) -> float:
        """The radius on a surface, world units."""
        seen = desk.scene.surfaces[surface]
        return self.radius or _PART * seen.scale * seen.rest.bounding_box_diagonal

    def resized(self, desk: Desk, factor: float) -> float:
        """The radius larger by a factor, world units: that of the surface which tools work on, or of the first."""
        surface = desk.selection.surface or next(iter(desk.scene.surfaces), None)
        if self.radius is None and surface not in desk.scene.surfaces:
            raise InvalidInput("there is no surface to measure the radius against.")
        return factor * (self.radius or self.radius_on(desk, str(surface)))

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        erases = pointer.holds("ctrl")
        brush: Brush = desk.made(BRUSHES, "eraser" if erases else self.brush)
        return begun(self, desk, pointer, brush)


@dataclass(frozen=True)
class Erase(Paint):
    """Takes away from the active patch, or from that where the stroke begins."""

    name: str = "erase"
    key: str = "E"
    summary: str = "take points of a patch away"
    brush: str = setting("eraser", help="which brush erases")

    @property
    def hint(self) -> str:
        return "erase; [ and ] change the radius"


LASSO = Paint("lasso", "L", "paint what a closed curve holds", "line", brush="lasso")
CURVE = Paint("curve", "C", "paint points along a curve", "line", brush="curve")


def begun(tool: Paint, desk: Desk, pointer: Pointer, brush: Brush) -> Gesture | None:
    """The stroke that begins here; None beside every surface."""
    hit = desk.pick(pointer)
    if hit is None:
        return None
    active, found = desk.selection.patch, patch_under(desk, pointer)
    patch = None if found is None else found[0]
    if active is not None and desk.document.patch(active).surface == hit.surface:
        patch = active
    if brush.erases and patch is None:
        return None
    if not brush.erases and (tool.fresh or pointer.holds("shift")):
        patch = None
    return Painting(tool, desk, pointer, hit, brush, patch)


class Painting(Gesture):
    """One stroke over one surface. patch: None for a new one."""

    def __init__(
        self, tool: Paint, desk: Desk, pointer: Pointer, hit: Hit, brush: Brush, patch: str | None
    ) -> None:
        self.tool, self.desk, self.view, self.brush = tool, desk, desk.view, brush
        self.scene, self.seen = desk.scene, desk.scene.surfaces[hit.surface]
        self.patch = patch or desk.document.free_name("contact")
        self.is_new, self.before = patch is None, desk.selection
        self.pixels, self.shows = [pointer.pixel], tool.shows
        self.pressure = pointer.pressure
        self._check_locks(patch)
        self.hides = self._screens() if desk.worked_on is None else ()
        radius = tool.radius_on(desk, hit.surface) / self.seen.scale
        self.field = StrokeField.begun(self.seen.rest, radius)
        self.line = [hit.position]
        self.sampled = np.zeros((0, 3))  # rest positions of the samples so far
        document = desk.document
        palette = PALETTE[len(document.patches) % len(PALETTE)]
        self.color = palette if self.is_new else document.patch(self.patch).color
        self._extend(hit.point)
        desk.stroke  # noqa: B018  (a session that cannot be edited refuses here, and not after the stroke)

    def _check_locks(self, patch: str | None) -> None:
        """Raises CommandRejected before anything is painted that could not be kept."""
        if patch is None:
            self.desk.locks.check_surface(self.seen.name)
        else:
            self.desk.locks.check_patches(self.desk.document, (patch,))

    def _screens(self) -> tuple[Screen, ...]:
        """What stands between the eye and the surface: every other one."""
        shown = (seen for name, seen in self.scene.surfaces.items() if shows(self.view, name))
        others = (seen for seen in shown if seen is not self.seen)
        return tuple(Screen(each.mesh, each.surface @ self.seen.world) for each in others if len(each.mesh.faces))

    def move(self, pointer: Pointer) -> None:
        last = self.pixels[-1]
        length = float(np.linalg.norm(pointer.pixel - last))
        if length == 0.0:
            return
        count = min(max(int(np.ceil(length / (_STEP * self.view.pixel_ratio))), 1), 2000)
        along = last + (np.arange(1, count + 1) / count)[:, None] * (pointer.pixel - last)
        self.pixels.append(pointer.pixel)
        self.pressure = max(self.pressure, pointer.pressure)
        points, rows = self.scene.hits(self.view, along, self.seen.name)
        if len(rows) and self.hides:
            seen = self._in_front(along[rows], self.seen.positions(points))
            points, rows = points[np.flatnonzero(seen)], rows[seen]
        if len(rows):
            self.line.append(self.seen.positions(points[len(points) - 1])[0])
            self._extend(points)

    def _in_front(self, pixels: FloatArray, at: FloatArray) -> BoolArray:
        """(k,) whether nothing hides world positions (k, 3) that rays through pixels (k, 2) meet."""
        origins, directions = self.seen.rays_of(self.view, pixels)
        world, _ = self.view.rays(pixels)
        away = np.linalg.norm(at - world, axis=1)
        result = np.ones(len(pixels), bool)
        for screen in self.hides:
            result &= away <= screen.distances(origins, directions) * (1.0 + 1e-9)
        return result

    def _extend(self, points: SurfacePoints) -> None:
        """Lower the distances round new samples; those that lie beside an earlier one change nothing to the eye."""
        if self.shows != "area":
            return
        at, new, near = points.positions(self.seen.rest), [], _APART * self.field.radius
        for k in range(len(points)):
            gaps = np.linalg.norm(self.sampled - at[k], axis=1)
            if not len(gaps) or gaps.min() > near:
                self.sampled = np.concatenate([self.sampled, at[k : k + 1]])
                new.append(k)
        try:
            self.field = self.field.extended(points[new])
        except InvalidInput:  # a broken surface, whose distances only its proxy has: the line will do
            self.shows = "line"

    def release(self, pointer: Pointer) -> None:
        self.move(pointer)
        stroke, gesture = self.desk.stroke, self.gesture()
        try:
            self._brushed(gesture)
        except InvalidInput:  # a brush that reads only the path, and no screen
            parts = gestures_along(gesture, 0.25 * self.field.radius)
            if not parts:
                raise
            self._brushed(*parts)
        if stroke.command is not None and self.patch in self.desk.document.patches:
            self.desk.take(self.patch)

    def _brushed(self, *gestures: BrushGesture) -> None:
        if self.is_new and self.brush.erases:
            raise CommandRejected("there is nothing to erase here.")
        self.desk.stroke.patches.brush(
            self.brush, self.patch, *gestures,
            surface=self.seen.name, generator=self.tool.generator, color=self.color if self.is_new else None,
        )  # fmt: skip

    def gesture(self) -> BrushGesture:
        """All of the stroke, as brushes take it."""
        rest, mesh, scale = self.seen.rest, self.seen.mesh, self.seen.scale
        pressed = self.pressure if self.tool.pressure else 1.0
        return BrushGesture(
            rest,
            SurfacePoints.concatenate([]),
            radius=self.field.radius * max(pressed, 0.05),
            spacing=self.tool.spacing / scale,
            screen=np.stack(self.pixels),
            rays=lambda pixels: self.seen.rays_of(self.view, pixels),
            seen=None if mesh is rest else mesh,
            before=self.hides,
        )

    def cancel(self) -> None:
        self.desk.selection = self.before

    def overlay(self) -> Overlay:
        color = _ERASED if self.brush.erases else self.color
        if self.shows == "line":
            return Overlay(axes=(AxisLine(np.stack(self.line), color),))
        field = self.field
        tint = StrokeTint(self.seen.name, field.distances, field.changed, field.radius, color, self.brush.erases)
        return Overlay(tint=tint)

    def hint(self) -> str:
        return f"{self.brush.name} on {self.patch}"
