"""Time in documents: what a document is at a frame."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.contact.linkage import follow_walk
from contact_core.contact.placement import Root, Walk
from contact_core.document.document import ContactDocument, ContactPair
from contact_core.document.schema import dump_document, inconsistencies, parse_document
from contact_core.document.timeline import (
    PlaceKey,
    PoseKey,
    Span,
    Timeline,
    Track,
    WeightKey,
    address,
    gain_of,
    of_address,
)
from contact_core.edit.commands import Pair, Remove, Rename, RenameSurface, SetKeys, SetSpans, Unpair
from contact_core.errors import CommandRejected, FileRefused, InvalidInput
from contact_core.motion.placement_keys import PlacementKey, PlacementKeys
from contact_core.rig.pose_keys import PoseKeys
from contact_core.rig.rig import Pose
from contact_core.testing import meshes
from contact_core.testing.random_commands import random_document
from contact_core.testing.random_values import random_motion, random_root, random_track
from contact_core.testing.rigs import tentacle


def timed(seed: int) -> ContactDocument:
    """A random document in which a patch, a surface, a rig and a pair have keys, and the pair a span."""
    rng = np.random.default_rng(seed)
    document = random_document(seed, 40)
    patch = next(p for p in document.patches.values() if isinstance(p.placement, Root))
    surface = document.surfaces[patch.surface]
    first, second = list(document.patches)[:2]
    document = Pair(ContactPair("timed", first, second)).apply(document)
    document = replace(document, tracks=type(document.tracks)(), spans=type(document.spans)())
    for kind, name in (("placement", patch.name), ("place", surface.name), ("weight", "timed")):
        keys = random_track(rng, kind, (2.0, 10.0, 31.5), surface).keys
        document = SetKeys(address(kind, name), keys).apply(document)  # type: ignore[arg-type]
    return SetSpans("timed", (Span(10.0, 20.0, 4.0, 8.0),)).apply(document)


@settings(max_examples=25)
@given(seed=st.integers(0, 10_000), frame=st.floats(-10.0, 60.0))
def test_a_document_at_a_frame_is_a_sound_document_without_time(seed: int, frame: float) -> None:
    document = timed(seed)
    still = document.at(frame)
    assert not list(inconsistencies(document)) and not list(inconsistencies(still))
    assert not still.is_timed and still.at(frame + 1.0) is still
    assert dump_document(parse_document(dump_document(still))) == dump_document(still)
    assert dump_document(parse_document(dump_document(document))) == dump_document(document)
    assert set(still.patches) == set(document.patches) and still.shapes is document.shapes


@settings(max_examples=25)
@given(seed=st.integers(0, 10_000))
def test_values_are_exact_at_keys_and_held_beyond_the_ends(seed: int) -> None:
    document = timed(seed)
    for where, track in document.tracks.items():
        kind, name = of_address(where)
        for frame, key in [
            *zip(track.frames, track.keys, strict=True),
            (-5.0, track.keys[0]),
            (99.0, track.keys[-1]),
        ]:
            still = document.at(frame)
            if isinstance(key, PlacementKey):
                assert still.patches[name].placement == key.root
            elif isinstance(key, WeightKey):
                assert still.pairs[name].weight == key.weight
            elif isinstance(key, PlaceKey):
                assert np.array_equal(still.surfaces[name].world_from_surface, key.world_from_surface)
        assert kind in ("placement", "place", "weight")


@pytest.mark.parametrize("name", ["plane", "sphere", "noisy"])
@pytest.mark.parametrize("seed", range(3))
def test_a_walk_ends_where_the_keys_are_sampled(name: str, seed: int) -> None:
    mesh, rng = meshes.family(name), np.random.default_rng(seed)
    roots = []
    for _ in range(3):
        face = int(rng.integers(len(mesh.faces)))
        roots.append(
            Root(face, tuple(rng.dirichlet(np.ones(3)).tolist()), complex(np.exp(1j * rng.uniform(-3, 3))))
        )
    keys = PlacementKeys.of(mesh, list(zip((0.0, 8.0, 20.0), roots, strict=True)))
    track = Track(keys.keys)
    for frame in (0.0, 0.25, 4.0, 8.0, 13.5, 19.75, 20.0, 30.0):
        place, wanted = track.placement_at(frame), keys.at(mesh, frame)
        found = follow_walk(mesh, place) if isinstance(place, Walk) else place
        off = found.point().positions(mesh) - wanted.point().positions(mesh)
        assert np.abs(off).max() <= 1e-9 * mesh.bounding_box_diagonal
        if found.face == wanted.face:
            assert abs(found.heading - wanted.heading) < 1e-9


def test_poses_follow_their_keys_as_pose_keys_do() -> None:
    rig, rng = tentacle(4), np.random.default_rng(4)
    poses, speeds = [], []
    for _ in range(3):
        local = rig.rest_local.copy()
        local[:, :3, :3] = np.array([random_motion(rng)[:3, :3] for _ in local]) @ local[:, :3, :3]
        poses.append(Pose(rig.joints, local))
        speeds.append(rng.uniform(-0.05, 0.05, (len(rig.joints), 6)))
    frames = (1.0, 12.0, 30.0)
    cubic = PoseKeys(rig.name, frames, tuple(poses), tuple(speeds))
    linear = PoseKeys(rig.name, frames, tuple(poses))
    tracks = [
        (cubic, Track(tuple(PoseKey(f, p, s) for f, p, s in zip(frames, poses, speeds, strict=True)))),
        (linear, Track(tuple(PoseKey(f, p, None, "linear") for f, p in zip(frames, poses, strict=True)))),
    ]
    for keys, track in tracks:
        for frame in (0.0, 1.0, 5.5, 12.0, 29.0, 40.0):
            assert np.allclose(track.pose_at(frame).local, keys.at(rig, frame).local, atol=1e-12)
    held = Track(tuple(PoseKey(f, p, None, "hold") for f, p in zip(frames, poses, strict=True)))
    assert held.pose_at(29.9) is poses[1]


@given(
    span=st.tuples(st.floats(0, 50), st.floats(0, 50), st.floats(0, 20), st.floats(0, 20)),
    frame=st.floats(-50, 150),
)
def test_a_span_is_on_between_its_ends_and_off_beyond_its_ramps(span: Any, frame: float) -> None:
    on, off = sorted(span[:2])
    bar = Span(on, off, *span[2:])
    gain = bar.gain(frame)
    assert 0.0 <= gain <= 1.0
    if on <= frame <= off:
        assert gain == 1.0
    if (frame <= on - bar.ease_in and frame < on) or (frame >= off + bar.ease_out and frame > off):
        assert gain == 0.0
    assert gain_of((bar, Span(1000.0, 1001.0)), frame) == gain


def test_ramps_have_no_corner() -> None:
    gains = np.array([Span(10.0, 20.0, 10.0, 5.0).gain(f) for f in np.linspace(-2.0, 27.0, 2901)])
    slopes = np.diff(gains) * 100.0
    assert np.abs(np.diff(slopes)).max() < 0.01 and gains.max() == 1.0 and gains.min() == 0.0


def test_tracks_follow_their_owners() -> None:
    document = timed(5)
    placement = next(of_address(w)[1] for w in document.tracks if w.startswith("placement/"))
    place = next(of_address(w)[1] for w in document.tracks if w.startswith("place/"))
    renamed = RenameSurface(place, "elsewhere").apply(Rename(placement, "new name").apply(document))
    assert {"placement/new name", "place/elsewhere", "weight/timed"} == set(renamed.tracks)
    assert not list(inconsistencies(renamed))
    alone = Unpair("timed").apply(document)
    assert not alone.spans and "weight/timed" not in alone.tracks
    leaf = document.pairs["timed"].object
    children = [
        (c, random_root(np.random.default_rng(0), document.surface(document.patch(c).surface)))
        for c in document.children(leaf)
    ]
    gone = Remove((leaf,), tuple(children)).apply(document)
    assert "timed" not in gone.pairs and not gone.spans and not list(inconsistencies(gone))


def test_times_that_mean_nothing_are_refused_in_words() -> None:
    document, rng = timed(5), np.random.default_rng(0)
    surface = next(iter(document.surfaces.values()))
    weights = random_track(rng, "weight", (1.0,))
    for make, says in [
        (lambda: Timeline((0, 1)), "fraction"),
        (lambda: Timeline(first=2.0, last=1.0), "runs from"),
        (lambda: Span(3.0, 2.0), "runs from"),
        (lambda: Span(1.0, 2.0, -1.0), "eases"),
        (lambda: WeightKey(float("nan"), 1.0), "finite"),
        (lambda: WeightKey(0.0, -1.0), "not negative"),
        (lambda: PlaceKey(0.0, 2.0 * np.eye(4)), "rigid"),
        (lambda: Track(()), "at least one"),
        (lambda: Track((*weights.keys, *weights.keys)), "rising"),
        (lambda: Track((*weights.keys, PlaceKey(2.0, np.eye(4)))), "one kind"),
        (lambda: PoseKey(0.0, Pose(("a", "a"), np.tile(np.eye(4), (2, 1, 1)))), "twice"),
    ]:
        with pytest.raises(InvalidInput, match=says):
            make()
    for command, says in [
        (SetKeys("weight/nobody", weights.keys), "does not exist"),
        (SetKeys("colour/timed", weights.keys), "a track is one of"),
        (SetKeys(f"place/{surface.name}", weights.keys), "keys of the kind"),
        (SetKeys("weight/none", ()), "no track"),
        (SetSpans("timed", (Span(1.0, 5.0), Span(5.0, 8.0))), "follow one another"),
    ]:
        with pytest.raises((CommandRejected, InvalidInput), match=says):
            command.apply(document)
    patch = next(p for p in document.patches.values() if isinstance(p.placement, Root))
    beyond = random_root(rng, replace(document.surfaces[patch.surface], faces=10**6))
    with pytest.raises(CommandRejected, match="another mesh"):
        SetKeys(f"placement/{patch.name}", (PlacementKey(50.0, beyond),), document.tracks.get(
            f"placement/{patch.name}", weights).frames).apply(document)  # fmt: skip


@pytest.mark.parametrize(
    ("says", "field", "value"),
    [
        ("one timeline", "timelines", {"other": {"rate": [24, 1], "first": 0.0, "last": 1.0}}),
        ("name the pair", "spans", {"nobody": [{"on": 0.0, "off": 1.0}]}),
        ("has none", "spans", {"timed": []}),
        ("does not exist", "tracks", {"pose/nobody": {"keys": [{"is": "WeightKey", "frame": 0.0, "weight": 1.0}]}}),
        ("a track is one of", "tracks", {"x": {"keys": [{"is": "WeightKey", "frame": 0.0, "weight": 1.0}]}}),
        ("at most 1000000 frames", "timelines", {"film": {"rate": [24, 1], "first": 0.0, "last": 1e12}}),
        ("none beyond 1e\\+09", "timelines", {"film": {"rate": [24, 1], "first": 1e17, "last": 1e17}}),
        ("at least one", "tracks", {"weight/timed": {"keys": []}}),
    ],
)
def test_files_that_contradict_themselves_over_time_are_refused(says: str, field: str, value: Any) -> None:
    data = json.loads(dump_document(timed(5)))
    data["digest"] = None
    data[field] = value
    with pytest.raises(FileRefused, match=says):
        parse_document(json.dumps(data).encode())


def test_a_span_says_what_it_holds() -> None:
    document = timed(5)
    spans = (Span(0.0, 10.0, 2.0, 4.0, "point"), Span(15.0, 20.0, 4.0, 2.0, "direction"))
    held = SetSpans("timed", spans).apply(document)
    found = [held.at(frame).pairs["timed"].hold for frame in (5.0, 11.0, 14.0, 18.0)]
    assert found == ["point", "point", "direction", "direction"]  # of the one that is farther on
    assert parse_document(dump_document(held)).spans["timed"] == spans
    with pytest.raises(InvalidInput, match="holds"):
        Span(0.0, 1.0, hold="nothing")  # type: ignore[arg-type]
