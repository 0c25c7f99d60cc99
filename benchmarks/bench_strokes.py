"""The preview of a brush stroke of 1,000 samples on 10,000 vertices, and the disk brush's mark beside it.

    python benchmarks/bench_strokes.py [--quick]

Processor milliseconds per sample, medians over hundreds of samples: flat means that a stroke costs what is new.
"""

from __future__ import annotations

import argparse
import sys
import time
from statistics import median

import numpy as np
from harness import record

from contact_builtins.brushes.disk import DiskBrush
from contact_core.contact.brush import BrushGesture
from contact_core.contact.stroke_field import StrokeField
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.testing import meshes

RADIUS = 0.15


def stroke(mesh: meshes.TriangleMesh, samples: int) -> SurfacePoints:
    """A spiral over a unit sphere from pole to pole, a fifth of the radius a sample at the start."""
    z = np.linspace(0.95, -0.95, samples)
    angle = 0.08 * np.arange(samples)
    ring = np.sqrt(1.0 - z * z)
    return Locator.of(mesh).closest(np.stack([ring * np.cos(angle), ring * np.sin(angle), z], -1)).points


def previews(mesh: meshes.TriangleMesh, points: SurfacePoints) -> list[float]:
    """Processor ms of every sample."""
    StrokeField.begun(mesh, RADIUS).extended(points[[0]])  # compiles, and builds the tree
    field, times = StrokeField.begun(mesh, RADIUS), []
    for k in range(len(points)):
        began = time.process_time()
        field = field.extended(points[[k]])
        times.append(1e3 * (time.process_time() - began))
    return times


def marks(mesh: meshes.TriangleMesh, points: SurfacePoints, counts: list[int]) -> dict[int, float]:
    """Processor ms of the exact mark of the first samples: what a commit costs, and a preview cost before."""
    result = {}
    for count in counts:
        gesture = BrushGesture(mesh, points[:count], radius=RADIUS, spacing=RADIUS / 4.0)
        DiskBrush().mark(gesture)
        times = []
        for _ in range(5):
            began = time.process_time()
            DiskBrush().mark(gesture)
            times.append(1e3 * (time.process_time() - began))
        result[count] = median(times)
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer samples: a smoke test, which is not recorded")
    few = parser.parse_args().quick
    mesh = meshes.icosphere(5)
    points = stroke(mesh, 200 if few else 1000)
    times = previews(mesh, points)
    part = len(times) // 10
    lines = {
        "preview, a sample, the first tenth (bar: 2 ms)": f"{median(times[:part]):.2f} ms",
        "preview, a sample, the last tenth (bar: 2 ms)": f"{median(times[-part:]):.2f} ms",
        "preview, the slowest sample": f"{max(times):.2f} ms",
    } | {
        f"disk, exact mark of {count} samples": f"{ms:.1f} ms"
        for count, ms in marks(mesh, points, [5, 60] if few else [5, 60, 280, 1000]).items()
    }
    if few:
        sys.stdout.writelines(f"{name}: {line}\n" for name, line in lines.items())
    else:
        record("Strokes, on a sphere of 10,242 vertices", lines)


if __name__ == "__main__":
    main()
