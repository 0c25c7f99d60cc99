"""The camera: rays and projection for whoever picks, and how an artist moves it.

Pixels are those of the image that is drawn, from its top left corner; (0.5, 0.5) is the centre of the first one.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray

FIELD_OF_VIEW = 30.0  # degrees, of the height: little perspective, as a portrait lens has
_TURN = 0.4  # degrees for a pixel of an image that is not magnified
_STEP = 1.15  # a notch of the wheel
_NEAREST, _FARTHEST = 0.002, 20.0  # of the scene's diagonal, from what is looked at: beyond, nothing is recognised
_STEEPEST = 89.0  # degrees above the horizon: beyond, left and right change places


class Eye:
    """The camera of a vtkRenderer, as a view.

    up: the axis of the scene that stays upright, "X", "Y" or "Z". viewport: width and height of the view, pixels;
    the image that is drawn may have fewer while things move. pixel_ratio: pixels for one of the screen's own units,
    2 on most laptops. surfaces: those that it shows alone; None for all.
    """

    def __init__(self, renderer: Any, *, up: str = "Y") -> None:
        self._renderer = renderer
        self._camera = renderer.GetActiveCamera()
        self._camera.SetViewAngle(FIELD_OF_VIEW)
        self.surfaces: frozenset[str] | None = None
        self.pixel_ratio = 1.0
        self.viewport = (1280, 720)
        self.up = up

    @property
    def up(self) -> str:
        """The axis of the scene that stays upright."""
        return self._up_axis

    @up.setter
    def up(self, axis: str) -> None:
        self._up_axis = axis
        self._up: FloatArray = np.eye(3)["XYZ".index(axis)]
        self._front: FloatArray = -np.eye(3)[1] if axis == "Z" else np.eye(3)[2]  # where the eye is by default
        self.look_from("default")

    # -- what a view answers -------------------------------------------------------------------------------------

    @property
    def eye(self) -> FloatArray:
        """Where it looks from (3,), world."""
        return np.array(self._camera.GetPosition())

    @property
    def direction(self) -> FloatArray:
        """Where it looks to, unit (3,)."""
        return np.array(self._camera.GetDirectionOfProjection())

    def rays(self, pixels: Any) -> tuple[FloatArray, FloatArray]:
        """World origins (k, 3) and unit directions (k, 3) of the rays through pixels (k, 2)."""
        screen = np.asarray(pixels, np.float64).reshape(-1, 2)
        width, height = self.viewport
        right, upward = self._axes()
        x = (screen[:, :1] - width / 2) * self._pixel_at_one  # (k, 1)
        y = (height / 2 - screen[:, 1:]) * self._pixel_at_one
        away = self.direction + x * right + y * upward
        return np.tile(self.eye, (len(screen), 1)), away / np.linalg.norm(away, axis=1, keepdims=True)

    def project(self, points: Any) -> FloatArray:
        """(k, 3): pixel x and y of world points (k, 3), and their depth, the distance along the line of sight.

        What lies behind the eye has a depth that is not positive.
        """
        width, height = self.viewport
        right, upward = self._axes()
        away = np.asarray(points, np.float64).reshape(-1, 3) - self.eye
        depth = away @ self.direction
        size = np.where(np.abs(depth) < 1e-12, 1e-12, depth) * self._pixel_at_one
        return np.stack([width / 2 + away @ right / size, height / 2 - away @ upward / size, depth], axis=1)

    def pixel_size(self, point: Any) -> float:
        """How long a pixel of the image is at a world point (3,)."""
        return self._pixel_at_one * max(float((np.asarray(point, float) - self.eye) @ self.direction), 1e-12)

    def shows(self, surface: str) -> bool:
        """Whether a surface is seen here."""
        return self.surfaces is None or surface in self.surfaces

    @property
    def _pixel_at_one(self) -> float:
        """How long a pixel is at depth 1."""
        return 2 * math.tan(math.radians(FIELD_OF_VIEW / 2)) / max(self.viewport[1], 1)

    # -- how it moves --------------------------------------------------------------------------------------------

    def orbit(self, dx: float, dy: float) -> None:
        """Turn about what it looks at, after the pointer moved by so many pixels; the scene stays upright."""
        turn = -math.radians(_TURN) * dx / self.pixel_ratio
        rise = math.radians(_TURN) * dy / self.pixel_ratio
        focus = np.array(self._camera.GetFocalPoint())
        back = self.eye - focus
        distance = float(np.linalg.norm(back))
        limit = math.radians(_STEEPEST)
        height = math.asin(float(np.clip(back @ self._up / distance, -1, 1)))
        level = back - (back @ self._up) * self._up
        if np.linalg.norm(level) < 1e-9 * distance:  # straight above: what points upwards on the screen lies ahead
            level = -math.copysign(1.0, height) * np.array(self._camera.GetViewUp())
        level = level / np.linalg.norm(level)
        level = math.cos(turn) * level + math.sin(turn) * np.cross(self._up, level)
        height = float(np.clip(height + rise, -limit, limit))
        self._place(focus + distance * (math.cos(height) * level + math.sin(height) * self._up), focus)

    def pan(self, dx: float, dy: float) -> None:
        """Move sideways, so that what it looks at follows the pointer, which moved by so many pixels."""
        focus = np.array(self._camera.GetFocalPoint())
        right, upward = self._axes()
        shift = self.pixel_size(focus) * (-dx * right + dy * upward)
        self._place(self.eye + shift, focus + shift)

    def zoom(self, notches: float, pixel: Any = None) -> None:
        """Go nearer by notches of the wheel, towards what is under a pixel; straight ahead without one.

        Not beyond what the scene's size makes sense of, but always back from there.
        """
        focus = np.array(self._camera.GetFocalPoint())
        factor = self._within(_STEP ** -float(np.clip(notches, -20, 20)), float(np.linalg.norm(self.eye - focus)))
        towards = focus
        if pixel is not None:
            origin, direction = (part[0] for part in self.rays([pixel]))
            towards = origin + direction * ((focus - origin) @ self.direction) / (direction @ self.direction)
        self._place(towards + factor * (self.eye - towards), towards + factor * (focus - towards))

    def _within(self, factor: float, distance: float) -> float:
        """The factor to go away by, from a distance to what is looked at, so that the scene is neither lost nor
        passed through."""
        low, high = np.reshape(self._renderer.ComputeVisiblePropBounds(), (3, 2)).T
        diagonal = float(np.linalg.norm(high - low))
        if (high < low).any() or diagonal == 0.0:  # nothing is there
            return factor
        if factor > 1.0:
            return min(factor, max(_FARTHEST * diagonal / distance, 1.0))
        return max(factor, min(_NEAREST * diagonal / distance, 1.0))

    def look_from(self, side: str) -> None:
        """Look from a side, at what it looks at now: default, front, right, top, or back, left, bottom."""
        focus = np.array(self._camera.GetFocalPoint())
        distance = max(float(np.linalg.norm(self.eye - focus)), 1e-9)
        right = np.cross(self._up, self._front)
        sides = {
            "default": 0.80 * self._front + 0.45 * right + 0.40 * self._up,
            "front": self._front,
            "right": right,
            "top": self._up + 1e-4 * self._front,
            "back": -self._front,
            "left": -right,
            "bottom": -self._up + 1e-4 * self._front,
        }
        back = sides[side] / np.linalg.norm(sides[side])
        self._place(focus + distance * back, focus)

    def look_from_point(self, eye: FloatArray, focus: FloatArray) -> None:
        """Look from a point to another, both (3,) world."""
        self._place(np.asarray(eye, float), np.asarray(focus, float))

    def look_along(self, other: Eye) -> None:
        """Look as another does."""
        self._place(other.eye, np.array(other._camera.GetFocalPoint()))

    def fit(self, points: Any, *, margin: float = 1.12) -> None:
        """Keep the direction, and see all of the points (k, 3); k = 0 changes nothing."""
        seen = np.asarray(points, np.float64).reshape(-1, 3)
        if not len(seen):
            return
        width, height = self.viewport
        tangent = math.tan(math.radians(FIELD_OF_VIEW / 2))
        right, upward = self._axes()
        axes = np.stack([right, upward, -self.direction])  # (3, 3)
        local = seen @ axes.T  # (k, 3)
        middle = 0.5 * (local.min(axis=0) + local.max(axis=0))
        offset = local - middle
        aspect = width / max(height, 1)
        reach = np.maximum(np.abs(offset[:, 0]) / aspect, np.abs(offset[:, 1])) * margin / tangent + offset[:, 2]
        focus = middle @ axes
        self._place(focus - max(float(reach.max()), 1e-6) * self.direction, focus)

    def _axes(self) -> tuple[FloatArray, FloatArray]:
        """What points to the right and upwards on the screen, unit (3,) each."""
        ahead = self.direction
        right = np.cross(ahead, np.array(self._camera.GetViewUp()))
        right /= np.linalg.norm(right)
        return right, np.cross(right, ahead)

    def _place(self, eye: FloatArray, focus: FloatArray) -> None:
        ahead = focus - eye
        ahead = ahead / np.linalg.norm(ahead)
        upward = self._up - (self._up @ ahead) * ahead
        if np.linalg.norm(upward) < 1e-6:
            upward = -self._front if self._up @ ahead < 0 else self._front
        self._camera.SetPosition(*eye)
        self._camera.SetFocalPoint(*focus)
        self._camera.SetViewUp(*(upward / np.linalg.norm(upward)))
