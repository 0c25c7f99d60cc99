"""A view: how pixels and places in the world belong together. Every front end has its own; one of numpy is here.

The world is the scene in units of `Interaction.meters_per_unit`. All of this is a host's `Picking` and its inverse.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np

from contact_core.arrays import FloatArray, frozen
from contact_core.errors import InvalidInput


@runtime_checkable
class View(Protocol):
    """Where an artist looks from. It is asked at every event, so it may be another one each time."""

    @property
    def viewport(self) -> tuple[int, int]:
        """Width and height, pixels."""
        ...

    @property
    def pixel_ratio(self) -> float:
        """Its pixels per pixel of a plain screen: 2 on a dense one. Sizes in pixels are multiplied by it."""
        ...

    def rays(self, pixels: Any) -> tuple[FloatArray, FloatArray]:
        """World origins (k, 3) and unit directions (k, 3) of the rays through screen positions (k, 2)."""
        ...

    def project(self, points: Any) -> FloatArray:
        """(k, 3) of world points (k, 3): pixel x, pixel y, and the distance along the view, not above 0 for what is
        behind the eye (its pixels then mean nothing)."""
        ...


@dataclass(frozen=True, eq=False)
class Perspective:
    """A pinhole camera in numpy: the view of tests, of pictures, and of front ends without a camera of their own.

    eye: (3,) world. camera_from_world: (3, 3) rows right, up, back. field_of_view: vertical, radians.
    """

    eye: FloatArray
    camera_from_world: FloatArray
    viewport: tuple[int, int] = (1280, 720)
    field_of_view: float = math.radians(28.0)
    pixel_ratio: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "eye", frozen(self.eye, np.float64, (3,), "eye"))
        turn = frozen(self.camera_from_world, np.float64, (3, 3), "camera_from_world")
        object.__setattr__(self, "camera_from_world", turn)
        if min(self.viewport) < 1 or not 0.0 < self.field_of_view < math.pi:
            raise InvalidInput(
                f"a view has a size and sees less than half of the world, but got {self.viewport} pixels and"
                f" {self.field_of_view} radians."
            )

    @classmethod
    def looking_at(cls, centre: Any, eye: Any, up: Any = (0.0, 1.0, 0.0), **settings: Any) -> Perspective:
        """From an eye to a centre, both (3,) world. settings: the other fields."""
        eye = np.asarray(eye, float)
        back = eye - np.asarray(centre, float)
        back = back / np.linalg.norm(back)
        right = np.cross(np.asarray(up, float), back)
        if np.linalg.norm(right) < 1e-6:  # along up: any horizontal will do
            right = np.cross(np.roll(np.asarray(up, float), 1), back)
        right = right / np.linalg.norm(right)
        return cls(eye, np.stack([right, np.cross(back, right), back]), **settings)

    @property
    def _focal(self) -> float:
        """Pixels per unit of slope."""
        return 0.5 * self.viewport[1] / math.tan(0.5 * self.field_of_view)

    def rays(self, pixels: Any) -> tuple[FloatArray, FloatArray]:
        """See `View`."""
        at = np.asarray(pixels, float).reshape(-1, 2) - 0.5 * np.array(self.viewport, float)
        seen = np.stack([at[:, 0], -at[:, 1], np.full(len(at), -self._focal)], axis=1)  # (k, 3) camera axes
        directions = seen @ self.camera_from_world
        directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        return np.broadcast_to(self.eye, directions.shape).copy(), directions

    def project(self, points: Any) -> FloatArray:
        """See `View`."""
        seen = (np.asarray(points, float).reshape(-1, 3) - self.eye) @ self.camera_from_world.T
        depth = -seen[:, 2]
        slope = self._focal / np.where(depth > 1e-12, depth, 1e-12)
        x, y = 0.5 * self.viewport[0] + slope * seen[:, 0], 0.5 * self.viewport[1] - slope * seen[:, 1]
        return np.stack([x, y, depth], axis=1)


def shows(view: View, surface: str) -> bool:
    """Whether a view shows a surface. It shows all, unless it names those that it shows in an attribute `surfaces`,
    as one half of a split view does: what it does not show cannot be picked in it either."""
    only: Collection[str] | None = getattr(view, "surfaces", None)
    return only is None or surface in only


def world_per_pixel(view: View, point: FloatArray) -> float:
    """World units that a pixel spans at a world point (3,)."""
    x, y, depth = view.project(point[None])[0]
    if depth <= 0.0 or not np.isfinite([x, y]).all():
        return 0.0
    origins, directions = view.rays([[x, y], [x + 1.0, y]])
    along = np.einsum("ki,ki->k", point - origins, directions)
    both = origins + np.maximum(along, 0.0)[:, None] * directions
    return float(np.linalg.norm(both[1] - both[0]))


def on_plane(view: View, pixel: FloatArray, point: FloatArray) -> FloatArray:
    """(3,) where the ray through a pixel (2,) meets the plane through a world point (3,) that faces the view."""
    middle = 0.5 * np.array(view.viewport, float)
    (_, origin), (normal, direction) = view.rays(np.stack([middle, pixel]))
    slope = float(direction @ normal)
    if abs(slope) < 1e-9:
        return np.asarray(point, float)
    return np.asarray(origin + (float((point - origin) @ normal) / slope) * direction)
