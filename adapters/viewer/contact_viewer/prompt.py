"""A line of text that is asked for in a window without panels: a file, a grasp of the library."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

_MOST = 12  # offers that are listed


@dataclass
class Prompt:
    """What is being typed. done: gets the text at Enter. offers: what it may go on as, for Tab and the list."""

    label: str
    done: Callable[[str], None]
    offers: Callable[[str], list[str]]
    text: str = ""

    def take(self, key: str, letter: str) -> bool:
        """Take a key by VTK's name, and the letter that it writes; whether the prompt goes on."""
        if key == "Escape":
            return False
        if key in ("Return", "KP_Enter"):
            self.done(self.text)
            return False
        if key == "BackSpace":
            self.text = self.text[:-1]
        elif key == "Tab":
            self.text = completed(self.text, self.offers(self.text))
        elif letter.isprintable():
            self.text += letter
        return True

    def shown(self) -> str:
        """The prompt as lines of text."""
        offers = self.offers(self.text)
        listed = [f"  {each}" for each in offers[:_MOST]]
        more = [f"  and {len(offers) - _MOST} more"] if len(offers) > _MOST else []
        return "\n".join(
            [f"{self.label}: {self.text}_", *listed, *more, "Tab completes, Enter does it, Esc leaves."]
        )


def completed(text: str, offers: list[str]) -> str:
    """As much of a text as all that it may go on as have in common; the only offer whole."""
    if len(offers) == 1:
        return offers[0]
    same = takewhile(lambda letters: len(set(letters)) == 1, zip(*offers, strict=False))
    common = "".join(letters[0] for letters in same)
    return common if len(common) >= len(text) else text


def paths(text: str) -> list[str]:
    """What the last of several paths, with ; between them, may go on as; folders end with a slash."""
    before, mark, last = text.rpartition(";")
    head, slash, tail = last.strip().replace(os.sep, "/").rpartition("/")
    folder = Path(head + slash or ".").expanduser()
    try:
        with os.scandir(folder) as entries:
            found = [(each.name, each.is_dir()) for each in entries if each.name.startswith(tail)]
    except OSError:
        return []
    shown = [name + "/" * is_folder for name, is_folder in sorted(found) if tail or not name.startswith(".")]
    return [f"{before}{mark}{head}{slash}{name}" for name in shown]
