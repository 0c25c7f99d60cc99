"""What is handed out: a page that asks, and the pictures of each pair, which do not tell whose they are."""

from __future__ import annotations

import json
from importlib.resources import files
from pathlib import Path
from typing import Any

from contact_core.atomic_file import replacing, write_atomic
from contact_core.errors import FileRefused, InvalidInput, MissingExtra
from contact_gallery.survey.pairs import QUESTIONS, Key, common_items, draw_lots

WIDEST, GAP = 900, 24  # pixels: of a picture, and between the two of a printed pair
SIDES = ("first", "second")


def make_survey(
    folders: tuple[Path, Path], out: Path, *, seed: int, names: tuple[str, str] | None = None
) -> tuple[Key, list[str]]:
    """Write `out`/sheets, to hand out, and `out`/key.json, to keep. Returns the key and what had no partner.

    folders: of pictures; those at the same place in both are a pair. names: of the two in the tally, else those
    of the folders. A survey that is there already is never overwritten: its key would fit its answers no more.
    Raises InvalidInput, FileRefused, and MissingExtra without Pillow.
    """
    if (out / "key.json").exists() or (out / "sheets").exists():
        raise FileRefused(f"{out} holds a survey already; give another folder, or delete it.")
    items, alone = common_items(*folders)
    sets = names or (str(folders[0]), str(folders[1]))
    if sets[0] == sets[1]:
        raise InvalidInput(f"the two sets are compared, but both are {sets[0]!r}; name them apart.")
    key, found = draw_lots([item for item, _, _ in items], sets, seed), {item: both for item, *both in items}
    for pair in key.pairs:
        one, two = _alike([found[pair.item][pair.first], found[pair.item][1 - pair.first]])
        for side, picture in zip(SIDES, (one, two), strict=True):
            _save(picture, out / "sheets" / f"{pair.number}-{side}.png")
        _save(_beside(one, two), out / "sheets" / "print" / f"{pair.number}.png")
    write_atomic(out / "sheets" / "index.html", page(key))
    write_atomic(out / "sheets" / "print" / "answers.csv", blank(key))
    write_atomic(out / "key.json", key.to_json())
    return key, alone


def page(key: Key) -> str:
    """The page that asks. It holds no item's name and no set's: only numbers."""
    asked = {"survey": key.survey, "pairs": [pair.number for pair in key.pairs], "questions": dict(QUESTIONS)}
    data = json.dumps(asked, ensure_ascii=False).replace("<", "\\u003c")
    return (files("contact_gallery.survey") / "page.html").read_text(encoding="utf-8").replace("{ASKED}", data)


def blank(key: Key) -> str:
    """The answers of one person as CSV, to be filled in where the pairs were printed."""
    rows = [f"{key.survey},,{pair.number},{question}," for pair in key.pairs for question in QUESTIONS]
    return "\n".join(["survey,person,pair,question,choice", *rows]) + "\n"


def _alike(paths: list[Path]) -> list[Any]:
    """Two pictures of one size, in RGB, with nothing of their files but the pixels."""
    try:
        from PIL import Image, ImageOps
    except ImportError:
        raise MissingExtra("a survey's pictures", "movies") from None
    opened = []
    for path in paths:
        try:
            with Image.open(path, formats=["PNG", "JPEG"]) as picture:
                opened.append(picture.convert("RGB"))
        except (OSError, ValueError, Image.DecompressionBombError) as error:
            raise FileRefused(f"{path} is no picture that can be read: {error}.") from error
    most = [min(WIDEST, max(picture.size[axis] for picture in opened)) for axis in (0, 1)]
    return [ImageOps.pad(picture, (most[0], most[1]), color="white") for picture in opened]


def _beside(one: Any, two: Any) -> Any:
    from PIL import Image

    both = Image.new("RGB", (one.width + GAP + two.width, one.height), "white")
    both.paste(one, (0, 0))
    both.paste(two, (one.width + GAP, 0))
    return both


def _save(picture: Any, path: Path) -> None:
    with replacing(path) as written:
        picture.save(written, format="PNG")
