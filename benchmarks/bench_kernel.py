"""The geodesic kernel beside every peer that pip installs, in one process, in turn.

    python -m benchmarks kernel [--quick]

Workload W: a geodesic disk of radius 5% of the bounding-box diagonal on the Stanford bunny, 500 random points in
it, an axis of 20 points across; on the mesh as it is and subdivided at the midpoints. Needs $CONTACT_ASSETS or
../shared/assets, pygeodesic and potpourri3d.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import potpourri3d
from pygeodesic import geodesic

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from benchmarks.harness import interleaved, ratio, record
from contact_core.geometry import SurfacePoints, Topology, TriangleMesh, log_map, trace_chains, trace_geodesic
from contact_core.geometry.tangent import heading_to_direction
from contact_core.testing import meshes

ROOT = Path(__file__).resolve().parents[1]
CENTRE = np.array([-0.03, 0.10, 0.035])  # on the bunny's side


def bunny(subdivisions: int) -> TriangleMesh:
    """stanford_bunny_35k.obj without unused points, subdivided at the midpoints."""
    folder = Path(os.environ.get("CONTACT_ASSETS", ROOT.parent / "shared" / "assets"))
    words = [line.split() for line in (folder / "objects/stanford_bunny_35k.obj").read_text().splitlines()]
    points = np.array([line[1:4] for line in words if line and line[0] == "v"], float)
    faces = np.array(
        [[corner.split("/")[0] for corner in line[1:4]] for line in words if line and line[0] == "f"], int
    )
    mesh = meshes.without_unused(points, faces - 1)
    for _ in range(subdivisions):
        mesh = meshes.subdivided(mesh)
    return mesh


class Workload:
    """W on one mesh: axis (20), points (500), reach."""

    def __init__(self, mesh: TriangleMesh, seed: int = 0) -> None:
        random = np.random.default_rng(seed)
        self.mesh = mesh
        self.reach = 0.05 * mesh.bounding_box_diagonal
        middles = mesh.points[mesh.faces].mean(axis=1)
        face = int(np.linalg.norm(middles - CENTRE, axis=1).argmin())
        centre = SurfacePoints([face], [[1 / 3, 1 / 3, 1 / 3]])
        near = np.flatnonzero(np.linalg.norm(middles - middles[face], axis=1) < 1.05 * self.reach)
        areas = mesh.face_areas[near]
        darts = SurfacePoints(random.choice(near, 2000, p=areas / areas.sum()), random.dirichlet([1.0] * 3, 2000))
        hits = np.flatnonzero(log_map(mesh, centre, darts, self.reach).anchor >= 0)[:500]
        self.points = darts[hits]
        across = np.linspace(-0.9, 0.9, 20) * self.reach
        self.axis = trace_geodesic(mesh, SurfacePoints(np.full(20, face), np.full((20, 3), 1 / 3)), across).points
        self.log = log_map(mesh, self.axis, self.points)

    def parameterize(self) -> None:
        log_map(self.mesh, self.axis, self.points)

    def reconstruct(self) -> None:
        log = self.log
        trace_chains(self.mesh, self.axis[log.anchor], log.first_leg, log.offsets, log.turning_angles, log.lengths)


class _WideResults:
    """numpy, as pygeodesic sees it.

    pygeodesic marks a vertex out of reach by 2**32 - 1 in an int32 array: numpy 1 wraps that, numpy 2 refuses it
    (OverflowError). Room for the number gives the peer its bounded call back, at the same cost.
    """

    def __getattr__(self, name: str) -> Any:
        return getattr(np, name)

    def zeros(self, shape: Any, dtype: Any) -> Any:
        return np.zeros(shape, np.int64 if dtype is np.int32 else dtype)


geodesic.numpy = _WideResults()


def vertices_of(mesh: TriangleMesh, points: SurfacePoints) -> np.ndarray:
    """(k,) the corner nearest to each point: peers start at vertices."""
    return mesh.faces[points.faces, points.barycentric.argmax(axis=1)].astype(np.int32)


def parameterize(rounds: int, levels: int) -> dict[str, Any]:
    """W against pygeodesic, on the mesh and its subdivisions.

    Its bounded call (max_distance alone) answers for every vertex of the mesh, inf beyond the reach. Asked for the
    vertices nearest to the points only, it answers for these; both clear data of the whole mesh first. These and
    calls point by point run in turn apart from the bounded call: a peer that runs five times for our one finds its
    own data in the caches, and leaves none of ours there.
    """
    rows: dict[str, Any] = {}
    for level in range(levels):
        work = Workload(bunny(level))
        mesh, name = work.mesh, f"W at {len(work.mesh.faces)} faces"
        peer = geodesic.PyGeodesicAlgorithmExact(mesh.points.copy(), mesh.faces.astype(np.int32))
        sources, targets = vertices_of(mesh, work.axis), vertices_of(mesh, work.points)
        reach = float(work.log.distance.max())

        def call(targets: Any = None, reach: float = reach, batches: Any = (sources,), peer: Any = peer) -> None:
            for batch in batches:
                peer.geodesicDistances(batch, targets, reach)

        times = interleaved({"ours": work.parameterize, "trace": work.reconstruct, "bounded": call}, rounds)
        contestants: dict[str, Any] = {
            "ours": work.parameterize,
            "targets": lambda call=call, targets=targets: call(targets),
        }
        if level == 0:
            each = np.split(sources, len(sources))
            contestants |= {
                "20 calls": lambda call=call, each=each: call(batches=each),
                "20 calls, targets": lambda call=call, each=each, targets=targets: call(targets, batches=each),
                "zero radius": lambda call=call: call(reach=1e-9),
            }
        others = interleaved(contestants, rounds)
        rows[f"{name}: parameterize, ms median (best)"] = (
            f"{1e3 * times['ours'].median:.2f} ({1e3 * times['ours'].best:.2f})"
        )
        rows[f"{name}: times faster than pygeodesic's one bounded call (bar on the first: 5)"] = ratio(
            times["bounded"], times["ours"]
        )
        rows[f"{name}: times faster than that call asked for the vertices nearest to the points only"] = ratio(
            others["targets"], others["ours"]
        )
        if level == 0:
            rows[f"{name}: times faster than pygeodesic, a bounded call per axis point"] = ratio(
                others["20 calls"], others["ours"]
            )
            rows[f"{name}: times faster than those calls asked for the nearest vertices only"] = ratio(
                others["20 calls, targets"], others["ours"]
            )
            rows[f"{name}: pygeodesic's bounded call at zero radius, ms"] = 1e3 * others["zero radius"].median
        rows[f"{name}: pygeodesic's bounded call, ms"] = 1e3 * times["bounded"].median
        rows[f"{name}: pygeodesic asked for the nearest vertices only, ms"] = 1e3 * others["targets"].median
        rows[f"{name}: reconstruct 500 points, ms median (best)"] = (
            f"{1e3 * times['trace'].median:.2f} ({1e3 * times['trace'].best:.2f})"
        )
        rows[f"{name}: heap pops"] = work.log.pops
    return rows


def one_to_all(rounds: int) -> dict[str, Any]:
    mesh = bunny(0)
    peer = geodesic.PyGeodesicAlgorithmExact(mesh.points.copy(), mesh.faces.astype(np.int32))
    everywhere = SurfacePoints.at_vertices(mesh, np.arange(len(mesh.points)))
    source = 12345
    times = interleaved(
        {
            "ours": lambda: log_map(mesh, everywhere[source], everywhere),
            "peer": lambda: peer.geodesicDistances(np.array([source], np.int32)),
        },
        rounds,
    )
    truth, _ = peer.geodesicDistances(np.array([source], np.int32))
    ours = log_map(mesh, everywhere[source], everywhere)
    return {
        "bunny, one source to all vertices: ms": 1e3 * times["ours"].median,
        "bunny, one source to all vertices: times faster than pygeodesic (bar: 2.5)": ratio(
            times["peer"], times["ours"]
        ),
        "bunny, one source to all vertices: largest difference, relative": float(
            np.abs(ours.distance - truth).max() / truth.max()
        ),
        "bunny, one source to all vertices: heap pops": ours.pops,
    }


def traces(rounds: int, count: int = 20_000) -> dict[str, Any]:
    mesh = bunny(0)
    random = np.random.default_rng(1)
    starts = SurfacePoints(random.integers(0, len(mesh.faces), count), random.dirichlet([1.0] * 3, count))
    headings = np.exp(2j * np.pi * random.random(count))
    vectors = 0.05 * mesh.bounding_box_diagonal * headings
    # The peer traces one at a time, from Python, and always returns the polyline.
    spatial = heading_to_direction(mesh, starts, headings) * 0.05 * mesh.bounding_box_diagonal
    tracer = potpourri3d.GeodesicTracer(mesh.points, mesh.faces)

    def peer() -> None:
        for k in range(count):
            tracer.trace_geodesic_from_face(int(starts.faces[k]), starts.barycentric[k], spatial[k])

    times = interleaved(
        {
            "ends": lambda: trace_geodesic(mesh, starts, vectors),
            "lines": lambda: trace_geodesic(mesh, starts, vectors, polyline=True),
            "peer": peer,
        },
        rounds,
    )
    return {
        "20,000 traces of 5%: us each, end points only": 1e6 * times["ends"].median / count,
        "20,000 traces of 5%: us each, polylines": 1e6 * times["lines"].median / count,
        "20,000 traces, polylines: times faster than potpourri3d (bar: 8)": ratio(times["peer"], times["lines"]),
        "20,000 traces, end points: times faster than potpourri3d (bar: 12)": ratio(times["peer"], times["ends"]),
    }


def resident() -> float:
    """Resident memory of this process in MiB."""
    pages = Path("/proc/self/statm")
    if pages.exists():
        return int(pages.read_text().split()[1]) * resource.getpagesize() / 2**20
    return float("nan")


def many_copies(rounds: int, count: int = 64) -> dict[str, Any]:
    """The same patch on one bunny and on the last of 64 in one mesh."""
    work = Workload(bunny(0))
    large = meshes.copies(work.mesh, count)
    shift = (count - 1) * len(work.mesh.faces)
    axis = SurfacePoints(work.axis.faces + shift, work.axis.barycentric)
    points = SurfacePoints(work.points.faces + shift, work.points.barycentric)
    times = interleaved({"one": work.parameterize, "64": lambda: log_map(large, axis, points)}, rounds)
    rows: dict[str, Any] = {
        f"W on the last of {count} bunnies ({len(large.faces)} faces): times the cost on one (bar: 1.3)": ratio(
            times["64"], times["one"]
        )
    }
    fresh = TriangleMesh(work.mesh.points, work.mesh.faces), TriangleMesh(large.points, large.faces)
    for name, mesh, sources, targets in (
        ("one bunny", fresh[0], work.axis, work.points),
        (f"{count} bunnies", fresh[1], axis, points),
    ):
        first, later = memory_of_a_query(mesh, sources, targets)
        rows[f"W on {name}: memory that the first query makes resident, MiB"] = first
        rows[f"W on {name}: memory that a later query allocates, at most, MiB"] = later
    return rows


def memory_of_a_query(mesh: TriangleMesh, sources: SurfacePoints, targets: SurfacePoints) -> tuple[float, float]:
    """MiB: pages of the workspace that a first query touches; the peak of what the same query allocates later."""
    Topology.of(mesh)
    before = resident()
    log_map(mesh, sources, targets)
    grown = resident() - before
    tracemalloc.start()
    log_map(mesh, sources, targets)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return grown, peak / 2**20


def start_up() -> dict[str, Any]:
    """Seconds in fresh processes: import, kernels from the cache, kernels compiled."""
    code = (
        "import time; t = time.perf_counter(); import contact_core.geometry; print(time.perf_counter() - t);"
        "t = time.perf_counter(); import numba; print(time.perf_counter() - t);"
        "from contact_core.geometry.warm_up import warm_up; print(warm_up())"
    )

    def run(cache: str) -> list[float]:
        environment = {**os.environ, "NUMBA_CACHE_DIR": cache}
        done = subprocess.run(
            [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
        )
        return [float(line) for line in done.stdout.split()]

    with tempfile.TemporaryDirectory() as cache:
        cold, warm = run(cache), min((run(cache) for _ in range(3)), key=sum)
    return {
        "start: import contact_core.geometry, s": warm[0],
        "start: import numba, s": warm[1],
        "start: load all geodesic kernels from the cache, s": warm[2],
        "start: compile all geodesic kernels, s": cold[2],
    }


def topology(rounds: int) -> dict[str, Any]:
    mesh = bunny(2)
    times = interleaved({"build": lambda: Topology._build(mesh)}, rounds)
    return {f"topology of {len(mesh.faces)} faces, s": times["build"].median}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer rounds, no large meshes")
    quick = parser.parse_args().quick
    rows: dict[str, Any] = {}
    parts = [
        lambda: parameterize(5 if quick else 15, 1 if quick else 3),
        lambda: one_to_all(1 if quick else 3),
        lambda: traces(2 if quick else 5),
        start_up,
    ]
    if not quick:
        parts += [lambda: many_copies(15), lambda: topology(3)]
    for part in parts:
        rows |= part()
        record("Geodesic kernel", rows)


if __name__ == "__main__":
    main()
