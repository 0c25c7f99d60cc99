"""What an artist did and how long it took, as plain JSON: the measure of a user study that needs no people.

Opt-in and local: nothing is logged unless somebody makes an `OperationLog`, or sets the variable CONTACT_OPERATIONS
to a file, to which every session of the process, whatever its program, then adds a line of JSON per operation. It
holds tools and times, no names of patches, files or persons.
"""

from __future__ import annotations

import json
import logging
import os
import secrets
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from contact_core.atomic_file import write_atomic
from contact_core.edit.listeners import DocumentChanged, Listener

log = logging.getLogger(__name__)
VARIABLE = "CONTACT_OPERATIONS"
BY_HAND = "user"  # the origin of what an artist did; assets that are loaded and hosts have others


class Listened(Protocol):
    """What tells of its changes: a session."""

    def listen(self, listener: Listener) -> Callable[[], None]: ...


class OperationLog:
    """The operations of a session since the log was made.

    operations: of each the tool ("rotate"), seconds since the log began, and what became of it ("do", "undo",
    "redo", "goto"). Previews are none: a drag counts once. clock: returns seconds. lines: a file to which each
    operation is added as it happens, one line of JSON, with a random word for the session that it was in.
    """

    def __init__(
        self,
        session: Listened,
        *,
        clock: Callable[[], float] = time.perf_counter,
        lines: Path | str | None = None,
    ) -> None:
        self._clock, self._began = clock, clock()
        self._lines, self._session = lines, secrets.token_hex(6)
        self.operations: list[dict[str, Any]] = []
        self.stop = session.listen(self._heard)

    def _heard(self, change: DocumentChanged) -> None:
        if change.kind in ("preview", "frame") or (change.kind == "do" and change.origin != BY_HAND):
            return
        seconds = round(self._clock() - self._began, 3)
        self.operations.append({"tool": _tool(change), "at": seconds, "kind": change.kind})
        if self._lines is not None:
            self._add_line(self._lines)

    def _add_line(self, path: Path | str) -> None:
        """The last operation to the file; one that cannot be written is told once, and nobody's edit fails."""
        try:
            with Path(path).open("a", encoding="utf-8") as file:
                file.write(json.dumps({"session": self._session, **self.operations[-1]}) + "\n")
        except OSError as error:
            log.warning("the log of operations ends here: %s cannot be written: %s.", path, error.strerror)
            self._lines = None

    def summary(self) -> dict[str, Any]:
        """operations and undos: how many. seconds: until the last of them. tools: how often each was used."""
        done = [operation for operation in self.operations if operation["kind"] == "do"]
        return {
            "operations": len(done),
            "undos": sum(operation["kind"] == "undo" for operation in self.operations),
            "seconds": self.operations[-1]["at"] if self.operations else 0.0,
            "tools": dict(Counter(operation["tool"] for operation in done)),
        }

    def write(self, path: Path | str) -> None:
        """Write the log as JSON, atomically. Raises FileRefused."""
        content = {"schema": "contact.operations", "version": 1, **self.summary(), "log": self.operations}
        write_atomic(path, json.dumps(content, indent=1) + "\n")


def log_when_asked(session: Listened) -> None:
    """Log a session's operations to the file that CONTACT_OPERATIONS names; without it, do nothing."""
    if path := os.environ.get(VARIABLE):
        OperationLog(session, lines=path)


def _tool(change: DocumentChanged) -> str:
    """The first word of what the artist reads in the history: "rotate" of "Rotate thumb tip"."""
    return change.kind if change.command is None else change.command.label().split(" ")[0].lower()
