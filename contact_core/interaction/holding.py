"""What an artist holds: a tool, settings, the selection, and how surfaces look because of them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from contact_core.document.document import named
from contact_core.errors import InvalidInput
from contact_core.interaction.actions import Action, actions_of
from contact_core.interaction.desk import Desk
from contact_core.interaction.lock import Kind
from contact_core.interaction.settings import InteractionSettings, Selection
from contact_core.interaction.status import Part
from contact_core.interaction.tool import TOOLS, Tool
from contact_core.interaction.view import Perspective
from contact_core.plugins.slot import Slot
from contact_core.settings import configured

if TYPE_CHECKING:
    from contact_core.session import Session


class Holding:
    """The part of an interaction that panels and menus read and set; each change is told to the front end."""

    def __init__(self, session: Session, meters_per_unit: float) -> None:
        nowhere = Perspective.looking_at((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
        self.session = session
        self.desk = Desk(session, nowhere, meters_per_unit=meters_per_unit)
        self._parts: set[Part] = {"document", "overlay", "selection", "tool", "settings", "status", "visibility"}
        offered = list(session.plugins.offers(TOOLS))
        self._tool = "select" if "select" in offered else (offered or [""])[0]

    @property
    def tools(self) -> tuple[Tool, ...]:
        """All tools, with their settings."""
        return tuple(self.tool_named(name) for name in self.session.plugins.offers(TOOLS))

    def tool_named(self, name: str) -> Tool:
        """A tool by name, with its settings as they are now. Raises InvalidInput."""
        found: Tool = self.desk.made(TOOLS, name)
        return found

    @property
    def tool(self) -> str:
        """The name of the tool in the hand, "" where no tool is offered."""
        return self._tool

    @property
    def settings(self) -> InteractionSettings:
        """What holds for all tools."""
        return self.desk.settings

    def set(self, **values: Any) -> None:
        """Set some of `settings` by name. Raises InvalidInput."""
        self.desk.settings = configured(self.desk.settings, values, "the interaction")
        self._touch("settings", "overlay", "status", "visibility")

    def configure(self, slot: Slot[Any], name: str, **values: Any) -> None:
        """Set settings of a tool, a brush, an axis generator, a solver or a term by name. Raises InvalidInput."""
        self.desk.configure(slot, name, **values)
        self._touch("settings", "overlay", "status")

    @property
    def selection(self) -> Selection:
        """What is selected."""
        return self.desk.selection

    def select(self, *patches: str, surface: str | None = None) -> None:
        """Select patches, the active one last, and the surface that tools work on; by default that stays.

        Raises CommandRejected for a name that the document does not have.
        """
        for name in patches:
            self.desk.document.patch(name)
        if surface is not None:
            self.desk.document.surface(surface)
        self.desk.selection = replace(self.desk.selection, patches=patches,
                                      surface=surface or self.desk.selection.surface)  # fmt: skip
        self._touch("selection", "overlay", "status", "visibility")

    def turn_lock(self, kind: Kind, name: str) -> None:
        """Lock a surface's patches or a patch against tools, or unlock. Raises CommandRejected."""
        document = self.desk.document
        named(document.surfaces if kind == "surface" else document.patches, name, kind)
        self.desk.locks = self.desk.locks.turned(kind, name)
        self._touch("visibility", "status")

    def opacity(self, surface: str) -> float:
        """How a front end draws a surface: 1 solid, 0 not at all, between them as a ghost."""
        mine = self.desk.selection.surface
        if mine is None or surface == mine:
            return 1.0
        return 0.0 if self.settings.isolate else 0.35 if self.settings.xray else 1.0

    @property
    def actions(self) -> tuple[Action, ...]:
        """The table of actions and keys, tools among them."""
        return actions_of(self.tools)

    def resize(self, factor: float) -> None:
        """Make the radius of the tool in the hand larger by a factor. Raises InvalidInput where it has none."""
        resized = getattr(self.tool_named(self._tool), "resized", None)
        if resized is None:
            raise InvalidInput(f"the tool {self._tool!r} has no radius.")
        self.configure(TOOLS, self._tool, radius=resized(self.desk, factor))

    def _keep_selection(self) -> None:
        """Only what there is can be selected."""
        document, selection = self.session.document, self.desk.selection
        patches = tuple(name for name in selection.patches if name in document.patches)
        surface = selection.surface if selection.surface in document.surfaces else None
        if (patches, surface) != (selection.patches, selection.surface):
            self.desk.selection = replace(selection, patches=patches, surface=surface)
            self._touch("selection", "visibility")

    def _touch(self, *parts: Part) -> None:
        self._parts.update(parts)
