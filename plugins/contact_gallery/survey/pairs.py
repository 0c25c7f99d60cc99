"""Which pictures are compared, which of the two stands first, and the key that says so."""

from __future__ import annotations

import json
import random
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from contact_core.atomic_file import read_bounded
from contact_core.errors import FileRefused, InvalidInput
from contact_core.strict_table import Table

SCHEMA, MOST_BYTES, MOST_PAIRS = "contact.survey.key", 1 << 20, 200
SUFFIXES = (".png", ".jpg", ".jpeg")
QUESTIONS: Mapping[str, str] = {  # the paper's four, in its order
    "appeal": "Which of the two looks better overall?",
    "plausible": "Which of the two is physically more plausible?",
    "complex": "Which of the two is more complex?",
    "natural": "Which of the two looks more natural?",
}


@dataclass(frozen=True)
class Pair:
    """A pair of pictures: its number, the item, and which of the two sets (0 or 1) stands first."""

    number: int
    item: str
    first: int


@dataclass(frozen=True)
class Key:
    """What tells whose picture is whose: the survey's id, the names of both sets, and the pairs."""

    survey: str
    sets: tuple[str, str]
    pairs: tuple[Pair, ...]

    def to_json(self) -> str:
        content = {"schema": SCHEMA, "version": 1, "questions": dict(QUESTIONS), **asdict(self)}
        return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


def draw_lots(items: list[str], sets: tuple[str, str], seed: int) -> Key:
    """A key for items: their order and their sides by lot, as many of the one set first as of the other, or one
    more. The same seed draws the same lots."""
    lots = random.Random(seed)
    order, sides = list(items), [place % 2 for place in range(len(items))]
    lots.shuffle(order)
    lots.shuffle(sides)
    pairs = tuple(
        Pair(number, item, side) for number, (item, side) in enumerate(zip(order, sides, strict=True), start=1)
    )
    return Key(f"{lots.getrandbits(48):012x}", sets, pairs)


def common_items(first: Path, second: Path) -> tuple[list[tuple[str, Path, Path]], list[str]]:
    """Pictures that both folders have at the same place (`mug/picture.png`), and those that only one has.

    Raises InvalidInput where there is no pair, or more than MOST_PAIRS.
    """
    here, there = _pictures(first), _pictures(second)
    both = sorted(here.keys() & there.keys())
    if not 0 < len(both) <= MOST_PAIRS:
        raise InvalidInput(
            f"{first} and {second} must share 1 to {MOST_PAIRS} pictures of the same names, but share {len(both)}."
        )
    return [(item, here[item], there[item]) for item in both], sorted(here.keys() ^ there.keys())


def _pictures(folder: Path) -> dict[str, Path]:
    if not folder.is_dir():
        raise InvalidInput(f"{folder} is no folder; give two folders of pictures, as `contact batch` leaves them.")
    found = [path for path in sorted(folder.rglob("*")) if path.suffix.lower() in SUFFIXES and path.is_file()]
    return {path.relative_to(folder).with_suffix("").as_posix(): path for path in found}


def read_key(path: Path) -> Key:
    """A key that `Key.to_json` wrote. Raises FileRefused."""
    table = read_table(path, SCHEMA)
    try:
        pairs = [
            Pair(row.count("number", at_least=1), row.text("item"), row.count("first", at_most=1))
            for row in table.tables("pairs")
        ]
        survey, names = table.text("survey"), table.texts("sets")
        table.raw("questions")  # for who reads the key; the tally knows them
        table.done()
    except InvalidInput as error:
        raise FileRefused(str(error)) from error
    if len(names) != 2:
        raise FileRefused(f"{path} must name two sets, but names {len(names)}.")
    return Key(survey, (names[0], names[1]), tuple(pairs))


def read_table(path: Path, schema: str) -> Table:
    """The JSON object in a small file that says that it is of `schema`, version 1. Raises FileRefused."""
    try:
        content: Any = json.loads(read_bounded(path, MOST_BYTES))
    except (ValueError, RecursionError) as error:
        raise FileRefused(f"{path} is not JSON: {error}.") from error
    if not isinstance(content, dict) or content.get("schema") != schema or content.get("version") != 1:
        raise FileRefused(f"{path} must say that it is {schema!r}, version 1; give the file that was saved.")
    return Table({name: value for name, value in content.items() if name not in ("schema", "version")}, str(path))
