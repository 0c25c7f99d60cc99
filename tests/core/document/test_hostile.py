"""Documents that no release of this package wrote: each is refused in a sentence, and soon."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest

from contact_core.document.codec import MAX_DEPTH
from contact_core.document.document import check_name
from contact_core.document.schema import dump_document, inconsistencies, parse_document
from contact_core.errors import FileRefused, InvalidInput
from contact_core.testing.random_commands import random_document

Data = dict[str, Any]
Change = Callable[[Data], object]


def link(parent: str) -> Data:
    return {"is": "Link", "parent": parent, "direction": 0.0, "lengths": [1.0], "turns": [], "heading": 0.0}


def together(data: Data, parents: dict[int, int]) -> None:
    """The k-th patch is a child of the given one; all lie on one surface."""
    names = list(data["patches"])
    surface = data["patches"][names[0]]["surface"]
    for child, parent in parents.items():
        data["patches"][names[child]] |= {"surface": surface, "placement": link(names[parent])}
        data["patches"][names[parent]]["surface"] = surface


def first(items: Data) -> Data:
    found: Data = next(iter(items.values()))
    return found


def nested(levels: int) -> Any:
    value: Any = 1
    for _ in range(levels):
        value = [value]
    return value


BARYCENTRIC = [1.0, 0.0, 0.0]
CHANGES: list[tuple[str, Change]] = [
    ("is its own ancestor", lambda d: together(d, {0: 0})),
    ("is its own ancestor", lambda d: together(d, {0: 1, 1: 0})),
    ("is its own ancestor", lambda d: together(d, {0: 1, 1: 2, 2: 3, 3: 1})),
    ("which does not exist", lambda d: first(d["patches"]).update(placement=link("nobody"))),
    ("past its axis", lambda d: (together(d, {0: 1}), first(d["patches"])["placement"].update(parent_point=99))),
    ("past its axis", lambda d: (together(d, {0: 1}), first(d["patches"])["placement"].update(own_point=99))),
    ("each once", lambda d: d["groups"].update(g=2 * list(d["patches"])[:1])),
    ("each once", lambda d: d["groups"].update(g=[])),
    ("no name for a group", lambda d: d["groups"].update({"\x1b[2J": list(d["patches"])})),
    ("no name for a namespace", lambda d: d["extras"].update({"": 1})),
    ("no name for a namespace", lambda d: d["extras"].update({"x" * 1000: 1})),
    (f"at most {MAX_DEPTH} levels", lambda d: d["extras"].update(deep=nested(300))),
    ("at most 64 bits", lambda d: d["extras"].update(large=10**4000)),
    ("is rooted in face", lambda d: first(d["patches"])["placement"].update(face=10**30)),
    ("cannot have -5 points", lambda d: first(d["surfaces"]).update(points=-5)),
    ("names a joint twice", lambda d: d["poses"].update({next(iter(d["surfaces"])): {
        "joints": ["a", "a"], "local": 2 * [[[float(i == j) for j in range(4)] for i in range(4)]]}})),
    ("does not fit", lambda d: first(d["shapes"])["coordinates"].update(anchors=[2**63])),
    ("does not fit", lambda d: first(d["shapes"]).update(weights=nested(70))),
    ("wants 3 items", lambda d: first(d["patches"]).update(color=[0.0] * 4)),
    ("is filed under", lambda d: d["patches"].update({"other": first(d["patches"])})),
    ("twice", lambda d: d["pairs"].update(
        x={"name": "x", "manipulator": next(iter(d["patches"])), "object": next(iter(d["patches"]))})),
]  # fmt: skip


@pytest.mark.parametrize(("says", "change"), CHANGES, ids=[f"{k}-{says}" for k, (says, _) in enumerate(CHANGES)])
def test_contradictions_are_named(says: str, change: Change) -> None:
    data = json.loads(dump_document(random_document(5, 30)))
    data["digest"] = None
    assert parse_document(json.dumps(data).encode()) is not None and len(data["patches"]) >= 4
    change(data)
    with pytest.raises(FileRefused, match=says):
        parse_document(json.dumps(data).encode())


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('"patches": {', '"patches": {}, "patches": {', "names 'patches' twice"),
        ('"mirrored": ', '"mirrored": true, "mirrored": ', "names 'mirrored' twice"),
        ('"weight": ', '"weight": NaN, "w": ', "not a number that a document may hold"),
        ('"spread": 1.0', '"spread": 1e999', "wants a finite number, but got inf"),
        # from Python 3.12 on the JSON reader takes deeper data, and the document's own bound refuses it
        ('"extras": {', '"extras": {"x": ' + 5000 * "[" + 5000 * "]" + ", ", "not valid JSON|at most 100 levels"),
    ],
)
def test_text_that_only_looks_like_a_document_is_refused(old: str, new: str, says: str) -> None:
    text = json.dumps(json.loads(dump_document(random_document(5, 30))))
    assert old in text
    with pytest.raises(FileRefused, match=says):
        parse_document(text.replace(old, new, 1).encode())


def test_checking_a_long_chain_costs_its_length(monkeypatch: pytest.MonkeyPatch) -> None:
    """Looked up are a few patches for each patch, not all those above it."""
    data = json.loads(dump_document(random_document(2, 0)))
    name, patch = next(iter(data["patches"].items()))
    data["digest"], count = None, 800
    for number in range(count):
        parent = f"q{number - 1}" if number else name
        data["patches"][f"q{number}"] = patch | {"name": f"q{number}", "original": False, "placement": link(parent)}
    document = parse_document(json.dumps(data).encode())
    kind, looked_up = type(document.patches), []
    real = kind.__getitem__
    monkeypatch.setattr(kind, "__getitem__", lambda self, key: (looked_up.append(key), real(self, key))[1])
    assert list(inconsistencies(document)) == []
    assert len(looked_up) <= 10 * count


@pytest.mark.parametrize("name", ["", " a", "a\0b", "a" * 10_000, "\x1b" * 10_000])
def test_a_name_that_is_none_is_told_in_a_short_sentence(name: str) -> None:
    with pytest.raises(InvalidInput, match="printable characters") as refusal:
        check_name(name, "a surface")
    assert len(str(refusal.value)) < 200


@pytest.mark.parametrize("value", ["a" * 100_000, [1] * 10_000, {"is": "b" * 100_000}])
@pytest.mark.parametrize("field", ["surface", "placement", "original", "name"])
def test_what_came_is_cut_to_a_sentence(field: str, value: Any) -> None:
    data = json.loads(dump_document(random_document(2, 20)))
    data["digest"] = None
    first(data["patches"])[field] = value
    with pytest.raises(FileRefused) as refusal:
        parse_document(json.dumps(data).encode())
    assert len(str(refusal.value)) < 1000
