"""How the command line talks: answers on stdout, progress and errors on stderr, JSON when asked."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TextIO

from contact_core.progress import Progress

if TYPE_CHECKING:
    from rich.progress import Progress as Bar
    from rich.progress import TaskID

_SHOW_AFTER_S = 1.0  # a bar for anything longer than a second, and none for what is over at once


class Output(Progress):
    """How a command answers, and the progress that is told: on a command line, Ctrl+C is what cancels.

    json: one JSON document on stdout and nothing else. quiet: no progress and no remarks. stdout: where answers
    go, where sys.stdout is lent to others."""

    def __init__(self, *, json: bool = False, quiet: bool = False, stdout: TextIO | None = None) -> None:
        self.json = json
        self.quiet = quiet
        self._stdout = stdout
        self._bar: Bar | None = None
        self._task: TaskID | None = None
        self._since = time.monotonic()

    def answer(self, data: Mapping[str, Any] | Sequence[Any], text: str) -> None:
        """The result of a command: `data` when JSON was asked for, else `text`."""
        stdout = self._stdout or sys.stdout
        if self.json:
            text = json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False)
            if not _fits(text, stdout):  # still the same JSON
                text = json.dumps(data, indent=2, allow_nan=False)
        _say(text, stdout)

    def remark(self, text: str) -> None:
        """Something worth knowing that is not the answer."""
        if not self.quiet:
            _say(text, sys.stderr)

    @staticmethod
    def error(text: str) -> None:
        """One sentence on stderr."""
        _say(" ".join(f"contact: {text}".split()), sys.stderr)

    def tell(self, fraction: float | None, text: str) -> None:
        """A bar on stderr, where that is a terminal and the work takes more than a second."""
        if not self.quiet and sys.stderr.isatty():
            if self._bar is None and time.monotonic() - self._since > _SHOW_AFTER_S:
                self._start(text)
            if self._bar is not None and self._task is not None:
                self._bar.update(self._task, completed=fraction, description=text)

    def _start(self, text: str) -> None:
        from rich.console import Console
        from rich.progress import Progress as Bar

        self._bar = Bar(console=Console(stderr=True), transient=True)
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


def _say(text: str, stream: TextIO) -> None:
    """Print, and learn at once when nobody can read it; letters that the stream does not know are spelt out."""
    if not _fits(text, stream):
        text = text.encode("ascii", "backslashreplace").decode()
    print(text, file=stream, flush=True)  # the one place


def _fits(text: str, stream: TextIO) -> bool:
    """Whether a stream can print a text: a terminal in the C locale knows no umlaut."""
    try:
        text.encode(getattr(stream, "encoding", None) or "utf-8", getattr(stream, "errors", None) or "strict")
    except UnicodeEncodeError:
        return False
    return True


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
