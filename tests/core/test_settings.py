"""Settings that declare themselves: what is declared, what is kept, what is refused and in which words."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError, dataclass
from typing import Any, ClassVar, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from contact_core.errors import InvalidInput
from contact_core.settings import HasSettings, configured, declaration_mistakes, setting, settings_of
from contact_core.solve.solver import SolveOptions
from contact_core.testing.settings_checks import check_settings


@dataclass(frozen=True)
class Many(HasSettings):
    """One setting of every kind, and data beside them."""

    name: ClassVar[str] = "many"
    reach: float = setting(0.5, low=0.0, high=1.0, unit="mm", help="how far it reaches")
    rounds: int = setting(3, low=1, high=10, help="how often it goes round")
    exact: bool = setting(False, help="whether it takes its time")
    title: str = setting("x", help="what it is called")
    kind: Literal["soft", "hard"] = setting("soft", help="which kind of edge")
    axis: tuple[float, float, float] = setting((0.0, 0.0, 1.0), help="which way it looks")
    joints: tuple[str, ...] = setting((), help="patterns of joint names")
    weights: tuple[float, ...] = setting((1.0,), low=0.0, help="one for each term")
    limit: float | None = setting(None, above=0.0, help="none lets it decide")
    points: list[int] | None = None  # data, which no panel shows


def test_every_kind_is_declared_and_checked() -> None:
    check_settings(Many())
    check_settings(SolveOptions())
    kinds = [(each.name, each.kind, each.optional) for each in settings_of(Many)]
    assert kinds == [
        ("reach", "number", False), ("rounds", "count", False), ("exact", "flag", False), ("title", "text", False),
        ("kind", "choice", False), ("axis", "vector", False), ("joints", "texts", False),
        ("weights", "numbers", False), ("limit", "number", True),
    ]  # fmt: skip
    reach = settings_of(Many)[0]
    assert (reach.default, reach.low, reach.high, reach.unit) == (0.5, 0.0, 1.0, "mm")
    assert settings_of(Many)[4].choices == ("soft", "hard")
    assert settings_of(Many(reach=0.25))[0].default == 0.25


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"reach": 2.0}, "it: reach is at most 1 mm, but got 2."),
        ({"reach": -1}, "it: reach is at least 0 mm, but got -1."),
        ({"reach": math.nan}, "it: reach is finite, but got nan."),
        ({"reach": "far"}, "it: reach is a number, but got 'far'."),
        ({"reach": True}, "it: reach is a number, but got True."),
        ({"rounds": 1.5}, "it: rounds is a whole number, but got 1.5."),
        ({"kind": "sharp"}, "it: kind is one of soft, hard, but got 'sharp'."),
        ({"axis": [1, 2]}, "it: axis is three numbers, but got [1, 2]."),
        ({"joints": "thumb*"}, "it: joints is a list of texts, but got 'thumb*'."),
        ({"limit": 0}, "it: limit is above 0, but got 0."),
        ({"reech": 1}, "it has no setting 'reech'; did you mean 'reach'?"),
    ],
)
def test_what_does_not_fit_is_a_sentence(given: dict[str, Any], says: str) -> None:
    with pytest.raises(InvalidInput) as refusal:
        configured(Many, given, "it")
    assert str(refusal.value) == says
    if "reech" not in given:  # and without a manager, too
        with pytest.raises(InvalidInput, match="many: "):
            Many(**given)


def test_values_come_out_as_the_setting_holds_them() -> None:
    made = configured(Many, {"reach": 1, "axis": [1, 0, 0], "joints": ["a", "b"], "points": [1]}, "it")
    assert (made.reach, made.axis, made.joints, made.points) == (1.0, (1.0, 0.0, 0.0), ("a", "b"), [1])
    assert isinstance(made.reach, float)
    again = configured(made, {"reach": 0.25}, "it")
    assert (again.reach, again.axis) == (0.25, made.axis) and made.reach == 1.0
    with pytest.raises(FrozenInstanceError):
        made.reach = 0.0  # type: ignore[misc]


@given(
    st.dictionaries(st.sampled_from([*(each.name for each in settings_of(Many)), "other"]), st.from_type(object))
)
def test_whatever_is_given_it_is_made_or_refused_in_words(given: dict[str, Any]) -> None:
    try:
        made = configured(Many, given, "it")
    except InvalidInput as error:
        assert str(error).startswith("it") and str(error).endswith((".", "?"))
    else:
        assert configured(made, {each.name: each.default for each in settings_of(made)}, "it") == made


def test_wrong_declarations_are_named() -> None:
    @dataclass(frozen=True)
    class Odd(HasSettings):
        when: complex = setting(1j, help="no panel shows this")

    @dataclass
    class Loose:
        far: float = setting(3.0, high=1.0, help="far")

    assert "'when' of Odd is annotated" in declaration_mistakes(Odd)[0]
    mistakes = " ".join(declaration_mistakes(Loose))
    for part in ("no frozen dataclass", "HasSettings", "three words", "refuses its own default: far is at most"):
        assert part in mistakes
