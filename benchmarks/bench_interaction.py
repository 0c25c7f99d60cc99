"""From a pointer event to the edited document, and to the solved pose: a real hand on the bunny, nine pairs.

    python benchmarks/bench_interaction.py [--quick] [--sizes 0 1 2]

The WebXR generic hand (1.2k vertices) and the Stanford bunny (69k faces, then split into four 0, 1, 2 times), nine
patches of about 80 points each, transferred and paired. One of them is dragged over the bunny, pixel by pixel; each
row is over all moves of the drags, in processor milliseconds of this process, which its neighbours hardly
change, and by the clock. Nothing is drawn.
"""

from __future__ import annotations

import argparse
import sys
import time
import tomllib
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

import numpy as np
from bench_edits import default_bunny
from harness import record

from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.interaction.events import Key, Pointer
from contact_core.interaction.interaction import Interaction
from contact_core.interaction.tool import TOOLS
from contact_core.interaction.view import Perspective
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.reading import read_asset
from contact_core.session import Session
from contact_core.solve.threads import one_blas_thread
from contact_core.testing import meshes

HAND = "webxr_generic_hand_left"
PATCHES = (
    "index_tip",
    "index_pad",
    "middle_tip",
    "middle_pad",
    "ring_tip",
    "ring_pad",
    "pinky_tip",
    "pinky_pad",
    "palm",
)
BARS = {"edited": "3 / 8", "solved": "16 / 30"}


def bunny(splits: int) -> TriangleMesh:
    """The bunny where the hand can hold it, each face split into four so many times."""
    mesh: TriangleMesh = read_asset(default_bunny(), PluginManager()).mesh
    for _ in range(splits):
        mesh = meshes.subdivided(mesh)
    middle = 0.5 * (mesh.points.min(axis=0) + mesh.points.max(axis=0))
    return mesh.with_points(0.6 * (mesh.points - middle) + [-0.085, -0.05, 0.02])


def grasp(hand: Asset, mesh: TriangleMesh) -> tuple[Session, dict[str, str]]:
    """The session, and the copies on the bunny by their patches on the hand: each at the closest point, paired."""
    axes = tomllib.loads((Path(__file__).parent / "held_out_axes.toml").read_text())[HAND]
    session = Session()
    session.surfaces.add("hand", hand.mesh, rig=hand.rig)
    session.surfaces.add("bunny", mesh)
    copies = {}
    for name in PATCHES:
        row = axes[name]
        ends = Locator.of(hand.mesh).closest(np.array(row["axis"])).points
        radius = float(row["radius"])
        session.patches.brush(
            "disk", name, surface="hand", at=row["stroke"], radius=radius, spacing=radius / 4.5, axis=ends
        )
        there = (
            Locator.of(mesh).closest(session.geometry.points(name).positions(hand.mesh).mean(axis=0)[None]).points
        )
        along = ends.positions(hand.mesh)
        copies[name] = session.patches.transfer(name, "bunny", there, direction=along[1] - along[0])
        session.pairs.add(name, copies[name])
    return session, copies


def views(mesh: TriangleMesh) -> list[Perspective]:
    """All round the bunny."""
    middle = 0.5 * (mesh.points.min(axis=0) + mesh.points.max(axis=0))
    turns = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    eyes = 0.4 * np.stack([np.cos(turns), np.full(12, 0.3), np.sin(turns)], -1)
    return [Perspective.looking_at(middle, middle + eye) for eye in eyes]


def grabbable(artist: Interaction, copies: Iterable[str]) -> tuple[Perspective, FloatArray]:
    """A view, and the pixel (2,) of a copy round which a drag stays on the bunny and faces the eye the most."""
    best: tuple[float, Perspective, FloatArray] | None = None
    seen = artist.desk.scene.surfaces["bunny"]
    for view in views(seen.rest):
        artist.desk.view = view
        for copy in copies:
            pixel = view.project(seen.positions(artist.session.geometry.root(copy).point()))[0, :2]
            hits = [artist.desk.pick(Pointer("move", *at)) for at in (pixel, *(pixel + 1.3 * path(80)[::4]))]
            if any(hit is None for hit in hits) or artist.desk.patch_at(hits[0]) != copy:
                continue
            facing = min(float(hit.normal @ (view.eye - hit.position)) for hit in hits)
            if best is None or facing > best[0]:
                best = facing, view, pixel
    assert best is not None
    return best[1], best[2]


def path(moves: int) -> FloatArray:
    """(moves, 2) pixels from the press: a spiral."""
    k = np.arange(moves)
    return (6.0 + 0.3 * k)[:, None] * np.stack([np.cos(0.13 * k), np.sin(0.13 * k)], -1)


class Times:
    """Milliseconds of the moves: processor, clock."""

    def __init__(self) -> None:
        self.rows: dict[str, list[tuple[float, float]]] = {}

    def measured(self, names: Iterable[str], *work: Callable[[], object]) -> None:
        """Do the pieces one after the other; each name gets the time from the beginning to the end of its piece."""
        processor, clock = time.process_time(), time.perf_counter()
        for name, piece in zip(names, work, strict=True):
            piece()
            row = 1e3 * (time.process_time() - processor), 1e3 * (time.perf_counter() - clock)
            self.rows.setdefault(name, []).append(row)

    def percentiles(self, name: str) -> FloatArray:
        """(2, 2) processor and clock: p50, p95."""
        return np.percentile(np.array(self.rows[name]), [50, 95], axis=0).T


def drags(session: Session, copies: dict[str, str], moves: int, times: Times) -> None:
    """Move, turn and paint, each put back by Escape: the document stays the same for all."""
    artist = Interaction(session)
    artist.select(surface="bunny")
    artist.configure(TOOLS, "paint", radius=0.008)
    view, start = grabbable(artist, copies.values())
    for tool in ("move", "turn", "paint"):
        artist.take_up(tool)
        assert artist.handle(Pointer("press", *start, "left"), view), (tool, artist.status)
        for at in start + path(moves):
            what = "move" if tool == "turn" else tool
            handle = partial(artist.handle, Pointer("move", *at), view)
            times.measured((f"{what} edited", f"{what} solved"), handle, artist.advance)
        if tool == "move":
            off = artist.desk.scene.surfaces["hand"].points
            artist.handle(Pointer("release", *(start + path(moves)[-1]), "left"), view)
            off = off - artist.desk.scene.surfaces["hand"].points
            times.rows["off"] = [(1e3 * float(np.linalg.norm(off, axis=1).max()), 0.0)]
            assert "hand" in artist.session.document.poses, artist.status
            artist.handle(Key("Z", frozenset({"ctrl"})), view)
            continue
        assert tool == "paint" or "hand" in artist.desk.document.poses, artist.status
        artist.handle(Key("Escape"), view)
    artist.close()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="few moves and the smallest bunny; not recorded")
    parser.add_argument(
        "--sizes", type=int, nargs="+", default=[0, 1, 2], help="how often the bunny's faces are split"
    )
    given = parser.parse_args()
    hand = read_asset(default_bunny().parents[1] / "rigs" / f"{HAND}.glb", PluginManager())
    lines = {}
    for splits in [0] if given.quick else given.sizes:
        mesh = bunny(splits)
        session, copies = grasp(hand, mesh)
        drags(session, copies, 3, Times())  # compiles, and builds trees and fields
        times = Times()
        with one_blas_thread():
            drags(session, copies, 20 if given.quick else 80, times)
        points = sum(len(session.geometry.points(name)) for name in copies)
        for name, bar in (
            ("move edited", BARS["edited"]),
            ("move solved", BARS["solved"]),
            ("paint edited", BARS["edited"]),
        ):
            (cpu, cpu95), (clock, clock95) = times.percentiles(name)
            what, stage = name.split()
            label = f"{what}: event to {stage} {'pose' if stage == 'solved' else 'document'}"
            lines[f"{label}, {len(mesh.faces):,} faces, {points} points, p50 / p95 (bar: {bar} ms)"] = (
                f"{cpu:.1f} / {cpu95:.1f} ms of processor, {clock:.1f} / {clock95:.1f} by the clock"
            )
        lines[
            f"move: the skin at the last move, from where letting go leaves it, at most, {len(mesh.faces):,} faces"
        ] = f"{times.rows['off'][0][0]:.2f} mm"
    if given.quick:
        sys.stdout.writelines(f"{name}: {line}\n" for name, line in lines.items())
    else:
        record("Interaction", lines)


if __name__ == "__main__":
    main()
