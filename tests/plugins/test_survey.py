"""A survey: sheets that give nothing away, a key, and a tally that finds what people preferred."""

from __future__ import annotations

import contextlib
import csv
import json
import math
import shutil
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from contact_core.cli import main
from contact_core.errors import FileRefused
from contact_gallery.survey.pairs import QUESTIONS, draw_lots, read_key
from contact_gallery.survey.sheets import make_survey
from contact_gallery.survey.tally import chance, read_answers, tally

Image = pytest.importorskip("PIL.Image")
ITEMS = ("ball", "deep/mug", "pole", "scissors")
OURS, THEIRS = (200, 30, 30), (30, 30, 200)


@pytest.fixture
def folders(tmp_path: Path) -> tuple[Path, Path]:
    """Pictures of two methods, told apart by colour, one method's smaller and with words in its files."""
    from PIL.PngImagePlugin import PngInfo

    words = PngInfo()
    words.add_text("Author", "theirs")
    for folder, color, size in (("ours", OURS, (60, 40)), ("theirs", THEIRS, (30, 20))):
        for item in ITEMS:
            path = tmp_path / folder / f"{item}.png"
            path.parent.mkdir(parents=True, exist_ok=True)
            Image.new("RGB", size, color).save(path, pnginfo=words if folder == "theirs" else None)
    (tmp_path / "ours" / "alone.jpg").write_bytes((tmp_path / "ours" / "ball.png").read_bytes())
    return tmp_path / "ours", tmp_path / "theirs"


def answered(out: Path, person: str, choose: dict[int, str] | None = None) -> Path:
    """Answers of a person who prefers red, and looks at nothing but the pictures."""
    rows, key = [], json.loads((out / "key.json").read_text(encoding="utf-8"))
    for pair in range(1, len(key["pairs"]) + 1):
        red = [side for side in ("first", "second") if center(out / "sheets" / f"{pair}-{side}.png") == OURS]
        rows += [{"pair": pair, "question": q, "choice": (choose or {}).get(pair, red[0])} for q in QUESTIONS]
    saved = {"schema": "contact.survey.answers", "version": 1, "survey": key["survey"], "person": person}
    path = out.parent / f"{person}.json"
    path.write_text(json.dumps({**saved, "answers": rows}), encoding="utf-8")
    return path


def center(path: Path) -> tuple[int, int, int]:
    with Image.open(path) as picture:
        return tuple(picture.getpixel((picture.width // 2, picture.height // 2)))


def test_the_sheets_give_nothing_away_and_the_key_tells_all(folders: tuple[Path, Path], tmp_path: Path) -> None:
    key, alone = make_survey(folders, tmp_path / "out", seed=3, names=("our way", "their way"))
    assert alone == ["alone"] and sorted(pair.item for pair in key.pairs) == sorted(ITEMS)
    assert sorted(pair.first for pair in key.pairs) == [0, 0, 1, 1]  # no side is the better one by accident
    sheets = [path for path in (tmp_path / "out" / "sheets").rglob("*") if path.is_file()]
    for path in sheets:
        raw = path.read_bytes()
        assert not any(word in raw for word in (b"our way", b"their", b"mug", b"ours", b"Author")), path
    pictures = [Image.open(path) for path in sheets if path.suffix == ".png" and path.parent.name == "sheets"]
    assert {picture.size for picture in pictures} == {(60, 40)} and not any(picture.info for picture in pictures)
    assert read_key(tmp_path / "out" / "key.json") == key
    for pair in key.pairs:
        assert center(tmp_path / "out" / "sheets" / f"{pair.number}-first.png") == (OURS, THEIRS)[pair.first]
    with pytest.raises(FileRefused, match="a survey already"):
        make_survey(folders, tmp_path / "out", seed=4)


def test_lots_are_repeated_by_their_seed_alone() -> None:
    items = [f"{number}" for number in range(40)]
    one, again, other = (draw_lots(items, ("a", "b"), seed) for seed in (1, 1, 2))
    assert one == again and one.survey != other.survey and one.pairs != other.pairs


def test_what_people_preferred_is_found_behind_the_sides(folders: tuple[Path, Path], tmp_path: Path) -> None:
    key, _ = make_survey(folders, tmp_path / "out", seed=5)
    papers = [answered(tmp_path / "out", f"p{number}", {1: "same"}) for number in range(4)]
    rows = tally(key, read_answers(papers, key))
    assert [row["question"] for row in rows] == list(QUESTIONS)
    for row in rows:
        assert row["votes"] == [12, 0, 4] and row["score"] == [3.5, 0.5]
        assert row["p_votes"] == pytest.approx(2 * 0.5**12) and row["p_pairs"] == pytest.approx(0.25)


def test_the_page_asks_everybody_in_another_order_and_its_answers_fit_the_key(
    folders: tuple[Path, Path], tmp_path: Path
) -> None:
    """In a real browser, offline: who prefers red clicks on what is red, and nothing is asked for elsewhere."""
    key, _ = make_survey(folders, tmp_path / "out", seed=7)
    sides, asked, orders, saved = {pair.number: pair.first for pair in key.pairs}, list[str](), set(), []
    with chromium(tmp_path) as browser:
        for person in range(2):
            page = browser.new_page()
            page.on("request", lambda request: asked.append(request.url))
            page.goto((tmp_path / "out" / "sheets" / "index.html").as_uri())
            for section in page.locator("section").all():
                first, _ = (shown.get_attribute("src") for shown in section.locator("img").all())
                number, side = first.removesuffix(".png").split("-")
                red = sides[int(number)] ^ ("first", "second").index(side)  # 0 where the left one is red
                for question in section.locator("fieldset").all():
                    question.locator("input").nth(red).check()
            orders.add(page.content())
            with page.expect_download() as download:
                page.click("#save")
            saved.append(tmp_path / f"{person}.json")
            download.value.save_as(saved[-1])
    assert len(orders) == 2 and all(url.startswith(("file:", "blob:")) for url in asked)
    assert {tuple(row["votes"]) for row in tally(key, read_answers(saved, key))} == {(8, 0, 0)}


@contextlib.contextmanager
def chromium(folder: Path) -> Iterator[Any]:
    """A headless Chromium of this system, without the limit of memory that the tests have: it reserves more."""
    api = pytest.importorskip("playwright.sync_api", reason="playwright (extra dev) drives the browser")
    found = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if found is None:
        pytest.skip("there is no Chromium here: apt-get install chromium")
    program = folder / "chromium"
    program.write_text(f'#!/bin/sh\nulimit -S -v unlimited\nexec {found} "$@"\n')
    program.chmod(0o755)
    with api.sync_playwright() as playwright:
        made = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield made
        made.close()


def test_the_binomial_test_is_the_sum_of_all_that_is_no_likelier() -> None:
    for one, other in ((0, 0), (5, 5), (9, 3), (1, 12)):
        n = one + other
        likely = [math.comb(n, k) * 0.5**n for k in range(n + 1)]
        expected = math.fsum(p for p in likely if p <= likely[one] * (1 + 1e-9))
        assert chance(one, other) == pytest.approx(expected)


def test_printed_pairs_are_answered_in_the_table_that_lies_with_them(
    folders: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["survey", "make", *map(str, folders), "--names", "a", "b", "--seed", "1", "--out", str(out)]) == 0
    with (out / "sheets" / "print" / "answers.csv").open(encoding="utf-8", newline="") as blank:
        rows = list(csv.DictReader(blank))
    assert Counter(row["question"] for row in rows) == dict.fromkeys(QUESTIONS, len(ITEMS))
    rows[0]["choice"] = "First"
    filled = tmp_path / "filled.csv"
    with filled.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    capsys.readouterr()
    assert main(["survey", "tally", str(out / "key.json"), str(filled), "--json"]) == 0
    counted = json.loads(capsys.readouterr().out)
    assert counted["sets"] == ["a", "b"] and counted["people"] == 1
    assert sum(map(sum, (row["votes"] for row in counted["questions"]))) == 1


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"survey": "other"}, "find its own key"),
        ({"version": 2}, "version 1"),
        ({"answers": [{"pair": 9, "question": "appeal", "choice": "same"}]}, "pairs 1 to 4"),
        ({"answers": [{"pair": 1, "question": "taste", "choice": "same"}]}, "question must be one of"),
        ({"answers": 2 * [{"pair": 1, "question": "appeal", "choice": "same"}]}, "twice"),
    ],
)
def test_answers_that_do_not_fit_are_one_sentence(
    folders: tuple[Path, Path], tmp_path: Path, change: dict[str, object], said: str,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    make_survey(folders, tmp_path / "out", seed=5)
    path = answered(tmp_path / "out", "p")
    path.write_text(json.dumps({**json.loads(path.read_text(encoding="utf-8")), **change}), encoding="utf-8")
    assert main(["survey", "tally", str(tmp_path / "out" / "key.json"), str(path)]) == 2
    told = capsys.readouterr().err
    assert said in told and len(told.strip().splitlines()) == 1
