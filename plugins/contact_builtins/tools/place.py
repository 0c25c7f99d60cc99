"""Place a surface in the scene: the object, or a whole hand by its wrist, by a gizmo or anywhere on it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from contact_builtins.tools.drag import Drag
from contact_core.arrays import FloatArray
from contact_core.interaction.desk import Desk
from contact_core.interaction.events import Pointer
from contact_core.interaction.overlay import NOTHING, Handle, Overlay
from contact_core.interaction.seen import SeenSurface
from contact_core.interaction.tool import Gesture
from contact_core.interaction.view import on_plane, world_per_pixel
from contact_core.rig.rotations import exponential
from contact_core.settings import HasSettings, setting

_COLORS = ((0.9, 0.3, 0.3), (0.45, 0.8, 0.35), (0.35, 0.55, 1.0))


@dataclass(frozen=True)
class Place(HasSettings):
    """An arrow moves along its axis, a knob turns about it; anywhere else the surface follows the pointer in the
    plane of the view. The hand follows an object that is placed; a hand that is placed stays where it is put."""

    name: ClassVar[str] = "place"
    summary: ClassVar[str] = "place the object or a hand in the scene"
    key: ClassVar[str] = "N"
    hint: ClassVar[str] = "drag the surface; Shift towards you and away, Ctrl turns; or drag a handle"
    arm: float = setting(70.0, low=20.0, unit="pixels", help="how far the handles stand off")
    turn: float = setting(200.0, above=0.0, unit="pixels", help="how far a drag goes for half a turn")

    def hover(self, desk: Desk, pointer: Pointer) -> Overlay:
        seen = self._placed(desk)
        return NOTHING if seen is None else Overlay(handles=self.handles(desk, seen))

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        seen = self._placed(desk)
        handle = None if seen is None else desk.handle_at(pointer, self.handles(desk, seen))
        if seen is not None and handle is not None:
            return Placing(self, desk, pointer, seen, handle, handle.position)
        hit = desk.pick(pointer)
        if hit is None:
            return None
        return Placing(self, desk, pointer, desk.scene.surfaces[hit.surface], None, hit.position)

    def handles(self, desk: Desk, seen: SeenSurface) -> tuple[Handle, ...]:
        """Arrows and knobs round the middle of a surface, along the axes of the world."""
        middle = centre_of(seen)
        away = self.arm * desk.view.pixel_ratio * world_per_pixel(desk.view, middle)
        made = []
        for axis, name, color in zip(np.eye(3), "xyz", _COLORS, strict=True):
            made.append(Handle(f"move {name}", "move", middle + away * axis, 9.0, color, axis))
            side = np.roll(axis, 1) + np.roll(axis, 2)
            made.append(Handle(f"turn {name}", "turn", middle + 0.5 * away * side, 7.0, color, axis))
        return tuple(made)

    def _placed(self, desk: Desk) -> SeenSurface | None:
        """The surface that has the gizmo: the one that tools work on."""
        return None if desk.worked_on is None else desk.scene.surfaces.get(desk.worked_on)


class Placing(Drag):
    """handle: None where the surface itself was pressed. held: (3,) world, what was taken hold of."""

    def __init__(
        self, tool: Place, desk: Desk, pointer: Pointer, seen: SeenSurface, handle: Handle | None, held: FloatArray
    ) -> None:
        super().__init__(desk, pointer)
        self.tool, self.seen, self.handle, self.held = tool, seen, handle, held
        self.middle = centre_of(seen)
        record = desk.document.surface(seen.name)
        self.before, self.unit = record.world_from_surface, desk.scene.meters_per_unit / record.meters_per_unit
        desk.settled = record.rig is not None  # placed by hand: a solve would pull it back

    def drag(self, pointer: Pointer) -> None:
        turn, shift = np.eye(3), np.zeros(3)
        role = "turn" if pointer.holds("ctrl") else "centre"
        role = self.handle.role if self.handle is not None else role
        if role == "turn":
            turn = self._turned(pointer)
        elif role == "move" and self.handle is not None and self.handle.axis is not None:
            shift = self._along(pointer, self.handle.axis)
        else:
            shift = self._in_view(pointer)
        world = np.eye(4)
        world[:3, :3] = turn @ self.before[:3, :3]
        middle = self.unit * self.middle  # in units of the surface, as the document has it
        world[:3, 3] = turn @ (self.before[:3, 3] - middle) + middle + self.unit * shift
        world[:3, :3] = _orthonormal(world[:3, :3])
        self.desk.stroke.surfaces.place(self.seen.name, world)

    def _in_view(self, pointer: Pointer) -> FloatArray:
        """In the plane of the view, or with Shift towards the eye and away."""
        if not pointer.holds("shift"):
            return on_plane(self.desk.view, pointer.pixel, self.held) - on_plane(
                self.desk.view, self.start.pixel, self.held
            )
        _, directions = self.desk.view.rays(self.start.pixel[None])
        return (self.start.y - pointer.y) * world_per_pixel(self.desk.view, self.held) * directions[0]

    def _along(self, pointer: Pointer, axis: FloatArray) -> FloatArray:
        """Along an axis, by as far as the pointer went along it on the screen."""
        ends = self.desk.view.project(np.stack([self.held, self.held + axis]))[:, :2]
        along = ends[1] - ends[0]
        size = float(along @ along)
        return axis * (float((pointer.pixel - self.start.pixel) @ along) / size) if size > 1.0 else np.zeros(3)

    def _turned(self, pointer: Pointer) -> FloatArray:
        """(3, 3) about the handle's axis, or about those of the view."""
        x, y = (pointer.pixel - self.start.pixel) * math.pi / (self.tool.turn * self.desk.view.pixel_ratio)
        if self.handle is not None and self.handle.axis is not None:
            return np.asarray(exponential((x - y) * self.handle.axis[None])[0][0])
        _, (middle, right, below) = self.desk.view.rays(
            self.start.pixel + np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
        )
        side, down = _unit(right - middle), _unit(below - middle)
        return np.asarray(exponential((y * side - x * down)[None])[0][0])


def centre_of(seen: SeenSurface) -> FloatArray:
    """(3,) the middle of the box round a surface, world."""
    return np.asarray(0.5 * (seen.points.min(axis=0) + seen.points.max(axis=0)))


def _unit(vector: FloatArray) -> FloatArray:
    return vector / max(float(np.linalg.norm(vector)), 1e-300)


def _orthonormal(turn: FloatArray) -> FloatArray:
    """The nearest rotation: many drags one after the other do not add up to a shear."""
    u, _, v = np.linalg.svd(turn)
    return np.asarray(u @ v)
