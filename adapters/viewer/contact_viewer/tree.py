"""What the rows of the tree do: select, hide, lock, rename, colour."""

from __future__ import annotations

from abc import abstractmethod

from contact_core.errors import InvalidInput
from contact_core.interaction.interaction import Interaction
from contact_core.session import Session
from contact_viewer.drawer import Drawer
from contact_viewer.look import from_hex


class TreeActions:
    """The part of an application that its tree of surfaces and patches asks."""

    drawer: Drawer

    @property
    @abstractmethod
    def session(self) -> Session:
        """What is edited now."""

    @property
    @abstractmethod
    def interaction(self) -> Interaction:
        """What the artist does in it."""

    def hide(self, kind: str, name: str) -> None:
        """Hide a surface or a patch, or show it again."""
        hidden = self.drawer.hidden_surfaces if kind == "surface" else self.drawer.hidden_patches
        hidden.symmetric_difference_update({name})
        self.drawer.stale = True

    def lock(self, kind: str, name: str) -> None:
        """Lock a surface's patches or a patch against tools, or unlock. Raises CommandRejected."""
        self.interaction.turn_lock("surface" if kind == "surface" else "patch", name)

    def select(self, kind: str, name: str, *, more: bool = False) -> None:
        """Select from the tree: a patch (more: beside those selected), or the surface that tools work on."""
        if kind == "surface":
            now = self.interaction.selection
            surface = None if now.surface == name else name
            if surface is None:
                self.interaction.do("selection.none")
            else:
                self.interaction.select(*now.patches, surface=surface)
            return
        chosen = self.interaction.selection.patches
        kept = tuple(each for each in chosen if each != name) if more else ()
        self.interaction.select(*(kept if more and name in chosen else (*kept, name)))

    def rename(self, patch: str, name: str) -> None:
        """Give a patch another name. Raises ContactError."""
        if name and name != patch:
            self.session.patches.rename(patch, name)
            self.interaction.desk.locks = self.interaction.desk.locks.renamed(patch, name)

    def recolor(self, patch: str, color: str) -> None:
        """Give a patch another colour, "#rrggbb"; its partners follow, so that pairs stay recognisable."""
        document = self.session.document
        together = {patch, *document.partners(patch)}
        for pair in document.pairs.values():
            if {pair.manipulator, pair.object} & together:
                together |= {pair.manipulator, pair.object}
        try:
            self.session.patches.recolor(sorted(together), from_hex(color))
        except ValueError as error:
            raise InvalidInput(str(error)) from None
