"""What an interaction tells a front end: what changed, and the line of status."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from contact_core.interaction.work import WorkStatus

Part: TypeAlias = Literal[
    "document", "overlay", "selection", "tool", "settings", "status", "work", "visibility", "film"
]


@dataclass(frozen=True)
class Changes:
    """What changed since the last call. surfaces: those whose points or places moved, or that came or went. parts:
    what else a front end may show."""

    surfaces: frozenset[str] = frozenset()
    parts: frozenset[Part] = frozenset()

    def __bool__(self) -> bool:
        return bool(self.surfaces or self.parts)


@dataclass(frozen=True)
class Status:
    """The line of status. refusal: the last sentence that something was refused with, until the next event that
    works. remark: what is worth knowing of what was done last. solve_ms: of the last live solve. proposed: what
    waits to be accepted, in a few words."""

    tool: str
    hint: str
    surface: str | None
    refusal: str
    solve_ms: float | None
    work: WorkStatus | None
    proposed: str
    remark: str = ""

    def line(self) -> str:
        """All of it as one line of text."""
        parts = [self.tool, f"on {self.surface}" if self.surface else "", self.hint, self.proposed]
        if self.work is not None:
            share = "" if self.work.fraction is None else f" {100 * self.work.fraction:.0f} %"
            parts.append(f"{self.work.title}{share} {self.work.text}".strip())
        if self.solve_ms is not None:
            parts.append(f"solve {self.solve_ms:.0f} ms")
        return " · ".join(part for part in [*parts, self.remark, self.refusal] if part)
