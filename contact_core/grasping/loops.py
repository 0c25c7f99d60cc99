"""Loops of an object, such as a mug's handle or the rings of scissors, and which digits go through one.

A loop is said by a flat disk across it, whose rim lies on the object all round and on both sides of which there is
a way out: that a cup's inside has not. A digit goes through it where its centre line crosses the disk more often
one way than the other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contact_core.arrays import BoolArray, FloatArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.grasping.facts import sphere_directions
from contact_core.grasping.features import surface_samples
from contact_core.grasping.hand import Hand, spread_out

LEAST, WIDEST = 0.025, 0.4  # hand lengths: how far the rim of a loop is from its middle
OUT = 96  # directions in which a way out is looked for
NEAR = 0.15  # hand lengths from the place that is to be held to the rim of a loop there
SPOKES = 16
DENSE, GAPS, WAYS = 4000, 24, 120  # places of the surface, gaps before those near, and directions that are tried
TILTS = np.radians([12.0, 12.0, 6.0, 6.0, 3.0])  # by which a disk is turned, or moved, while that makes it smaller
AGAIN = 2  # times that a disk is laid about the middle of its own rim


@dataclass(frozen=True, eq=False)
class Loop:
    """middle: (3,). way: (3,) unit, through it. rim: (SPOKES, 3) where the disk across it ends, in order. Object's
    space."""

    middle: FloatArray
    way: FloatArray
    rim: FloatArray

    @property
    def area(self) -> float:
        return float(_areas((self.rim - self.middle)[None], self.way[None])[0])


def loops_near(mesh: TriangleMesh, length: float, at: FloatArray | None) -> tuple[Loop, ...]:
    """Loops whose rim is near a place (3,), the nearest first; none without a place. length: of the hand."""
    if at is None:
        return ()
    locator, found = Locator.of(mesh), []
    middles = _gaps(mesh, locator, length, at)
    if not len(middles):
        return ()
    ways = sphere_directions(2 * WAYS)
    ways = ways[ways[:, 2] > 0.0]
    for middle in middles:
        loop = _across(locator, length, np.tile(middle, (len(ways), 1)), ways)
        if loop is not None:
            found.append(_tightened(locator, length, loop))
    found = sorted((loop for loop in found if _is_open(locator, loop)), key=lambda loop: loop.area)
    kept: list[Loop] = []
    for loop in found:
        if all(not _same(loop, other) for other in kept):
            kept.append(loop)
    near = [(float(np.linalg.norm(loop.rim - at, axis=1).min()), loop) for loop in kept]
    return tuple(loop for away, loop in sorted(near, key=lambda each: each[0]) if away < NEAR * length)


def _gaps(mesh: TriangleMesh, locator: Locator, length: float, at: FloatArray) -> FloatArray:
    """(k, 3) halfway between the surface near a place and what is opposite of it, the way outwards."""
    dense = surface_samples(mesh, DENSE, 0)
    points, normals = dense.positions(mesh), mesh.face_normals[dense.faces]
    near = np.flatnonzero(np.linalg.norm(points - at, axis=1) < NEAR * length)
    points, normals = points[near] + 1e-4 * length * normals[near], normals[near]
    ahead = locator.cast(points, normals, max_distance=2.0 * WIDEST * length)
    found = ahead.found
    middles = points[found] + 0.5 * ahead.distance[found, None] * normals[found]
    return middles[spread_out(middles, GAPS, 0)]


def crossed(hand: Hand, frames: FloatArray, loop: Loop) -> BoolArray:
    """(N, D) which digits go through a loop. frames: (N, B, 4, 4) of bones in the object's space."""
    own = hand.capsules.copy()
    tips = hand.bones[1:] - 1  # whose capsules end before the skin does
    way = own[tips, 1] - own[tips, 0]
    size = np.maximum(np.linalg.norm(way, axis=1), 1e-30)
    own[tips, 1] += (hand.radii[tips] / size)[:, None] * way
    ends = np.einsum("nbij,bej->nbei", frames[:, :, :3, :3], own) + frames[:, :, None, :3, 3]
    lines = ends.reshape(len(ends), -1, 3)  # (N, 2B, 3) bone after bone
    high = (lines - loop.middle) @ loop.way
    share = high[:, :-1] / np.where(high[:, :-1] == high[:, 1:], 1.0, high[:, :-1] - high[:, 1:])
    here = lines[:, :-1] + share[:, :, None] * (lines[:, 1:] - lines[:, :-1])
    through = (np.sign(high[:, 1:]) - np.sign(high[:, :-1])) / 2.0 * _in_disk(here, loop)  # (N, 2B - 1)
    through = np.concatenate([through, np.zeros((len(through), 1))], axis=1)
    through[:, 2 * hand.bones[1:] - 1] = 0.0  # from one digit's tip to the next one's root is no line
    return np.asarray(np.abs(np.add.reduceat(through, 2 * hand.bones[:-1], axis=1)) > 0.5)


def digits_through(hand: Hand, frames: FloatArray, loops: tuple[Loop, ...]) -> BoolArray:
    """(N, L, D) which digits go through which of some loops. frames: as for `crossed`."""
    none = np.zeros((len(frames), 0, len(hand.bones) - 1), bool)
    return np.stack([crossed(hand, frames, loop) for loop in loops], axis=1) if loops else none


def _in_disk(points: FloatArray, loop: Loop) -> BoolArray:
    """(...,) which points of the plane of a disk are within its rim, as seen from its middle."""
    first = loop.rim[0] - loop.middle
    first = first / np.linalg.norm(first)
    second = np.cross(loop.way, first)
    flat = np.stack([(points - loop.middle) @ first, (points - loop.middle) @ second], axis=-1)
    rim = np.stack([(loop.rim - loop.middle) @ first, (loop.rim - loop.middle) @ second], axis=-1)
    turn = np.arctan2(flat[..., 1], flat[..., 0]) % (2.0 * np.pi)
    sector = np.minimum((turn / (2.0 * np.pi) * SPOKES).astype(np.int64), SPOKES - 1)
    a, b = rim[sector], rim[(sector + 1) % SPOKES]
    edge, off = b - a, flat - a
    return np.asarray(edge[..., 0] * off[..., 1] - edge[..., 1] * off[..., 0] >= 0.0)


def _spokes(ways: FloatArray) -> FloatArray:
    """(k, SPOKES, 3) unit directions across ways (k, 3), turning about them."""
    least = np.eye(3)[np.abs(ways).argmin(axis=1)]
    first = np.cross(ways, least)
    first /= np.linalg.norm(first, axis=1)[:, None]
    second = np.cross(ways, first)
    turn = (np.arange(SPOKES) * 2.0 * np.pi / SPOKES)[None, :, None]
    return np.asarray(np.cos(turn) * first[:, None] + np.sin(turn) * second[:, None])


def _across(locator: Locator, length: float, middles: FloatArray, ways: FloatArray) -> Loop | None:
    """The smallest disk of those about middles (k, 3) across ways (k, 3), each laid about its own middle anew; None
    where none ends on the object all round."""
    for _ in range(AGAIN + 1):
        spokes = _spokes(ways)
        origins = np.repeat(middles, SPOKES, axis=0)
        hit = locator.cast(origins, spokes.reshape(-1, 3), max_distance=2.0 * WIDEST * length)
        closed = hit.found.reshape(-1, SPOKES).all(axis=1)
        middles, ways, spokes = middles[closed], ways[closed], spokes[closed]
        if not len(middles):
            return None
        rims = hit.distance.reshape(-1, SPOKES)[closed][:, :, None] * spokes  # about their middles
        before, middles = middles, middles + _centroids(rims, ways)
    middles = before
    reach = np.linalg.norm(rims, axis=2)
    good = (reach.min(axis=1) > LEAST * length) & (reach.max(axis=1) < WIDEST * length)
    if not good.any():
        return None
    best = int(np.where(good, _areas(rims, ways), np.inf).argmin())
    return Loop(middles[best], ways[best], middles[best] + rims[best])


def _tightened(locator: Locator, length: float, loop: Loop) -> Loop:
    """The disk turned and moved along its way so that it is smaller, as long as that helps."""
    for tilt in TILTS:
        spokes = _spokes(loop.way[None])[0, ::2]
        ways = np.concatenate([np.cos(tilt) * loop.way + np.sin(tilt) * spokes, np.tile(loop.way, (2, 1))])
        middles = np.tile(loop.middle, (len(ways), 1))
        middles[-2:] += np.array([[tilt], [-tilt]]) * np.sqrt(loop.area) * loop.way
        other = _across(locator, length, middles, ways)
        loop = other if other is not None and other.area < loop.area else loop
    return loop


def _is_open(locator: Locator, loop: Loop) -> bool:
    """Whether a way out is in sight on both sides of a disk."""
    ways = sphere_directions(OUT)
    free = ~locator.cast(np.tile(loop.middle, (OUT, 1)), ways).found
    ahead = ways @ loop.way
    return bool((free & (ahead > 0.1)).any() and (free & (ahead < -0.1)).any())


def _wedges(rims: FloatArray, ways: FloatArray) -> FloatArray:
    """(k, SPOKES) the areas between neighbouring spokes of rims (k, SPOKES, 3)."""
    return 0.5 * np.asarray(np.einsum("ksi,ki->ks", np.cross(rims, np.roll(rims, -1, axis=1)), ways))


def _areas(rims: FloatArray, ways: FloatArray) -> FloatArray:
    return np.asarray(_wedges(rims, ways).sum(axis=1))


def _centroids(rims: FloatArray, ways: FloatArray) -> FloatArray:
    """(k, 3) of the disks, from where their spokes begin."""
    wedges = _wedges(rims, ways)
    middles = (rims + np.roll(rims, -1, axis=1)) / 3.0
    return np.asarray(np.einsum("ks,ksi->ki", wedges, middles) / wedges.sum(axis=1)[:, None])


def _same(loop: Loop, other: Loop) -> bool:
    """Whether a disk lies across the loop of a smaller one: its middle is within that one's width of it."""
    width = np.linalg.norm(other.rim - other.middle, axis=1).max()
    return bool(np.linalg.norm(loop.middle - other.middle) < width)
