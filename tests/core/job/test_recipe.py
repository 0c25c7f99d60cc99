# ruff: noqa: E501  (a table of mistakes reads best in one row each)
"""Recipes: strict, and every mistake a sentence that names the file, the place and the cure."""

from __future__ import annotations

from pathlib import Path

import pytest

from contact_core.errors import FileRefused, InvalidInput
from contact_core.grasping.verdict import ACCEPT
from contact_core.recipe.reader import load_recipe, parse_recipe

GOOD = """
schema = 1
name = "ball"
[manipulator]
file = "hand.glb"
sha256 = "BC677831449400000000000000000000000000000000000000000000000000ff"
rig = "hand.rig.toml"
pose = { "index*" = [0, 0, 30], "thumb-1" = 20 }
[object]
sample = "baseball"
solids = ["surface", "hull"]
hull_box = { low = [-1, -1, -1], high = [1, 1, 1] }
center = [0, 0.1, 0]
[placer]
name = "from pose"
approach = [1, 0, 0]
close = ["index*"]
[[patch]]
name = "{joint} pad"
joints = ["index-tip", "thumb-tip"]
disk = { along = 0.6, radius = 0.007, points = 40 }
[[patch]]
name = "palm"
vertices = [1, 2, 3]
axis = { through = [{ vertex = 1 }, { position = [0, 0, 1] }] }
place = { root = { vertex = 7 }, aim = { position = [0, 1, 0] } }
[accept]
gap = 0.01
"""


def test_a_recipe_says_what_it_says() -> None:
    recipe = parse_recipe(GOOD, name="ball.toml")
    assert [patch.name for patch in recipe.patches] == ["index-tip pad", "thumb-tip pad", "palm"]
    tip, _, palm = recipe.patches
    assert tip.disk is not None and tip.disk.at.joint == "index-tip" and tip.disk.at.along == 0.6
    assert tip.disk.count == 40 and tip.generator is None and tip.place is None
    assert palm.vertices == (1, 2, 3) and palm.axis[1].position == (0.0, 0.0, 1.0)
    assert palm.place is not None and palm.place.aim is not None and palm.place.root.vertex == 7
    assert recipe.manipulators[0].source.sha256 is not None and recipe.manipulators[0].source.sha256.startswith(
        "bc67"
    )
    assert recipe.manipulators[0].pose == {"index*": (0.0, 0.0, 30.0), "thumb-1": (20.0,)}
    assert recipe.placer_options == {"approach": [1, 0, 0], "close": ["index*"]}
    assert recipe.accept == {"gap": 0.01} and set(recipe.accept) <= set(ACCEPT)
    assert recipe.objects[0].solids == ("surface", "hull") and recipe.objects[0].fill_high == (1.0, 1.0, 1.0)


MISTAKES = {
    "no schema": ("schema = 1", "", r"recipe needs 'schema'"),
    "a newer schema": ("schema = 1", "schema = 7", r"schema 7; this contact-core reads up to 1. Update"),
    "a misspelt key": ("center =", "centre =", r"object has no key 'centre'; did you mean 'center'"),
    "an unknown table": ("[accept]", "[expect]", r"recipe has no key 'expect'; it knows .*accept"),
    "two sources": ('sample = "baseball"', 'sample = "baseball"\nfile = "b.obj"', r"exactly one of 'file', 'sample', but got 'file' and 'sample'"),
    "no source": ('sample = "baseball"', "", r"exactly one of 'file', 'sample', but got none"),
    "a bad digest": ("BC67", "XY67", r"sha256 must be 64 hex digits"),
    "a word for a number": ("radius = 0.007", 'radius = "wide"', r"disk.radius must be a number above 0, but got 'wide'"),
    "a negative radius": ("radius = 0.007", "radius = -1", r"disk.radius must be a number above 0, but got -1"),
    "a boolean is no number": ("radius = 0.007", "radius = true", r"a number above 0, but got True"),
    "not a number": ("radius = 0.007", "radius = nan", r"a number above 0, but got nan"),
    "too few points": ("points = 40", "points = 2", r"a whole number from 3 to 20000, but got 2"),
    "a short vector": ("center = [0, 0.1, 0]", "center = [0, 0.1]", r"three numbers, but got \[0, 0.1\]"),
    "a zero direction": ("root = { vertex = 7 }, aim", "root = { vertex = 7 }, direction = [0,0,0], ain", r"ain|exactly one|not all zero"),
    "both ways to head": ("root = { vertex = 7 },", "root = { vertex = 7 }, direction = [1,0,0],", r"exactly one of 'direction', 'aim'"),
    "no place for the joint's name": ('"{joint} pad"', '"pad"', r"must hold \{joint\}"),
    "the same name twice": ('name = "palm"', 'name = "thumb-tip pad"', r"unique, but 'thumb-tip pad' comes twice"),
    "an unknown solid": ('"hull"]', '"inside"]', r"'surface' and 'hull', but got 'inside'"),
    "an unknown threshold": ("gap = 0.01", "gaps = 0.01", r"accept has no key 'gaps'; did you mean 'gap'"),
    "an axis of one point": ("{ vertex = 1 }, { position = [0, 0, 1] }", "{ vertex = 1 }", r"at least two points"),
    "patches that are no list": ('[[patch]]\nname = "{joint} pad"', '[patch]\nname = "{joint} pad"', r"is not TOML"),
    "points twice": ("vertices = [1, 2, 3]", "vertices = [1, 2, 3]\npositions = [[0,0,0]]", r"exactly one of 'vertices', 'positions', 'disk'"),
    "a fraction as a vertex": ("vertices = [1, 2, 3]", "vertices = [1.5]", r"a list of whole numbers"),
    "too many angles": ('"thumb-1" = 20', '"thumb-1" = [1,2,3,4]', r"one to three angles"),
    "no vertex": ("vertices = [1, 2, 3]", "vertices = []", r"vertices holds no point"),
    "a number that overflows": ("radius = 0.007", "radius = " + "9" * 400, r"disk.radius must be a number above 0, but got 9+..."),
    "a number that overflows when squared": ("center = [0,", "center = [1e300,", r"center must be three numbers"),
    "a number beyond Python's own": ("radius = 0.007", "radius = " + "9" * 5000, r"holds a number of more digits"),
    "such a number in base 16": ("radius = 0.007", "radius = 0x" + "f" * 5000, r"disk.radius must be .* but got a number without end"),
    "a vertex beyond the machine's numbers": ("vertices = [1, 2, 3]", f"vertices = [{2**63}]", r"a list of whole numbers"),
    "a direction that vanishes when squared": ("approach = [1, 0, 0]", 'approach = [1, 0, 0]\n[view]\nup = [0, 1e-200, 0]', r"view.up must be three numbers, not all zero"),
    "a sidecar of a sample": ('file = "hand.glb"\nsha256 = "BC677831449400000000000000000000000000000000000000000000000000ff"', 'sample = "human_hand"', r"rig goes with a file; the sample 'human_hand' has its own limits"),
    "half an iteration": ("[accept]", "[solve]\noptions = { max_iterations = 2.5 }\n[accept]", r"options.max_iterations must be a whole number"),
    "a tolerance of words": ("[accept]", '[solve]\noptions = { tolerance = "small" }\n[accept]', r"options.tolerance must be a number"),
    "a seed that is none": ("[accept]", "[solve]\noptions = { seed = -1 }\n[accept]", r"options.seed must be a whole number"),
    "candidates that are no words": ("[accept]", "[solve]\noptions = { candidates = [[1]] }\n[accept]", r"options.candidates must be a list of texts"),
    "not TOML": ("[accept]", "[accept", r"is not TOML"),
}  # fmt: skip


@pytest.mark.parametrize("mistake", MISTAKES)
def test_each_mistake_is_a_sentence_with_the_files_name(mistake: str) -> None:
    right, wrong, says = MISTAKES[mistake]
    assert GOOD.count(right) >= 1
    with pytest.raises(InvalidInput, match=says) as caught:
        parse_recipe(GOOD.replace(right, wrong, 1), name="ball.toml")
    assert str(caught.value).startswith("ball.toml")


def test_files_that_are_no_recipes(tmp_path: Path) -> None:
    with pytest.raises(FileRefused, match=r"cannot read the recipe .*none.toml"):
        load_recipe(tmp_path / "none.toml")
    binary = tmp_path / "picture.toml"
    binary.write_bytes(b"\x89PNG\xff\xfe")
    with pytest.raises(FileRefused, match="not UTF-8"):
        load_recipe(binary)
    large = tmp_path / "large.toml"
    large.write_bytes(b"#" * 5_000_000)
    with pytest.raises(FileRefused, match="too large"):
        load_recipe(large)


def test_a_byte_order_mark_and_windows_line_ends_change_nothing() -> None:
    assert parse_recipe("\ufeff" + GOOD.replace("\n", "\r\n"), name="ball.toml") == parse_recipe(
        GOOD, name="ball.toml"
    )


def test_settings_of_a_solver_of_its_own_pass_through() -> None:
    asked = '[solve]\noptions = { max_iterations = 3, candidates = "current", algorithm = "LD_MMA" }\n[accept]'
    options = parse_recipe(GOOD.replace("[accept]", asked), name="ball.toml").solve.options
    assert options == {"max_iterations": 3, "candidates": ("current",), "algorithm": "LD_MMA"}
