"""The contact pairs of a problem, one below the other, as tracks over its bones."""

from __future__ import annotations

from collections.abc import Mapping, MutableMapping, Sequence
from dataclasses import dataclass

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import Rig
from contact_core.rig.skinning import normal_track, point_track
from contact_core.rig.track import Track, watched_track
from contact_core.solve.layout import DofLayout


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


def pairs_of(layout: DofLayout, kept_tracks: KeptTracks, kept_ends: KeptEnds) -> Pairs:
    """The contact pairs of a layout as tracks; what a problem before kept is taken over, what is made is kept.

    Weights are divided by the sum over all pairs whatever their gains, so what is on does not change how strong the
    others are. A problem without contacts, or with none that holds, has pairs that cost nothing.
    """
    if not layout.contacts:
        points, normals = Track.empty(4), Track.empty(3)
        return Pairs(points, points, normals, normals, points, np.zeros(0), np.zeros(0), {})
    shares = np.concatenate([contact.weights for contact in layout.contacts])
    gains = np.repeat([c.gain for c in layout.contacts], [len(c.weights) for c in layout.contacts])
    weights = gains * shares / max(float(shares.sum()), np.finfo(float).tiny)
    holds = np.repeat([c.hold for c in layout.contacts], [len(c.weights) for c in layout.contacts])
    ends = np.cumsum([0, *(len(contact.weights) for contact in layout.contacts)])
    rows = {c.name: slice(int(ends[i]), int(ends[i + 1])) for i, c in enumerate(layout.contacts)}
    manipulators = [(contact.manipulator, contact.manipulator_points) for contact in layout.contacts]
    objects = [(contact.object, contact.object_points) for contact in layout.contacts]
    first, first_normals = _tracks(layout, manipulators, kept_tracks, kept_ends, as_object=False)
    second, second_normals = _tracks(layout, objects, kept_tracks, kept_ends, as_object=True)
    gap = first.combined(second, -1.0)
    return Pairs(first, second, first_normals, second_normals, gap, np.where(holds == "direction", 0.0, weights),
        np.where(holds == "point", 0.0, weights), rows,
    )  # fmt: skip


def _tracks(
    layout: DofLayout,
    ends: Sequence[tuple[str, SurfacePoints]],
    kept_tracks: KeptTracks,
    kept_ends: KeptEnds,
    *,
    as_object: bool,
) -> tuple[Track, Track]:
    """Points and normals of one end of all pairs; an end that is that of a problem before is taken over whole."""
    key = as_object, tuple((name, id(points)) for name, points in ends)
    if key not in kept_ends:
        kept_ends[key] = (tuple(ends), *_made_tracks(layout, ends, kept_tracks, as_object=as_object))
    return kept_ends[key][1:]


def _made_tracks(
    layout: DofLayout, ends: Sequence[tuple[str, SurfacePoints]], kept: KeptTracks, *, as_object: bool
) -> tuple[Track, Track]:
    """Points and normals of one end of all pairs; what lies on one body is blended in one go."""
    owner = np.repeat([layout.body_index(name) for name, _ in ends], [len(points) for _, points in ends])
    order, tracks, normals = [], [], []
    for index in np.unique(owner):
        rows = np.flatnonzero(owner == index)
        rig, first = layout.bodies[index].rig, int(layout.bone_offsets[index])
        order.append(rows)
        if layout.bodies[index].black_box is not None:
            total = int(layout.watched_offsets[-1])
            end = int(layout.watched_offsets[index + 1])
            start = end - len(rows) if as_object else int(layout.watched_offsets[index])
            tracks.append(watched_track(start, len(rows), total, 4))
            normals.append(watched_track(start, len(rows), total, 3))
            continue
        mine = [points for name, points in ends if layout.body_index(name) == index]
        carried, turned = _carried(rig, first, mine, kept)
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
