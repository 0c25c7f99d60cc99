"""What an artist did and how long it took, as plain JSON: the measure of a user study that needs no people.

Opt-in and local: nothing is logged unless somebody makes an `OperationLog`, and nothing is written but where
`write` is told to. It holds tools and times, no names of patches, files or persons.
"""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from contact_core.atomic_file import write_atomic
from contact_core.edit.listeners import DocumentChanged, Listener

BY_HAND = "user"  # the origin of what an artist did; assets that are loaded and hosts have others


class Listened(Protocol):
    """What tells of its changes: a session."""

    def listen(self, listener: Listener) -> Callable[[], None]: ...


class OperationLog:
    """The operations of a session since the log was made.

    operations: of each the tool ("rotate"), seconds since the log began, and what became of it ("do", "undo",
    "redo", "goto"). Previews are none: a drag counts once. clock: returns seconds.
    """

    def __init__(self, session: Listened, *, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock, self._began = clock, clock()
        self.operations: list[dict[str, Any]] = []
        self.stop = session.listen(self._heard)

    def _heard(self, change: DocumentChanged) -> None:
        if change.kind == "preview" or (change.kind == "do" and change.origin != BY_HAND):
            return
        seconds = round(self._clock() - self._began, 3)
        self.operations.append({"tool": _tool(change), "at": seconds, "kind": change.kind})

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


def _tool(change: DocumentChanged) -> str:
    """The first word of what the artist reads in the history: "rotate" of "Rotate thumb tip"."""
    return change.kind if change.command is None else change.command.label().split(" ")[0].lower()
