"""Default axes against axes drawn by hand: agreement and transfer distortion, for every built-in hand.

    python benchmarks/bench_axes.py [--picture docs/images/axis_generators.png | --held-out RIG.glb] [--page]

For each patch of reference_axes.toml, painted by the disk brush, and for each generator: the angle between its
axis and the reference (0 to 180 degrees: a wrong sign counts), how far the middles lie apart (in brush radii),
and how the patch is stretched when it goes onto the baseball along that axis (largest and median change of
length, folds).
"""

from __future__ import annotations

import argparse
import tomllib
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from contact_core.contact.axis import draw_axis
from contact_core.contact.axis_generator import AxisRequest
from contact_core.contact.brush import BrushGesture
from contact_core.document.asset import Asset
from contact_core.geometry import SurfacePoints, TriangleMesh, exact_geodesic
from contact_core.geometry.raycast import Locator
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import AXIS_GENERATORS, BRUSHES, FORMATS, RENDERERS, SAMPLES
from contact_core.rig.bones import bones_of
from contact_core.scene.picture import Picture, PictureMesh
from contact_core.session import Session

HERE = Path(__file__).parent
KINDS = ("tip", "pad", "palm", "band", "side", "crease", "heel", "edge")
COLUMNS = {"tip": ("tip",), "pad": ("pad",), "palm": ("palm",), "band across": ("band",)}
COLUMNS_HELD_OUT = {
    "tip": ("tip",), "pad": ("pad",), "along": ("palm", "side", "edge"), "across": ("band", "crease", "heel"),
}  # fmt: skip
PAGE = HERE.parent / "docs" / "algorithms" / "axes.md"


@dataclass(frozen=True, eq=False)
class Painted:
    """One patch of the benchmark: its points, and the axis drawn by hand."""

    hand: str
    name: str
    radius: float
    points: SurfacePoints
    reference: SurfacePoints

    @property
    def kind(self) -> str:
        return self.name.rpartition("_")[2]


def painted(hand: str, asset: Asset, plugins: PluginManager, references: str) -> list[Painted]:
    """The patches of one hand in a file of references."""
    table = tomllib.loads((HERE / references).read_text(encoding="utf-8"))[hand]
    brush, locator = plugins.get(BRUSHES, "disk"), Locator.of(asset.mesh)
    result = []
    for name, entry in table.items():
        stroke = locator.closest(entry["stroke"]).points
        gesture = BrushGesture(asset.mesh, stroke, radius=entry["radius"], spacing=entry["radius"] / 7.0)
        points = brush.mark(gesture).points
        result.append(Painted(hand, name, entry["radius"], points, locator.closest(entry["axis"]).points))
    return result


def along(mesh: TriangleMesh, axis: SurfacePoints) -> tuple[np.ndarray, np.ndarray]:
    """The middle of an axis and its unit direction there, in space."""
    at = draw_axis(mesh, axis)[1].points.positions(mesh)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(at, axis=0), axis=1))])
    places = np.array([0.4, 0.5, 0.6]) * length[-1]
    before, middle, after = np.stack([np.interp(places, length, at[:, k]) for k in range(3)], -1)
    return middle, (after - before) / np.linalg.norm(after - before)


def measure(asset: Asset, patch: Painted, axis: SurfacePoints, ball: TriangleMesh) -> dict[str, float]:
    """Angle (degrees), offset (brush radii), stretch of the patch on the ball."""
    middle, direction = along(asset.mesh, axis)
    wanted_middle, wanted = along(asset.mesh, patch.reference)
    result = {
        "angle": float(np.degrees(np.arccos(np.clip(direction @ wanted, -1.0, 1.0)))),
        "offset": float(np.linalg.norm(middle - wanted_middle) / patch.radius),
    }
    with Session(discover=False) as session:
        session.surfaces.add("hand", asset.mesh)
        session.surfaces.add("ball", ball)
        session.patches.paint("patch", patch.points, surface="hand", axis=axis)
        root = Locator.of(ball).closest((ball.points.mean(axis=0) + np.array([0.3, 0.2, 0.1]))[None]).points
        copy = session.patches.transfer("patch", "ball", root, direction=[0.0, 1.0, 0.0])
        stretch = session.geometry.distortion("patch", copy)
    ratio = stretch.length_ratio[np.isfinite(stretch.length_ratio)]
    change = np.maximum(ratio, 1.0 / ratio)
    return {**result, "median": float(np.median(change)), "worst": float(change.max()), "folds": stretch.folds}


def generated(asset: Asset, patches: list[Painted], generator: Any) -> dict[str, SurfacePoints]:
    """The generator's axis of each patch, one after the other, as an artist would paint them."""
    drawn: dict[str, SurfacePoints] = {}
    assert asset.rig is not None
    for patch in patches:
        bones, owner = bones_of(asset.rig, patch.points)
        drawn[patch.name] = generator.generate(AxisRequest(asset.mesh, patch.points, bones, owner, dict(drawn)))
    return drawn


def lines(mesh: TriangleMesh, axis: SurfacePoints) -> np.ndarray:
    """(k, 2, 3) segments of an axis, lifted off the skin so that the patch does not hide them."""
    parts = [exact_geodesic(mesh, axis[k], axis[k + 1]).points for k in range(len(axis) - 1)]
    ways = [part.positions(mesh) + 2e-3 * part.normals(mesh) for part in parts]
    return np.concatenate([np.stack([way[:-1], way[1:]], 1) for way in ways])


def picture(asset: Asset, patches: list[Painted], drawn: dict[str, SurfacePoints], caption: str) -> Picture:
    """The hand from the palm's side: patches, axes by hand in black, generated ones in red with their starts."""
    mesh = asset.mesh
    dots = np.concatenate([patch.points.positions(mesh)[::4] for patch in patches])
    by_hand = np.concatenate([lines(mesh, patch.reference) for patch in patches])
    ours = np.concatenate([lines(mesh, axis) for axis in drawn.values()])
    starts = np.concatenate([axis[0].positions(mesh) + 2.5e-3 * axis[0].normals(mesh) for axis in drawn.values()])
    return Picture(
        (PictureMesh(mesh, (0.88, 0.77, 0.68)),),
        points=((dots, (0.35, 0.5, 0.8)), (starts, (0.8, 0.0, 0.0))),
        lines=((by_hand, (0.05, 0.05, 0.05)), (ours, (0.85, 0.1, 0.1))),
        camera_from=(0.0, -0.15, 1.0),
        caption=caption,
    )


def table(found: dict[tuple[str, str], list[dict[str, float]]], columns: dict[str, tuple[str, ...]]) -> str:
    """The page's table: angle in degrees, median, and the share within 20 degrees, by generator and kind."""
    names = list(dict.fromkeys(name for name, _ in found))
    rows = []
    for name in names:
        angles = [
            np.array([row["angle"] for kind in kinds for row in found[name, kind]]) for kinds in columns.values()
        ]
        heads = [f"{title} ({len(angle)})" for title, angle in zip(columns, angles, strict=True)]
        if "across" in columns:  # how much of it is the sign
            angles.append(np.minimum(angles[-1], 180.0 - angles[-1]))
            heads.append("across, sign aside")
        rows.append([name, *(f"{np.median(angle):.0f} / {np.mean(angle <= 20.0):.0%}" for angle in angles)])
    lines = [["generator", *heads], ["---"] * (1 + len(heads)), *rows]
    return (
        "\n".join("| " + " | ".join(line) + " |" for line in lines)
        .replace("| --- ", "|---")
        .replace("--- |", "---|")
    )


def put_into_page(text: str, name: str) -> None:
    """Put a table between the page's marks of that name."""
    before, mark, rest = PAGE.read_text(encoding="utf-8").partition(f"<!-- {name}: written by bench_axes.py -->\n")
    _, end, after = rest.partition("<!-- end -->")
    assert mark and end, f"{PAGE} has no marks for {name}"
    PAGE.write_text(f"{before}{mark}\n{text}\n\n{end}{after}", encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--picture", type=Path, help="where to write the hands side by side")
    parser.add_argument("--held-out", type=Path, help="a glTF hand of held_out_axes.toml, in place of the samples")
    parser.add_argument("--page", action="store_true", help="put the angles into docs/algorithms/axes.md")
    arguments = parser.parse_args()
    plugins = PluginManager()
    ball = plugins.get(SAMPLES, "baseball").build().mesh
    found: dict[tuple[str, str], list[dict[str, float]]] = defaultdict(list)
    pictures = []
    held_out = arguments.held_out
    references = "held_out_axes.toml" if held_out else "reference_axes.toml"
    for hand in (held_out.stem,) if held_out else ("human_hand", "witch_hand", "alien_hand"):
        asset = plugins.get(FORMATS, "gltf").read(held_out) if held_out else plugins.get(SAMPLES, hand).build()
        patches = painted(hand, asset, plugins, references)
        for name, generator in plugins.offers(AXIS_GENERATORS).items():
            drawn = generated(asset, patches, generator)
            for patch in patches:
                found[name, patch.kind].append(measure(asset, patch, drawn[patch.name], ball))
            if hand == "human_hand":
                pictures.append(picture(asset, patches, drawn, name))
    print("generator      patches  n   angle to the axis by hand     offset   change of length     folds")
    print("                            median    max   within 20 deg  median   median   worst")
    for name in plugins.offers(AXIS_GENERATORS):
        for kind in KINDS:
            rows = found[name, kind]
            if not rows:
                continue
            angle, offset, median, worst, folds = (
                np.array([row[key] for row in rows]) for key in ("angle", "offset", "median", "worst", "folds")
            )
            print(
                f"{name:<14} {kind:<5} {len(rows):4d} {np.median(angle):9.1f} {angle.max():8.1f}"
                f" {np.mean(angle <= 20.0):10.0%} {np.median(offset):11.2f} {np.median(median):8.3f}"
                f" {worst.max():8.3f} {int(folds.sum()):6d}"
            )
    if arguments.page:
        put_into_page(
            table(found, COLUMNS_HELD_OUT if held_out else COLUMNS), "held out" if held_out else "tuned on"
        )
    if arguments.picture:
        renderer = plugins.get(RENDERERS, "software")  # the same picture on every machine
        renderer.render(pictures, arguments.picture, size=(360 * len(pictures), 560))


if __name__ == "__main__":
    main()
