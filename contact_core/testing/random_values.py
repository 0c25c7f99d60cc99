"""Random but valid parts of documents, without any mesh: shapes, placements, surfaces, patches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.contact.placement import Link, Placement, Root
from contact_core.contact.shape import AxisShape, PatchCoordinates, PatchShape
from contact_core.document.document import ContactDocument, Patch, Proxy, Surface
from contact_core.document.frozen_map import FrozenMap
from contact_core.document.timeline import Key, PlaceKey, PoseKey, Track, WeightKey
from contact_core.motion.placement_keys import PlacementKey, Way
from contact_core.rig.rig import Pose

Rng = np.random.Generator


def random_shape(rng: Rng, points: int | None = None) -> PatchShape:
    """A shape with an axis of 1 to 6 points and some chains."""
    segments, n = int(rng.integers(0, 6)), int(points or rng.integers(1, 9))
    axis = AxisShape(rng.uniform(0.1, 1.0, segments), rng.uniform(-1.0, 1.0, max(segments - 1, 0)))
    return PatchShape(axis, random_coordinates(rng, n, axis.point_count), rng.uniform(0.0, 2.0, n))


def random_coordinates(rng: Rng, n: int, axis_points: int) -> PatchCoordinates:
    """Coordinates of n points from an axis of so many points."""
    bends = rng.choice([0, 0, 0, 1, 2], n)
    starts = np.concatenate([[0], np.cumsum(bends)])
    legs = rng.uniform(-1.0, 1.0, n) + 1j * rng.uniform(-1.0, 1.0, n)
    c = int(starts[-1])
    return PatchCoordinates(
        rng.integers(0, axis_points, n), legs, starts, rng.uniform(-1.0, 1.0, c), rng.uniform(0.0, 1.0, c)
    )


def random_root(rng: Rng, surface: Surface) -> Root:
    """A root somewhere on a surface."""
    a, b, c = rng.dirichlet(np.ones(3)).tolist()
    return Root(int(rng.integers(surface.carrier_faces)), (a, b, c), complex(np.exp(1j * rng.uniform(-3.0, 3.0))))


def random_link(rng: Rng, document: ContactDocument, parent: str, child: Patch) -> Link:
    """A link that fits both axes."""
    turns = int(rng.integers(0, 3))
    return Link(
        parent,
        float(rng.uniform(-3.0, 3.0)),
        tuple(rng.uniform(0.0, 1.0, turns + 1).tolist()),
        tuple(rng.uniform(-1.0, 1.0, turns).tolist()),
        float(rng.uniform(-3.0, 3.0)),
        int(rng.integers(document.shape_of(parent).axis.point_count)),
        int(rng.integers(document.shapes[child.shape].axis.point_count)),
    )


def pick(rng: Rng, items: Sequence[Any]) -> Any:
    """One of the items, None where there is none."""
    return items[int(rng.integers(len(items)))] if len(items) else None


def pick_patch(document: ContactDocument, rng: Rng) -> Patch | None:
    """A patch of the document, if any."""
    patch: Patch | None = pick(rng, list(document.patches.values()))
    return patch


def pick_surface(document: ContactDocument, rng: Rng) -> Surface | None:
    """A surface of the document, if any."""
    surface: Surface | None = pick(rng, list(document.surfaces.values()))
    return surface


def new_surface(rng: Rng, name: str) -> Surface:
    """A surface of some size and unit, most with a rig, some with a proxy."""
    rig = str(pick(rng, ["hand", "tentacle"])) if rng.random() < 0.7 else None
    unit = float(pick(rng, [1.0, 0.01]))
    number = int(rng.integers(1 << 30))
    settings: FrozenMap[Any] = FrozenMap({"offset": 0.01 * (number % 7 + 1), "cell": None, "fill": number % 2 == 0})
    proxy = Proxy("level_set", settings, f"{number + 1:x}", number % 60 + 5) if number % 5 == 0 else None
    return Surface(name, f"{number:x}", "topology", 50, int(rng.integers(5, 90)), unit, rig=rig, proxy=proxy)


def new_patch(document: ContactDocument, rng: Rng, name: str, surface: Surface) -> Patch:
    """A patch to paint on a surface, in some colour."""
    color = tuple(rng.uniform(0.0, 1.0, 3).tolist())
    key = document.free_name(name, document.shapes)
    return Patch(name, surface.name, key, random_root(rng, surface), color=color)


def moved_placement(document: ContactDocument, rng: Rng, patch: Patch) -> Placement:
    """Another placement of the same kind."""
    if isinstance(patch.placement, Link):
        return random_link(rng, document, patch.placement.parent, patch)
    return random_root(rng, document.surface(patch.surface))


def random_way(rng: Rng) -> Way:
    """From one placement key to the next."""
    turns = int(rng.integers(0, 3))
    lengths, angles = rng.uniform(0.0, 1.0, turns + 1), rng.uniform(-3.0, 3.0, turns + 2)
    return Way(float(angles[0]), tuple(lengths.tolist()), tuple(angles[2:].tolist()), float(angles[1]))


def random_track(rng: Rng, kind: str, frames: Sequence[float], surface: Surface | None = None) -> Track:
    """Keys of a kind at frames; of a placement, on a surface."""

    def key(frame: float, is_last: bool) -> Key:
        how = pick(rng, ["smooth", "linear", "hold"])
        if kind == "placement":
            assert surface is not None
            return PlacementKey(frame, random_root(rng, surface), None if is_last else random_way(rng), how)
        if kind == "weight":
            return WeightKey(frame, float(rng.uniform(0.0, 2.0)), how)
        if kind == "place":
            return PlaceKey(frame, random_motion(rng), how)
        local = np.array([random_motion(rng), random_motion(rng)])
        speeds = rng.uniform(-0.1, 0.1, (2, 6)) if rng.random() < 0.5 else None
        return PoseKey(frame, Pose(("wrist", "thumb"), local), speeds, how, pick(rng, ["", "5eed"]))

    return Track(tuple(key(float(frame), frame == frames[-1]) for frame in frames))


def random_motion(rng: Rng) -> FloatArray:
    """(4, 4) a rigid motion."""
    angle = rng.uniform(-3.0, 3.0)
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    matrix[:3, 3] = rng.uniform(-1.0, 1.0, 3)
    return matrix
