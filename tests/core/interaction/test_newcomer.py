"""A grasp from nothing: somebody who follows the cards of the tutorial, with an open hand and a mug."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contact_core as contact
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.grasping.filled import KeepOutOfHollowsTerm
from contact_core.grasping.judging import verdict
from contact_core.grasping.slots import GRASP_SAMPLERS
from contact_core.interaction.interaction import Interaction
from contact_core.interaction.lesson import STEPS, Lesson
from contact_core.interaction.tool import TOOLS
from contact_core.interaction.view import Perspective
from contact_core.testing.artist import Artist, ball_and_hand, block, shifted

MUG = np.array([0.14811, 0.0, 0.0])  # where it stands, beside the hand
MOST = 25  # gestures and keys
FRONT = Perspective.looking_at((0.08, 0.08, 0.0), (0.08, 0.08, 0.75), viewport=(1280, 720))
ASKEW = Perspective.looking_at((0.08, 0.08, 0.0), (0.3275, 0.3, 0.44), viewport=(896, 638))  # as the application
BEHIND = Perspective.looking_at((0.1, 0.08, 0.0), (-0.52, 0.08, -0.42), viewport=(1280, 720))


def by(x: float, y: float) -> Any:
    """(2,) pixels to the right and down."""
    return np.array([x, y], float)


@dataclass
class Newcomer(Artist):
    """Counts what it does: a press with all that is dragged, a key, a turn of the camera."""

    count: int = 0

    def drag(self, *pixels: Any, held: Any = ()) -> None:
        self.count += 1
        super().drag(*pixels, held=held)
        assert not self.hands.status.refusal, self.hands.status.refusal

    def key(self, chord: str) -> bool:
        self.count += 1
        taken = super().key(chord)
        while self.hands.worker.status is not None:
            self.hands.worker.wait(0.05)
            self.hands.advance()
        assert taken and not self.hands.status.refusal, self.hands.status.refusal
        return taken

    def orbit(self, view: Perspective) -> None:
        self.count += 1
        self.view = view

    def drag_the_mark(self, lesson: Lesson, *held: Any) -> None:
        """Drag along what the card marks, after a turn of the view where it lies on the far side."""
        self.hands.desk.view = self.view
        if lesson.card().far_side:
            self.orbit(BEHIND)
        self.hands.desk.view = self.view
        assert not lesson.card().far_side and lesson.overlay().axes
        shown = lesson.marked()
        assert shown is not None
        self.drag(*self.view.project(shown[0])[:, :2], held=held)
        lesson.follow()


@pytest.fixture
def newcomer() -> Iterator[Newcomer]:
    with contact.new(hand="sample:human_hand", mug="sample:mug") as session:
        session.surfaces.place("mug", shifted(*MUG))
        yield Newcomer(session, Interaction(session), FRONT)


def test_a_pose_that_is_only_proposed_bears_no_mark(newcomer: Newcomer) -> None:
    """Marks are places of the hand at rest: on another pose they would lie anywhere."""
    lesson, hands = Lesson(newcomer.hands), newcomer.hands
    hands.desk.view = newcomer.view
    assert lesson.overlay().axes
    hands.set(suggestions=1)
    hands.configure(GRASP_SAMPLERS, "around", places=30, most=160)
    newcomer.key("Shift+G")
    assert hands.proposing.proposal is not None, hands.status
    assert not lesson.overlay().axes and not lesson.overlay().labels
    newcomer.key("Escape")
    assert lesson.overlay().axes


def keys_of(lesson: Lesson, step: str) -> list[str]:
    """The keys that the card of a step names, in their order."""
    assert STEPS[lesson.number].name == step, lesson.card()
    return re.findall("`([^`]+)`", lesson.card().words)


@pytest.mark.parametrize("view", [FRONT, ASKEW], ids=["front", "askew"])
def test_a_grasp_from_nothing(newcomer: Newcomer, repository: Path, view: Perspective) -> None:
    """Somebody who does what the cards of the tutorial say, and nothing else."""
    session, hands, newcomer.view = newcomer.session, newcomer.hands, view
    lesson = Lesson(hands)
    paint, smaller, shift = keys_of(lesson, "paint")
    for key in (paint, smaller, smaller):
        newcomer.key(key)
    while lesson.number == 0:
        newcomer.drag_the_mark(lesson, shift.lower())
    newcomer.key(keys_of(lesson, "axis")[0])
    newcomer.drag_the_mark(lesson)
    transfer, other = keys_of(lesson, "transfer")
    newcomer.key(transfer)
    while hands.selection.surface != "mug":
        newcomer.key(other)
    for place in range(4):
        assert lesson.card().progress == f"{place} of 4"
        newcomer.drag_the_mark(lesson)
    assert STEPS[lesson.number].name == "pair" and lesson.card().done, "a transfer pairs"
    newcomer.count += 1
    lesson.next()
    for key in keys_of(lesson, "solve")[:2]:
        newcomer.key(key)
    lesson.follow()
    solved, first = verdict(session), newcomer.count
    newcomer.key(keys_of(lesson, "edit")[0])
    newcomer.drag_the_mark(lesson)
    for key in keys_of(lesson, "again")[:2]:
        newcomer.key(key)
    lesson.follow()
    edited = verdict(session)
    print(f"a grasp from nothing: {newcomer.count} gestures and keys, {first} until it is solved")  # noqa: T201
    assert lesson.is_over and lesson.card().over and all(done for _, done in lesson.card().steps)
    assert solved.is_grasp, solved.failures
    assert edited.is_grasp, edited.failures
    assert newcomer.count <= MOST
    page = (repository / "docs" / "app.md").read_text(encoding="utf-8")
    assert f"takes {newcomer.count} gestures and keys" in page and f"{first} of them" in page


def test_a_transfer_takes_up_the_next_patch_without_a_pair() -> None:
    artist = ball_and_hand()
    session, hands = artist.session, artist.hands
    mesh = session.geometry.mesh("hand")
    session.patches.paint("second", block(mesh, (5.0, 0.0, 0.5), 0.3), surface="hand")
    session.patches.paint("third", block(mesh, (3.0, 0.0, 0.5), 0.3), surface="hand")
    hands.take_up("transfer")
    hands.select("second", surface="ball")
    before = session.document
    spot = artist.pixel("ball", session.geometry.points("spot"))[18]
    artist.press(spot)
    artist.key("Escape")
    assert hands.selection.patches == ("second",) and session.document is before
    for following in ("third", "pad", "pad"):  # round and round, as long as there is one
        artist.drag(spot, spot + by(20.0, 3.0))
        assert hands.selection.patches == (following,), hands.status
    hands.configure(TOOLS, "transfer", onward=False)
    hands.select("spot")
    artist.drag(spot + by(30.0, 30.0), spot + by(40.0, 30.0))
    assert hands.selection.patches == ("spot",)


def test_a_hollow_is_solid_unless_a_contact_lies_in_it(newcomer: Newcomer) -> None:
    session, term = newcomer.session, KeepOutOfHollowsTerm()
    rig, mug = session.rigs["hand"], session.geometry.mesh("mug")
    tip = rig.rest_world[rig.joint_index("index_distal"), :3, 3] + [0.0, 0.01, 0.02]
    session.patches.brush("disk", "pad", surface="hand", at=tip, radius=0.006)
    inside = np.array([[0.0, 0.05, 0.0]])
    for place, filled in (
        ((0.0, 0.05, 0.2), True),
        ((0.0, 0.012, 0.0), False),
    ):  # on the wall; on the bottom inside
        root = contact_point(mug, place)
        copy = session.patches.transfer("pad", "mug", root, direction=(1.0, 0.0, 0.0))
        session.pairs.add("pad", copy)
        solid = term.solids_in(session.problem())["mug"]
        assert (solid.distances(inside)[0] < 0.0) == filled
        session.undo()
        session.undo()
    with pytest.raises(InvalidInput):
        newcomer.hands.set(hollows="some")


def contact_point(mesh: TriangleMesh, place: Any) -> SurfacePoints:
    from contact_core.geometry.raycast import Locator

    return Locator.of(mesh).closest(np.array([place])).points
