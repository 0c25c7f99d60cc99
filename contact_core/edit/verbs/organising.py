"""Verbs that group, name and colour patches."""

from __future__ import annotations

from collections.abc import Sequence

from contact_core.document.document import Color
from contact_core.edit.commands import Group, Recolor, Rename, Ungroup
from contact_core.edit.verbs.group import VerbGroup


class OrganisingVerbs(VerbGroup):
    """Group, ungroup, rename, recolour."""

    def group(self, name: str, patches: Sequence[str]) -> None:
        """Keep patches as one, on whatever surfaces they lie."""
        self._editor.do(Group(name, tuple(patches)))

    def ungroup(self, name: str) -> None:
        """Dissolve a group; its patches stay."""
        self._editor.do(Ungroup(name))

    def rename(self, patch: str, name: str) -> None:
        """Give a patch another name, everywhere."""
        self._editor.do(Rename(patch, name))

    def recolor(self, patches: str | Sequence[str], color: Color) -> None:
        """Colour patches (RGB 0..1)."""
        self._editor.do(Recolor((patches,) if isinstance(patches, str) else tuple(patches), color))
