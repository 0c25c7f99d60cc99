"""What a tool is (hook `contact_tools`), and the gesture that it begins when it is pressed.

A tool is a value: a frozen dataclass with settings, shared by every window. What happens between press and release
is a gesture of its own, which previews on the desk's stroke. The interaction opens the stroke, commits it once at
release together with the pose that follows, or puts everything back: no tool can leave anything open.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Protocol, runtime_checkable

from contact_core.interaction.overlay import NOTHING, Overlay
from contact_core.plugins.slot import SLOTS, Slot

if TYPE_CHECKING:
    from contact_core.interaction.desk import Desk
    from contact_core.interaction.events import Pointer


class Gesture:
    """What goes on between press and release. Derive from it.

    What these methods raise as a ContactError is shown to the artist. In `move` the preview before stays; in
    `release` nothing is committed. crosses: whether it goes on in another view where the pointer goes there; else
    the view of the press keeps the pointer to the end.
    """

    crosses: ClassVar[bool] = False

    def move(self, pointer: Pointer) -> None:
        """The pointer moved with the button held: replace the preview, from the document at the press."""

    def release(self, pointer: Pointer) -> None:
        """The button went up: leave on the stroke what shall be committed, nothing for nothing."""

    def cancel(self) -> None:
        """It is put back. The document is so without you: put back what else you changed, such as a setting."""

    def overlay(self) -> Overlay:
        """What to draw meanwhile, beside the document itself."""
        return NOTHING

    def hint(self) -> str:
        """What happens now, in a few words, for the line of status."""
        return ""


@runtime_checkable
class Tool(Protocol):
    """Something to take into one's hand. Settings of its own are fields, see `contact_core.settings`."""

    @property
    def name(self) -> str: ...

    @property
    def summary(self) -> str:
        """A sentence for the help."""
        ...

    @property
    def key(self) -> str:
        """The key that takes it up ("B"), "" for none. Where two want the same, the first has it."""
        ...

    @property
    def hint(self) -> str:
        """How to use it, with what each modifier does, for the line of status."""
        ...

    def hover(self, desk: Desk, pointer: Pointer) -> Overlay:
        """What to draw while no button is held: a ring, handles, a ghost. Changes nothing."""
        ...

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        """Begin at a press of the left button. None: nothing here for this tool, so the press is the camera's."""
        ...


TOOLS: Slot[Tool] = SLOTS["contact_tools"]
