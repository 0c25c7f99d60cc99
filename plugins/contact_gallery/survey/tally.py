"""Answers against the key: votes, the paper's scores, and how likely chance alone would be as one-sided."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from contact_core.atomic_file import read_bounded
from contact_core.errors import FileRefused, InvalidInput
from contact_core.strict_table import Table
from contact_gallery.survey.pairs import MOST_BYTES, QUESTIONS, Key, read_table

SCHEMA, COLUMNS = "contact.survey.answers", ("survey", "person", "pair", "question", "choice")
CHOICES = ("first", "second", "same")
MAJORITY = 4  # votes more than the other needs, to win a pair (the paper's rule)


@dataclass(frozen=True)
class Answer:
    """What a person chose of a pair: 0 or 1, the number of a set, or None for neither."""

    person: str
    pair: int
    question: str
    chosen: int | None


def read_answers(paths: Sequence[Path], key: Key) -> list[Answer]:
    """The answers in files (.json as the page saves them, or .csv), as sets of the key.

    A row without a choice was not answered. Raises FileRefused for a file of another survey, an unknown pair, and a
    person who answers a question twice.
    """
    sides, found = {pair.number: pair.first for pair in key.pairs}, dict[tuple[str, int, str], Answer]()
    for path in paths:
        for person, row in _rows(path, key):
            try:
                number, question = row.count("pair"), row.choice("question", tuple(QUESTIONS))
                choice = row.choice("choice", CHOICES)
                row.done()
            except InvalidInput as error:
                raise FileRefused(str(error)) from error
            if number not in sides:
                raise FileRefused(f"{path} answers pair {number}, but the survey has pairs 1 to {len(sides)}.")
            chosen = None if choice == "same" else sides[number] ^ CHOICES.index(choice)
            if (person, number, question) in found:
                raise FileRefused(f"{path} answers pair {number}, {question}, twice for {person!r}; leave one out.")
            found[person, number, question] = Answer(person, number, question, chosen)
    return list(found.values())


def tally(key: Key, answers: Sequence[Answer]) -> list[dict[str, Any]]:
    """A row per question, in the paper's order.

    votes: for each set, and for neither. score: for each set, 1 for a pair that it won by MAJORITY votes or more
    and 0.5 for an even one, as in the paper's table. p_votes: two-sided binomial test of the votes against a coin,
    neither left out. p_pairs: the same of the pairs by who has more votes, which is the careful one: the votes on
    one pair, and those of one person, are not independent.
    """
    rows = []
    for question in QUESTIONS:
        votes = {pair.number: Counter[int | None]() for pair in key.pairs}
        for answer in answers:
            if answer.question == question:
                votes[answer.pair][answer.chosen] += 1
        leads = [count[0] - count[1] for count in votes.values() if count.total()]
        total = sum(votes.values(), Counter[int | None]())
        won = [sum(_score(sign * lead) for lead in leads) for sign in (1, -1)]
        more = [sum(sign * lead > 0 for lead in leads) for sign in (1, -1)]
        rows.append(
            {
                "question": question,
                "votes": [total[0], total[1], total[None]],
                "score": won,
                "p_votes": chance(total[0], total[1]),
                "p_pairs": chance(*more),
            }
        )
    return rows


def chance(one: int, other: int) -> float:
    """How likely a fair coin is to fall at least as one-sidedly: the exact two-sided binomial test, 1 of none."""
    from scipy.stats import binomtest

    return float(binomtest(one, one + other).pvalue) if one + other else 1.0


def _score(lead: int) -> float:
    """A pair's, for whom leads it by so many votes."""
    return 0.5 if abs(lead) < MAJORITY else float(lead > 0)


def _rows(path: Path, key: Key) -> Iterator[tuple[str, Table]]:
    """Person and row of each answer in a file of this survey."""
    if path.suffix.lower() == ".csv":
        yield from _csv_rows(path, key)
        return
    table = read_table(path, SCHEMA)
    try:
        survey, person, rows = table.text("survey"), table.text("person"), list(table.tables("answers"))
        table.done()
    except InvalidInput as error:
        raise FileRefused(str(error)) from error
    _check_survey(path, survey, key)
    yield from ((person, row) for row in rows)


def _csv_rows(path: Path, key: Key) -> Iterator[tuple[str, Table]]:
    try:
        text = read_bounded(path, MOST_BYTES).decode("utf-8-sig")
        rows = list(csv.DictReader(io.StringIO(text), restkey="more", strict=True))
    except (ValueError, csv.Error) as error:
        raise FileRefused(f"{path} is no table of answers: {error}.") from error
    for number, row in enumerate(rows, start=2):
        if set(row) != set(COLUMNS) or None in row.values():
            raise FileRefused(f"{path}, line {number}: expected the columns {', '.join(COLUMNS)}.")
        if not row["choice"].strip():
            continue
        _check_survey(path, row["survey"], key)
        pair = int(row["pair"]) if row["pair"].isascii() and row["pair"].isdigit() else row["pair"]
        values = {"pair": pair, "question": row["question"].strip(), "choice": row["choice"].strip().lower()}
        yield row["person"].strip() or path.stem, Table(values, f"{path}, line {number}")


def _check_survey(path: Path, survey: str, key: Key) -> None:
    if survey != key.survey:
        raise FileRefused(f"{path} answers survey {survey!r}, but the key is of {key.survey!r}; find its own key.")
