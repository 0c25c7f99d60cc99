"""A baseball: a sphere with the one closed seam that two leather figure-eights leave."""

from __future__ import annotations

import numpy as np

from contact_builtins.samples.fields import Field
from contact_builtins.samples.modelling import surface_of
from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset

MM = 1e-3
RADIUS = 36.8 * MM  # rule 3.01: 9 to 9 1/4 inches round
STITCHES = 108  # double stitches, as the rule book's ball has


def build() -> Asset:
    """7.4 cm across, centred at the origin."""
    reach = np.full(3, RADIUS + 3 * MM)
    mesh = surface_of(
        leather(),
        -reach,
        reach,
        2.0 * MM,
        lambda p: np.where(np.abs(np.linalg.norm(p, axis=1) - RADIUS) > 0.05 * MM, 1.4 * MM, 2.4 * MM),
    )
    return Asset(name="baseball", mesh=mesh, meters_per_unit=1.0, up_axis="Y")


def seam(count: int, bend: float = 0.44) -> FloatArray:
    """(count, 3) points on the unit sphere along the seam (the closed curve of R. Thompson's parameters)."""
    t = np.linspace(0.0, 4.0 * np.pi, count, endpoint=False)
    polar = np.pi / 2 - (np.pi / 2 - bend) * np.cos(t)
    turn = t / 2 + bend * np.sin(2 * t)
    return np.stack([np.sin(polar) * np.cos(turn), np.cos(polar), np.sin(polar) * np.sin(turn)], axis=1)


def leather() -> Field:
    """The sphere, raised on both sides of the seam by its stitches and sunk in between."""
    from scipy.spatial import cKDTree

    count = 4 * 4 * STITCHES
    line = seam(count)
    steps = np.linalg.norm(np.diff(line, axis=0, append=line[:1]), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)[:-1]]) / steps.sum()  # (count,) arc length, 0..1
    tree = cKDTree(line * RADIUS)

    def field(p: FloatArray) -> FloatArray:
        radius = np.linalg.norm(p, axis=1)
        on_ball = p / np.maximum(radius, 1e-9)[:, None] * RADIUS
        away, nearest = tree.query(on_ball)
        stitch = 0.75 + 0.25 * np.cos(2 * np.pi * STITCHES * along[nearest])
        ridge = 0.75 * MM * stitch * np.exp(-(((away - 2.6 * MM) / (1.5 * MM)) ** 2))
        groove = -0.55 * MM * np.exp(-((away / (1.1 * MM)) ** 2))
        return radius - RADIUS - ridge - groove

    return field
