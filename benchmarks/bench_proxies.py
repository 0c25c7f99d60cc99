"""Proxies: what running on one costs a contact, what it cures, and how long it takes to make.

    python benchmarks/bench_proxies.py [--quick]

Sound meshes: disks painted and transferred on the meshes themselves, and the same points again with both surfaces
on proxies; the error is how far corresponding points lie apart, as a share of the disk's radius. Broken ones: disks
painted all over, by the mesh itself and on its proxy.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from pathlib import Path

import numpy as np
from harness import record

from contact_builtins.proxies.level_set import LevelSetProxy
from contact_core.errors import ContactError
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.opening import new
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.reading import read_asset
from contact_core.progress import NO_PROGRESS
from contact_core.session import Session
from contact_core.testing.broken_meshes import cards, fin, shells, shirt, torn_knot
from contact_core.testing.meshes import icosphere, torus

ASSETS = Path(os.environ.get("CONTACT_ASSETS", "../shared/assets"))
OFFSETS = (0.005, 0.01, 0.02)
DISK = 0.06  # of the diagonal of the mesh that is painted


def scattered(mesh: TriangleMesh, count: int, seed: int) -> SurfacePoints:
    rng = np.random.default_rng(seed)
    faces = rng.choice(len(mesh.faces), count, p=mesh.face_areas / mesh.face_areas.sum())
    return SurfacePoints(faces, rng.dirichlet(np.ones(3), count))


def painted(session: Session, disks: int) -> dict[str, tuple[SurfacePoints, SurfacePoints]]:
    """Disks on "source": their points, and the ends of their axes."""
    mesh = session.geometry.mesh("source")
    radius = DISK * mesh.bounding_box_diagonal
    found = {}
    for k, centre in enumerate(scattered(mesh, disks, 3)[[n]] for n in range(disks)):
        name = f"disk {k}"
        session.patches.brush("disk", name, surface="source", at=centre, radius=radius, spacing=radius / 6)
        found[name] = session.geometry.points(name), session.geometry.axis_points(name)[[0, -1]]
    return found


def transferred(
    session: Session, disks: dict[str, tuple[SurfacePoints, SurfacePoints]]
) -> dict[str, tuple[np.ndarray, int]]:
    """Disks painted and transferred onto "target": positions there, and how many of their triangles fold."""
    target = session.geometry.mesh("target")
    roots = scattered(target, len(disks), 4)
    result = {}
    for k, (name, (points, ends)) in enumerate(disks.items()):
        session.patches.paint(name, points, surface="source", axis=ends)
        normal = roots[[k]].normals(target)[0]
        direction = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
        copy = session.patches.transfer(name, "target", roots[[k]], direction=direction)
        result[name] = (
            session.geometry.points(copy).positions(target),
            session.geometry.distortion(name, copy).folds,
        )
    return result


def on_sound_meshes(disks: int) -> dict[str, str]:
    plugins = PluginManager()
    bunny = read_asset(ASSETS / "objects" / "stanford_bunny_7k_closed.obj", plugins).mesh
    hand = read_asset("sample:human_hand", plugins).mesh
    pairs = {"ball to torus": (icosphere(4), torus(60, 30)), "hand to bunny": (hand, bunny)}
    rows = {}
    for label, (source, target) in pairs.items():
        size = source.bounding_box_diagonal / target.bounding_box_diagonal
        target = target.with_points(target.points * size)
        radius = DISK * source.bounding_box_diagonal
        with new(source=source, target=target, plugins=plugins) as session:
            given = painted(session, disks)
        with new(source=source, target=target, plugins=plugins) as session:
            direct = transferred(session, given)
        for offset in OFFSETS:
            with new(source=source, target=target, plugins=plugins) as session:
                for surface in ("source", "target"):
                    session.surfaces.add_proxy(surface, offset=offset)
                there = transferred(session, given)
            alike = [name for name in given if there[name][0].shape == direct[name][0].shape]  # no two points met
            gap = np.concatenate(
                [np.linalg.norm(there[name][0] - direct[name][0], axis=1) / radius for name in alike]
            )
            rows[f"{label}, offset {offset:.1%}"] = (
                f"mean error {gap.mean():.2%} of the radius, median {np.median(gap):.2%}, 95 %"
                f" {np.quantile(gap, 0.95):.2%} ({len(alike)} disks);"
                f" folds {sum(folds for _, folds in there.values())}"
                f" (direct {sum(folds for _, folds in direct.values())})"
            )
    return rows


def on_broken_meshes() -> dict[str, str]:
    plugins = PluginManager()
    chair = read_asset(ASSETS / "objects" / "chair_kitchen_10_parts.glb", plugins).mesh
    meshes = {"chair of 10 parts": chair, "torn knot": torn_knot(), "shirt": shirt(), "ball with a fin": fin(),
              "12 shells": shells(), "cards of hair": cards()}  # fmt: skip
    return {name: _painted_all_over(mesh, plugins) for name, mesh in meshes.items()}


def _painted_all_over(mesh: TriangleMesh, plugins: PluginManager, count: int = 12) -> str:
    """Disks painted at random places, on the mesh itself and on its proxy."""
    radius = 0.1 * mesh.bounding_box_diagonal
    centres = scattered(mesh, count, 8)

    def painted(session: Session) -> tuple[int, int]:
        whole = refused = 0
        for k in range(count):
            try:
                session.patches.brush(
                    "disk", f"{k}", surface="thing", at=centres[k], radius=radius, spacing=radius / 6
                )
                whole += not session.geometry.reconstruction(f"{k}").ran_off.any()
            except ContactError:
                refused += 1
        return whole, refused

    with new(thing=mesh, plugins=plugins) as session:
        session.makers.mends = False
        _, refused = painted(session)
    with new(thing=mesh, plugins=plugins) as session:
        session.surfaces.add_proxy("thing")
        whole, still = painted(session)
        proxy = session.geometry.carrier("thing")
        away = Locator.of(mesh).closest(proxy.points).distance.max() / mesh.bounding_box_diagonal
    return (
        f"{refused} of {count} disks refused by itself, {still} on its proxy, {whole} of them whole;"
        f" {len(proxy.faces)} faces, at most {away:.2%} of the diagonal away"
    )


def times() -> dict[str, str]:
    rows = {}
    plugins = PluginManager()
    bunny = read_asset(ASSETS / "objects" / "stanford_bunny_35k.obj", plugins).mesh
    for name, mesh in {"torus": torus(500, 100), "bunny": bunny, "sphere": icosphere(6)}.items():
        mesh = TriangleMesh(mesh.points.copy(), mesh.faces)
        began, worked = time.perf_counter(), time.process_time()
        proxy = LevelSetProxy().make(mesh, NO_PROGRESS)
        rows[f"making, {name} of {len(mesh.faces)} faces"] = (
            f"{time.process_time() - worked:.2f} s of processor time ({time.perf_counter() - began:.2f} s on the"
            f" clock), {len(proxy.faces)} faces"
        )
    with tempfile.TemporaryDirectory() as folder:
        os.environ["CONTACT_CACHE"] = folder
        for number in (1, 2):
            with new(thing=bunny, plugins=plugins) as session:
                worked = time.process_time()
                session.surfaces.add_proxy("thing")
                rows[f"adding to the bunny, time {number}"] = f"{time.process_time() - worked:.2f} s"
    return rows


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    quick = parser.parse_args().quick
    LevelSetProxy(offset=0.05).make(icosphere(2), NO_PROGRESS)  # compiled once
    record("proxies", {**on_sound_meshes(4 if quick else 16), **on_broken_meshes(), **times()})
