"""The picture that is drawn, as data: what a renderer draws off-screen and a host draws over its scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from contact_core.arrays import FloatArray
from contact_core.geometry.mesh import TriangleMesh


@dataclass(frozen=True, eq=False)
class PictureMesh:
    """One mesh of a picture. color: RGB 0..1; opacity 0..1; vertex_colors (n, 3) override color."""

    mesh: TriangleMesh
    color: tuple[float, float, float]
    opacity: float = 1.0
    vertex_colors: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Picture:
    """All that a renderer needs, in world space: meshes, coloured points, line segments, camera, caption.

    focus: (k, 3) what has to be in the frame; all meshes by default. table and legend stand above the scene.
    lettering: height of the caption's letters, times the usual.
    row: of a sheet of pictures, from the top; those of one row stand side by side.
    """

    meshes: tuple[PictureMesh, ...]
    points: tuple[tuple[FloatArray, tuple[float, float, float]], ...] = ()  # (k, 3) positions, colour
    lines: tuple[tuple[FloatArray, tuple[float, float, float]], ...] = ()  # (k, 2, 3) segments, colour
    camera_from: tuple[float, float, float] | None = None  # direction from the centre to the eye
    up: tuple[float, float, float] = (0.0, 1.0, 0.0)
    caption: str = ""
    table: tuple[tuple[str, str, bool], ...] = ()  # name, value, failed
    focus: FloatArray | None = None
    legend: tuple[tuple[str, tuple[float, float, float]], ...] = ()  # name, colour
    lettering: float = 1.0
    row: int = 0


def sheet_rows(pictures: Sequence[Picture]) -> list[list[Picture]]:
    """Pictures by row, from the top."""
    return [[p for p in pictures if p.row == row] for row in sorted({p.row for p in pictures})]
