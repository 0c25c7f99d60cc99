"""`contact library`: from a document onto the shelf, from there onto files, and sentences for what cannot be."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from contact_core.cli import main
from contact_core.document.library import ContactSet
from contact_core.document.schema import dump_document, parse_document
from contact_core.library.record import Grasp
from contact_core.library.shelf import Library
from contact_core.session import Session

Saved = tuple[Grasp, ContactSet]
FILES = ("sample:human_hand", "sample:baseball")


@pytest.fixture
def document(tmp_path: Path, held: Session) -> Path:
    path = tmp_path / "grasp.json"
    path.write_bytes(dump_document(held.document))
    return path


def test_save_list_show_apply_sheet(
    tmp_path: Path, document: Path, held: Session, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "lib"
    line = ["library", "--library", str(folder)]
    assert main([*line, "save", "a ball", str(document), *FILES, "--tag", "round", "--note", "for <b>Ann</b>"]) == 0
    assert main([*line, "list", "--json"]) == 0
    shown = capsys.readouterr().out
    assert json.loads(shown[shown.index("[") :])[0]["tags"] == ["round"]
    assert main([*line, "show", "a ball", "--picture", str(tmp_path / "ball.png")]) == 0
    assert "human_hand (right" in capsys.readouterr().out
    assert (tmp_path / "ball.png").read_bytes().startswith(b"\x89PNG")
    out = tmp_path / "out"
    assert main([*line, "apply", "a ball", *FILES, "--out", str(out), "--check", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["report"]["summary"].startswith("1 good grasp")
    made = parse_document((out / "grasp_1.json").read_bytes())
    touching = {name for pair in held.document.pairs.values() for name in (pair.manipulator, pair.object)}
    assert dict(made.patches) == {n: p for n, p in held.document.patches.items() if n in touching}
    assert (out / "sheet.png").exists()
    page = tmp_path / "page.html"
    assert main([*line, "sheet", str(page)]) == 0
    text = page.read_text(encoding="utf-8")
    assert "a ball" in text and "&lt;b&gt;Ann" in text and "<script" not in text and "data:image/png" in text


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (["list"], "there is no library"),
        (["show", "x"], "there is no library"),
        (["show", "../x"], "name of a grasp"),
        (["apply", "x", "sample:human_hand", "sample:mug", "--out", "o", "--count", "0"], "1 to 64"),
        (["save", "x", "no.json"], "give the files of the hand and of the object"),
        (["save", "x", "no.json", *FILES], "cannot read"),
        (["save", "x", "DOCUMENT", "sample:human_hand", "sample:mug"], "was not made with sample:mug"),
        (["save", "a/b", "DOCUMENT", *FILES], "name of a grasp"),
        (["save", "x", "DOCUMENT", *FILES, "--kind", "claw"], "one of power"),
        (["sheet", "x.pdf"], "HTML"),
    ],
)
def test_what_cannot_be_is_a_sentence(
    act: list[str], words: str, tmp_path: Path, document: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    act = [str(document) if word == "DOCUMENT" else word for word in act]
    assert main(["library", "--library", str(tmp_path / "nowhere"), *act]) == 2
    err = capsys.readouterr().err
    assert words in err and "Traceback" not in err
    assert not (tmp_path / "nowhere").exists()


def test_the_environment_names_the_library(
    tmp_path: Path, saved: Saved, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    Library(tmp_path / "studio").add("ball", *saved)
    monkeypatch.setenv("CONTACT_LIBRARY", str(tmp_path / "studio"))
    assert main(["library", "list"]) == 0
    assert capsys.readouterr().out.split()[:3] == ["ball", "v1", "power"]


def test_suggestions_begin_with_a_saved_grasp(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = ["grasp", "sample:human_hand", "sample:baseball", "--like", "power sphere", "--count", "1"]
    assert main([*line, "--out", str(tmp_path / "out"), "--json"]) == 0
    (entry,) = json.loads(capsys.readouterr().out)["report"]["grasps"]
    assert entry["kind"] == "power" and entry["verdict"] == "grasp"
    assert main([*line, "--out", str(tmp_path / "no"), "--library", str(tmp_path)]) == 2
    assert "has no grasp 'power sphere'" in capsys.readouterr().err
