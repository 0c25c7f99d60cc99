"""A sitting rabbit, where the Stanford bunny may not be at hand: round head, two ears, a back to lay a hand on."""

from __future__ import annotations

import numpy as np

from contact_builtins.samples.fields import Field, ball, chain, ellipsoid, half_space, union, without
from contact_builtins.samples.modelling import surface_of
from contact_core.document.asset import Asset

CM = 1e-2


def build() -> Asset:
    """22 cm tall, sitting on y = 0 and looking along +x."""
    mesh = surface_of(_rabbit(), np.array([-11, -1, -8]) * CM, np.array([11, 24, 8]) * CM, 0.4 * CM, 0.52 * CM)
    return Asset(name="rabbit", mesh=mesh, meters_per_unit=1.0, up_axis="Y")


def _rabbit() -> Field:
    body = union([
        ellipsoid(np.array([-2.2, 6.2, 0]) * CM, np.array([7.0, 6.2, 5.6]) * CM),
        ellipsoid(np.array([2.6, 6.4, 0]) * CM, np.array([4.2, 6.0, 4.0]) * CM),
    ], 3.0 * CM)  # fmt: skip
    head = union([
        ellipsoid(np.array([5.0, 14.2, 0]) * CM, np.array([4.3, 3.6, 3.5]) * CM),
        ball(np.array([7.9, 13.3, 0]) * CM, 1.9 * CM),
    ], 2.0 * CM)  # fmt: skip
    parts: list[Field] = [body, head, ball(np.array([-9.0, 4.4, 0]) * CM, 1.9 * CM)]
    for side in (-1.0, 1.0):
        ear = [(3.2, 16.4, 1.5), (1.4, 19.4, 2.2), (-0.6, 22.0, 2.7)]
        parts.append(chain(np.array(ear) * [1, 1, side] * CM, np.array([1.25, 1.45, 0.85]) * CM, 0.8 * CM))
        parts.append(ellipsoid(np.array([-2.8, 4.2, 3.6 * side]) * CM, np.array([4.4, 4.0, 2.4]) * CM))  # haunch
        parts.append(ellipsoid(np.array([1.2, 1.1, 4.0 * side]) * CM, np.array([3.6, 1.3, 1.5]) * CM))  # hind foot
        parts.append(
            chain(np.array([(4.6, 5.2, 1.9 * side), (5.6, 1.2, 1.9 * side)]) * CM, np.array([1.6, 1.35]) * CM)
        )
    return without(union(parts, 1.6 * CM), half_space(np.array([0, 0, 0]) * CM, [0, 1, 0]), 0.8 * CM)
