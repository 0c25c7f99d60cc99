"""The document on disk: deterministic, complete, checked, refused in words where it cannot be read."""

from __future__ import annotations

import copy
import json
import os
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.arrays import all_finite
from contact_core.contact.placement import Root
from contact_core.document import schema, shape_texts
from contact_core.document.codec import from_json, pretty, to_json
from contact_core.document.document import ContactDocument, Patch, Surface
from contact_core.document.frozen_map import FrozenMap
from contact_core.document.schema import (
    document_digest,
    dump_document,
    parse_document,
    parse_edited,
    same_documents,
)
from contact_core.edit.commands import Recolor
from contact_core.edit.recovery import open_file, read_document, write_document
from contact_core.errors import CommandRejected, EditedFile, FileRefused, InvalidInput
from contact_core.testing.random_commands import random_document


@settings(max_examples=40)
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


@settings(max_examples=20)
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


@settings(max_examples=15)
@given(seed=st.integers(0, 10**6))
def test_what_is_kept_of_the_text_changes_no_byte(seed: int) -> None:
    document = random_document(seed)
    data = {"digest": document_digest(document), **schema.document_to_json(document)}
    assert dump_document(document).decode() == pretty(data) + "\n"
    assert dump_document(copy.deepcopy(document)) == dump_document(document)


@settings(max_examples=15)
@given(seed=st.integers(0, 10**6))
def test_what_was_read_is_written_again_without_encoding_what_nobody_changed(seed: int) -> None:
    """The texts of its shapes are those of the file; a changed one is encoded, and no byte differs."""
    written = dump_document(random_document(seed))
    document = parse_document(written)
    with pytest.MonkeyPatch.context() as patched:
        encoded: list[Any] = []
        real = shape_texts.shape_to_json
        patched.setattr(shape_texts, "shape_to_json", lambda shape: (encoded.append(shape), real(shape))[1])
        assert dump_document(document) == written and not encoded
        for key, shape in list(document.shapes.items())[:1]:
            changed = document.with_shape(key, replace(shape, meters_per_unit=2.0 * shape.meters_per_unit))
            raw = dump_document(changed)
            assert encoded == [changed.shapes[key]]
            assert raw == dump_document(copy.deepcopy(changed))  # of which no text is kept


@pytest.mark.parametrize("name", ["s", 'a": {', '\\": ', '"shapes": {', "},", "ü", shape_texts.CUT])
def test_shapes_are_cut_out_whatever_they_are_called(name: str) -> None:
    """Names that look like the layout, in the place of a key and in the notes of a host."""
    document = random_document(3)
    shapes = {f"{name}{k}": shape for k, shape in enumerate(document.shapes.values())}
    keys = dict(zip(document.shapes, shapes, strict=True))
    patches = {key: replace(patch, shape=keys[patch.shape]) for key, patch in document.patches.items()}
    extras = FrozenMap({"host": FrozenMap({"shapes": FrozenMap({name: 1})})})
    named = replace(document, shapes=FrozenMap(shapes), patches=FrozenMap(patches), extras=extras)
    raw = dump_document(named)
    assert same_documents(parse_document(raw), named)
    assert dump_document(parse_document(raw)) == raw
    assert same_documents(parse_document(json.dumps(json.loads(raw)).encode()), named)


def test_a_shape_that_is_there_twice_is_refused() -> None:
    """Cut out or not: a file that says two things at once is none."""
    raw = dump_document(random_document(3)).decode()
    start = raw.index('\n "shapes": {\n') + len('\n "shapes": {\n')
    piece = raw[start : raw.index("\n  }", start)] + "\n  },\n"
    with pytest.raises(FileRefused, match="twice"):
        parse_document((raw[:start] + piece + raw[start:]).encode())


def test_it_is_made_for_review() -> None:
    """One edit changes one line and the digest, no line is longer than a matrix, and it is plain JSON."""
    document = random_document(5, 40)
    assert document.poses
    name = next(iter(document.patches))
    edited = Recolor((name,), (0.125, 0.25, 0.5)).apply(document)
    before, after = dump_document(document).decode().splitlines(), dump_document(edited).decode().splitlines()
    assert len(before) == len(after)
    assert sum(a != b for a, b in zip(before, after, strict=True)) == 2
    assert max(map(len, before)) < 400
    assert json.loads("\n".join(before))["schema"] == "contact-core.document"


@settings(max_examples=200)
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
    old["digest"], old["version"], old["meshes"] = None, 1, old.pop("surfaces")
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
        ("legs", [[1.0, 2.0], 3.0], "pairs of numbers"),
        ("legs", [["1.0", "2.0"]], "finite numbers"),
        ("legs", [[1.0, 10**400]], "finite numbers"),
        ("chain_starts", [0, 5], "does not fit"),
    ],
)
def test_arrays_are_checked(field: str, value: Any, says: str) -> None:
    data = json.loads(dump_document(random_document(2, 0)))
    shape = next(iter(data["shapes"].values()))
    shape["coordinates"][field] = value
    with pytest.raises(FileRefused, match=says):
        parse_document(json.dumps(data).encode())


@pytest.mark.parametrize("size", [1, 7, 5000])
def test_finite_arrays_are_told_from_others(size: int) -> None:
    """Also where squares overflow, and where not every number lies beside the next."""
    for dtype in (np.float64, np.complex128):
        array = np.full(size, 1e200, dtype)
        assert all_finite(array) and all_finite(array[::2]) and all_finite(array[:0])
        for wrong in (np.nan, np.inf, -np.inf):
            array[-1] = wrong
            assert not all_finite(array) and not all_finite(array[::-1])


@settings(max_examples=25)
@given(seed=st.integers(0, 50), data=st.data())
def test_no_damaged_file_is_read_as_another_document(seed: int, data: st.DataObject) -> None:
    """Flips, holes, cuts and swaps: what is read in spite of them is what was written (white space was hit)."""
    document = random_document(seed, 6)
    sound = dump_document(document)
    for _ in range(40):
        raw = bytearray(sound)
        start = data.draw(st.integers(0, len(raw) - 1))
        length = data.draw(st.integers(1, 300))
        kind = data.draw(st.sampled_from(["flip", "hole", "cut", "gone", "twice"]))
        if kind == "flip":
            raw[start] ^= 1 << data.draw(st.integers(0, 7))
        elif kind == "hole":
            raw[start : start + length] = bytes(len(raw[start : start + length]))
        elif kind == "cut":
            del raw[start:]
        elif kind == "gone":
            del raw[start : start + length]
        else:
            raw[start:start] = raw[start : start + length]
        try:
            found = parse_document(bytes(raw))
        except FileRefused:
            continue
        assert dump_document(found) == sound, (kind, start, length)


@settings(max_examples=20)
@given(seed=st.integers(0, 10**6))
def test_the_digest_is_that_of_the_content_whatever_the_layout(seed: int) -> None:
    document = random_document(seed)
    raw = dump_document(document)
    digest = document_digest(document)
    assert len(digest) == 64 and json.loads(raw)["digest"] == digest
    for text in (raw, raw.replace(b"\n", b"\r\n"), json.dumps(json.loads(raw)).encode()):
        assert document_digest(parse_document(text)) == digest
    edited = Recolor((next(iter(document.patches)),), (0.125, 0.25, 0.5)).apply(document)
    assert (document_digest(edited) == digest) == (dump_document(edited) == raw)


def test_the_digest_is_the_same_in_another_process(repository: Path) -> None:
    """Neither the seed of hashes nor what was read before it changes it: hosts store it."""
    path = repository / "tests" / "golden" / "document-v1.json"
    code = (
        "import sys; from pathlib import Path\n"
        "from contact_core.document.schema import document_digest, parse_document\n"
        "print(document_digest(parse_document(Path(sys.argv[1]).read_bytes())))"
    )
    told = {
        subprocess.run([sys.executable, "-c", code, str(path)], env={**os.environ, "PYTHONHASHSEED": seed},
                       capture_output=True, text=True, check=True).stdout.strip()
        for seed in ("1", "2")
    }  # fmt: skip
    assert told == {json.loads(path.read_bytes())["digest"]}


@pytest.mark.parametrize("digest", ["0" * 64, "", 7, "absent"])
def test_a_file_edited_by_hand_is_refused_with_a_way_out_and_accepted_on_request(digest: Any) -> None:
    data = json.loads(dump_document(random_document(2, 10)))
    name = next(iter(data["patches"]))
    data["patches"][name]["weight" if "weight" in data["patches"][name] else "along"] = 0.25
    if digest == "absent":
        del data["digest"]
    else:
        data["digest"] = digest
    raw = json.dumps(data).encode()
    with pytest.raises(EditedFile, match=r"`contact accept FILE`.*`contact replay FILE\.journal --out NEW`"):
        parse_document(raw)
    accepted = dump_document(parse_edited(raw))
    believed = parse_document(json.dumps({**data, "digest": None}).encode())
    assert accepted == dump_document(parse_document(accepted)) == dump_document(believed)
    with pytest.raises(FileRefused, match="no field"):
        parse_edited(json.dumps({**data, "colour": 1}).encode())


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


@settings(max_examples=30)
@given(seed=st.integers(0, 10**6), other=st.integers(0, 10**6))
def test_documents_are_the_same_exactly_where_their_files_are(seed: int, other: int) -> None:
    a, b = random_document(seed), random_document(other)
    for x, y in ((a, copy.deepcopy(a)), (a, b), (a, replace(a, extras=b.extras)), (a, replace(b, shapes=a.shapes))):
        assert same_documents(x, y) == (dump_document(x) == dump_document(y))
