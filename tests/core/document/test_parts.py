"""A document in parts: what changed and nothing else, one digest however it was reached, damage that is refused."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.document.asset import Asset
from contact_core.document.document import ContactDocument
from contact_core.document.frozen_map import FrozenMap
from contact_core.document.parts import NO_PARTS, DocumentParts
from contact_core.document.schema import VERSION, dump_document, same_documents
from contact_core.document.timeline import Track, WeightKey
from contact_core.errors import FileRefused
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.scene.host import DocumentStamp
from contact_core.scene.memory_host import MemoryHost
from contact_core.session import Session
from contact_core.testing import meshes
from contact_core.testing.host_scenes import arm_rig
from contact_core.testing.random_commands import random_document, random_history


def texts_of(document: ContactDocument) -> dict[str, str]:
    return dict(NO_PARTS.to(document)[1].put)


def read(parts: dict[str, str], digest: str) -> DocumentParts:
    return DocumentParts.read(parts, VERSION, digest, "the scene")


@given(st.integers(0, 10_000))
@settings(max_examples=8)
def test_a_walk_through_a_history_keeps_parts_and_digest(seed: int) -> None:
    """Changes applied one by one lead to the parts that the document has by itself, there and back."""
    history = random_history(seed, 10)
    documents = [history.base, *(step.after for step in history.steps)]
    held, texts = NO_PARTS, dict[str, str]()
    for document in [*documents, *documents[::-2], documents[-1], ContactDocument()]:
        held, change = held.to(document)
        assert not set(change.put) & set(change.removed) and set(change.removed) <= set(texts)
        texts = {key: text for key, text in texts.items() if key not in change.removed} | dict(change.put)
        assert texts == texts_of(document)
        assert held.digest == DocumentParts.of(document).digest
        found = read(texts, held.digest)
        assert same_documents(found.document, document) and found.digests == held.digests
        assert found.to(document)[1].put == {} == held.to(found.document)[1].put
    assert texts == {} and held.digest == NO_PARTS.digest


@given(st.integers(0, 10_000), st.integers(0, 10_000))
@settings(max_examples=25)
def test_digests_are_equal_exactly_for_equal_documents(one: int, other: int) -> None:
    a, b = random_document(one, 6), random_document(other, 6)
    same = dump_document(a) == dump_document(b)
    assert (DocumentParts.of(a).digest == DocumentParts.of(b).digest) == same
    turned = replace(a, patches=FrozenMap(list(a.patches.items())[::-1]))  # the order of items says nothing
    assert DocumentParts.of(turned).digest == DocumentParts.of(a).digest


@given(st.text(st.characters(exclude_categories=["C", "Z"]), min_size=1, max_size=60), st.integers(0, 100))
@settings(max_examples=40)
def test_any_host_can_keep_keys_and_texts(name: str, number: int) -> None:
    document = ContactDocument(extras=FrozenMap({name: name, "2": number, "none": None}))
    texts = texts_of(document)
    for key, text in texts.items():
        assert re.fullmatch(r"[a-z_]+_[0-9a-f]{32}", key) and len(key) <= 63
        assert re.fullmatch(r"[ -~\n]*", text)
    found = read(texts, DocumentParts.of(document).digest)
    assert same_documents(found.document, document)


def painted(points: int = 200) -> tuple[MemoryHost, Session]:
    """A session in a memory host, with two patches on a torus and a rig in the scene."""
    host = MemoryHost()
    host.add(Asset("torus", meshes.family("torus"), meters_per_unit=1.0))
    rig = arm_rig()
    host.add(Asset("arm", rig.surface, rig, meters_per_unit=1.0))
    session = Session(host=host, objects=["torus"], discover=False)
    mesh = session.surfaces.meshes["torus"]
    for name, seed in (("one", 0), ("two", 1)):
        near = np.argsort(np.linalg.norm(mesh.points - mesh.points[seed], axis=1), kind="stable")[:points]
        patch = SurfacePoints.at_vertices(mesh, near)
        session.patches.paint(name, patch, surface="torus", axis=patch[[0, 5, 12]])
    return host, session


def test_an_edit_in_a_host_writes_what_it_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of all kinds of edits, by keys and by bytes; what the host then holds is the session's document."""
    host, session = painted()
    told: list[tuple[set[str], int]] = []
    store = MemoryHost.store_document

    def spy(self: MemoryHost, stamp: DocumentStamp, put: dict[str, str], remove: tuple[str, ...] = ()) -> None:
        told.append(({re.sub("_[0-9a-f]{32}$", "", key) for key in (*put, *remove)}, sum(map(len, put.values()))))
        store(self, stamp, put, remove)

    monkeypatch.setattr(MemoryHost, "store_document", spy)
    points = len(session.document.shapes["one"]) * 20  # bytes: more than an edit of anything else may cost
    session.patches.rotate("one", 0.2)
    session.patches.bend("one", 1, 0.1)
    session.patches.rename("two", "three")
    session.set_extra("note", [1, 2])
    session.pairs.add("one", "three")
    session.patches.remove("three")
    kinds, sizes = zip(*told, strict=True)
    assert kinds == ({"patches"}, {"shapes"}, {"patches"}, {"extras"}, {"pairs"}, {"patches", "shapes", "pairs"})
    assert max(sizes) < points
    stored = host.stored_document()
    assert stored is not None and same_documents(stored.read("the scene").document, session.document)


def test_after_undo_an_edit_still_writes_what_it_changes_only() -> None:
    """Also where the session began at a document that binding had changed, which the host does not hold."""
    host, first = painted()
    first.close()
    session = Session(host=host, objects=["arm"], discover=False)
    for _ in range(2):
        assert "arm" in session.document.surfaces
        session.patches.rotate("one", 0.2)
        session.patches.rotate("two", 0.2)
        for back in (1, 2):
            session.undo()
            session.set_extra("back", back)
            stored = host.stored_document()
            assert stored is not None and stored.stamp.revision == session.revision
            assert same_documents(stored.read("the scene").document, session.document)
            session.undo()
        assert session.revision == 2  # where this session began


@pytest.mark.parametrize("damage", ["changed", "removed", "added", "swapped", "twice", "no object", "renamed"])
def test_damaged_parts_are_refused_in_words(damage: str) -> None:
    document = random_document(3, 12)
    texts, digest = texts_of(document), DocumentParts.of(document).digest
    one, other = [key for key in texts if key.startswith("patches_")][:2]
    if damage == "changed":
        texts[one] = texts[one].replace("1", "2")
    elif damage == "removed":
        del texts[one]
    elif damage == "added":
        texts["extras_0"] = '{"extras": {"x": 1}}'
    elif damage == "swapped":
        texts[one], texts[other] = texts[other], texts[one]
    elif damage == "twice":
        texts["again"] = texts[one]
    elif damage == "no object":
        texts[one] = "[1]"
    else:
        texts["patches_x"] = texts.pop(one)
    with pytest.raises(FileRefused, match="the scene"):
        read(texts, digest)


def test_a_damaged_scene_is_left_and_a_session_refused() -> None:
    host, session = painted()
    session.close()
    stored = host.stored_document()
    assert stored is not None
    key = next(key for key in stored.parts if key.startswith("patches_"))
    host.store_document(stored.stamp, {key: stored.parts[key].replace("true", "false")})
    before = host.scene
    with pytest.raises(FileRefused, match="not as it was stored"):
        Session(host=host, discover=False)
    assert host.scene is before


def test_a_new_axis_leaves_the_points_of_its_shape() -> None:
    shape = next(iter(random_document(5, 12).shapes.values()))
    other = replace(shape, axis=replace(shape.axis, spread=2.0))
    held, whole = NO_PARTS.to(ContactDocument(shapes=FrozenMap({"a": shape})))
    after, change = held.to(ContactDocument(shapes=FrozenMap({"a": other})))
    assert len(whole.put) == 2 and len(change.put) == 1 and not change.removed
    (text,) = change.put.values()
    assert '"spread": 2.0' in text and '"legs"' not in text
    assert after.to(ContactDocument(shapes=FrozenMap({"a": shape})))[1].put.keys() == change.put.keys()


def test_a_key_leaves_the_others_of_its_track() -> None:
    """A track of a hundred keys, in whatever order a host gives its parts back."""
    keys = [WeightKey(float(frame), abs(frame) / 100) for frame in range(-50, 50)]
    held = DocumentParts.of(keyed(keys[:1]))
    held, whole = held.to(keyed(keys))
    after, change = held.to(keyed([*keys[:30], WeightKey(-20.0, 0.5), *keys[31:99], WeightKey(48.5, 0.1)]))
    assert (len(whole.put), len(change.put), len(change.removed)) == (99, 2, 1)
    texts = texts_of(after.document)
    for order in (sorted(texts), sorted(texts, reverse=True)):
        found = read({key: texts[key] for key in order}, after.digest)
        assert same_documents(found.document, after.document)


PAIRED = next(found for found in map(random_document, range(100)) if found.pairs and not found.tracks)


def keyed(keys: list[WeightKey]) -> ContactDocument:
    """A document with a pair that counts as keys say."""
    return replace(PAIRED, tracks=FrozenMap({f"weight/{next(iter(PAIRED.pairs))}": Track(tuple(keys))}))
