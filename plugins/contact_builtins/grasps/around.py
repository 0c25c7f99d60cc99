"""The sampler "around": the palm laid on the object, fingers round what is long, tips on what is opposite.

Places come from the surface, thin ones and long ones first (`grasping.features`). For each kind:

power: the palm on a place that a hand can span, fingers across the local axis; round bars also by closing on the
bar alone, from all sides, so that fingers pass through handles and loops, which the body behind them would stop.
hook: the same with the thumb at rest and the bar below the fingers' first bones.
precision, pinch: the line between thumb and finger pads, as this hand brings them to face each other at the
thickness, laid on two opposite places, turned about itself; and over the rims of plates and walls, the palm
outside.
lateral: the same with the side of the bent index finger.

Near two loops that are to be held, thumb and fingers go through both (`loops`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from contact_builtins.grasps.loops import through_handle, through_two
from contact_builtins.grasps.opposition import SIDEWAYS, Opposition, oppositions
from contact_core.arrays import FloatArray, IntArray
from contact_core.grasping.features import Features, features_of, rims_of
from contact_core.grasping.hand import Hand, spread_out
from contact_core.grasping.slots import Approaches, GraspRequest, Kind, lacks
from contact_core.settings import HasSettings, setting

LARGE, MOST_PLACES = 12.0, 4.0  # square hand lengths of an object that has more places, up to so many times as many
SPAN = 0.62  # hand lengths: what is thicker is not spanned
ROOM = 0.35  # hand lengths: a palm needs so much room outwards
BAR = 0.30  # hand lengths: what is thinner, and no wider, is closed on as a bar
LONG = 0.45  # elongation from which fingers go across
ALONG_FINGERS = (0.0, 0.14, 0.26)  # hand lengths from the palm's middle at which a thing is held
TILTS = np.radians([0.0, -20.0, 20.0])
ROLLS = 8
SHARES = {"power": 3.0}  # of the approaches, where that of another kind is 1
WIDEST = {"precision": 0.55, "pinch": 0.25, "lateral": 0.14}  # hand lengths
PALM_POINTS = 40
MOVED = 0.3  # hand lengths that an approach may move a body out of an object
OPPOSITE = 24  # places between whose sides pads are laid,
IN_BODY = 4  # times as many for a hand whose body is in the way of most
FITTING = 3  # ways of opposing that are tried at a place
ON_RIMS = ("precision", "pinch")
RIMS = 32  # places on rims, at most
TURNS = np.radians([0.0, -25.0, 25.0, -50.0, 50.0])  # of a hand over a rim, about the line between its pads
DEPTHS = (0.5, 0.85)  # of how far pads are from the palm: how far they lie from the rim
RELAXED = 0.3  # of its room: how far a digit that takes no part is bent


@dataclass(frozen=True)
class Around(HasSettings):
    """Approaches from places on the surface."""

    name: ClassVar[str] = "around"
    summary: ClassVar[str] = "palm on the surface, fingers across what is long, pads on opposite places"
    places: int = setting(110, low=8, high=2000, help="how many places of the surface are looked at")
    most: int = setting(900, low=16, high=20000, help="how many approaches come out at most")

    def sample(self, request: GraspRequest) -> Approaches:
        hand, length = request.hand, request.hand.length
        found = features_of(request.mesh, length, self._count(request), request.seed, request.at)
        makers = {"power": _power, "hook": _hook, "precision": _tips, "pinch": _tips, "lateral": _tips}
        wanted = [kind for kind in request.kinds if lacks(hand, kind) is None]
        parts = []
        for kind in wanted:
            made = [*makers[kind](hand, found, kind), *_over_rims(request, kind)]
            if made:
                joined = Approaches.joined(made)
                free = joined[_free(request, joined)]
                share = SHARES.get(kind, 1.0) / sum(SHARES.get(each, 1.0) for each in wanted)
                parts.append(_thinned(free, int(share * self.most), request.seed))
        if (handled := through_handle(request, tuple(wanted))) is not None:
            parts.append(handled)
        if "precision" in wanted and (threaded := through_two(request)) is not None:
            parts.append(threaded)
        return Approaches.joined(parts) if parts else _none(hand)

    def _count(self, request: GraspRequest) -> int:
        """How many places: more of a large object, on which those that a hand can span are few."""
        area = float(request.mesh.face_areas.sum()) / request.hand.length**2
        return int(self.places * np.clip(area / LARGE, 1.0, MOST_PLACES))


def _free(request: GraspRequest, approaches: Approaches) -> IntArray:
    """Which approaches have the palm outside of the object, of those that stay where they are; and of a hand in a
    body, the body, which else is in the way of nearly all where an object is large."""
    hand = request.hand
    stays = ~approaches.ways.any(axis=1)
    some = hand.tested[spread_out(hand.tested, PALM_POINTS, 0)]
    free = ~stays | (_least_distances(request, approaches, some) > -0.005 * hand.length)
    if hand.is_in_body:
        moved = np.where(stays, 0.0, MOVED)  # may still come free
        free &= _least_distances(request, approaches, hand.rest) > -moved * hand.length
    return np.flatnonzero(free)


def _least_distances(request: GraspRequest, approaches: Approaches, points: FloatArray) -> FloatArray:
    """(N,) the least signed distance of points (k, 3) of the hand to the object."""
    placed = np.einsum("nij,pj->npi", approaches.placed[:, :3, :3], points) + approaches.placed[:, None, :3, 3]
    return request.field.distances(placed.reshape(-1, 3)).reshape(len(placed), -1).min(axis=1)


def _thinned(approaches: Approaches, most: int, seed: int) -> Approaches:
    """At most `most`, chosen at random."""
    count = len(approaches.kinds)
    if count <= most:
        return approaches
    return approaches[np.sort(np.random.default_rng(seed).permutation(count)[:most])]


def _none(hand: Hand) -> Approaches:
    digits = len(hand.bones) - 1
    return Approaches(
        np.zeros((0, 4, 4)), (), np.zeros((0, 3)), np.zeros((0, 7)), np.zeros(0), np.zeros((0, digits))
    )


def _made(
    hand: Hand, kind: Kind, frames: FloatArray, refs: FloatArray, places: FloatArray, *,
    bars: FloatArray | None = None, stay: bool = False, curl: float = 0.0, limits: FloatArray | None = None,
) -> Approaches:  # fmt: skip
    """Hands whose points `refs` (N, 3), rig space, are at `places` (N, 3). frames: (N, 3, 3) columns: the ways into
    which palm, fingers and the third axis of the hand's frame look there."""
    n, digits = len(frames), len(hand.bones) - 1
    placed = np.tile(np.eye(4), (n, 1, 1))
    placed[:, :3, :3] = frames @ hand.frame.T
    placed[:, :3, 3] = places - np.einsum("nij,nj->ni", placed[:, :3, :3], refs)
    ways = np.zeros((n, 3)) if stay else frames[:, :, 0].copy()
    return Approaches(
        placed, (kind,) * n, ways, np.zeros((n, 7)) if bars is None else bars, np.full(n, curl),
        np.ones((n, digits)) if limits is None else np.tile(limits, (n, 1)),
    )  # fmt: skip


def _frames(out: FloatArray, fingers: FloatArray, tilt: float = 0.0) -> FloatArray:
    """(N, 3, 3) from the palm's way (N, 3) and the fingers' (N, 3), turned about the palm's by `tilt`."""
    third = np.cross(out, fingers)
    ahead = np.cos(tilt) * fingers + np.sin(tilt) * third
    return np.stack([out, ahead, np.cross(out, ahead)], axis=2)


def _refs(hand: Hand, along: float, n: int) -> FloatArray:
    return np.tile(hand.description.palm.point + along * hand.length * hand.frame[:, 1], (n, 1))


def _power(hand: Hand, found: Features, kind: Kind) -> Iterator[Approaches]:
    """The palm on places that can be spanned, and round bars."""
    span = np.minimum(found.thickness, found.width)
    rows = np.flatnonzero((span < SPAN * hand.length) & (found.free > ROOM * hand.length))
    if not len(rows):
        rows = np.argsort(span)[: max(8, len(span) // 6)]
    some = found[rows]
    long = some.elongation > LONG
    for tilt in TILTS:
        for side in (1.0, -1.0):
            for along in ALONG_FINGERS[:2]:
                here = some[np.flatnonzero(long)]
                if len(here):
                    frames = _frames(-here.normals, side * here.across, float(tilt))
                    yield _made(hand, kind, frames, _refs(hand, along, len(here)), here.points)
    round_ = some[np.flatnonzero(~long)]
    for turn in np.arange(ROLLS) * 2.0 * np.pi / ROLLS:
        if len(round_):
            frames = _frames(-round_.normals, round_.across, float(turn))
            yield _made(hand, kind, frames, _refs(hand, ALONG_FINGERS[1], len(round_)), round_.points)
    yield from _bars(hand, found, kind, ALONG_FINGERS[1:], None)


def _hook(hand: Hand, found: Features, kind: Kind) -> Iterator[Approaches]:
    limits = np.ones(len(hand.bones) - 1)
    if hand.thumb >= 0:
        limits[hand.thumb] = RELAXED
    yield from _bars(hand, found, kind, (0.22, 0.34), limits)


def _bars(
    hand: Hand, found: Features, kind: Kind, along: tuple[float, ...], limits: FloatArray | None
) -> Iterator[Approaches]:
    """Round what is thin both ways and long, from all sides, closing on it alone."""
    thin = (np.maximum(found.thickness, found.width) < BAR * hand.length) & (found.elongation > LONG)
    some = found[np.flatnonzero(thin)]
    if not len(some):
        return
    radius = np.maximum(0.5 * np.maximum(some.thickness, some.width), 0.01 * hand.length)
    shift = 0.5 * some.thickness[:, None] * some.normals
    middles = some.points - shift
    bars = np.concatenate([middles, some.axis, radius[:, None]], axis=1)
    for roll in np.arange(ROLLS) * 2.0 * np.pi / ROLLS:
        out = np.cos(roll) * some.normals + np.sin(roll) * some.across
        for side in (1.0, -1.0):
            fingers = side * np.cross(some.axis, out)
            for share in along:
                frames = _frames(out, fingers)
                places = middles - radius[:, None] * out
                yield _made(hand, kind, frames, _refs(hand, share, len(some)), places, bars=bars, limits=limits)


def _tips(hand: Hand, found: Features, kind: Kind) -> Iterator[Approaches]:
    """Thumb and finger pads on opposite places, turned about the line between them."""
    facing = np.einsum("ki,ki->k", found.normals, found.opposite) < -0.6
    table = oppositions(hand, kind)
    if not table:
        return
    widest = min(max(one.width for one in table), WIDEST[kind] * hand.length)
    rows = np.flatnonzero(facing & (found.thickness < 0.95 * widest))
    count = IN_BODY * OPPOSITE if hand.is_in_body else OPPOSITE
    for row in rows[spread_out(found.points[rows], count, 0)] if len(rows) else rows:
        place = found[np.array([row])]
        for one in _fitting(table, float(place.thickness[0])):
            yield _pinched(hand, place, one, kind)


def _over_rims(request: GraspRequest, kind: Kind) -> Iterator[Approaches]:
    """Thumb and finger pads on both sides of the rims of plates and walls, the palm outside: of a large plate a
    hand reaches nothing else, and few places that are chosen at random are as near a rim as that."""
    hand, length = request.hand, request.hand.length
    table = oppositions(hand, kind) if kind in ON_RIMS else []
    if not table:
        return
    widest = min(max(one.width for one in table), WIDEST[kind] * length)
    rims = rims_of(request.mesh, length, 0.95 * widest, request.seed, request.at)
    for row in spread_out(rims.points, RIMS, 0) if len(rims.points) else ():
        across, inwards = rims.across[row], rims.inwards[row]
        for one in _fitting(table, float(rims.thickness[row])):
            ahead = one.middle - hand.description.palm.point
            own = _square(one.towards, ahead)
            to = [_square(side * across, _turned(inwards, across, turn)) for side in (1.0, -1.0) for turn in TURNS]
            turns = np.array(to) @ own.T
            for depth in DEPTHS:
                middle = rims.points[row] + depth * one.room * inwards
                refs, middles = np.tile(one.middle, (len(turns), 1)), np.tile(middle, (len(turns), 1))
                limits = np.full(len(hand.bones) - 1, RELAXED)
                limits[list(one.digits)] = 1.0
                yield _made(hand, kind, turns @ hand.frame, refs, middles, stay=True, curl=one.curl, limits=limits)


def _square(line: FloatArray, ahead: FloatArray) -> FloatArray:
    """(3, 3) columns: a unit line, the way ahead made square to it, and the third."""
    across = ahead - (ahead @ line) * line
    across = across / max(float(np.linalg.norm(across)), 1e-12)
    return np.stack([line, across, np.cross(line, across)], axis=1)


def _turned(way: FloatArray, axis: FloatArray, angle: float) -> FloatArray:
    """A way (3,) across a unit axis, turned about it."""
    return np.asarray(np.cos(angle) * way + np.sin(angle) * np.cross(axis, way))


def _fitting(table: list[Opposition], thick: float) -> list[Opposition]:
    """The best oppositions of at least a thickness and not much more, with fingers bent differently far."""
    wide = [one for one in table if thick <= one.width <= 1.3 * thick + min(each.width for each in table)]
    return sorted(wide, key=lambda one: one.misfit + max(0.5 * thick - one.room, 0.0) / thick)[:FITTING]


def _pinched(hand: Hand, place: Features, one: Opposition, kind: Kind) -> Approaches:
    """One place (a batch of one) between the pads, from both sides and all round."""
    limits = np.full(len(hand.bones) - 1, SIDEWAYS if kind == "lateral" else RELAXED)
    limits[hand.thumb if kind == "lateral" else list(one.digits)] = 1.0
    line = one.towards  # (3,) rig space, from the thumb's pad to the fingers'
    aside = np.cross(line, hand.frame[:, 1])
    aside = aside / max(float(np.linalg.norm(aside)), 1e-12)
    own = np.stack([line, aside, np.cross(line, aside)], axis=1)  # (3, 3)
    roll = (np.arange(ROLLS) * 2.0 * np.pi / ROLLS)[:, None]
    first = np.tile(np.cos(roll) * place.axis[0] + np.sin(roll) * place.across[0], (2, 1))  # (r, 3)
    to = np.repeat([[1.0], [-1.0]], ROLLS, axis=0) * place.normals[0]
    turns = np.stack([to, first, np.cross(to, first)], axis=2) @ own.T  # (r, 3, 3)
    refs, middles = np.tile(one.middle, (len(turns), 1)), np.tile(place.middles, (len(turns), 1))
    return _made(hand, kind, turns @ hand.frame, refs, middles, stay=True, curl=one.curl, limits=limits)
