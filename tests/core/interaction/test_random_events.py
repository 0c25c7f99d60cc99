"""Whatever comes in whatever order: nothing is raised, no stroke stays open, every document is sound."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.arrays import FloatArray
from contact_core.document.schema import inconsistencies
from contact_core.edit.listeners import DocumentChanged
from contact_core.interaction.events import BUTTONS, KEY_NAMES, MODIFIERS, POINTER_KINDS, Event, Key, Pointer
from contact_core.interaction.tool import TOOLS
from contact_core.testing.artist import Artist, paired

STREAMS, LENGTH = 64, 160  # 10,240 events; drawn by a seed, for a stream of hypothesis' own shrinks for minutes
TOOL_NAMES = sorted(paired().session.plugins.offers(TOOLS))


@cache
def spots() -> FloatArray:
    """(k, 2) pixels of points of patches and of their axes: where something happens."""
    artist, found = paired(), []
    geometry = artist.session.geometry
    for patch in artist.session.document.patches.values():
        both = geometry.points(patch.name), geometry.axis(patch.name).points
        found += [artist.pixel(patch.surface, points)[::3] for points in both]
    return np.concatenate(found)


@cache
def chords() -> list[str]:
    return [key for action in paired().hands.actions for key in action.keys]


class Monkey:
    """At a view and a keyboard."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)

    def held(self) -> frozenset[str]:
        few = self.random.choice(MODIFIERS, self.random.choice(3, p=[0.7, 0.25, 0.05]), replace=False)
        return frozenset(str(each) for each in few)

    def place(self) -> FloatArray:
        kind = self.random.random()
        if kind < 0.7:
            return self.random.choice(spots()) + self.random.normal(0.0, 3.0, 2)
        return self.random.uniform(-60.0, 860.0, 2) if kind < 0.98 else np.array([1e9, -1e9])

    def pointer(
        self, kind: str, at: FloatArray, button: str = "none", held: frozenset[str] | None = None
    ) -> Pointer:
        held = self.held() if held is None else held
        return Pointer(kind, *at.tolist(), button, held, float(self.random.random()))  # type: ignore[arg-type]

    def drag(self) -> Iterator[Event]:
        """With the left button, perhaps without an end."""
        at, held = self.place(), self.held()
        yield self.pointer("press", at, "left", held)
        for _ in range(self.random.integers(0, 4)):
            at = at + self.random.normal(0.0, 25.0, 2)
            yield self.pointer("move", at, held=held)
        if self.random.random() < 0.8:
            yield self.pointer("release", at, "left", held)

    def key(self) -> Key:
        if self.random.random() < 0.85:
            *held, name = str(self.random.choice(chords())).split("+")
            return Key(name, frozenset(each.lower() for each in held))  # type: ignore[misc]
        return Key(str(self.random.choice([*sorted(KEY_NAMES), "b", "7", "é"])), self.held())  # type: ignore[arg-type]

    def events(self) -> Iterator[Event]:
        while True:
            kind = self.random.random()
            if kind < 0.6:
                yield from self.drag()
            elif kind < 0.85:
                yield self.key()
            else:
                name = str(self.random.choice(POINTER_KINDS))
                button = str(self.random.choice(BUTTONS)) if name in ("press", "release") else "none"
                yield self.pointer(name, self.place(), button)


def check(artist: Artist) -> None:
    hands, session = artist.hands, artist.session
    assert hands.is_busy or hands.desk.command is None, "a stroke is open without a gesture"
    if not hands.is_busy:
        assert hands.desk.document is (hands.desk.ghost or session.document)
    assert set(hands.selection.patches) <= {*session.document.patches, *hands.desk.document.patches}


HANDLED = [0]


@settings(max_examples=STREAMS)
@given(st.integers(0, 2**32 - 1))
def test_random_events(seed: int) -> None:
    artist, monkey = paired(), Monkey(seed)
    before, steps = artist.session.document, list[DocumentChanged]()
    artist.session.listen(lambda change: steps.append(change) if change.kind != "preview" else None)
    artist.hands.set(iterations=2)
    for name in ("paint", "erase", "lasso", "curve"):
        artist.hands.configure(TOOLS, name, spacing=0.15, radius=0.3)
    artist.hands.take_up(str(monkey.random.choice(TOOL_NAMES)))
    for _, event in zip(range(LENGTH), monkey.events(), strict=False):
        steps.clear()
        artist.hands.handle(event, artist.view)
        assert len(steps) <= 1, event
        check(artist)
        if monkey.random.random() < 0.5:
            artist.hands.advance()
            check(artist)
        if monkey.random.random() < 0.02:
            artist.hands.overlay()
        HANDLED[0] += 1
    artist.hands.overlay()
    artist.hands.close()
    assert not list(inconsistencies(artist.session.document))
    assert np.isfinite(artist.hands.desk.scene.surfaces["hand"].points).all()
    while artist.session.history.can_undo:
        artist.session.undo()
    assert artist.session.document is before


def test_ten_thousand_events_were_handled() -> None:
    assert HANDLED[0] >= 10_000, HANDLED[0]
