"""What the contract suites ask of the settings of whatever has some."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import pytest

from contact_core.errors import InvalidInput
from contact_core.settings import Setting, configured, declaration_mistakes, settings_of

WRONG: dict[str, tuple[Any, ...]] = {
    "number": ("much", True, math.nan, [1.0]),
    "count": (1.5, "many", True),
    "flag": (1, "yes"),
    "text": (3, ["a"]),
    "choice": ("no such choice", 3),
    "vector": ((1.0, 2.0), "xyz", (math.inf, 0.0, 0.0)),
    "texts": ("one", (1, 2)),
    "numbers": ("one", ("a",), (math.nan,)),
}


def check_settings(thing: object) -> None:
    """Its settings are declared in full; values within their ranges are kept, and all others refused in words.

    A thing that is no dataclass, or has no field made by `setting`, has none; then every name is refused.
    """
    assert declaration_mistakes(thing) == []
    _refused(thing, "no_such_setting", 1)
    for each in settings_of(thing):
        kept = getattr(configured(thing, {each.name: each.default}, "it"), each.name)
        assert kept == each.default, f"{each.name} is {kept!r} where {each.default!r} was given"
        for value in WRONG[each.kind]:
            _refused(thing, each.name, value)
        if not each.optional:
            _refused(thing, each.name, None)
        for value, allowed in _at_the_bounds(each):
            if allowed:
                assert getattr(configured(thing, {each.name: value}, "it"), each.name) == value
            else:
                _refused(thing, each.name, value)
                with pytest.raises(InvalidInput):  # made without a manager, it is checked all the same
                    dataclasses.replace(thing, **{each.name: value})  # type: ignore[type-var]


def _at_the_bounds(each: Setting) -> list[tuple[Any, bool]]:
    """Values at the ends of a range and just beyond, and whether they are allowed."""
    if each.kind not in ("number", "count"):
        return []
    step = 1 if each.kind == "count" else 0.5
    found: list[tuple[Any, bool]] = []
    if each.low is not None:
        found += [(each.low, True), (each.low - step, False)]
    if each.high is not None:
        found += [(each.high, True), (each.high + step, False)]
    if each.above is not None:
        found += [(each.above, False)]
    return [(int(value) if each.kind == "count" else float(value), allowed) for value, allowed in found]


def _refused(thing: object, name: str, value: Any) -> None:
    with pytest.raises(InvalidInput) as refusal:
        configured(thing, {name: value}, "it")
    assert len(str(refusal.value).split()) >= 4 and name in str(refusal.value), str(refusal.value)
