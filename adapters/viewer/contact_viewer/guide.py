"""The tutorial in the application: whether it is shown, and that it comes by itself only once."""

from __future__ import annotations

import contextlib
import re
from pathlib import Path
from typing import Any

from contact_core.atomic_file import write_atomic
from contact_core.errors import ContactError
from contact_core.interaction.interaction import Interaction
from contact_core.interaction.lesson import STEPS, Lesson
from contact_core.interaction.overlay import Overlay


class Guide:
    """Shows a lesson, or none. folder: where it is kept that this user has seen it."""

    def __init__(self, folder: Path) -> None:
        self._seen = folder / "tutorial-seen"
        self.lesson: Lesson | None = None

    @property
    def is_new(self) -> bool:
        """Whether this user has not seen it yet."""
        return not self._seen.exists()

    def begin(self, interaction: Interaction) -> None:
        """From the first card, on what is open, without contacts and at rest; that it was not is one step back."""
        session = interaction.session
        if session.document.patches or session.document.poses:
            with session.macro("Begin the tutorial"):
                if session.document.patches:
                    session.patches.remove(*session.document.patches)
                for surface in tuple(session.document.poses):
                    session.surfaces.clear_pose(surface)
        self.lesson = Lesson(interaction)

    def end(self) -> None:
        """No more cards, also at the next start."""
        self.lesson = None
        with contextlib.suppress(OSError, ContactError):  # then they come once more: nothing is lost
            self._seen.parent.mkdir(parents=True, exist_ok=True)
            write_atomic(self._seen, b"")

    def turn(self, which: str) -> None:
        """next, back or end."""
        if self.lesson is None:
            return
        if which == "end" or (which == "next" and self.lesson.is_over):
            self.end()
        elif which == "next":
            self.lesson.next()
        elif which == "back":
            self.lesson.back()

    def follow(self) -> bool:
        """Look whether a step is done; whether the card is another."""
        return self.lesson is not None and self.lesson.follow()

    def overlay(self) -> Overlay:
        """The mark of the card."""
        return Overlay() if self.lesson is None else self.lesson.overlay()

    def card(self) -> dict[str, Any] | None:
        """The card as plain data; its words in parts, each with whether it is a key."""
        if self.lesson is None:
            return None
        card = self.lesson.card()
        parts = re.split("`([^`]+)`", card.words)
        return {
            "title": card.title,
            "words": [{"text": text, "key": bool(place % 2)} for place, text in enumerate(parts) if text],
            "progress": card.progress,
            "done": card.done,
            "far_side": card.far_side,
            "over": card.over,
            "first": card.number == 0,
            "steps": [
                {"name": name, "done": done, "now": place == card.number}
                for place, (name, done) in enumerate(card.steps)
            ],
        }

    def text(self) -> str:
        """The card as lines of text, for a window without panels; "" for none."""
        if self.lesson is None:
            return ""
        card = self.lesson.card()
        place = "" if card.over else f"{card.number + 1} of {len(STEPS)}: "
        turned = " It lies on the far side: turn the view (middle button)." if card.far_side else ""
        going = "F2 closes it." if card.over else "Done: F2 goes on." if card.done else card.progress
        words = card.words.replace("`", "") + turned
        return f"{place}{card.title}\n{words}\n{going}".rstrip()
