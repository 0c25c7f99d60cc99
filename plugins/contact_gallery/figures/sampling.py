"""The same curves and edits on a coarse mesh, and on meshes 16 and 64 times denser.

A patch is painted by a curve, not by vertices, so a mesh of 320 triangles carries as many contact points as one of
20,480. Edits trace over the surface and do not see its triangles: after the same translation, rotation and bend the
patches lie on top of one another, as far as the coarse mesh still has the same shape.
"""

from dataclasses import replace
from functools import partial

import numpy as np

import contact_core as contact
from contact_core.arrays import FloatArray
from contact_core.geometry.raycast import Locator
from contact_core.scene.picture import Picture
from contact_core.testing import meshes
from contact_gallery.looks import edges, view
from contact_gallery.sheet import Sheet

PAPER = "Figure 4"
LEVELS = (2, 4, 5)  # subdivisions of an icosahedron


def draw(sheet: Sheet) -> None:
    before: list[Picture] = []
    after: list[Picture] = []
    where: list[FloatArray] = []
    for level in LEVELS:
        mesh = gourd(level)
        with contact.new(gourd=mesh, plugins=sheet.plugins) as session, sheet.counting(session):
            on = Locator.of(mesh)
            x = np.linspace(-0.75, 0.85, 54)  # a zigzag, as one fills an area with a pencil
            y = np.where(np.arange(54) % 2 == 0, 0.16, -0.16) + 0.1 * x
            drawn = on.cast(np.stack([x, y, np.full(54, 2.0)], axis=1), np.tile([0.0, 0.0, -1.0], (54, 1))).points
            axis = on.cast([(-0.75, -0.07, 2.0), (0.0, 0.0, 2.0), (0.85, 0.08, 2.0)], [(0, 0, -1)] * 3).points
            session.patches.brush(
                "curve", "stroke", surface="gourd", at=drawn, spacing=0.03, radius=0.03, axis=axis
            )
            caption = f"({'abc'[len(before)]}) {len(mesh.faces):,} triangles"
            look = partial(view, session, camera_from=(0.0, 0.25, 1.0), colors={"gourd": (0.74, 0.77, 0.8)})
            wire = ((edges(mesh), (0.5, 0.53, 0.58) if level == 2 else (0.68, 0.71, 0.75)),) if level < 5 else ()
            before.append(replace(look(caption=caption), lines=wire))
            session.patches.translate("stroke", on.closest([(-0.6, 0.25, 1.5)]).points)
            session.patches.rotate("stroke", np.radians(-25.0))
            middle = int(np.argmin(np.abs(session.geometry.axis("stroke").points.positions(mesh)[:, 0] - 0.1)))
            session.patches.bend("stroke", middle, np.radians(50.0))
            after.append(replace(look(caption="translated, rotated, bent"), lines=wire))
            where.append(session.geometry.points("stroke").positions(mesh))
    sheet.show(*before, aspect=1.5)
    sheet.show(*after, aspect=1.5)
    sheet.measure("triangles", ", ".join(f"{20 * 4**level:,}" for level in LEVELS), "coarse and fine")
    sheet.measure("contact points", ", ".join(f"{len(points)}" for points in where))
    sheet.measure(
        "strokes apart after the edits, mean",
        ", ".join(f"{apart(p, where[-1]):.3f}" for p in where[:-1]) + " of the height",
        "sampling-agnostic",
    )


def gourd(level: int) -> contact.TriangleMesh:
    """A smooth pear lying on its side, about 2.6 by 1.8 units."""
    ball = meshes.icosphere(level)
    x, y, z = ball.points.T
    thick = 0.72 + 0.22 * np.tanh(2.0 * x + 0.3) - 0.1 * np.exp(-6.0 * (x + 0.1) ** 2)
    return ball.with_points(np.stack([1.3 * x, thick * y, thick * z], axis=1))


def apart(points: FloatArray, others: FloatArray) -> float:
    """Mean distance of points to the closest of others, over the pear's height of 1.8."""
    return float(np.linalg.norm(points[:, None] - others[None], axis=2).min(axis=1).mean() / 1.8)
