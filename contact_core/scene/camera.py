"""Where the eye of a picture is: one rule for every renderer, so that their pictures match."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.scene.picture import Picture

FIELD_OF_VIEW = math.radians(28.0)  # vertical; a long lens, as a product photograph has
ROW = 1 / 36  # of the frame's height, a row of the table or of the legend
LEGEND_AT = 0.55  # of the frame's width, where the legend begins; the table begins at the left edge
LEGEND_ROWS = 11  # more patches than that are counted in the last row
WIDEST_NAME = 22  # letters of a row's name; a longer one pushes its value aside
MARGIN = 0.07  # of the frame's height at its top and its bottom; the caption stands in it
DEFAULT_FROM = (0.55, 0.4, 1.0)


@dataclass(frozen=True, eq=False)
class Camera:
    """eye, centre: (3,) world. camera_from_world: (3, 3), rows right, up, back. drop: how far `centre` is drawn
    below the middle of the frame, 0 to 1 (lower edge): below the table, where there is one."""

    eye: FloatArray
    centre: FloatArray
    camera_from_world: FloatArray
    drop: float = 0.0
    field_of_view: float = FIELD_OF_VIEW


def camera_of(picture: Picture, aspect: float) -> Camera:
    """The camera that sees the picture's focus in a frame of width / height `aspect`, below the table."""
    if picture.focus is not None and len(picture.focus):
        points = np.asarray(picture.focus, float)  # (n, 3)
    else:
        points = np.concatenate([item.mesh.points[item.mesh.used_points] for item in picture.meshes])
    back = np.asarray(picture.camera_from or DEFAULT_FROM, float)
    back = back / np.linalg.norm(back)
    right = np.cross(np.asarray(picture.up, float), back)
    if np.linalg.norm(right) < 1e-6:  # looking along up: any horizontal will do
        right = np.cross(np.roll(np.asarray(picture.up, float), 1), back)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(back, right), back])  # (3, 3)
    seen = points @ axes.T  # (n, 3) camera axes, world origin
    middle = 0.5 * (seen.min(axis=0) + seen.max(axis=0))
    tangent = math.tan(FIELD_OF_VIEW / 2)
    offset = seen - middle
    drop = min(0.6, rows_above(picture) * ROW)
    wide, tall = tangent * aspect * (1.0 - MARGIN), tangent * (1.0 - 2.0 * MARGIN - drop)
    reach = np.maximum(np.abs(offset[:, 0]) / wide, np.abs(offset[:, 1]) / tall) + offset[:, 2]  # (n,)
    distance = max(float(reach.max()), 1e-9)
    centre = middle @ axes
    return Camera(centre + distance * back, centre, axes, drop)


def rows_above(picture: Picture) -> int:
    """How many rows the table and the legend take above the scene."""
    return max(len(picture.table), min(len(picture.legend), LEGEND_ROWS))


def legend_rows(picture: Picture) -> list[tuple[str, tuple[float, float, float] | None]]:
    """The legend as it is written: name and colour of each row; the last row counts what has no room."""
    rows: list[tuple[str, tuple[float, float, float] | None]] = list(picture.legend)
    if len(rows) > LEGEND_ROWS:
        rows = [*rows[: LEGEND_ROWS - 1], (f"and {len(rows) - LEGEND_ROWS + 1} more", None)]
    return rows
