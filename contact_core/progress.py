"""Progress of long work, and its cancelling: one protocol for solvers, jobs, hosts and the command line.

Who works calls `tell`; who watches shows it, or raises `Cancelled` from it. Nothing is returned, so the two cannot
misunderstand each other.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable


@runtime_checkable
class Progress(Protocol):
    """Somebody who is told how far long work has come. Derive from it and define `tell`."""

    @abstractmethod
    def tell(self, fraction: float | None, text: str) -> None:
        """fraction: 0 to 1 done; None where nobody knows. text: what is being done, for people.

        Raises Cancelled when the work is to stop.
        """
        ...

    def part(self, start: float, end: float, label: str = "") -> Progress:
        """The progress of a part of the work: its fractions 0 to 1 are told as start to end, after a label."""
        return _Part(self, start, end, label)


@dataclass(frozen=True)
class _Part(Progress):
    whole: Progress
    start: float
    end: float
    label: str

    def tell(self, fraction: float | None, text: str) -> None:
        share = None if fraction is None else self.start + (self.end - self.start) * min(max(fraction, 0.0), 1.0)
        self.whole.tell(share, f"{self.label}: {text}" if self.label and text else self.label or text)


class _NoProgress(Progress):
    def tell(self, fraction: float | None, text: str) -> None:
        pass

    def part(self, start: float, end: float, label: str = "") -> Progress:
        return self


NO_PROGRESS: Progress = _NoProgress()  # nobody watches, nothing is cancelled


@dataclass(frozen=True)
class CallbackProgress(Progress):
    """A function as a progress; it raises Cancelled to stop the work, and what it returns is ignored."""

    call: Callable[[float | None, str], object]

    def tell(self, fraction: float | None, text: str) -> None:
        self.call(fraction, text)
