"""What is under way in a session: a stroke, a macro, and the thread that edits."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from threading import RLock

from contact_core.document.document import ContactDocument
from contact_core.edit.open_macro import OpenMacro
from contact_core.edit.stroke import Stroke
from contact_core.errors import CommandRejected


class OpenEdits:
    """At most one stroke and one macro, of one thread. stroke, macro: None where there is none."""

    def __init__(self) -> None:
        self.stroke: Stroke | None = None
        self.macro: OpenMacro | None = None
        self._editing = RLock()

    @property
    def document(self) -> ContactDocument | None:
        """As the macro has made it so far, None where there is none."""
        return None if self.macro is None or self.macro.abandoned else self.macro.document

    @contextlib.contextmanager
    def alone(self) -> Iterator[None]:
        """This thread alone edits. Raises CommandRejected where another is in the middle of an edit."""
        if not self._editing.acquire(blocking=False):
            raise CommandRejected("another thread is editing this session: a session is for one thread at a time.")
        try:
            yield
        finally:
            self._editing.release()

    def check_no_stroke(self) -> None:
        """A command may be committed. Raises CommandRejected."""
        if self.stroke is not None:
            raise CommandRejected("a stroke is under way: end it first.")

    def check_nothing(self) -> None:
        """The history may move. Raises CommandRejected."""
        self.check_no_stroke()
        if self.macro is not None:
            raise CommandRejected("a macro is under way: undo comes after its end.")

    def abandon(self) -> None:
        """The document that they started from is no longer the current one: nothing comes of them, and what their
        blocks still do is refused."""
        if self.stroke is not None:
            self.stroke.abandon()
            self.stroke = None
        if self.macro is not None:
            self.macro.abandon()
