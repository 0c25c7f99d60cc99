"""What a figure hands in: rows of pictures, measures beside the paper's claims, and what it cost an artist."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from contact_core.document.asset import Asset
from contact_core.edit.operation_log import OperationLog
from contact_core.errors import InvalidInput
from contact_core.plugins.manager import PluginManager
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.scene.picture import Picture
from contact_core.session import Session


@dataclass(frozen=True)
class Measure:
    """One row of the table under a figure. paper: what the paper claims, in words or as a number; "" where it is
    silent. here: what was measured."""

    what: str
    paper: str
    here: str


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

    @contextmanager
    def counting(self, session: Session) -> Iterator[OperationLog]:
        """What is done to the session within counts as an artist's operations."""
        log = OperationLog(session)
        try:
            yield log
        finally:
            log.stop()
            summary = log.summary()
            self.operations += summary["operations"]
            self.undos += summary["undos"]
