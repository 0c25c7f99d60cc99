"""Contact models compared, and the axis model where it is strained: folds and distortion of transfers.

    python benchmarks/bench_contact_models.py [--pictures docs/images]

First a strip along a bent, tapered tentacle is transferred onto a pole, by three models: the axis model of this
package; one log map from a single point (Lakshmipathy et al. 2022); and the boundary alone, traced as a closed
chain (Lakshmipathy et al. 2021). The two others are in `contact_gallery.other_models`.
Then the axis model with axes that are too sparse, off the patch, outside it, and across a mismatch of curvature.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from benchmarks.harness import record
from contact_core.arrays import ComplexArray, FloatArray
from contact_core.contact.area import measure_area
from contact_core.contact.axis import Axis, draw_axis
from contact_core.contact.distortion import Distortion, measure_distortion
from contact_core.contact.patch import PatchPoints, parameterize_patch, reconstruct_patch
from contact_core.contact.placement import Root
from contact_core.contact.shape import PatchShape
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import direction_to_heading
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import RENDERERS
from contact_core.scene.picture import Picture, PictureMesh
from contact_core.testing import meshes
from contact_gallery.other_models import boundary_alone, single_point

POLE_RADIUS = 0.25
ROWS: dict[str, str] = {}  # what is recorded, in order
PICTURED = (
    "strip on a ball: axis along it, dense",
    "  too sparse: two points",
    "  beside it, half its length away",
)


@dataclass(frozen=True, eq=False)
class Patch:
    """A painted patch with the axis that serves for measuring."""

    mesh: TriangleMesh
    points: SurfacePoints
    axis: Axis
    shape: PatchShape

    @classmethod
    def painted(
        cls, mesh: TriangleMesh, points: SurfacePoints, picks: SurfacePoints, *, dense: bool = True
    ) -> Patch:
        axis_shape, axis = draw_axis(mesh, picks, 1.0 + 0j, dense=dense)
        coordinates = parameterize_patch(mesh, axis, points)
        return cls(mesh, points, axis, PatchShape(axis_shape, coordinates, np.ones(len(points))))

    def distortion(self, target: TriangleMesh, there: SurfacePoints, measured: Patch | None = None) -> Distortion:
        """Against a mirrored copy, on the triangles of the layout of `measured` (this patch by default)."""
        shape = (measured or self).shape
        here = self.points.positions(self.mesh)
        triangles = measure_area(shape, here).triangles
        return measure_distortion(
            triangles, here, self.points.normals(self.mesh), there.positions(target), there.normals(target),
            mirrored=True,
        )  # fmt: skip


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--pictures", type=Path, metavar="DIR", help="also draw contact-models.png and axes.png there"
    )
    arguments = parser.parse_args()
    models = compare_models()
    print()
    axes = strain_the_axis()
    record("Contact models: folds, 95th percentile of stretch in length and in area", ROWS)
    if arguments.pictures is not None:
        draw(models, arguments.pictures / "contact-models.png")
        draw(axes, arguments.pictures / "contact-axes.png")
    return 0


def draw(pictures: Sequence[Picture], path: Path) -> None:
    """Side by side, with the first renderer that works here."""
    offers = PluginManager(discover=True).offers(RENDERERS)
    working = [renderer for renderer in offers.values() if renderer.unavailable() is None]
    max(working, key=lambda renderer: renderer.priority).render(pictures, path, size=(420 * len(pictures), 460))


def portrait(
    target: TriangleMesh, there: SurfacePoints, found: Distortion, caption: str, side: tuple[float, float, float]
) -> Picture:
    """A transferred patch on its target: blue where lengths shrank, red where they grew, black where it folds."""
    where = there.positions(target) + 0.004 * target.bounding_box_diagonal * there.normals(target)
    octaves = np.round(np.clip(np.nan_to_num(np.log2(found.length_ratio)), -1.0, 1.0) * 5.0) / 5.0  # (n,)
    even, grown, shrunk = np.array([0.95, 0.85, 0.3]), np.array([0.85, 0.1, 0.1]), np.array([0.1, 0.3, 0.9])
    batches = [(where[found.folded], (0.0, 0.0, 0.0))]
    for amount in np.unique(octaves):
        color = even + abs(amount) * ((grown if amount > 0.0 else shrunk) - even)
        chosen = (octaves == amount) & ~found.folded
        batches.append((where[chosen], (float(color[0]), float(color[1]), float(color[2]))))
    body = PictureMesh(target, (0.62, 0.65, 0.7))  # light, so that folds in black stand out
    return Picture((body,), points=tuple(batches), camera_from=side, up=(0.0, 0.0, 1.0), caption=caption)


def compare_models() -> list[Picture]:
    """The tentacle-to-cylinder transfer."""
    pictures = []
    tentacle, strip, picks = painted_tentacle()
    pole = meshes.cylinder(48, 50, POLE_RADIUS, 4.8)
    patch = Patch.painted(tentacle, strip, picks)
    print(f"tentacle to pole: {len(strip)} points, axis of {len(patch.axis)}, {patch.shape.axis.length:.2f} long")
    print(f"{'heading':>8s} {'model':22s} {'folds':>7s} {'length x':>9s} {'area x':>8s}  remarks")
    for degrees in (0, 30, 60):
        root = pole_root(pole, np.radians(degrees))
        ours = reconstruct_patch(pole, patch.shape, root, patch.shape.axis.transformed(mirrored=True))
        print_row(f"{degrees:d} deg", "axis", patch.distortion(pole, ours.points), f"{int(ours.ran_off.sum())} off")
        single = single_point(patch.mesh, patch.points, patch.axis, pole, ours.axis)
        print_row(f"{degrees:d} deg", "single-point log map", patch.distortion(pole, single), "")
        if degrees == 30:
            for title, there in (("axis", ours.points), ("single-point log map", single)):
                pictures.append(portrait(pole, there, patch.distortion(pole, there), title, (1.0, 0.6, 0.35)))
        gap, crossings, area = boundary_model(patch, pole, ours)
        print(f"{'':8s} {'boundary alone':22s} {'-':>7s} {'-':>9s} {area:8.2f}  gap {100 * gap:.1f}% of the loop,"
              f" {crossings} self-crossings; no point answers another")  # fmt: skip
    return pictures


def boundary_model(patch: Patch, pole: TriangleMesh, placed: PatchPoints) -> tuple[float, int, float]:
    """The boundary loop on the pole: closing gap over length, self-crossings, area ratio."""
    traced, length = boundary_alone(patch.mesh, patch.points, patch.axis, patch.shape, pole, placed.axis)
    where = traced.points.positions(pole)
    flat = POLE_RADIUS * np.unwrap(np.arctan2(where[:, 1], where[:, 0])) + 1j * where[:, 2]
    gap = float(np.linalg.norm(where[-1] - where[0])) / length
    area = measure_area(patch.shape, patch.points.positions(patch.mesh))
    return gap, crossings(flat), abs(polygon_area(flat)) / area.area


def strain_the_axis() -> list[Picture]:
    """Distortion for axes that the paper warns of, and for the cure of each."""
    pictures: list[Picture] = []
    front = (0.8, 0.9, 0.45)
    print(f"{'case':46s} {'folds':>7s} {'length x':>9s} {'area x':>8s}")
    plane, ball, saddle = meshes.plane(40, 2.0), meshes.icosphere(5, 0.6), meshes.saddle(40)
    root = ball_root(ball)
    rng = np.random.default_rng(0)
    box = rng.uniform(-0.5, 0.5, (400, 2)) * [1.2, 0.4] + 1.0
    strip = on_plane(plane, box)
    axes = {
        "strip on a ball: axis along it, dense": ([(0.4, 1.0), (1.6, 1.0)], True),
        "  too sparse: two points": ([(0.4, 1.0), (1.6, 1.0)], False),
        "  one point at its end": ([(0.4, 1.0)], True),
        "  across it": ([(1.0, 0.8), (1.0, 1.2)], True),
        "  beside it, half its length away": ([(0.4, 1.6), (1.6, 1.6)], True),
    }
    reference = Patch.painted(plane, strip, on_plane(plane, np.array([(0.4, 1.0), (1.6, 1.0)])))
    for title, (picks, dense) in axes.items():
        patch = Patch.painted(plane, strip, on_plane(plane, np.array(picks)), dense=dense)
        placed = reconstruct_patch(ball, patch.shape, root, patch.shape.axis.transformed(mirrored=True))
        found = patch.distortion(ball, placed.points, reference)
        print_row(None, title, found, "")
        if title in PICTURED:
            pictures.append(portrait(ball, placed.points, found, title.strip(), front))
    angle, radius = rng.uniform(0.3, 2 * np.pi - 0.3, 400), rng.uniform(0.4, 0.6, 400)
    ring = on_plane(plane, 1.0 + np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]))
    arc = np.linspace(0.35, 2 * np.pi - 0.35, 24)
    inside = on_plane(plane, 1.0 + 0.5 * np.column_stack([np.cos(arc), np.sin(arc)]))
    outside = on_plane(plane, np.array([(1.5, 0.85), (1.5, 1.15)]))
    good = Patch.painted(plane, ring, inside)
    for title, patch in {
        "ring with a gap on a ball: axis inside it": good,
        "  axis across the gap, outside it": Patch.painted(plane, ring, outside),
    }.items():
        placed = reconstruct_patch(ball, patch.shape, root, patch.shape.axis.transformed(mirrored=True))
        found = good.distortion(ball, placed.points)
        print_row(None, title, found, "")
        middle = placed.points.positions(ball).mean(axis=0)
        below = (float(middle[0]), float(middle[1]), float(middle[2]))
        pictures.append(portrait(ball, placed.points, found, title.strip(), below))
    for title, target, where in (
        ("strip, curvature mismatch: ball of half its size", meshes.icosphere(5, 0.3), root),
        ("  saddle", saddle, middle_root(saddle)),
        ("  rough ball", meshes.noisy(4, 0.03), Root(2000, (0.3, 0.3, 0.4), 1j)),
    ):
        placed = reconstruct_patch(target, reference.shape, where, reference.shape.axis.transformed(mirrored=True))
        print_row(None, title, reference.distortion(target, placed.points), f"{int(placed.ran_off.sum())} off")
    return pictures


def print_row(heading: str | None, title: str, found: Distortion, remark: str) -> None:
    """One line: folds, then the 95th percentile of stretch or squeeze of lengths and of areas."""
    start = f"{title:46s}" if heading is None else f"{heading:>8s} {title:22s}"
    lengths, areas = spread_of(found.length_ratio), spread_of(found.area_ratio)
    print(f"{start} {found.folds:7d} {lengths:9.2f} {areas:8.2f}  {remark}".rstrip())
    ROWS[title.strip() if heading is None else f"{title}, {heading.strip()}"] = (
        f"{found.folds} folds, {lengths:.2f}, {areas:.2f}"
    )


def spread_of(ratio: FloatArray) -> float:
    """The 95th percentile of max(r, 1 / r)."""
    known = ratio[np.isfinite(ratio) & (ratio > 0.0)]
    return float(np.exp(np.percentile(np.abs(np.log(known)), 95)))


def painted_tentacle() -> tuple[TriangleMesh, SurfacePoints, SurfacePoints]:
    """A bent, tapered tube, a strip of points along its outer side, and axis picks along the strip's middle."""
    around, along, length = 24, 120, 4.0
    s, phi = np.meshgrid(np.linspace(0, 1, along), 2 * np.pi * np.arange(around) / around, indexing="ij")

    def surface(u: FloatArray, turn: FloatArray) -> FloatArray:
        radius = 0.16 - 0.10 * u
        bend = 2.0 * u
        centre = np.stack([length / 2.0 * np.sin(bend), np.zeros_like(u), length / 2.0 * (1 - np.cos(bend))], -1)
        out = np.stack([np.sin(bend), np.zeros_like(u), -np.cos(bend)], -1)
        side = np.broadcast_to([0.0, 1.0, 0.0], out.shape)
        wave = 0.15 * np.sin(9.0 * u)
        return centre + radius[..., None] * (
            np.cos(turn + wave)[..., None] * out + np.sin(turn + wave)[..., None] * side
        )

    mesh = TriangleMesh(surface(s, phi).reshape(-1, 3), meshes.grid_faces(along, around, wrap_columns=True))
    rng = np.random.default_rng(1)
    u, turn = rng.uniform(0.05, 0.9, 600), rng.uniform(-0.9, 0.9, 600)
    locator = Locator.of(mesh)
    strip = locator.closest(surface(u, turn)).points
    picks = locator.closest(surface(np.linspace(0.06, 0.89, 12), np.zeros(12))).points
    return mesh, strip, picks


def pole_root(pole: TriangleMesh, angle: float) -> Root:
    """A root low on the pole, heading up, turned by `angle`."""
    point = Locator.of(pole).closest(np.array([[POLE_RADIUS, 0.0, 1.0]])).points
    up = complex(direction_to_heading(pole, point, np.array([[0.0, 0.0, 1.0]]))[0])
    return Root.at(point, up * np.exp(1j * angle))


def ball_root(ball: TriangleMesh) -> Root:
    """A root on the equator of a ball, heading along it."""
    point = Locator.of(ball).closest(np.array([[0.6, 0.01, 0.02]])).points
    return Root.at(point, complex(direction_to_heading(ball, point, np.array([[0.0, 1.0, 0.0]]))[0]))


def middle_root(field: TriangleMesh) -> Root:
    """A root on a height field, so that a strip of length 1.2 along x has room."""
    point = Locator.of(field).closest(np.array([[-0.6, 0.01, 0.18]])).points
    return Root.at(point, complex(direction_to_heading(field, point, np.array([[1.0, 0.0, 0.0]]))[0]))


def on_plane(plane: TriangleMesh, where: FloatArray) -> SurfacePoints:
    """Points of the plane at (k, 2) positions."""
    return Locator.of(plane).closest(np.column_stack([where, np.zeros(len(where))])).points


def polygon_area(loop: ComplexArray) -> float:
    """Signed area of a closed polygon."""
    return float(0.5 * (np.conj(loop) * np.roll(loop, -1)).imag.sum())


def crossings(loop: ComplexArray) -> int:
    """How often the edges of a polygon cross one another."""
    a, b = loop[:-1], loop[1:]

    def side(p: ComplexArray, q: ComplexArray, r: ComplexArray) -> FloatArray:
        return np.sign((np.conj(q - p) * (r - p)).imag)

    first = side(a[:, None], b[:, None], a[None]) * side(a[:, None], b[:, None], b[None])
    second = side(a[None], b[None], a[:, None]) * side(a[None], b[None], b[:, None])
    crossed = (first < 0) & (second < 0)
    return int(np.triu(crossed, 2).sum())


if __name__ == "__main__":
    sys.exit(main())
