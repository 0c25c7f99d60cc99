"""The file of a grasp: what is written is read, and whatever else is in a file is refused in a sentence."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.document.library import ContactSet
from contact_core.errors import FileRefused
from contact_core.library.record import MAX_BYTES, Grasp, dump_grasp, parse_grasp

Saved = tuple[Grasp, ContactSet]


def test_what_is_written_is_read(saved: Saved) -> None:
    text = dump_grasp(saved[0])
    again = parse_grasp(text.encode(), "a grasp")
    assert dump_grasp(again) == text
    assert np.array_equal(again.placed, saved[0].placed) and again.tags == ("ball", "test")
    assert again.touching == saved[0].touching and "thumb" in again.touching


JUNK: st.SearchStrategy[Any] = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(2**70), 2**70),
    st.floats(allow_nan=False),
    st.text(max_size=5),
    st.lists(st.floats(-2, 2), max_size=4),
    st.dictionaries(st.text(max_size=3), st.integers(), max_size=2),
)


def _leaves(data: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    found = [at] if at else []
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, item in items:
        found += _leaves(item, (*at, key))
    return found


@settings(max_examples=40)
@given(st.data())
def test_a_spoilt_file_is_refused_or_still_a_grasp(saved: Saved, data: st.DataObject) -> None:
    content = json.loads(dump_grasp(saved[0])) | {"digest": None}
    *path, last = data.draw(st.sampled_from(_leaves(content)))
    inner = content
    for key in path:
        inner = inner[key]
    if data.draw(st.booleans()) and isinstance(inner, dict):
        del inner[last]
    else:
        inner[last] = data.draw(JUNK)
    try:
        found = parse_grasp(json.dumps(content).encode(), "spoilt")
    except FileRefused as refused:
        assert "spoilt" in str(refused)
    else:  # what is taken is whole: it can be written and read again
        assert dump_grasp(parse_grasp(dump_grasp(found).encode(), "again")) == dump_grasp(found)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"version": 99}, "install a newer"),
        ({"schema": "contact-core.document"}, "is not a contact-core.grasp file"),
        ({"surprise": 1}, "has no field"),
        ({"kind": "claw"}, "is one of"),
        ({"placed": np.diag([2.0, 1.0, 1.0, 1.0]).tolist()}, "turns and moves"),
    ],
)
def test_what_does_not_fit_is_said(saved: Saved, change: dict[str, Any], words: str) -> None:
    content = json.loads(dump_grasp(saved[0])) | {"digest": None} | change
    with pytest.raises(FileRefused, match=words):
        parse_grasp(json.dumps(content).encode(), "a file")


def test_a_file_of_any_size_is_not_read() -> None:
    with pytest.raises(FileRefused, match="at most"):
        parse_grasp(b" " * (MAX_BYTES + 1), "a file")
