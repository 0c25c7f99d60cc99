"""The table clause x subject that `pytest --contact-report` prints and docs/contract-report.md holds."""

from __future__ import annotations

import json
from dataclasses import dataclass, field

PROPERTY = "contact_clause"
KEPT, BROKEN, DECLINED, SKIPPED = "kept", "BROKEN", "declined", "skipped"
_WORST_FIRST = (BROKEN, SKIPPED, KEPT, DECLINED)


@dataclass
class ContractReport:
    """Outcomes by (contract, subject, clause); several runs of one clause (parameters) give the worst of them."""

    texts: dict[tuple[str, str], str] = field(default_factory=dict)  # (about, clause) -> sentence
    outcomes: dict[tuple[str, str, str], str] = field(default_factory=dict)  # (about, subject, clause) -> outcome
    reasons: dict[tuple[str, str, str], str] = field(default_factory=dict)  # declined only

    def promised(self, about: str, subject: str, clause: str, text: str, reason: str | None) -> None:
        """Note a clause that was collected: a clause that is not declined counts as kept until it ran."""
        self._note((about, subject, clause), text, reason, KEPT)

    def ran(
        self,
        about: str,
        subject: str,
        clause: str,
        text: str,
        reason: str | None,
        *,
        outcome: str,
        when: str | None,
    ) -> None:
        """Note one phase (setup, call, teardown) of one test."""
        if outcome == "failed":
            self._note((about, subject, clause), text, reason, BROKEN)
        elif outcome == "skipped":
            self._note((about, subject, clause), text, reason, SKIPPED)
        elif when == "call":
            self._note((about, subject, clause), text, reason, KEPT)

    def _note(self, key: tuple[str, str, str], text: str, reason: str | None, outcome: str) -> None:
        self.texts[key[0], key[2]] = text
        if reason is not None:
            outcome = DECLINED
            self.reasons[key] = reason
        before = self.outcomes.get(key, outcome)
        self.outcomes[key] = min(before, outcome, key=_WORST_FIRST.index)

    def broken(self) -> dict[str, list[str]]:
        """Clauses that did not hold, in order, by subject; subjects that keep everything are left in, empty."""
        result: dict[str, list[str]] = {subject: [] for _, subject, _ in self.outcomes}
        for (_, subject, clause), outcome in sorted(self.outcomes.items()):
            if outcome == BROKEN:
                result[subject].append(clause)
        return result

    def tables(self) -> list[tuple[str, list[str], list[list[str]]]]:
        """Per contract: its name, the subjects, and rows of clause, sentence and one outcome per subject."""
        result = []
        for about in sorted({key[0] for key in self.outcomes}):
            subjects = sorted({key[1] for key in self.outcomes if key[0] == about})
            rows = [
                [clause, text, *(self.outcomes.get((about, subject, clause), "") for subject in subjects)]
                for (kind, clause), text in sorted(self.texts.items())
                if kind == about
            ]
            result.append((about, subjects, rows))
        return result

    def text(self) -> str:
        """For a terminal."""
        lines = []
        for about, subjects, rows in self.tables():
            widths = [max(8, len(subject)) for subject in subjects]
            lines.append(f"{about:<6}" + "".join(f" {s:<{w}}" for s, w in zip(subjects, widths, strict=True)))
            for clause, text, *outcomes in rows:
                cells = "".join(f" {o:<{w}}" for o, w in zip(outcomes, widths, strict=True))
                lines.append(f"  {clause:<4}{cells}  {text}")
        lines += [f"{key[1]} declines {key[2]}: {reason}" for key, reason in sorted(self.reasons.items())]
        return "\n".join(lines)

    def json(self) -> str:
        """For other programs: outcomes by contract, subject and clause, and the broken clauses by subject."""
        outcomes = [[*key, outcome] for key, outcome in sorted(self.outcomes.items())]
        reasons = [[*key, reason] for key, reason in sorted(self.reasons.items())]
        return json.dumps({"outcomes": outcomes, "declined": reasons, "broken": self.broken()}, indent=1) + "\n"

    def markdown(self) -> str:
        """For docs/contract-report.md."""
        lines = ["# Which subject keeps which clause", "", "Written by `pytest --contact-report-file`."]
        for about, subjects, rows in self.tables():
            lines += ["", f"## {about}", "", "| clause | promise | " + " | ".join(subjects) + " |"]
            lines += ["|---" * (2 + len(subjects)) + "|"]
            lines += ["| " + " | ".join(row) + " |" for row in rows]
        if self.reasons:
            lines += ["", "## Declined", ""]
            lines += [f"- {key[1]}, {key[2]}: {reason}" for key, reason in sorted(self.reasons.items())]
        return "\n".join(lines) + "\n"
