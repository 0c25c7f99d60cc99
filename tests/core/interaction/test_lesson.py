"""The tutorial: steps are judged by the document alone, whoever did it, and nothing of it can go astray."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from contact_core.interaction.interaction import Interaction
from contact_core.interaction.lesson import FINGERS, STEPS, Lesson, ends_of
from contact_core.plugins.manager import PluginManager
from contact_core.rig.rig import Pose
from contact_core.session import Session
from contact_core.testing.artist import ball_and_hand, block, ends


def begun() -> tuple[Session, Lesson]:
    """A lesson on a hand and a ball without contacts."""
    artist = ball_and_hand()
    artist.session.patches.remove(*artist.session.document.patches)
    return artist.session, Lesson(artist.hands)


def painted(session: Session, lesson: Lesson, count: int) -> None:
    mesh = session.geometry.mesh("hand")
    for place in range(count):
        session.patches.paint(f"pad {place}", block(mesh, (1.0 + 1.5 * place, 0.0, 0.5), 0.3), surface="hand")
        lesson.follow()


def name(lesson: Lesson) -> str:
    return STEPS[lesson.number].name


def test_every_step_is_done_by_the_document_whoever_edits_it() -> None:
    session, lesson = begun()
    assert ends_of(session) == ("hand", "ball")
    painted(session, lesson, FINGERS - 1)
    assert name(lesson) == "paint" and lesson.card().progress == f"{FINGERS - 1} of {FINGERS}"
    session.undo()
    lesson.follow()
    assert lesson.card().progress == f"{FINGERS - 2} of {FINGERS}"
    session.redo()
    session.patches.paint("last", block(session.geometry.mesh("hand"), (7.0, 0.0, 0.5), 0.3), surface="hand")
    lesson.follow()
    assert name(lesson) == "axis"
    hand, ball = session.geometry.mesh("hand"), session.geometry.mesh("ball")
    session.patches.set_axis("last", ends(hand, (6.6, -0.2, 0.5), (7.0, 0.1, 0.5), (7.3, 0.0, 0.5)))
    lesson.follow()
    assert name(lesson) == "transfer"
    for place, patch in enumerate(list(session.document.patches)):
        there = ends(ball, (0.3 * place - 0.5, 0.2, 0.9))
        session.patches.transfer(patch, "ball", there, direction=(0.0, 1.0, 0.0))
        lesson.follow()
    assert name(lesson) == "pair" and not lesson.card().done  # nobody has paired them
    for patch in [each.name for each in session.document.patches.values() if each.surface == "hand"]:
        session.pairs.add(patch, session.document.partners(patch)[0])
        lesson.follow()
    assert name(lesson) == "solve"
    for step in ("solve", "edit", "again"):
        assert name(lesson) == step
        if step == "edit":
            copy = session.document.partners("last")[0]
            session.patches.translate(copy, ends(ball, (0.0, -0.4, 0.9)))
        else:
            rig = session.rigs["hand"]
            turned = rig.rest_local.copy()
            turned[1, :3, :3] = turned[1, :3, :3] @ about_z(0.1 if step == "solve" else 0.2)
            session.surfaces.set_pose("hand", Pose(rig.joints, turned))
        lesson.follow()
    assert lesson.is_over and all(done for _, done in lesson.card().steps)


def about_z(angle: float) -> Any:
    return np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])


def test_what_is_done_before_its_card_waits_with_a_tick_and_goes_on_with_the_next_thing() -> None:
    session, lesson = begun()
    lesson.next()
    lesson.next()
    lesson.next()
    assert name(lesson) == "pair" and not lesson.card().done
    lesson.back()
    assert name(lesson) == "transfer"
    lesson.back()
    lesson.back()
    lesson.back()  # there is none before the first
    painted(session, lesson, FINGERS)
    lesson.back()
    assert name(lesson) == "paint" and not lesson.card().done  # to be done once more, or gone on from
    before = lesson.card()
    assert not lesson.follow() and lesson.card() == before


def test_words_name_the_keys_of_the_table_or_those_of_a_host() -> None:
    _, lesson = begun()
    assert "`B`" in lesson.card().words
    other = Lesson(lesson._interaction, key_of=lambda action: f"<{action}>")
    assert "`<tool.paint>`" in other.card().words
    for _ in STEPS:
        lesson.next()
        assert "{" not in lesson.card().words and lesson.card().words
    assert lesson.is_over and not lesson.follow() and lesson.marked() is None
    lesson.next()


@pytest.mark.parametrize("what", ["nothing", "ball"])
def test_a_scene_without_hand_and_mug_has_cards_without_marks(what: str) -> None:
    session = Session(plugins=PluginManager())
    if what == "ball":
        session.surfaces.add("ball", ball_and_hand().session.geometry.mesh("ball"))
    lesson = Lesson(Interaction(session))
    for _ in range(len(STEPS) + 1):
        assert lesson.marked() is None and not lesson.overlay().axes and lesson.card().title
        lesson.next()
