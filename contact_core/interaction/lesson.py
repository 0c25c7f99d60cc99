"""The guided tutorial: the six things of the paper's nine-minute film, each on a card, each checked.

A lesson looks at the document and never at the pointer: a step is done when the document shows it, by whatever
tool, menu or script. So it is the same in every front end, which shows `card` and draws `overlay` over the scene.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.document.document import ContactDocument
from contact_core.geometry.raycast import Locator
from contact_core.interaction.lesson_marks import EDIT, MARKS, THUMB, Mark, along_wall
from contact_core.interaction.overlay import ACCENT, AxisLine, Label, Overlay

if TYPE_CHECKING:
    from contact_core.interaction.interaction import Interaction
    from contact_core.session import Session

FINGERS = 4  # that the tutorial's grasp uses
_LIFT = 0.006  # of the surface's size, off the skin
_FACING = -0.15  # cosine between the line of sight and the skin, above which a mark lies on the far side


@dataclass(frozen=True)
class Facts:
    """What a step is judged by. start: the document when it began. hand, thing: the surfaces that meet, "" for none
    yet."""

    start: ContactDocument
    now: ContactDocument
    hand: str
    thing: str

    def painted(self, document: ContactDocument) -> tuple[str, ...]:
        """The patches of the hand, in the order of the document."""
        return tuple(patch.name for patch in document.patches.values() if patch.surface == self.hand)

    def paired(self) -> int:
        """How many patches of the hand meet another."""
        ends = {end for pair in self.now.pairs.values() for end in (pair.manipulator, pair.object)}
        return len(ends.intersection(self.painted(self.now)))


@dataclass(frozen=True)
class Step:
    """One thing to learn. words: what to do and why, with actions in braces ("{tool.paint}"), for which their keys
    are put. count: how much of it is done, and of how much."""

    name: str
    title: str
    words: str
    count: Callable[[Facts], tuple[int, int]]

    def done(self, facts: Facts) -> bool:
        """Whether the document shows it."""
        have, wanted = self.count(facts)
        return have >= wanted


@dataclass(frozen=True)
class Card:
    """What is shown of a lesson now.

    words: keys stand in backquotes. progress: "2 of 4", "" where there is nothing to count. done: it is, and `next`
    goes on. far_side: what is marked lies on the far side, so the view has to be turned. steps: the titles of all
    steps, each with whether it is done. over: nothing is left to do.
    """

    number: int
    title: str
    words: str
    progress: str
    done: bool
    far_side: bool
    steps: tuple[tuple[str, bool], ...]
    over: bool = False


def _reposed(facts: Facts) -> tuple[int, int]:
    return int(any(pose != facts.start.poses.get(name) for name, pose in facts.now.poses.items())), 1


def _axes(facts: Facts) -> tuple[int, int]:
    start, now = facts.start, facts.now
    both = [name for name in now.patches if name in start.patches]
    axes = ((now.shape_of(name).axis, start.shape_of(name).axis) for name in both)
    return int(any(not np.array_equal(one.turning_angles, two.turning_angles) for one, two in axes)), 1


def _moved(facts: Facts) -> tuple[int, int]:
    start, now = facts.start.patches, facts.now.patches
    both = [name for name, patch in now.items() if name in start and patch.surface == facts.thing]
    return int(any(now[name].placement != start[name].placement for name in both)), 1


STEPS: tuple[Step, ...] = (
    Step(
        "paint",
        "Paint where the hand touches",
        "Press {tool.paint}, and {edit.smaller} twice: the brush is as wide as a fingertip. With `Shift` held,"
        " drag along the marked line, then along the next ones: each such stroke begins a contact of its own.",
        lambda facts: (len(facts.painted(facts.now)), FINGERS),
    ),
    Step(
        "axis",
        "Give a contact its axis",
        "Every contact has an axis, by which it is placed, turned and bent. Press {tool.axis} and draw a new one"
        " along the finger.",
        _axes,
    ),
    Step(
        "transfer",
        "Bring the contacts to the object",
        "Press {tool.transfer}, then {selection.surface} until the line at the bottom says {thing}. Press at the"
        " mark, drag along its arrow. The hand follows, and the next contact waits to be placed.",
        lambda facts: (sum(p.surface == facts.thing for p in facts.now.patches.values()), FINGERS),
    ),
    Step(
        "pair",
        "See what meets what",
        "A copy is paired with its original: both have one colour, and a line between them. {tool.pair} pairs"
        " patches that were painted apart: drag from the one to the other.",
        lambda facts: (facts.paired(), max(1, len(facts.painted(facts.now)))),
    ),
    Step(
        "solve",
        "Let the hand take hold",
        "Press {pose.settle}: the contacts settle, the hand closes, and the old pose stays as a ghost."
        " {edit.accept} keeps the new one, {edit.cancel} leaves it.",
        _reposed,
    ),
    Step(
        "edit",
        "Change your mind",
        "Press {tool.move} and drag the thumb's contact on the {thing} along the arrow. Contacts stay editable,"
        " and the hand follows.",
        _moved,
    ),
    Step(
        "again",
        "Take hold again",
        "Press {pose.settle}, then {edit.accept}. {edit.undo} goes back through all that you did, step by step.",
        _reposed,
    ),
)
_OVER = (
    "That was all of it: this is how every grasp is made. {file.save} saves, {pose.suggest} lets grasps be"
    " suggested, {show.help} shows all keys."
)


class Lesson:
    """One way through STEPS, in an interaction. Begin it on an open hand and an object.

    key_of: the key of an action by its id, "" for none; by default as the interaction's own table says.
    """

    def __init__(self, interaction: Interaction, *, key_of: Callable[[str], str] | None = None) -> None:
        self._interaction, self._session = interaction, interaction.session
        self._key_of = key_of or self._own_key
        self.number = 0
        self._seen = self._start = self._session.document
        self._done: set[int] = set()

    @property
    def is_over(self) -> bool:
        """Whether all steps were gone through."""
        return self.number >= len(STEPS)

    def follow(self) -> bool:
        """Look at the document after it may have changed; whether the card is another."""
        before, now = self._seen, self._session.document
        if now is before or self.is_over:
            return False
        self._seen = now
        if self.number in self._done:  # done before, and gone on with by doing the next thing
            self._begin(self.number + 1, before)
        if not self.is_over and STEPS[self.number].done(self._facts):
            self._done.add(self.number)
            self._begin(self.number + 1, now)
        return True

    def next(self) -> None:
        """Go on, whether or not the step is done."""
        if not self.is_over:
            self._begin(self.number + 1, self._session.document)

    def back(self) -> None:
        """To the step before, to be done once more."""
        self._begin(max(self.number - 1, 0), self._session.document)
        self._done.discard(self.number)

    def _begin(self, number: int, start: ContactDocument) -> None:
        self.number, self._start = number, start
        if not self.is_over and STEPS[number].done(self._facts):
            self._done.add(number)

    # -- what is shown ---------------------------------------------------------------------------------------

    def card(self) -> Card:
        """The card as it is now."""
        steps = tuple((step.name, place in self._done) for place, step in enumerate(STEPS))
        if self.is_over:
            return Card(self.number, "A grasp", self._written(_OVER), "", True, False, steps, over=True)
        step = STEPS[self.number]
        have, wanted = step.count(self._facts)
        progress = f"{min(have, wanted)} of {wanted}" if wanted > 1 else ""
        shown = self.marked()
        return Card(self.number, step.title, self._written(step.words), progress, self.number in self._done,
                    shown is not None and not self._is_seen(*shown), steps)  # fmt: skip

    def marked(self) -> tuple[FloatArray, FloatArray] | None:
        """What to drag along now: points (k, 3) on the skin and normals (k, 3), world; None where nothing is to be
        dragged, or not on the hand and mug that the marks are for."""
        mark = self._mark()
        seen = None if mark is None else self._interaction.desk.scene.surfaces.get(self._surface_of(mark))
        if mark is None or seen is None:
            return None
        places = mark.places(self._session.rigs.get(self._surface_of(mark)))
        if places is None:
            return None
        hits = Locator.of(seen.rest).cast(places + mark.off * mark.toward, np.tile(-mark.toward, (len(places), 1)))
        points = hits.points[np.flatnonzero(hits.found)]
        lift = _LIFT * seen.scale * seen.rest.bounding_box_diagonal
        if len(points) < 2:
            return None
        at, normals = seen.positions(points), seen.normals(points)
        return at + lift * normals, normals

    def overlay(self) -> Overlay:
        """The mark, to be drawn over the scene; nothing while a gesture is under way, nor on a pose that is only
        proposed, which has places of its own."""
        waits = self._interaction.is_busy or self._interaction.proposing.proposal is not None
        shown = None if waits else self.marked()
        if shown is None or self.number in self._done:
            return Overlay()
        points = shown[0]
        mark = self._mark()
        where = None if mark is None else self._surface_of(mark)
        label = Label(f"{STEPS[self.number].name}: drag along here", points[0], ACCENT, where)
        return Overlay(axes=(AxisLine(points, ACCENT, 4.0, arrow=True, surface=where),), labels=(label,))

    def _mark(self) -> Mark | None:
        """The mark of what comes next in this step."""
        if self.is_over:
            return None
        name, facts = STEPS[self.number].name, self._facts
        marks = MARKS.get(name, ())
        if name == "paint":
            place = len(facts.painted(facts.now))
        elif name == "transfer":  # where the active patch goes, by when it was painted
            painted, active = facts.painted(facts.now), self._interaction.selection.patch
            place = painted.index(active) if active in painted else FINGERS
        elif name == "edit":
            return self._edit_mark()
        else:
            place = 0
        return marks[place] if place < len(marks) else None

    def _edit_mark(self) -> Mark | None:
        """From where the thumb's contact lies now."""
        facts, document = self._facts, self._session.document
        thumb = facts.painted(facts.now)[THUMB : THUMB + 1]
        copies = [name for each in thumb for name in document.partners(each)
                  if document.patch(name).surface == facts.thing]  # fmt: skip
        if not copies or facts.thing not in self._interaction.desk.scene.surfaces:
            return None
        mesh = self._session.geometry.mesh(facts.thing)
        return along_wall(self._session.geometry.axis_points(copies[0])[0].positions(mesh)[0], EDIT)

    def _is_seen(self, points: FloatArray, normals: FloatArray) -> bool:
        """Whether the skin at the mark faces the eye."""
        view = self._interaction.desk.view
        _, directions = view.rays(view.project(points)[:, :2])
        return bool(np.mean(np.einsum("ki,ki->k", directions, normals)) < _FACING)

    # -- inside ----------------------------------------------------------------------------------------------

    @property
    def _facts(self) -> Facts:
        return Facts(self._start, self._session.document, *ends_of(self._session))

    def _surface_of(self, mark: Mark) -> str:
        return self._facts.hand if mark.on_hand else self._facts.thing

    def _own_key(self, action: str) -> str:
        found = next((each for each in self._interaction.actions if each.id == action), None)
        return found.keys[0] if found is not None and found.keys else ""

    def _written(self, words: str) -> str:
        """Words with the keys of actions in the place of their ids."""
        words = words.replace("{thing}", self._facts.thing or "object")
        for action in [part.split("}")[0] for part in words.split("{")[1:]]:
            words = words.replace(f"{{{action}}}", f"`{self._key_of(action) or action}`")
        return words


def ends_of(session: Session) -> tuple[str, str]:
    """The first hand and the first object of a session, "" for none."""
    hands = [name for name in session.document.surfaces if name in session.rigs]
    things = [name for name in session.document.surfaces if name not in session.rigs]
    return next(iter(hands), ""), next(iter(things), "")
