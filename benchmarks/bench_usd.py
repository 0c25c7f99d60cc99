"""USD: reading the arrays of a million triangles, one edit through the adapter, undo, a key.

    python benchmarks/bench_usd.py

Medians of several runs, wall time. "connectivity" is what a surface computes when first asked for, told apart.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom, Vt

from contact_core.document.asset import Asset
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.session import Session
from contact_core.testing.host_scenes import arm_rig, bent
from contact_usd.host import UsdHost

SIDE = 708  # points along one side: about a million triangles


def seconds(work: Callable[[], object], repeats: int = 7) -> float:
    """Median wall time of a call."""
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return statistics.median(times)


def sheet(side: int, *, quads: bool) -> tuple[np.ndarray, np.ndarray]:
    """Points (side * side, 3) of a wavy sheet and its faces, (m, 4) or (2m, 3)."""
    u, v = np.meshgrid(np.linspace(0, 1, side), np.linspace(0, 1, side), indexing="ij")
    points = np.c_[u.ravel(), v.ravel(), 0.1 * np.sin(6 * u * v).ravel()].astype(np.float32)
    corner = np.arange((side - 1) * side).reshape(side - 1, side)[:, :-1].ravel()
    faces = np.c_[corner, corner + side, corner + side + 1, corner + 1]
    return points, faces if quads else np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])


def million(folder: Path, *, quads: bool) -> Path:
    """A binary layer with the sheet, written by pxr alone."""
    points, faces = sheet(SIDE, quads=quads)
    path = folder / f"{'quads' if quads else 'triangles'}.usdc"
    stage = Usd.Stage.CreateNew(str(path))
    mesh = UsdGeom.Mesh.Define(stage, "/sheet")
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(faces), faces.shape[1], np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(faces.astype(np.int32).ravel()))
    stage.Save()
    return path


def main() -> int:
    rows: list[tuple[str, float, float | None]] = []  # what, milliseconds, target
    with tempfile.TemporaryDirectory() as name:
        for quads in (False, True):
            path = million(Path(name), quads=quads)
            host = UsdHost(path)
            began = time.perf_counter()
            asset = host.read_surface("/sheet")
            first = time.perf_counter() - began
            kind = "500k quads" if quads else "1M triangles"
            rows.append((f"read {kind}, first time", 1e3 * first, None))
            again = seconds(lambda h=host: h.read_surface("/sheet"))
            rows.append((f"read {kind}", 1e3 * again, None if quads else 300.0))
            arrays = (asset.mesh.points, asset.mesh.faces)
            rows.append(("  digest", 1e3 * seconds(lambda a=arrays: TriangleMesh(*a).digest), None))
    rows += edits()
    width = max(len(what) for what, _, _ in rows)
    for what, milliseconds, target in rows:
        told = "" if target is None else f"  (target {target:g} ms{'' if milliseconds < target else ': MISSED'})"
        print(f"{what:<{width}}  {milliseconds:9.2f} ms{told}")
    return int(any(target is not None and value >= target for _, value, target in rows))


def edits() -> list[tuple[str, float, float | None]]:
    """A 500-point patch on a sheet in a stage: rotate, undo, key a pose."""
    points, faces = sheet(60, quads=False)
    host = UsdHost()
    key = host.add(Asset("sheet", TriangleMesh(points, faces), meters_per_unit=1.0))
    rig = arm_rig()
    arm = host.add(Asset("arm", rig.surface, rig, meters_per_unit=1.0))
    session = Session(host=host, discover=False)
    mesh = host.read_surface(key).mesh
    session.add_surface("sheet", mesh)
    middle = np.argsort(np.linalg.norm(mesh.points - [0.5, 0.5, 0.0], axis=1), kind="stable")[:500]
    patch = SurfacePoints.at_vertices(mesh, middle)
    session.paint("patch", patch, surface="sheet", axis=patch[[0, 400]])
    data = host.stored_document()
    assert data is not None
    rotate = seconds(lambda: session.rotate("patch", 0.01), 31)
    undo = seconds(session.undo, 15)
    frames = iter(range(1000))
    keyed = seconds(lambda: host.write_pose(arm, bent(rig, 1), float(next(frames))), 15)
    return [
        (f"rotate a patch of 500 points ({len(data.data)} bytes stored)", 1e3 * rotate, 15.0),
        ("undo of that", 1e3 * undo, None),
        ("key a pose", 1e3 * keyed, None),
    ]


if __name__ == "__main__":
    sys.exit(main())
