"""Edits end to end through the session, journal on: command, history, journal, reconstruction, notification.

    python benchmarks/bench_edits.py [--bunny FILE]

Without the bunny scan, a subdivided bumpy sphere of like size stands in, and the table says so. Every row holds the
median and the bar of the design; the bars are for an idle machine.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from benchmarks import host_edits
from benchmarks.harness import record
from contact_core.document.asset import Asset
from contact_core.edit.commands import Rotate
from contact_core.edit.history import History
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.scene.memory_host import MemoryHost
from contact_core.session import Session
from contact_core.testing import meshes

ROWS: dict[str, str] = {}  # what is recorded, in order


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bunny", type=Path, default=default_bunny())
    parser.add_argument("--copies", type=int, default=64)
    parser.add_argument("--host", action="store_true", help="the edits in the memory host alone")
    arguments = parser.parse_args()
    in_memory_host()
    if arguments.host:
        return 0
    mesh, name = scan(arguments.bunny)
    print(f"{name}: {len(mesh.faces)} faces, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    single = edits(mesh, "")
    many = edits(meshes.copies(mesh, arguments.copies, 0.0), f", {arguments.copies} copies")
    for key in ("translate", "rotate", "bend"):
        ROWS[f"{key}, {arguments.copies} copies over one, by the least"] = (
            f"{many[key] / single[key]:.2f}x (bar 1.5x)"
        )
    tree(mesh)
    history_memory()
    record(f"Edits through the session, journal on: {name}", ROWS)
    return 0


def edits(mesh: TriangleMesh, note: str) -> dict[str, float]:
    """Rows for one patch of 500 points; answers the least times in seconds."""
    least: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder, Session.open(Path(folder) / "d.json", discover=False) as session:
        session.surfaces.add("scan", mesh)
        points = disk(mesh, 500, 0.05)
        session.patches.paint("p", points, surface="scan", axis=points[ends(points, mesh)])
        session.listen(lambda change: session.geometry.points("p") and None)
        steps = nearby(points, mesh, 60)
        bars = {"translate": 2e-3, "rotate": 2e-3, "bend": 2e-3}
        actions: dict[str, Callable[[int], object]] = {
            "translate": lambda k: session.patches.translate("p", steps[k]),
            "rotate": lambda k: session.patches.rotate("p", 0.05),
            "bend": lambda k: session.patches.bend("p", 3, 0.02),
        }
        for key, action in actions.items():
            least[key] = row(f"{key}, 500 points{note}", action, bars[key])
        row(f"undo{note}", lambda k: session.undo(), 1e-4, warm=0)
        row(f"redo{note}", lambda k: session.redo(), 1e-4, warm=0)

        def transfer(k: int) -> None:
            copy = session.patches.transfer("p", "scan", steps[k], heading=1j)
            session.geometry.points(copy)

        row(f"transfer, 500 points{note}", transfer, 2e-3)
        session.close(discard=True)
    return least


def tree(mesh: TriangleMesh) -> None:
    """A tree of ten patches of 300 points, turned by its root."""
    with tempfile.TemporaryDirectory() as folder, Session.open(Path(folder) / "d.json", discover=False) as session:
        session.surfaces.add("scan", mesh)
        names = [f"p{k}" for k in range(10)]
        for k, name in enumerate(names):
            points = disk(mesh, 300, 0.03, seed=k)
            session.patches.paint(name, points, surface="scan", axis=points[ends(points, mesh)])
            if k:
                session.patches.link(name, names[(k - 1) // 2])

        def turn(k: int) -> None:
            session.patches.rotate("p0", 0.05)
            for name in names:
                session.geometry.points(name)

        row("rotate a tree of 10 patches of 300 points", turn, 10e-3)
        session.close(discard=True)


def in_memory_host() -> None:
    """Thirty patches of 500 points in the reference host, and saving as many in a document file."""
    host = MemoryHost()
    key = host.add(Asset("sheet", TriangleMesh(*host_edits.sheet()), meters_per_unit=1.0))
    with host_edits.painted(host, key) as session:
        document = session.document
        rows = host_edits.edits(host, session)
    with tempfile.TemporaryDirectory() as folder, Session(document, discover=False) as session:
        path = Path(folder) / "d.json"
        session.save(path)

        def save() -> None:
            session.patches.rotate("patch 0", 0.01)
            session.save()

        rows["rotate and save the document file"] = f"{host_edits.spelled(save, 9)}; {path.stat().st_size:,} bytes"
    record(f"{host_edits.TITLE}: memory", rows)


def history_memory() -> None:
    """Memory of 10,000 edits over 30 patches."""
    from contact_core.testing.random_commands import random_command, random_history

    rng = np.random.default_rng(0)
    history = random_history(0, 0)
    while len(history.document.patches) < 30:
        command = random_command(history.document, rng, "contact.paint")
        assert command is not None
        history.do(command)
    history = History(history.document)
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    while len(history.steps) < 10_000:
        command = random_command(history.document, rng, "contact.rotate")
        assert isinstance(command, Rotate)
        history.do(command)
    used = (tracemalloc.get_traced_memory()[0] - before) / 1e6
    tracemalloc.stop()
    ROWS["10,000 edits on 30 patches"] = f"{used:.1f} MB (bar 50 MB)"


def row(title: str, action: Callable[[int], object], bar: float, *, count: int = 40, warm: int = 3) -> float:
    """Time an action, keep its row, answer the least time in seconds."""
    taken = []
    for k in range(count):
        start = time.perf_counter()
        action(k)
        taken.append(time.perf_counter() - start)
    kept = taken[warm:]
    median = float(np.median(kept))
    ROWS[title] = f"{1e3 * median:.3f} ms, least {1e3 * min(kept):.3f} (bar {1e3 * bar:g} ms)"
    return min(kept)


def disk(mesh: TriangleMesh, count: int, reach: float, seed: int = 0) -> SurfacePoints:
    """Random points in faces within `reach` (of one copy's bounding box) of the seed-th place on the first copy.

    Places follow one another outwards from the first, up to about a fifth of the bounding box.
    """
    size = min(len(mesh.faces), 69_451)
    centres = mesh.points[mesh.faces[:size]].mean(axis=1)
    extent = float(np.linalg.norm(np.ptp(centres, axis=0)))
    random = np.random.default_rng(seed)
    outwards = np.argsort(np.linalg.norm(centres - centres[20_000 % size], axis=1))
    centre = centres[outwards[(size // 120) * seed]]
    near = np.flatnonzero(np.linalg.norm(centres - centre, axis=1) < reach * extent)
    return SurfacePoints(random.choice(near, count), random.dirichlet(np.ones(3), count))


def nearby(points: SurfacePoints, mesh: TriangleMesh, count: int) -> list[SurfacePoints]:
    """Single points in an order that steps a little further each time, as a drag does."""
    where = points.positions(mesh)
    order = np.argsort(np.linalg.norm(where - where[0], axis=1))
    return [points[int(k)] for k in order[1 : count + 1]]


def ends(points: SurfacePoints, mesh: TriangleMesh) -> list[int]:
    """The farthest pair, near enough: an axis."""
    where = points.positions(mesh)
    first = int(np.argmax(np.linalg.norm(where - where.mean(axis=0), axis=1)))
    return [first, int(np.argmax(np.linalg.norm(where - where[first], axis=1)))]


def default_bunny() -> Path:
    """Where the shared assets keep the scan."""
    beside = Path(__file__).resolve().parents[2] / "shared" / "assets"
    return Path(os.environ.get("CONTACT_ASSETS", beside)) / "objects" / "stanford_bunny_35k.obj"


def scan(path: Path) -> tuple[TriangleMesh, str]:
    """The bunny, or a stand-in of about as many faces."""
    if not path.exists():
        return meshes.noisy(6, 0.02), "a bumpy sphere (no bunny here)"
    points, faces = [], []
    for line in path.read_text().splitlines():
        if line.startswith("v "):
            points.append([float(x) for x in line.split()[1:4]])
        elif line.startswith("f "):
            faces.append([int(x.split("/")[0]) - 1 for x in line.split()[1:4]])
    return TriangleMesh(points, faces), path.stem


if __name__ == "__main__":
    sys.exit(main())
