"""Verbs that pair patches."""

from __future__ import annotations

from contact_core.contact.pairing import correspond
from contact_core.document.document import ContactPair
from contact_core.edit.commands import Pair, Unpair
from contact_core.edit.verbs.group import VerbGroup


class Pairs(VerbGroup):
    """Which patches are to touch."""

    def add(self, manipulator: str, target: str, *, name: str | None = None, weight: float = 1.0) -> str:
        """Say that two patches are to touch; returns the name of the pair.

        Patches painted independently need to match in axis coordinates; where they do not, InvalidInput says why.
        """
        if self._document.patch(manipulator).shape != self._document.patch(target).shape:
            correspond(self._document.shape_of(manipulator), self._document.shape_of(target))
        name = name or self._document.free_name(f"{manipulator} - {target}", self._document.pairs)
        self._editor.do(Pair(ContactPair(name, manipulator, target, weight)))
        return name

    def remove(self, pair: str) -> None:
        """Dissolve a pair; its patches stay."""
        self._editor.do(Unpair(pair))
