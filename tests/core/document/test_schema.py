"""The document on disk: deterministic, complete, checked, refused in words where it cannot be read."""

from __future__ import annotations

import copy
import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.contact.placement import Root
from contact_core.document import schema
from contact_core.document.codec import from_json, pretty, to_json
from contact_core.document.document import ContactDocument, Patch, Surface
from contact_core.document.frozen_map import FrozenMap
from contact_core.document.schema import dump_document, parse_document, same_documents
from contact_core.edit.commands import Recolor
from contact_core.edit.recovery import open_file, read_document, write_document
from contact_core.errors import CommandRejected, FileRefused, InvalidInput
from contact_core.testing.random_commands import random_document


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_written_and_read_back_it_is_the_same_to_the_last_bit(seed: int) -> None:
    document = random_document(seed, 40)
    text = dump_document(document)
    again = parse_document(text)
    assert dump_document(again) == text
    for key, shape in document.shapes.items():
        assert again.shapes[key].digest == shape.digest
        assert np.array_equal(again.shapes[key].weights, shape.weights)
    assert {n: p.placement for n, p in again.patches.items()} == {
        n: p.placement for n, p in document.patches.items()
    }
    assert dict(again.patches) == dict(document.patches)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_bytes_do_not_depend_on_the_order_of_making(seed: int) -> None:
    document = random_document(seed)
    order = np.random.default_rng(seed)

    def shuffled(items: FrozenMap[Any]) -> FrozenMap[Any]:
        names = list(items)
        order.shuffle(names)
        return FrozenMap({name: items[name] for name in names})

    parts = {name: shuffled(getattr(document, name)) for name in document.__dataclass_fields__}
    assert dump_document(ContactDocument(**parts)) == dump_document(document)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_what_is_kept_of_the_text_changes_no_byte(seed: int) -> None:
    document = random_document(seed)
    assert dump_document(document).decode() == pretty(schema.document_to_json(document)) + "\n"
    assert dump_document(copy.deepcopy(document)) == dump_document(document)


def test_it_is_made_for_review() -> None:
    """One edit changes one line, none is longer than a matrix, and it is plain JSON."""
    document = random_document(5, 40)
    assert document.poses
    name = next(iter(document.patches))
    edited = Recolor((name,), (0.125, 0.25, 0.5)).apply(document)
    before, after = dump_document(document).decode().splitlines(), dump_document(edited).decode().splitlines()
    assert len(before) == len(after)
    assert sum(a != b for a, b in zip(before, after, strict=True)) == 1
    assert max(map(len, before)) < 400
    assert json.loads("\n".join(before))["schema"] == "contact-core.document"


@settings(max_examples=200, deadline=None)
@given(
    data=st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
        lambda inner: st.lists(inner, max_size=14) | st.dictionaries(st.text(), inner, max_size=5),
        max_leaves=25,
    )
)
def test_pretty_json_is_json(data: Any) -> None:
    assert json.loads(pretty(data)) == data


def test_a_newer_schema_is_refused_with_its_version_and_left_untouched(tmp_path: Path) -> None:
    path = tmp_path / "document.json"
    data = json.loads(dump_document(random_document(1)))
    data["version"] = schema.VERSION + 3
    path.write_text(json.dumps(data))
    before = path.read_bytes()
    for _ in range(2):
        with pytest.raises(FileRefused, match=f"version {schema.VERSION + 3}.*newer contact-core.*untouched"):
            open_file(path)
    assert path.read_bytes() == before
    assert not path.with_name("document.json.journal").exists()


def test_every_released_version_has_an_upgrade() -> None:
    assert set(schema.UPGRADES) == set(range(1, schema.VERSION))


def test_upgrades_run_in_order(monkeypatch: pytest.MonkeyPatch) -> None:
    def to_two(body: dict[str, Any]) -> dict[str, Any]:
        surfaces = body.pop("meshes")
        return {**body, "surfaces": surfaces}

    def to_three(body: dict[str, Any]) -> dict[str, Any]:
        return {**body, "extras": {"came from": len(body["surfaces"])}}

    monkeypatch.setattr(schema, "VERSION", 3)
    monkeypatch.setattr(schema, "UPGRADES", {1: to_two, 2: to_three})
    document = ContactDocument(surfaces=FrozenMap({"hand": Surface("hand", "d", "t", 3, 1)}))
    old = json.loads(dump_document(document))
    old["version"], old["meshes"] = 1, old.pop("surfaces")
    del old["extras"]
    upgraded = parse_document(json.dumps(old).encode())
    assert list(upgraded.surfaces) == ["hand"] and upgraded.extras["came from"] == 1


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"schema": "something.else"}, "is not a contact-core.document file"),
        ({"version": "1"}, "names no version"),
        ({"version": True}, "names no version"),
        ({"colour": 1}, "no field 'colour'"),
        ({"patches": 3}, "wants an object"),
        ({"patches": {"p": {"name": "p"}}}, "lacks the field"),
        ({"shapes": {}}, "which does not exist"),
        ({"surfaces": {}}, "which does not exist"),
        ({"groups": {"g": ["nobody"]}}, "'nobody', which does not exist"),
        ({"poses": {"nowhere": {"joints": [], "local": []}}}, "which does not exist"),
    ],
)
def test_what_does_not_fit_is_refused_in_words(change: dict[str, Any], says: str) -> None:
    data = json.loads(dump_document(random_document(2, 10)))
    with pytest.raises(FileRefused, match=says):
        parse_document(json.dumps(data | change).encode())


@pytest.mark.parametrize(
    ("field", "value", "says"),
    [
        ("anchors", [0.5], "whole numbers"),
        ("anchors", ["a"], "finite numbers"),
        ("anchors", "abc", "wants a list"),
        ("legs", [[1.0]], "pairs of numbers"),
        ("chain_starts", [0, 5], "does not fit"),
    ],
)
def test_arrays_are_checked(field: str, value: Any, says: str) -> None:
    data = json.loads(dump_document(random_document(2, 0)))
    shape = next(iter(data["shapes"].values()))
    shape["coordinates"][field] = value
    with pytest.raises(FileRefused, match=says):
        parse_document(json.dumps(data).encode())


@settings(max_examples=120, deadline=None)
@given(seed=st.integers(0, 50), where=st.floats(0, 1), bit=st.integers(0, 7))
def test_a_damaged_file_is_refused_or_is_a_document(seed: int, where: float, bit: int) -> None:
    """Nothing but FileRefused ever comes out of reading, whatever the bytes are."""
    raw = bytearray(dump_document(random_document(seed, 6)))
    raw[int(where * (len(raw) - 1))] ^= 1 << bit
    try:
        document = parse_document(bytes(raw))
    except FileRefused:
        return
    assert parse_document(dump_document(document)) is not None


@pytest.mark.parametrize("raw", [b"", b"{", b"[]", b"null", b"\xff\xfe", b'{"schema": NaN}', b"[" * 100_000])
def test_what_is_no_json_is_refused(raw: bytes) -> None:
    with pytest.raises(FileRefused):
        parse_document(raw)


def test_files_are_written_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "document.json"
    first = random_document(1)
    write_document(path, first)

    def fails(self: Path, data: bytes) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", fails)
    with pytest.raises(FileRefused, match="No space left"):
        write_document(path, random_document(2))
    monkeypatch.undo()
    assert same_documents(read_document(path)[0], first)
    assert [p.name for p in tmp_path.iterdir()] == ["document.json"]


def test_documents_and_their_maps_pickle_and_copy() -> None:
    document = random_document(7)
    for twin in (pickle.loads(pickle.dumps(document)), copy.deepcopy(document)):
        assert same_documents(twin, document)
    assert document.patches.with_item("x", document.patch(next(iter(document.patches)))) is not document.patches
    assert len(document.patches.without(*document.patches)) == 0


def test_integers_where_numbers_belong_change_nothing() -> None:
    ints = Patch("p", "s", "k", Root(0, (1, 0, 0), 1), along=2, color=(1, 0, 0))
    floats = Patch("p", "s", "k", Root(0, (1.0, 0.0, 0.0), 1.0 + 0j), along=2.0, color=(1.0, 0.0, 0.0))
    assert pretty(to_json(ints)) == pretty(to_json(floats))
    assert from_json(Patch, to_json(ints)) == floats


@pytest.mark.parametrize("name", ["", " thumb", "thumb\n", "x" * 201, "\x07"])
def test_names_are_printable(name: str) -> None:
    with pytest.raises(InvalidInput, match="printable"):
        Surface(name, "d", "t", 3, 1)


def test_what_is_missing_is_named_with_what_is_near() -> None:
    document = random_document(3)
    name = next(iter(document.patches))
    with pytest.raises(CommandRejected, match=f"no patch '{name}x'; near names: .*{name}"):
        document.patch(name + "x")
    with pytest.raises(CommandRejected, match="has no patch at all"):
        ContactDocument().patch("thumb")
