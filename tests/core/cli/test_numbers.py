"""What is no finite number is refused at the command line, whichever option it is for."""

from __future__ import annotations

import argparse
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from contact_core.cli import main
from contact_core.cli.numbers import finite
from contact_core.errors import InvalidInput
from contact_core.grasping.searching import GraspSettings

HAND_AND_BALL = ["grasp", "sample:human_hand", "sample:baseball"]


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_finite_numbers_pass(number: float) -> None:
    assert finite(repr(number)) == number


@pytest.mark.parametrize("text", ["nan", "inf", "-inf", "1e999", "", "x" * 10_000])
def test_others_are_a_short_sentence(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match="a finite number was expected") as refusal:
        finite(text)
    assert len(str(refusal.value)) < 150


@pytest.mark.parametrize(
    "arguments",
    [
        [*HAND_AND_BALL, "--at", "nan", "0", "0"],
        [*HAND_AND_BALL, "--scale", "inf"],
        ["motion", "x.usda", "--tolerance", "nan"],
        ["motion", "x.usda", "--skate", "nan"],
        ["batch", "x.toml", "--limit", "nan"],
    ],
)
def test_every_option_asks_for_finite_numbers(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main([*arguments, "--out", "never"])
    assert end.value.code == 2 and "a finite number was expected" in capsys.readouterr().err


def test_a_script_gets_the_same_for_the_place_of_a_grasp() -> None:
    with pytest.raises(InvalidInput, match="three finite numbers"):
        GraspSettings(at=(math.nan, 0.0, 0.0))
