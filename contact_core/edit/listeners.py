"""Telling others what changed: one after the other, in the order in which it happened."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from contact_core.document.document import ContactDocument
from contact_core.edit.command import Command

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class DocumentChanged:
    """What listeners are told. kind: "preview" comes during a stroke or shows the ghost of a proposal; its revision
    is that of the start. "frame" says that another frame is shown. before, after: at the frame that is shown.

    command: the one done, undone or redone; None for a jump or a preview.
    """

    kind: Literal["do", "undo", "redo", "goto", "preview", "frame"]
    before: ContactDocument
    after: ContactDocument
    revision: int
    command: Command | None
    origin: str


Listener = Callable[[DocumentChanged], None]


class Listeners:
    """Listeners, and what they are still to be told.

    A listener may edit: everybody hears of the change that it answers first, and of its own change after that, so
    that nobody is left with the older document.
    """

    def __init__(self) -> None:
        self._listeners: list[Listener] = []
        self._waiting: deque[DocumentChanged] = deque()
        self._telling = False

    def listen(self, listener: Listener) -> Callable[[], None]:
        """Call `listener` with every change from now on; the returned function stops that."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener) if listener in self._listeners else None

    def tell(self, change: DocumentChanged) -> None:
        """Tell of a change, at once, or after the one that is being told."""
        self._waiting.append(change)
        if self._telling:
            return
        self._telling = True
        try:
            while self._waiting:
                self._tell_all(self._waiting.popleft())
        finally:
            self._telling = False

    def _tell_all(self, change: DocumentChanged) -> None:
        for listener in tuple(self._listeners):
            try:
                listener(change)
            except Exception:  # a panel that fails to redraw must not take back what is committed
                log.exception("a listener of the session failed on %s", change.kind)
