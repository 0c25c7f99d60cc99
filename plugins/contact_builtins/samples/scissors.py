"""Closed scissors, 19 cm: two blades, a pivot, two finger loops (genus 2)."""

from __future__ import annotations

import numpy as np

from contact_builtins.samples.fields import Field, chain, ellipsoid, slab, union
from contact_builtins.samples.modelling import surface_of
from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset

MM = 1e-3


def build() -> Asset:
    """In the plane z = 0, blades along +y, pivot at the origin."""
    left, right = _half(-1.0), _half(+1.0)
    screw = ellipsoid([0, 0, 0], [4.6 * MM, 4.6 * MM, 4.4 * MM])
    steel = union([left, right, screw], 1.6 * MM)
    low, high = np.array([-54, -102, -9]) * MM, np.array([54, 105, 9]) * MM
    mesh = surface_of(steel, low, high, 1.9 * MM, edge_length)
    return Asset(name="scissors", mesh=mesh, meters_per_unit=1.0, up_axis="Y")


def edge_length(points: FloatArray) -> FloatArray:
    """(n,) finer along the blades, which are thin."""
    return np.interp(points[:, 1], [-20 * MM, 10 * MM], [2.9 * MM, 2.0 * MM])


def _half(side: float) -> Field:
    """One blade with its handle. side: where the handle lies, -1 or +1 along x; the blade crosses to the other."""
    lift = side * 0.9 * MM  # the blades lie on one another
    corners = np.array([[-7.0, -6, 0], [7.0, -6, 0], [1.2 * side, 98, 0]]) * MM + [0, 0, lift]
    blade = slab(corners[0], corners[1], corners[2], 2.1 * MM)
    shank = chain(
        list(np.array([[0, 2, 0], [side * 7, -16, 0], [side * 19, -36, 0]]) * MM + [0, 0, lift]),
        [5.2 * MM, 4.8 * MM, 4.6 * MM],
    )
    turn = np.linspace(0, 2 * np.pi, 33)
    # an egg-shaped loop; the right one takes two fingers
    wide, long = (14.5, 22.0) if side < 0 else (15.5, 28.0)
    loop = np.stack([wide * np.cos(turn), long * np.sin(turn), 0 * turn], axis=1)
    lean = np.radians(14.0 * side)
    c, s = np.cos(lean), np.sin(lean)
    loop = loop @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T
    loop = (loop + np.array([side * (wide + 10.5), -34 - long, 0])) * MM
    ring = chain(list(loop), [4.6 * MM] * len(loop))
    return union([blade, union([shank, ring], 5 * MM)], 4 * MM)
