"""From two files to grasps: the same for the same seed, ordinary documents, one undo step, and no surprises."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from contact_builtins.samples.fields import chain, cylinder, union, without
from contact_builtins.samples.modelling import surface_of
from contact_core.cli import main
from contact_core.document.schema import parse_document as load_document
from contact_core.errors import Cancelled, InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.grasp_files.grasp import HAND, OBJECT, grasp, prepare
from contact_core.grasping.finishing import Suggestion
from contact_core.grasping.loops import digits_through, loops_near
from contact_core.grasping.pads import remark_on_size
from contact_core.grasping.searching import GraspSettings
from contact_core.grasping.slots import lacks
from contact_core.grasping.suggest import ranked, suggest
from contact_core.grasping.verbs import grasp_scene
from contact_core.plugins.manager import PluginManager
from contact_core.progress import CallbackProgress
from contact_core.rig.poses import posed_world
from contact_core.session import Session

SETTINGS = GraspSettings(count=2, sampler_settings={"places": 30, "most": 160})


@pytest.fixture(scope="module")
def session() -> Session:
    return prepare("sample:human_hand", "sample:baseball", 1.0, PluginManager()).session


@pytest.fixture(scope="module")
def found(session: Session) -> list[Suggestion]:
    return list(session.suggest(HAND, OBJECT, settings=SETTINGS))


def test_grasps_pass_and_are_accepted_as_one_step(session: Session, found: list[Suggestion]) -> None:
    assert len(found) == 2 and found[0].is_grasp, [one.verdict.failures for one in found]
    before, revision = session.document, session.revision
    session.accept(found[0].proposal)
    document = session.document
    assert len(document.pairs) >= 4 and HAND in document.poses
    assert {pair.object for pair in document.pairs.values()} <= set(document.patches)
    session.undo()
    assert session.document == before or session.document.pairs == before.pairs
    assert session.revision == revision or not session.document.pairs


def test_what_fails_ranks_below_what_passes_however_well_it_scores(found: list[Suggestion]) -> None:
    good, better = found
    bad = replace(better, score=good.score + 9.0, verdict=replace(good.verdict, failures=("it slips.",)))
    worse = replace(bad, score=good.score - 1.0)
    assert ranked([worse, bad, good]) == [good, bad, worse]


def test_a_grasp_is_no_other(found: list[Suggestion]) -> None:
    assert np.abs(found[0].seen - found[1].seen).mean() > 1e-3 * np.abs(found[0].seen).mean()


def test_the_same_seed_gives_the_same_grasps(session: Session, found: list[Suggestion]) -> None:
    again = next(iter(session.suggest(HAND, OBJECT, settings=SETTINGS)))
    assert again.score == found[0].score
    assert np.array_equal(again.skin.points, found[0].skin.points)


def test_a_hand_in_centimetres_grasps_as_one_in_metres(session: Session, found: list[Suggestion]) -> None:
    rig = session.rigs[HAND]
    local, bind = rig.rest_local.copy(), rig.bind_world.copy()
    local[:, :3, 3] *= 100.0
    bind[:, :3, 3] *= 100.0
    larger = replace(
        rig, rest_local=local, bind_world=bind, bind_points=100.0 * rig.bind_points, meters_per_unit=0.01
    )
    with Session(plugins=session.plugins) as other:
        other.surfaces.add(HAND, larger.surface, meters_per_unit=0.01, rig=larger)
        other.surfaces.add(OBJECT, session.geometry.mesh(OBJECT))
        first = next(iter(other.suggest(HAND, OBJECT, settings=SETTINGS)))
    assert first.kind == found[0].kind and first.is_grasp, first.verdict.failures
    assert first.score == pytest.approx(found[0].score, abs=0.02)  # of searches that part in their last bits


def test_who_cancels_gets_nothing_written(tmp_path: Path) -> None:
    def stop(fraction: float | None, text: str) -> None:
        if text.startswith("Solving"):
            raise Cancelled("stop.")

    with pytest.raises(Cancelled, match="nothing was written"):
        grasp("sample:human_hand", "sample:baseball", tmp_path / "out", SETTINGS, progress=CallbackProgress(stop))
    assert not (tmp_path / "out").exists()


def test_the_command_writes_documents_that_load(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    line = ["grasp", "sample:human_hand", "sample:baseball", "--count", "1", "--kind", "power", "--out", str(out)]
    assert main([*line, "--check", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)["report"]
    assert report["summary"].startswith("1 good grasp")
    (entry,) = report["grasps"]
    document = load_document((out / entry["files"]["document"]).read_bytes())
    assert len(document.pairs) >= 4
    assert (out / "sheet.png").stat().st_size > 5000 and (out / entry["files"]["model"]).stat().st_size > 5000
    assert json.loads((out / "report.json").read_text(encoding="utf-8"))["grasps"] == report["grasps"]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["sample:baseball", "sample:human_hand"], "no skeleton"),
        (["sample:human_hand", "sample:mug", "--kind", "grip"], "a grasp is one of power"),
        (["sample:human_hand", "sample:mug", "--count", "0"], "from 1 to 64"),
        (["sample:human_hand", "sample:mug", "--seed", "-1"], "the seed is"),
        (["sample:human_hand", "sample:mug", "--scale", "1e9"], "lengths of the manipulator"),
    ],
)
def test_what_cannot_be_done_is_told_in_a_sentence(
    words: list[str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["grasp", *words, "--out", str(tmp_path / "out")]) == 2
    assert told in capsys.readouterr().err


def test_only_a_hand_can_grasp(session: Session) -> None:
    with pytest.raises(InvalidInput, match="no hand"):
        next(iter(session.suggest(OBJECT, HAND)))
    with pytest.raises(InvalidInput, match="bends"):
        next(iter(session.suggest(HAND, HAND)))


def test_a_key_is_held_between_the_thumb_and_the_side_of_the_first_finger() -> None:
    session = prepare("sample:human_hand", "sample:scissors", 1.0, PluginManager()).session
    few = {"places": 30, "most": 200}
    settings = GraspSettings(count=1, kinds=("lateral",), sampler_settings=few)
    (found,) = session.suggest(HAND, OBJECT, settings=settings)
    assert found.is_grasp and found.kind == "lateral", found.verdict.failures
    hand = grasp_scene(session, HAND, OBJECT).hand
    assert hand.side_pad is not None
    session.accept(found.proposal)
    touching = {pair.manipulator for pair in session.document.pairs.values()}
    assert touching == {hand.side_pad.name, "thumb tip"}


def test_a_hand_without_a_thumb_is_told_what_it_cannot(session: Session) -> None:
    scene = grasp_scene(session, HAND, OBJECT)
    fingers = replace(scene, hand=replace(scene.hand, thumb=-1))
    for kind in ("lateral", "pinch", "precision"):
        assert lacks(scene.hand, kind) is None
        with pytest.raises(InvalidInput, match=f"a {kind} grasp needs a thumb"):
            next(suggest(fingers, GraspSettings(1, (kind,))))


def test_a_place_that_is_not_on_the_object_is_refused(session: Session) -> None:
    for far in ((1e9, 0.0, 0.0), (0.0, -3.0, 0.0)):
        with pytest.raises(InvalidInput, match="hand lengths away from the object"):
            next(suggest(grasp_scene(session, HAND, OBJECT), GraspSettings(1, at=far)))


@pytest.mark.parametrize(("scale", "word"), [(100.0, "thick"), (0.05, "of the hand's length"), (1.0, "large")])
def test_an_object_of_a_wrong_size_is_told(scale: float, word: str) -> None:
    session = prepare("sample:human_hand", "sample:baseball", scale, PluginManager()).session
    assert word in remark_on_size(grasp_scene(session, HAND, OBJECT))


def test_scissors_take_the_thumb_in_one_loop_and_a_finger_in_the_other() -> None:
    session = prepare("sample:human_hand", "sample:scissors", 1.0, PluginManager()).session
    scene, between = grasp_scene(session, HAND, OBJECT), (0.0, -0.062, 0.0)
    loops = loops_near(scene.mesh, scene.hand.length, np.array(between))
    assert sorted(np.sign(loop.middle[0]) for loop in loops) == [-1.0, 1.0], "two loops, and no crotch of blades"
    assert all(abs(loop.way[2]) > 0.98 for loop in loops)
    found = max(suggest(scene, GraspSettings(8, kinds=("precision",), at=between)), key=lambda each: each.score)
    assert found.is_grasp, found.verdict.failures
    posed = scene.object_from_rig @ posed_world(scene.rig, found.proposal.poses[HAND])
    (through,) = digits_through(scene.hand, posed[scene.hand.joints][None], loops)
    thumbs = [bool(each[scene.hand.thumb]) for each in through]
    assert sorted(thumbs) == [False, True], "the thumb is in one of them"
    assert through[thumbs.index(False)].any(), "and a finger in the other"


def pitcher() -> TriangleMesh:
    """20 cm tall, with a handle of 11 cm that takes four fingers."""
    body = without(
        cylinder([0, 0.1, 0], 0.06, 0.1, rounding=0.006), cylinder([0, 0.13, 0], 0.054, 0.124, rounding=0.009), 4e-3
    )
    bow = [(56, 165), (75, 172), (95, 168), (104, 155), (105, 120), (102, 85), (92, 60), (75, 50), (56, 50)]
    handle = chain(np.array([[x, y, 0.0] for x, y in bow]) * 1e-3, np.full(len(bow), 8e-3))
    shape = without(union([body, handle], 8e-3), cylinder([0, 0.13, 0], 0.054, 0.124, rounding=0.009), 4e-3)
    return surface_of(shape, np.array([-0.07, -0.01, -0.07]), np.array([0.125, 0.215, 0.07]), 3.5e-3, 4e-3)


@pytest.mark.parametrize(
    ("thing", "at", "least"), [("mug", (0.076, 0.047, 0), 2), ("pitcher", (0.113, 0.12, 0), 3)]
)
def test_a_handle_takes_fingers_through_its_loop_and_the_thumb_stays_outside(
    thing: str, at: tuple[float, float, float], least: int, tmp_path: Path
) -> None:
    name = "sample:mug"
    if thing == "pitcher":
        mesh = pitcher()
        lines = [f"v {x} {y} {z}" for x, y, z in mesh.points] + [f"f {a} {b} {c}" for a, b, c in mesh.faces + 1]
        name = str(tmp_path / "pitcher.obj")
        Path(name).write_text("\n".join(lines))
    scene = grasp_scene(prepare("sample:human_hand", name, 1.0, PluginManager()).session, HAND, OBJECT)
    grasps = list(suggest(scene, GraspSettings(4, kinds=("power", "hook"), at=at)))
    best = max(grasps, key=lambda each: each.score)
    assert best.is_grasp, best.verdict.failures
    through = best.facts.metrics["through_loop"]
    assert least <= len(through) <= 4 and "thumb" not in through
    assert sum(one.is_grasp for one in grasps) >= 3
    for one in grasps:
        posed = scene.object_from_rig @ posed_world(scene.rig, one.proposal.poses[HAND])
        loops = loops_near(scene.mesh, scene.hand.length, np.array(at))
        (goes,) = digits_through(scene.hand, posed[scene.hand.joints][None], loops)
        roles = [digit.role for digit, through in zip(scene.hand.digits, goes.any(axis=0), strict=True) if through]
        assert one.facts.metrics["through_loop"] == roles, "the report names those"


def test_a_hand_of_many_shells_is_not_refused(assets: Path) -> None:
    """A robot's links are shells of their own: a pad's axis, sought in space, ended on the next link."""
    hand = assets / "rigs" / "allegro_hand_right" / "allegro_hand_right.urdf"
    session = prepare(str(hand), "sample:mug", 1.0, PluginManager()).session
    settings = GraspSettings(count=1, sampler_settings={"places": 30, "most": 160})
    (found,) = session.suggest(HAND, OBJECT, settings=settings)
    session.accept(found.proposal)
    assert session.document.pairs and HAND in session.document.poses
