"""Sizes: time and memory of single operations on 4M faces, 500 joints, 2,000 patches, 50,000 points, 10,000 edits.

    python -m benchmarks.bench_sizes [--quick] [--part NAME]

Each part runs in a process of its own, so that its memory is its own. CPU time; memory is what an operation added
to the resident set, and "peak" the largest that the part ever had beyond the imports.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import contact_core as contact
from benchmarks.harness import record
from contact_core.document.frozen_map import FrozenMap
from contact_core.geometry.engine import EXACT
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.topology import Topology
from contact_core.rig.rig import JointFreedom, Rig, skin
from contact_core.solve.solver import SolveOptions
from contact_core.solve.warm_up import warm_up
from contact_core.testing import meshes

ROWS: dict[str, str] = {}
_PEAKS = {"faces": 432}  # MB: three times the arrays of 4M faces


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a quarter of the faces, a tenth of the edits")
    parser.add_argument("--part", choices=PARTS, help="one part alone, its rows as JSON")
    arguments, _ = parser.parse_known_args()
    if arguments.part:
        warm_up()
        base = _resident()
        PARTS[arguments.part](arguments.quick)
        peak, wanted = _peak() - base, _PEAKS.get(arguments.part)
        ROWS[f"{arguments.part}: peak"] = f"{peak:.0f} MB" + (
            f" (wanted: at most {wanted}{'' if peak <= wanted else '; MISSED'})"
            if wanted and not arguments.quick
            else ""
        )
        sys.stdout.write(json.dumps(ROWS))
        return
    rows: dict[str, str] = {}
    for part in PARTS:
        command = [sys.executable, __file__, "--part", part, *(["--quick"] if arguments.quick else [])]
        rows |= json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    record("Sizes", rows)


def measured(name: str, work: Callable[[], Any], limit: float | None = None) -> Any:
    """Do it once; a row of its time and of what it added to the memory. limit: milliseconds that are wanted."""
    before, began = _resident(), time.process_time()
    result = work()
    spent, added = 1e3 * (time.process_time() - began), _resident() - before
    ROWS[name] = _spelled(spent, limit) + (f", +{added:.0f} MB" if added >= 1.0 else "")
    return result


def repeated(name: str, works: list[Callable[[], Any]], limit: float | None = None) -> None:
    """The median and the worst of several."""
    spent = []
    for work in works:
        began = time.process_time()
        work()
        spent.append(1e3 * (time.process_time() - began))
    ROWS[name] = f"{_spelled(median(spent), limit)}, worst {max(spent):.3g} ms"


def faces(quick: bool) -> None:
    """4M faces: a wavy sheet."""
    side = 708 if quick else 1415
    mesh = sheet(side)
    arrays = (mesh.points.nbytes + mesh.faces.nbytes) / 1e6
    label = f"{len(mesh.faces) / 1e6:.0f}M faces ({arrays:.0f} MB)"
    measured(f"{label}: digest", lambda: mesh.digest)
    measured(f"{label}: connectivity", lambda: Topology.of(mesh))
    measured(f"{label}: tree for closest points and rays", lambda: Locator.of(mesh).closest(mesh.points[:1]))
    session = contact.new(sheet=mesh, discover=False)
    middle = len(mesh.points) // 2 + side // 2
    points = SurfacePoints.at_vertices(mesh, nearest(mesh, middle, 500))
    measured(f"{label}: paint 500 points, the first time", lambda: paint(session, "first", points))
    measured(f"{label}: paint 500 points", lambda: paint(session, "second", points))
    places = np.random.default_rng(0).integers(0, len(mesh.points), 20)
    repeated(f"{label}: transfer 500 points and trace them", [move(session, mesh, int(v)) for v in places])
    repeated(f"{label}: turn 500 points and trace them", [turn(session, "second") for _ in range(20)])


def joints(quick: bool) -> None:
    """500 joints: a worm of 24,000 points with four contacts on a ball."""
    rig = worm(500)
    mesh = rig.surface
    session = contact.new(
        worm=contact.Asset("worm", mesh, rig, meters_per_unit=1.0), ball=meshes.icosphere(4), discover=False
    )
    measured("500 joints: pose the skin of 24k points", lambda: skin(rig, rig.rest_world))
    ball = session.geometry.mesh("ball")
    for number, share in enumerate(np.linspace(0.2, 0.9, 4)):
        vertex = int(np.argmin(np.linalg.norm(mesh.points - [1.0, 0.0, 2.0 * share - 1.0], axis=1)))
        points = SurfacePoints.at_vertices(mesh, nearest(mesh, vertex, 60))
        session.patches.paint(f"p{number}", points, surface="worm", axis=points[[0, 40]])
        root = SurfacePoints.at_vertices(ball, [100 * number + 7])
        session.pairs.add(f"p{number}", session.patches.transfer(f"p{number}", "ball", root, heading=1.0 + 0.0j))
    measured("500 joints: make the problem", session.problem)
    options = SolveOptions(max_iterations=2 if quick else 5, candidates=("current",))
    found = measured("500 joints: solve, 1,500 dofs, five iterations", lambda: session.solve(options=options))
    measured("500 joints: accept", lambda: session.accept(found))
    repeated("500 joints: turn a patch", [turn(session, "p1") for _ in range(20)])


def patches(quick: bool) -> None:
    """2,000 patches of 80 points, each with a shape of its own."""
    count = 2000
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "document.json"
        mesh = meshes.icosphere(6)
        session = contact.new(ball=mesh, discover=False)
        points = SurfacePoints.at_vertices(mesh, nearest(mesh, 5, 80))
        session.patches.paint("p0", points, surface="ball", axis=points[[0, 40]])
        many = copied(session.document, count)
        session.close()
        with contact.Session(many, discover=False) as session:
            measured(f"{count} patches: save", lambda: session.save(path))
        ROWS[f"{count} patches: file"] = f"{path.stat().st_size / 1e6:.1f} MB"
        session = measured(f"{count} patches: open", lambda: contact.open(path), 1000.0)
        session.surfaces.add("ball", mesh)
        some = [f"p{k}" for k in range(0, count, 50)]
        repeated(f"{count} patches: turn one", [turn(session, name) for name in some], 5.0)
        repeated(
            f"{count} patches: paint one", [lambda n=f"new {k}": paint(session, n, points) for k in range(20)], 5.0
        )
        repeated(
            f"{count} patches: remove one", [lambda n=name: session.patches.remove(n) for name in some[20:]], 5.0
        )
        repeated(f"{count} patches: undo", [session.undo] * 20, 5.0)
        measured(
            f"{count} patches: where all points are",
            lambda: [session.geometry.points(n) for n in session.document.patches],
        )
        measured(f"{count} patches: save again", session.save)
        session.close()


def points(quick: bool) -> None:
    """A patch of 50,000 points on 1M faces."""
    count, side = (5_000 if quick else 50_000), 708
    mesh = sheet(side)
    session = contact.new(sheet=mesh, discover=False)
    middle = len(mesh.points) // 2 + side // 2
    painted = SurfacePoints.at_vertices(mesh, nearest(mesh, middle, count))
    paint(session, "small", painted[:100])
    label = f"{count:,} points"
    measured(f"{label}: paint", lambda: paint(session, "large", painted))
    measured(f"{label}: turn", turn(session, "large", traced=False))
    measured(f"{label}: trace", lambda: session.geometry.points("large"))
    root = SurfacePoints.at_vertices(mesh, [middle + 40 * side + 50])
    measured(f"{label}: transfer and trace", lambda: session.geometry.points(
        session.patches.transfer("large", "sheet", root, heading=1.0 + 0.0j)))  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        measured(f"{label}: save", lambda: session.save(Path(folder) / "d.json"))
        session.close()
        measured(f"{label}: open", lambda: contact.open(Path(folder) / "d.json").close())


def edits(quick: bool) -> None:
    """A history of 10,000 edits of 100 patches, journalled."""
    count = 1000 if quick else 10_000
    mesh = sheet(60)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "d.json"
        session = contact.new(sheet=mesh, discover=False)
        paint(session, "p0", SurfacePoints.at_vertices(mesh, np.arange(1000, 1080)))
        session.adopt(type(session.history)(copied(session.document, 100)))
        session.save(path)
        tenth = count // 10
        parts = [[turn(session, f"p{k % 100}", traced=False) for k in range(tenth)] for _ in range(10)]
        repeated(f"{count:,} edits: one of the first tenth", parts[0], 5.0)
        for part in parts[1:-1]:
            for work in part:
                work()
        repeated(f"{count:,} edits: one of the last tenth", parts[-1], 5.0)
        repeated(f"{count:,} edits: undo", [session.undo] * tenth, 5.0)
        measured(f"{count:,} edits: redo a tenth", lambda: [session.redo() for _ in range(tenth)])
        session._file.close(in_order=False)  # as a killed process does
        ROWS[f"{count:,} edits: journal"] = f"{path.with_name('d.json.journal').stat().st_size / 1e6:.1f} MB"
        measured(f"{count:,} edits: open after a crash", lambda: contact.open(path))


def visits(quick: bool) -> None:
    """The first log map in a region against later ones there: 300 points on 82k faces, 60 regions.

    Five rounds, each on a copy of the mesh that no query has seen. The ratio of a region is the median of its
    rounds, so that one interruption is no verdict; wanted is that nine regions in ten are within the bar.
    """
    mesh = meshes.icosphere(6)
    bumpy = mesh.points * (1 + 0.05 * np.sin(7 * mesh.points[:, [0]]) * np.cos(5 * mesh.points[:, [1]]))
    for words, each in (
        ("", mesh.with_points(bumpy)),
        (", faces in the order of space", in_order(mesh.with_points(bumpy))),
    ):
        tree, rounds = cKDTree(each.points), []
        for fresh in (each.with_points(each.points) for _ in range(5)):
            log_map_at(fresh, tree, 0)()
            places = np.random.default_rng(1).choice(len(each.points), 60, replace=False)
            rounds.append([_first_against_later(log_map_at(fresh, tree, int(vertex))) for vertex in places])
        ratios = np.median(rounds, axis=0)
        p90 = float(np.percentile(ratios, 90))
        ROWS[f"first visit against later{words}"] = (
            f"{median(ratios):.2f} times, 90 % within {p90:.2f} (wanted: at most 1.5"
            f"{'' if p90 <= 1.5 else '; MISSED'}), worst region {max(ratios):.2f}"
        )


def _first_against_later(query: Callable[[], Any]) -> float:
    spent = []
    for _ in range(6):
        began = time.thread_time()
        query()
        spent.append(time.thread_time() - began)
    return spent[0] / median(spent[1:])


PARTS: dict[str, Callable[[bool], None]] = {
    each.__name__: each for each in (faces, joints, patches, points, edits, visits)
}


def sheet(side: int) -> TriangleMesh:
    """2 (side - 1)^2 faces, made without a second copy of anything: the peak is to be that of the job."""
    points, faces = np.empty((side * side, 3)), np.empty((2 * (side - 1) ** 2, 3), np.int64)
    u, v = points[:, 0].reshape(side, side), points[:, 1].reshape(side, side)
    u[:], v[:] = np.linspace(0, 1, side)[:, None], np.linspace(0, 1, side)
    for row in range(side):
        points[row * side : (row + 1) * side, 2] = 0.1 * np.sin(6 * u[row] * v[row])
    halves = faces.reshape(2, side - 1, side - 1, 3)  # all first triangles of the squares, then all second ones
    for row in range(side - 1):
        corner = np.arange(row * side, (row + 1) * side - 1)
        halves[0, row] = np.c_[corner, corner + side, corner + side + 1]
        halves[1, row] = np.c_[corner, corner + side + 1, corner + 1]
    for array in (points, faces):
        array.setflags(write=False)  # so that a mesh keeps it
    return TriangleMesh(points, faces)


def worm(count: int) -> Rig:
    """A tube along z with a chain of joints."""
    tube = meshes.cylinder(24, 1000)
    z = tube.points[:, 2]
    rest = np.tile(np.eye(4), (count, 1, 1))
    rest[0, 2, 3], rest[1:, 2, 3] = z.min(), np.ptp(z) / count
    world = rest.copy()
    for joint in range(1, count):
        world[joint] = world[joint - 1] @ rest[joint]
    along = np.clip((z - z.min()) / np.ptp(z) * count, 0, count - 1.001)
    first = along.astype(int)
    return Rig(
        "worm", tuple(f"j{k}" for k in range(count)), np.arange(-1, count - 1), rest, world,
        tube.points, tube.faces, np.c_[first, first + 1], np.c_[1 - (along - first), along - first],
        tuple(JointFreedom() for _ in range(count)),
    )  # fmt: skip


def copied(document: Any, count: int) -> Any:
    """A document with its first patch so many times, each with a shape of its own."""
    patch = document.patches["p0"]
    shape = document.shapes[patch.shape]
    many = {f"p{k}": replace(patch, name=f"p{k}", shape=f"s{k}") for k in range(count)}
    return replace(document, patches=FrozenMap(many), shapes=FrozenMap({f"s{k}": shape for k in range(count)}))


def in_order(mesh: TriangleMesh) -> TriangleMesh:
    """The same mesh with points and faces numbered along a curve that fills space (Morton)."""

    def code(points: np.ndarray) -> np.ndarray:
        cells = ((points - points.min(axis=0)) / np.ptp(points, axis=0) * 1023).astype(np.int64)
        bits = [((cells[:, axis] >> bit) & 1) << (3 * bit + axis) for bit in range(10) for axis in range(3)]
        return np.sum(bits, axis=0)

    order = np.argsort(code(mesh.points))
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    by_face = np.argsort(code(mesh.points[mesh.faces].mean(axis=1)))
    return TriangleMesh(mesh.points[order], place[mesh.faces][by_face])


def nearest(mesh: TriangleMesh, vertex: int, count: int) -> np.ndarray:
    return np.argsort(np.linalg.norm(mesh.points - mesh.points[vertex], axis=1), kind="stable")[:count]


def log_map_at(mesh: TriangleMesh, tree: cKDTree, vertex: int) -> Callable[[], Any]:
    around = SurfacePoints.at_vertices(mesh, tree.query(mesh.points[vertex], 300)[1])
    return lambda: EXACT.log_map(mesh, around[[0]], around)


def paint(session: contact.Session, name: str, painted: SurfacePoints) -> None:
    surface = next(iter(session.document.surfaces))
    session.patches.paint(name, painted, surface=surface, axis=painted[[0, len(painted) // 2]])


def move(session: contact.Session, mesh: TriangleMesh, vertex: int) -> Callable[[], Any]:
    root = SurfacePoints.at_vertices(mesh, [vertex])
    return lambda: session.geometry.points(session.patches.transfer("first", "sheet", root, heading=1.0 + 0.0j))


def turn(session: contact.Session, name: str, *, traced: bool = True) -> Callable[[], Any]:
    def work() -> None:
        session.patches.rotate(name, 0.01)
        if traced:
            session.geometry.points(name)

    return work


def _resident() -> float:
    """Megabytes in memory now; 0 where the system does not say."""
    status = Path("/proc/self/statm")
    return int(status.read_text().split()[1]) * resource.getpagesize() / 1e6 if status.exists() else 0.0


def _peak() -> float:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / 1e6 if sys.platform == "darwin" else peak / 1e3


def _spelled(milliseconds: float, limit: float | None) -> str:
    told = f"{milliseconds:.3g} ms" if milliseconds < 1e4 else f"{milliseconds / 1e3:.3g} s"
    return (
        told
        if limit is None
        else f"{told} (wanted: under {limit:g} ms{'' if milliseconds < limit else '; MISSED'})"
    )


if __name__ == "__main__":
    main()
