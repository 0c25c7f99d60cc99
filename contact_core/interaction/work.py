"""Long work beside the window: one piece at a time on a thread of its own, taken over on the session's thread.

The work gets only values (documents, meshes) and a progress; what it returns is handed to `done` when the front
end's loop calls `poll`. So a session stays with one thread, and whatever the artist does meanwhile stands.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Any

from contact_core.errors import Cancelled, ContactError
from contact_core.progress import Progress

log = logging.getLogger(__name__)
_PATIENCE = 20.0  # seconds that the end waits for work that was told to stop


@dataclass(frozen=True)
class WorkStatus:
    """How far the work is. fraction: 0 to 1, None where nobody knows."""

    title: str
    fraction: float | None
    text: str


class _Piece(Progress):
    """One piece of work on its thread; it is its own progress."""

    def __init__(
        self, title: str, work: Callable[[Progress], Any], done: Callable[[Any], None], some: bool
    ) -> None:
        self.title, self.done, self.some = title, done, some
        self.came: SimpleQueue[Any] = SimpleQueue()
        self.status = WorkStatus(title, None, "")
        self.result: Any = None
        self.error: BaseException | None = None
        self.stop = threading.Event()
        self.over = threading.Event()
        self._work = work
        self.thread = threading.Thread(target=self._run, name=f"contact {title}", daemon=True)
        self.thread.start()

    def tell(self, fraction: float | None, text: str) -> None:
        self.status = WorkStatus(self.title, fraction, text)
        if self.stop.is_set():
            raise Cancelled(f"{self.title} was cancelled.")

    def _run(self) -> None:
        try:
            if self.some:
                for one in self._work(self):
                    self.came.put(one)
            else:
                self.result = self._work(self)
        except BaseException as error:  # told where it can be shown
            self.error = error
        self.over.set()


class Worker:
    """At most one piece of work; a new one takes the place of the old, whose result is dropped."""

    def __init__(self) -> None:
        self._piece: _Piece | None = None
        self._dropped: list[_Piece] = []  # told to stop, and perhaps not yet over

    @property
    def status(self) -> WorkStatus | None:
        """Of the work that runs; None where none does."""
        return None if self._piece is None else self._piece.status

    def begin(self, title: str, work: Callable[[Progress], Any], done: Callable[[Any], None]) -> None:
        """Start: `work` on a thread, then `done` with what it returns, in `poll`."""
        self.drop()
        self._piece = _Piece(title, work, done, some=False)

    def begin_some(
        self, title: str, work: Callable[[Progress], Iterable[Any]], each: Callable[[Any], None]
    ) -> None:
        """Start work that finds several things: `each` with one after the other, as they come, in `poll`."""
        self.drop()
        self._piece = _Piece(title, work, each, some=True)

    def cancel(self) -> None:
        """Ask the work to stop; solvers then return the best they have, which `poll` hands over. Work that finds
        several things has handed over what it had, and is dropped at once."""
        if self._piece is not None:
            self._piece.stop.set()
            if self._piece.some:
                self._let_go()

    def drop(self) -> None:
        """Stop the work and forget what it finds."""
        self.cancel()
        self._let_go()

    def close(self) -> None:
        """The end: stop, and wait until no thread is left. One that runs compiled code when the interpreter ends
        takes the whole process down with an abort."""
        self.drop()
        until = time.monotonic() + _PATIENCE
        for piece in self._dropped:
            piece.thread.join(max(0.0, until - time.monotonic()))

    def _let_go(self) -> None:
        if self._piece is not None:
            self._dropped = [*(each for each in self._dropped if not each.over.is_set()), self._piece]
            self._piece = None

    def poll(self) -> bool:
        """Hand over the result of work that is over; whether there was one.

        On the session's thread. Raises what the work raised, a ContactError for people.
        """
        piece = self._piece
        if piece is None:
            return False
        over = piece.over.is_set()  # asked first: what comes between would be lost
        while not piece.came.empty() and piece is self._piece:  # whoever gets one may drop the rest
            piece.done(piece.came.get())
        if not over or piece is not self._piece:
            return False
        self._piece = None
        piece.thread.join()
        if piece.error is None:
            if not piece.some:
                piece.done(piece.result)
        elif isinstance(piece.error, ContactError):
            raise piece.error
        else:
            log.error("%s failed", piece.title, exc_info=piece.error)
            raise ContactError(f"{piece.title} failed by a mistake in the program: {piece.error}") from piece.error
        return True

    def wait(self, seconds: float | None = None) -> bool:
        """Until the work is over, at most so long; whether it is. For scripts and tests."""
        return self._piece is None or self._piece.over.wait(seconds)
