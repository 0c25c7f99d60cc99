"""A mug with a handle that takes three fingers: genus 1."""

from __future__ import annotations

import numpy as np

from contact_builtins.samples.fields import chain, cylinder, union, without
from contact_builtins.samples.modelling import surface_of
from contact_core.document.asset import Asset

MM = 1e-3


def build() -> Asset:
    """9.6 cm tall, 8.2 cm wide, standing on y = 0, its handle towards +x."""
    outer = cylinder([0, 48 * MM, 0], 41 * MM, 48 * MM, rounding=4 * MM)
    foot = cylinder([0, -1 * MM, 0], 31 * MM, 3.5 * MM, rounding=2 * MM)
    cavity = cylinder([0, 75 * MM, 0], 36 * MM, 68 * MM, rounding=9 * MM)
    angles = np.linspace(-0.56 * np.pi, 0.56 * np.pi, 25)
    bow = np.stack([38 + 33 * np.cos(angles), 49 + 33 * np.sin(angles), 0 * angles], axis=1) * MM  # (25, 3)
    handle = chain(bow, np.full(25, 6.0 * MM))
    body = union([without(outer, foot, 2 * MM), handle], 9 * MM)
    mesh = surface_of(
        without(body, cavity, 4.0 * MM),
        np.array([-50, -8, -50]) * MM,
        np.array([90, 106, 50]) * MM,
        3.0 * MM,
        4.0 * MM,
    )
    return Asset(name="mug", mesh=mesh, meters_per_unit=1.0, up_axis="Y")
