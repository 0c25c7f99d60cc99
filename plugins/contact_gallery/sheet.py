"""What a figure hands in: rows of pictures, measures beside the paper's claims, and what it cost an artist."""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from contact_core.document.asset import Asset
from contact_core.edit.operation_log import OperationLog
from contact_core.errors import InvalidInput
from contact_core.job.job import Job
from contact_core.plugins.manager import PluginManager
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.scene.picture import Picture
from contact_core.session import Session

T = TypeVar("T")


def timed(work: Callable[[], T]) -> tuple[T, float]:
    """What some work returns, and the seconds of a processor that it took."""
    began = time.process_time()
    return work(), time.process_time() - began


@dataclass(frozen=True)
class Measure:
    """One row of the table under a figure. paper: what the paper claims, in words or as a number; "" where it is
    silent. here: what was measured."""

    what: str
    paper: str
    here: str


@dataclass(frozen=True)
class Effort:
    """What a pose took. tools: how often each was used, by the first words of the history ("paint", "transfer").
    seconds: a processor's, from the first operation to the last; a person's looking and thinking is not in it."""

    pose: str
    tools: dict[str, int]
    undos: int
    seconds: float


@dataclass(frozen=True, eq=False)
class Row:
    """Pictures side by side; width over height of each."""

    pictures: tuple[Picture, ...]
    aspect: float


@dataclass
class Sheet:
    """The sheet that a figure fills. plugins: those of the command, to share."""

    plugins: PluginManager = field(default_factory=PluginManager)
    progress: Progress = NO_PROGRESS
    rows: list[Row] = field(default_factory=list)
    measures: list[Measure] = field(default_factory=list)
    efforts: list[Effort] = field(default_factory=list)
    operations: int = 0
    undos: int = 0

    def show(self, *pictures: Picture, aspect: float = 1.0) -> None:
        """A row of pictures, side by side, under what is there already. aspect: width over height of each."""
        if not pictures:
            raise InvalidInput("a row of a sheet has at least one picture, but got none.")
        self.rows.append(Row(pictures, aspect))

    def measure(self, what: str, here: str, paper: str = "") -> None:
        """A row of the table: what was measured, and what the paper says of it."""
        self.measures.append(Measure(what, paper, here))

    def asset(self, name: str) -> Asset | None:
        """A file of the real assets (`CONTACT_ASSETS`), None where it is not there."""
        from contact_core.plugins.reading import read_asset

        folder = os.environ.get("CONTACT_ASSETS")
        found = sorted(Path(folder).rglob(name)) if folder else []
        return read_asset(found[0], self.plugins) if found else None

    def recipe(self, pose: str, job: Job, seconds: float) -> None:
        """What a recipe did counts as what an artist would do: its strokes, transfers and pairs, and one solve."""
        words = [step.command.label().split()[0].lower() for step in job.session.history.done]
        tools = Counter(word for word in words if word in ("paint", "transfer", "pair")) + Counter(solve=1)
        self.operations += tools.total()
        self.efforts.append(Effort(pose, dict(tools), 0, seconds))

    @contextmanager
    def counting(self, session: Session, pose: str = "") -> Iterator[OperationLog]:
        """What is done to the session within counts as an artist's operations, and as what the named pose took."""
        log = OperationLog(session, clock=time.process_time)
        try:
            yield log
        finally:
            log.stop()
            summary = log.summary()
            self.operations += summary["operations"]
            self.undos += summary["undos"]
            if pose:
                self.efforts.append(Effort(pose, summary["tools"], summary["undos"], summary["seconds"]))
