"""Where the eye of a picture is: one rule for every renderer, so that their pictures match."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.plugins.slots import Picture

FIELD_OF_VIEW = math.radians(28.0)  # vertical; a long lens, as a product photograph has
TABLE_WIDTH = 0.26  # of the frame, kept clear for the table
_DEFAULT_FROM = (0.55, 0.4, 1.0)


@dataclass(frozen=True, eq=False)
class Camera:
    """eye, centre: (3,) world. camera_from_world: (3, 3), rows right, up, back. shift: where `centre` is drawn,
    from -1 (left edge) to 1 (right edge); to the right of the table, where there is one."""

    eye: FloatArray
    centre: FloatArray
    camera_from_world: FloatArray
    shift: float = 0.0
    field_of_view: float = FIELD_OF_VIEW


def camera_of(picture: Picture, aspect: float) -> Camera:
    """The camera that sees the picture's focus in a frame of width / height `aspect`, caption space left."""
    if picture.focus is not None and len(picture.focus):
        points = np.asarray(picture.focus, float)  # (n, 3)
    else:
        points = np.concatenate([item.mesh.points[np.unique(item.mesh.faces)] for item in picture.meshes])
    back = np.asarray(picture.camera_from or _DEFAULT_FROM, float)
    back = back / np.linalg.norm(back)
    right = np.cross(np.asarray(picture.up, float), back)
    if np.linalg.norm(right) < 1e-6:  # looking along up: any horizontal will do
        right = np.cross(np.roll(np.asarray(picture.up, float), 1), back)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(back, right), back])  # (3, 3)
    seen = points @ axes.T  # (n, 3) camera axes, world origin
    middle = 0.5 * (seen.min(axis=0) + seen.max(axis=0))
    tangent = math.tan(FIELD_OF_VIEW / 2) * 0.88
    offset = seen - middle
    shift = TABLE_WIDTH if picture.table else 0.0
    reach = (
        np.maximum(np.abs(offset[:, 0]) / (aspect * (1.0 - shift)), np.abs(offset[:, 1])) / tangent + offset[:, 2]
    )  # (n,)
    distance = max(float(reach.max()), 1e-9)
    centre = middle @ axes
    return Camera(centre + distance * back, centre, axes, shift)
