"""The contact pairs of a problem, one below the other, as tracks over its bones."""

from __future__ import annotations

from collections.abc import Mapping, MutableMapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import Rig
from contact_core.rig.skinning import normal_track, point_track
from contact_core.rig.track import Track, watched_track

if TYPE_CHECKING:
    from contact_core.solve.problem import PoseProblem


@dataclass(frozen=True, eq=False)
class Pairs:
    """All contact pairs of a problem, one below the other.

    manipulator_points, object_points, and their normals: the two ends. gap: the first minus the second.
    weights: (k,) of each point its share of the weights of all pairs, times the gain of its own pair; sum 1 while
    every gain is 1, and 0 for pairs that hold a direction alone. facing: (k,) the same for their normals, 0 for
    pairs that hold points alone. rows: which rows are whose.
    """

    manipulator_points: Track
    object_points: Track
    manipulator_normals: Track
    object_normals: Track
    gap: Track
    weights: FloatArray
    facing: FloatArray
    rows: Mapping[str, slice]


def pairs_of(problem: PoseProblem) -> Pairs:
    """The contact pairs of a problem as tracks.

    Weights are divided by the sum over all pairs whatever their gains, so what is on does not change how strong the
    others are. A problem without contacts, or with none that holds, has pairs that cost nothing.
    """
    if not problem.contacts:
        points, normals = Track.empty(4), Track.empty(3)
        return Pairs(points, points, normals, normals, points, np.zeros(0), np.zeros(0), {})
    shares = np.concatenate([contact.weights for contact in problem.contacts])
    gains = np.repeat([c.gain for c in problem.contacts], [len(c.weights) for c in problem.contacts])
    weights = gains * shares / max(float(shares.sum()), np.finfo(float).tiny)
    holds = np.repeat([c.hold for c in problem.contacts], [len(c.weights) for c in problem.contacts])
    ends = np.cumsum([0, *(len(contact.weights) for contact in problem.contacts)])
    rows = {c.name: slice(int(ends[i]), int(ends[i + 1])) for i, c in enumerate(problem.contacts)}
    manipulators = [(contact.manipulator, contact.manipulator_points) for contact in problem.contacts]
    objects = [(contact.object, contact.object_points) for contact in problem.contacts]
    first, first_normals = _tracks(problem, manipulators, as_object=False)
    second, second_normals = _tracks(problem, objects, as_object=True)
    gap = first.combined(second, -1.0)
    return Pairs(first, second, first_normals, second_normals, gap, np.where(holds == "direction", 0.0, weights),
        np.where(holds == "point", 0.0, weights), rows,
    )  # fmt: skip


def _tracks(
    problem: PoseProblem, ends: Sequence[tuple[str, SurfacePoints]], *, as_object: bool
) -> tuple[Track, Track]:
    """Points and normals of one end of all pairs; an end that is that of a problem before is taken over whole."""
    key = as_object, tuple((name, id(points)) for name, points in ends)
    if key not in problem.kept_ends:
        problem.kept_ends[key] = (tuple(ends), *_made_tracks(problem, ends, as_object=as_object))
    return problem.kept_ends[key][1:]


def _made_tracks(
    problem: PoseProblem, ends: Sequence[tuple[str, SurfacePoints]], *, as_object: bool
) -> tuple[Track, Track]:
    """Points and normals of one end of all pairs; what lies on one body is blended in one go."""
    owner = np.repeat([problem.body_index(name) for name, _ in ends], [len(points) for _, points in ends])
    order, tracks, normals = [], [], []
    for index in np.unique(owner):
        rows = np.flatnonzero(owner == index)
        rig, first = problem.bodies[index].rig, int(problem.bone_offsets[index])
        order.append(rows)
        if problem.bodies[index].black_box is not None:
            total = int(problem.watched_offsets[-1])
            end = int(problem.watched_offsets[index + 1])
            start = end - len(rows) if as_object else int(problem.watched_offsets[index])
            tracks.append(watched_track(start, len(rows), total, 4))
            normals.append(watched_track(start, len(rows), total, 3))
            continue
        mine = [points for name, points in ends if problem.body_index(name) == index]
        carried, turned = _carried(rig, first, mine, problem.kept_tracks)
        tracks.append(carried)
        normals.append(turned)
    if len(order) == 1:
        return tracks[0], normals[0]
    back = np.argsort(np.concatenate(order))
    return Track.stacked(tracks).rows(back), Track.stacked(normals).rows(back)


KeptTracks = MutableMapping[tuple[int, int], tuple[Rig, SurfacePoints, Track, Track]]
KeptEnds = MutableMapping[
    tuple[bool, tuple[tuple[str, int], ...]], tuple[tuple[tuple[str, SurfacePoints], ...], Track, Track]
]  # by the bodies and the identities of the points, which are kept beside the tracks so that their ids stay theirs


def _carried(rig: Rig, first: int, batches: Sequence[SurfacePoints], kept: KeptTracks) -> tuple[Track, Track]:
    """Tracks of batches of points on one body, and of their normals: those that a problem before this one made are
    taken over. kept: by identity of the batch, which is kept beside its tracks so that its id stays its own."""
    new = [batch for batch in batches if (id(batch), first) not in kept]
    if len(new) == len(batches):  # all in one go
        together = SurfacePoints.concatenate(batches)
        points, normals = point_track(rig, together, first), normal_track(rig, together, first)
        ends = np.cumsum([0, *map(len, batches)])
        for k, batch in enumerate(batches):
            rows = np.arange(ends[k], ends[k + 1])
            kept[id(batch), first] = rig, batch, points.rows(rows), normals.rows(rows)
        return points, normals
    for batch in new:
        kept[id(batch), first] = rig, batch, point_track(rig, batch, first), normal_track(rig, batch, first)
    both = [kept[id(batch), first] for batch in batches]
    return Track.stacked([each[2] for each in both]), Track.stacked([each[3] for each in both])
