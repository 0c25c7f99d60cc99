"""The search: a hand closed at many approaches, looked at once, and those that are worth solving."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.geometry.distance_field import DistanceField
from contact_core.grasping.closing import Closed, close_hands, relaxed
from contact_core.grasping.hand import Hand
from contact_core.grasping.loops import digits_through
from contact_core.grasping.scene import GraspScene, uniform_scale_of
from contact_core.grasping.screening import ALIKE, distinct, elsewhere, first_look, seen_from
from contact_core.grasping.slots import GRASP_SAMPLERS, KINDS, Approaches, GraspRequest, Kind, lacks
from contact_core.progress import NO_PROGRESS, Progress

SECOND_LOOK = 220  # approaches that are closed with all starts of the thumb
MORE = {"power": 3.0}  # times as many approaches of a kind as of others
TURNS = ("power", "power", "precision", "power", "pinch", "power", "hook")  # one after the other
BOTH = 0.8  # what it is worth that the thumb is through one loop and a finger through another
THREADED = 0.3  # what each finger through a loop at the place to hold is worth to a first look
BESIDE = 0.6  # what it costs that the thumb is through the same
LIKE = 0.25  # times as far apart as grasps that are not alike: such are tried where there are few of those
WORSE, HOPELESS = 1.1, -0.6  # a first look that is worse than the best by so much, and below that, is not tried
USUAL: tuple[Kind, ...] = ("power", "precision", "pinch", "hook")


@dataclass(frozen=True)
class GraspSettings:
    """count: how many are wanted. kinds: which; usual ones by default. at: (3,) the place of the object that is
    to be held, in its surface space. sampler, score: plugins by name, the defaults without."""

    count: int = 8
    kinds: tuple[Kind, ...] = ()
    at: tuple[float, float, float] | None = None
    seed: int = 0
    sampler: str | None = None
    score: str | None = None
    sampler_settings: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not 1 <= self.count <= 64:
            raise InvalidInput(f"from 1 to 64 grasps can be asked for, but {self.count} were.")
        wrong = [kind for kind in self.kinds if kind not in KINDS]
        if wrong:
            raise InvalidInput(f"a grasp is one of {', '.join(KINDS)}, but {wrong[0]!r} was asked for.")
        if self.at is not None and not np.isfinite(self.at).all():
            raise InvalidInput(f"the place to hold is three finite numbers, but got {list(self.at)}.")
        if not 0 <= self.seed < 2**32:
            raise InvalidInput(f"the seed is a whole number from 0 to 2^32 - 1, but got {self.seed}.")


def kinds_of(scene: GraspScene, settings: GraspSettings) -> tuple[Kind, ...]:
    """The kinds that are asked for, else the usual ones that the hand can do."""
    return settings.kinds or tuple(kind for kind in USUAL if lacks(scene.hand, kind) is None)


def place_of(scene: GraspScene, settings: GraspSettings) -> FloatArray | None:
    """(3,) the place that is to be held, in the object's space in the hand's units."""
    return None if settings.at is None else np.array(settings.at) * uniform_scale_of(scene)


def screened(
    scene: GraspScene, settings: GraspSettings, progress: Progress = NO_PROGRESS
) -> tuple[Approaches, Closed, FloatArray, FloatArray]:
    """Approaches closed in full, what a first look makes of them (N,), and what each hand sees (N, p)."""
    hand, field = scene.hand, scene.field
    name = scene.plugins.name_for(GRASP_SAMPLERS, "grasp", settings.sampler)
    sampler = scene.plugins.make(GRASP_SAMPLERS, name, **settings.sampler_settings)
    at, kinds = place_of(scene, settings), kinds_of(scene, settings)
    approaches = sampler.sample(GraspRequest(hand, scene.mesh, field, kinds, at, settings.seed))
    progress.tell(0.3, "Closing the hand in many places")
    values = np.zeros(0)
    if len(approaches.kinds):
        rough = _closed(hand.quick, field, approaches)
        values = _looked_at(scene, approaches, rough, at)
        best = _shared_out(approaches, values, SECOND_LOOK)
        approaches, values = approaches[best], values[best]
    progress.tell(0.6, "Turning the thumb")
    closed = _closed(hand, field, approaches)
    value = values
    if len(approaches.kinds):
        value = _looked_at(scene, approaches, closed, at)
    return approaches, closed, value, seen_from(hand, field, closed.placed)


def _looked_at(scene: GraspScene, approaches: Approaches, closed: Closed, at: FloatArray | None) -> FloatArray:
    """(N,) what a first look makes of closed hands, the place that is to be held considered."""
    look = first_look(scene.hand, scene.mesh, approaches, closed)
    return look - elsewhere(scene.hand, closed, at) + _threaded(scene, closed)


def _threaded(scene: GraspScene, closed: Closed) -> FloatArray:
    """(N,) what fingers through a loop at the place that is to be held are worth; nothing without a place."""
    if not scene.loops:
        return np.zeros(len(closed.placed))
    frames = scene.hand.frames(closed.placed, closed.angles, closed.turns)
    through, thumb = digits_through(scene.hand, frames, scene.loops), scene.hand.thumb
    fingers = np.delete(through, thumb, axis=2) if thumb >= 0 else through
    value = THREADED * np.minimum(fingers.any(axis=1).sum(axis=1), 4)
    if thumb >= 0:
        alone = through[:, :, thumb] & ~fingers.any(axis=2)
        beside = through[:, :, thumb] & fingers.any(axis=2)
        value += BOTH * (alone.any(axis=1) & fingers.any(axis=(1, 2))) - BESIDE * beside.any(axis=1)
    return np.asarray(value)


def _closed(hand: Hand, field: DistanceField, approaches: Approaches) -> Closed:
    closed = close_hands(
        hand, field, approaches.placed, approaches.ways, approaches.bars, approaches.curls, approaches.limits
    )
    return relaxed(hand, closed)


def _shared_out(approaches: Approaches, values: FloatArray, most: int) -> IntArray:
    """Indices of the best of every kind, `most` in all."""
    kinds = sorted(set(approaches.kinds), key=approaches.kinds.index)
    names = np.array(approaches.kinds)
    shares = np.array([MORE.get(kind, 1.0) for kind in kinds])
    taken = []
    for kind, share in zip(kinds, shares / shares.sum(), strict=True):
        own = np.flatnonzero((names == kind) & np.isfinite(values))
        taken.append(own[np.argsort(-values[own], kind="stable")][: max(8, int(share * most))])
    return np.concatenate(taken) if taken else np.zeros(0, np.int64)


def chosen(hand: Hand, approaches: Approaches, value: FloatArray, seen: FloatArray, count: int) -> IntArray:
    """The approaches worth solving, `count` at most, in the order in which they are: two of three are power grasps,
    where there are such; none is like one before it. Where these are few, as on a ball, which looks the same from
    everywhere, others follow that are somewhat like them: a search that ends a little elsewhere may succeed."""
    names = np.array(approaches.kinds)
    least = min(value.max(initial=-np.inf) - WORSE, HOPELESS)
    queues: dict[str, list[int]] = {}
    for kind in dict.fromkeys(approaches.kinds):
        own = np.flatnonzero((names == kind) & (value >= least))
        order = own[np.argsort(-value[own], kind="stable")]
        queues[kind] = distinct(seen, order, count, hand.length).tolist()
    turn = [*(kind for kind in TURNS if kind in queues), *(kind for kind in queues if kind not in TURNS)]
    result: list[int] = []
    while any(queues.values()) and len(result) < count:
        result.extend(queues[kind].pop(0) for kind in turn if queues[kind])
    first = distinct(seen, np.array(result, np.int64), count, hand.length)
    others = np.setdiff1d(np.flatnonzero(value >= least), first)
    others = others[np.argsort(-value[others], kind="stable")]
    return distinct(seen, np.concatenate([first, others]), count, hand.length, LIKE * ALIKE)
