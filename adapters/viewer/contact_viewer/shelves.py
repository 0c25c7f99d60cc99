"""The libraries of grasps in the application: this user's own, and the starter library of the product."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol

from contact_core.errors import FileRefused, InvalidInput
from contact_core.interaction.interaction import Interaction
from contact_core.interaction.shelved import apply_saved, save_held
from contact_core.library.shelf import Entry, Library
from contact_core.library.starter import starter_library
from contact_viewer.recovery import state_directory

OWN, STARTER = "own", "starter"


class Shown(Protocol):
    """What shelves need of an application."""

    @property
    def interaction(self) -> Interaction:
        """What the artist does."""
        ...

    @property
    def say(self) -> Callable[[str], None]:
        """Let a sentence stand in the line of status."""
        ...


class Shelves:
    """Lists grasps with their tags, puts one on what is open, saves the one that is there.

    folder: of this user's own library: `CONTACT_LIBRARY`, else one beside what is kept against a crash.
    """

    def __init__(self, app: Shown, folder: Path | None = None) -> None:
        self._app = app
        self.saved = 0  # grasps since the start: a list of before is old
        named = os.environ.get("CONTACT_LIBRARY")
        self.own = Library(Path(named) if named else (folder or state_directory()) / "grasps")
        self._libraries: Mapping[str, Library] = {OWN: self.own, STARTER: starter_library()}

    def rows(self) -> list[dict[str, Any]]:
        """Every grasp as plain data, this user's own first; `text` is what a search looks at."""
        found = []
        for shelf, library in self._libraries.items():
            try:
                found += [_row(shelf, entry) for entry in library.entries()]
            except FileRefused:
                if shelf == STARTER:
                    raise  # one's own is made with the first grasp that is saved
        return found

    def find(self, word: str) -> list[dict[str, Any]]:
        """The rows with all words of a text in them."""
        words = word.casefold().split()
        return [row for row in self.rows() if all(each in row["text"] for each in words)]

    def names(self, word: str) -> list[str]:
        """Names that begin with a text, or, where none does, of the rows with its words in them."""
        found = [row["name"] for row in self.rows() if row["name"].casefold().startswith(word.casefold())]
        return found or [row["name"] for row in self.find(word)]

    def apply(self, shelf: str, name: str) -> None:
        """Propose a grasp for what is open. Raises ContactError."""
        apply_saved(self._app.interaction, self._library(shelf), name)

    def apply_best(self, word: str) -> None:
        """Propose the grasp of that name, else the only one with these words. Raises InvalidInput."""
        found = self.find(word)
        named = [row for row in found if row["name"].casefold() == word.strip().casefold()] or found
        if len(named) != 1 and not (named and named[0]["name"].casefold() == word.strip().casefold()):
            names = ", ".join(row["name"] for row in found[:6]) or "none"
            raise InvalidInput(f"{word.strip()!r} is to name one grasp of the library, but fits {names}.")
        self.apply(named[0]["shelf"], named[0]["name"])

    def save(self, name: str, tags: str) -> None:
        """Save the grasp of the document in one's own library. tags: separated by commas. Raises ContactError."""
        if not name.strip():
            raise InvalidInput("name the grasp to save it.")
        kept = [tag.strip() for tag in tags.split(",") if tag.strip()]
        taken = self.own.folder.is_dir() and name.strip() in self.own.names()
        save_held(self._app.interaction, self.own, name.strip(), kept, self._saved, replaces=taken)

    def _saved(self, sentence: str) -> None:
        self.saved += 1
        self._app.say(sentence)

    def picture(self, shelf: str, name: str) -> bytes | None:
        """The PNG of a grasp; None where it has none. Raises FileRefused, InvalidInput."""
        return self._library(shelf).picture(name)

    def _library(self, shelf: str) -> Library:
        if shelf not in self._libraries:
            raise InvalidInput(f"there is no library {shelf!r}.")
        return self._libraries[shelf]


def _row(shelf: str, entry: Entry) -> dict[str, Any]:
    grasp = entry.grasp
    tags = [] if grasp is None else [grasp.kind, *grasp.tags]
    made = "" if grasp is None else f"{grasp.hand.name} on {grasp.object.name}"
    text = " ".join([entry.name, *tags, made, "" if grasp is None else grasp.note]).casefold()
    return {
        "key": f"{shelf}/{entry.name}",
        "shelf": shelf,
        "name": entry.name,
        "version": entry.version,
        "tags": ", ".join(tags),
        "made": made,
        "problem": entry.problem,
        "text": text,
    }
