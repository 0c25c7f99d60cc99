"""One edit of one patch among 30 of 500 points, in any host: what it takes and how many bytes the host is given.

Used by bench_edits (memory), bench_usd and bench_blender. An edit is everything between the verb and its return:
the command, the stored parts, the host's step of undo. The bar of the design is 2 ms for each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from statistics import median
from time import perf_counter, process_time
from typing import Any

import numpy as np

from contact_core.document.parts import DocumentParts
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.session import Session

PATCHES, POINTS, BAR = 30, 500, 2e-3
TITLE = f"Edits in a host, one of {PATCHES} patches of {POINTS} points"


def sheet(side: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """Points (side * side, 3) of a wavy sheet and its triangles (m, 3)."""
    u, v = np.meshgrid(np.linspace(0, 1, side), np.linspace(0, 1, side), indexing="ij")
    corner = np.arange((side - 1) * side).reshape(side - 1, side)[:, :-1].ravel()
    lower, upper = (corner, corner + side, corner + side + 1), (corner, corner + side + 1, corner + 1)
    faces = np.concatenate([np.stack(lower, axis=1), np.stack(upper, axis=1)])
    return np.c_[u.ravel(), v.ravel(), 0.1 * np.sin(6 * u * v).ravel()].astype(np.float32), faces


def painted(host: Any, object_id: str) -> Session:
    """A session in a host with the patches painted on an object, which is a `sheet`."""
    session = Session(host=host, objects=[object_id], discover=False)
    (surface,) = session.document.surfaces
    mesh: TriangleMesh = session.surfaces.meshes[surface]
    for number in range(PATCHES):
        centre = mesh.points[(number * 97 + 1800) % len(mesh.points)]
        near = np.argsort(np.linalg.norm(mesh.points - centre, axis=1), kind="stable")[:POINTS]
        patch = SurfacePoints.at_vertices(mesh, near)
        session.patches.paint(f"patch {number}", patch, surface=surface, axis=patch[[0, 200, 400]])
    return session


def edits(host: Any, session: Session, repeats: int = 41) -> dict[str, str]:
    """Rows: the median of each kind of edit with the bytes that the host is given, and of an undo."""
    given: list[int] = []
    store = host.store_document

    def counted(stamp: Any, put: Mapping[str, str], remove: Iterable[str] = ()) -> None:
        given.append(sum(map(len, put.values())))
        store(stamp, put, remove)

    host.store_document = counted
    (surface,) = session.document.surfaces
    mesh = session.surfaces.meshes[surface]
    steps = SurfacePoints.at_vertices(mesh, range(1800, 1900))
    at, turn = iter(range(100)), iter(range(1000))
    acts: dict[str, Callable[[], object]] = {
        "rotate": lambda: session.patches.rotate("patch 0", 0.01),
        "translate": lambda: session.patches.translate("patch 0", steps[next(at)]),
        "bend": lambda: session.patches.bend("patch 0", 1, 0.01 * (next(turn) % 7)),
        "recolor": lambda: session.patches.recolor("patch 0", (0.1, 0.01 * (next(turn) % 90), 0.3)),
    }
    rows = {}
    for name, act in acts.items():
        given.clear()
        rows[name] = f"{spelled(act, repeats, BAR)}; {median(given):,.0f} bytes"
    del host.store_document
    rows["undo"] = spelled(session.undo, 9)
    whole = DocumentParts.of(session.document)
    texts = sum(map(len, host.stored_document().parts.values()))
    rows["the whole document"] = f"{texts:,} bytes in {len(whole.digests)} parts"
    return rows


def spelled(act: Callable[[], object], repeats: int, bar: float | None = None) -> str:
    """Medians of a call in words, after one that does not count.

    The bar is held against the processor's time, which neighbours on the machine disturb less.
    """
    act()
    processor, clock = list[float](), list[float]()
    for _ in range(repeats):
        began = process_time(), perf_counter()
        act()
        processor.append(process_time() - began[0])
        clock.append(perf_counter() - began[1])
    told = f"{1e3 * median(processor):.2f} ms of processor, {1e3 * median(clock):.2f} by the clock"
    if bar is None:
        return told
    return f"{told} (bar: {1e3 * bar:g} ms{'' if median(processor) < bar else '; MISSED'})"
