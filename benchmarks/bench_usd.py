"""USD: reading the arrays of a million triangles, one edit through the adapter, undo, a key.

    python -m benchmarks.bench_usd [--quick]

Medians of several runs, processor time; first times by the clock. Connectivity is built when first asked for and
is not part of reading.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom, Vt

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from benchmarks import host_edits
from benchmarks.harness import interleaved, record
from contact_core.document.asset import Asset
from contact_core.geometry.mesh import TriangleMesh
from contact_core.testing.host_scenes import arm_rig, bent
from contact_usd import contacts
from contact_usd.host import UsdHost

SIDE = 708  # points along one side: about a million triangles


def seconds(work: Callable[[], object], repeats: int) -> float:
    """Median processor time of a call."""
    return interleaved({"it": work}, repeats)["it"].median


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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer repeats")
    parser.add_argument("--host", action="store_true", help="the edits alone")
    arguments, _ = parser.parse_known_args()
    record(f"{host_edits.TITLE}: USD", editing(9 if arguments.quick else 41))
    if not arguments.host:
        record("USD adapter", reading(3 if arguments.quick else 9))


def reading(repeats: int) -> dict[str, str]:
    """A million triangles, and as many from quads, from a binary layer."""
    rows = {}
    with tempfile.TemporaryDirectory() as folder:
        for quads in (False, True):
            host = UsdHost(million(Path(folder), quads=quads))
            kind = "1M triangles out of 500k quads" if quads else "1M triangles"
            began = time.perf_counter()
            mesh = host.read_surface("/sheet").mesh
            rows[f"read {kind}, first time"] = spelled(time.perf_counter() - began)
            again = seconds(lambda h=host: h.read_surface("/sheet"), repeats)
            rows[f"read {kind}"] = spelled(again, None if quads else 0.3)
        rows["their digest"] = spelled(seconds(lambda: TriangleMesh(mesh.points, mesh.faces).digest, repeats))
    return rows


def editing(repeats: int) -> dict[str, str]:
    """Thirty patches of 500 points on a sheet in a stage: edits, publishing what one changed, a key."""
    host = UsdHost()
    key = host.add(Asset("sheet", TriangleMesh(*host_edits.sheet()), meters_per_unit=1.0))
    rig = arm_rig()
    arm = host.add(Asset("arm", rig.surface, rig, meters_per_unit=1.0))
    session = host_edits.painted(host, key)
    rows = host_edits.edits(host, session, repeats)
    frames = iter(range(1000))

    def publish() -> None:
        contacts.publish(host, session, {"sheet": key})

    def turn() -> None:
        session.patches.rotate("patch 0", 0.01)

    def key_pose() -> None:
        host.write_pose(arm, bent(rig, 1), float(next(frames)))

    rows["publish all patches"] = host_edits.spelled(lambda: (_unpublish(host), publish()), 5)
    rows["rotate, all patches published"] = host_edits.spelled(turn, repeats, host_edits.BAR)
    rows["rotate and publish what that changed"] = host_edits.spelled(lambda: (turn(), publish()), repeats)
    rows["publish nothing new"] = host_edits.spelled(publish, repeats)
    rows["key a pose"] = host_edits.spelled(key_pose, repeats)
    return rows


def _unpublish(host: UsdHost) -> None:
    """Remove what was published, so that the next publishing makes all of it."""
    for scope in (contacts.PATCHES, contacts.PAIRS):
        host.stage.RemovePrim(scope)


def spelled(value: float, target: float | None = None) -> str:
    """Milliseconds, and whether a target is kept."""
    told = f"{1e3 * value:.3g} ms"
    if target is None:
        return told
    return f"{told} (wanted: under {1e3 * target:g} ms{'' if value < target else '; MISSED'})"


if __name__ == "__main__":
    main()
