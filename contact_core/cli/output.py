"""How the command line talks: answers on stdout, progress and errors on stderr, JSON when asked."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

_SHOW_AFTER_S = 1.0  # a bar for anything longer than a second, and none for what is over at once


class Output:
    """json: one JSON document on stdout and nothing else. quiet: no progress and no remarks."""

    def __init__(self, *, json: bool = False, quiet: bool = False) -> None:
        self.json = json
        self.quiet = quiet
        self._bar: Progress | None = None
        self._task: TaskID | None = None
        self._since = time.monotonic()

    def answer(self, data: Mapping[str, Any] | Sequence[Any], text: str) -> None:
        """The result of a command: `data` when JSON was asked for, else `text`."""
        print(json.dumps(data, indent=2, ensure_ascii=False) if self.json else text)  # noqa: T201  # the one place

    def remark(self, text: str) -> None:
        """Something worth knowing that is not the answer."""
        if not self.quiet:
            print(text, file=sys.stderr)  # noqa: T201

    @staticmethod
    def error(text: str) -> None:
        """One sentence on stderr."""
        print(f"contact: {text}", file=sys.stderr)  # noqa: T201

    def progress(self, fraction: float, text: str) -> bool:
        """A step of something long: fraction 0..1 done. Always True: on a command line, Ctrl+C is what cancels."""
        if not self.quiet and sys.stderr.isatty():
            if self._bar is None and time.monotonic() - self._since > _SHOW_AFTER_S:
                self._start(text)
            if self._bar is not None and self._task is not None:
                self._bar.update(self._task, completed=fraction, description=text)
        return True

    def _start(self, text: str) -> None:
        from rich.console import Console
        from rich.progress import Progress

        self._bar = Progress(console=Console(stderr=True), transient=True)
        self._task = self._bar.add_task(text, total=1.0)
        self._bar.start()

    @contextmanager
    def closing(self) -> Iterator[Output]:
        """Takes the bar away at the end, whatever happens."""
        try:
            yield self
        finally:
            if self._bar is not None:
                self._bar.stop()


def columns(rows: Sequence[Sequence[str]], *, indent: str = "") -> str:
    """Rows as lines with aligned columns, two spaces between; the last column is left as it is."""
    if not rows:
        return ""
    widths = [max(len(row[k]) for row in rows if k < len(row)) for k in range(max(map(len, rows)))]
    lines = []
    for row in rows:
        cells = [cell if k == len(row) - 1 else cell.ljust(widths[k]) for k, cell in enumerate(row)]
        lines.append(indent + "  ".join(cells))
    return "\n".join(lines)
