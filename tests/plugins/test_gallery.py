"""The gallery: its page names every figure, a fast part is made again here, and its log holds what was done."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

import contact_builtins
import contact_core as contact
from contact_core.cli import main
from contact_core.edit.operation_log import OperationLog
from contact_core.plugins.manager import PluginManager
from contact_gallery.exhibition import exhibit
from contact_gallery.figure import figure, names
from contact_gallery.page import page

FAST = ("geodesics", "parameterisation", "sampling", "contact_models", "bulk_transfer")
PICTURE, PICTURES = 200_000, 4_000_000  # bytes at most


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, dict[str, str]]]:
    """A folder with some figures, drawn by the renderer that needs nothing, and what each measured."""
    out = tmp_path_factory.mktemp("gallery")
    records = exhibit(FAST, out, PluginManager([contact_builtins], discover=False), width=240)
    return out, {one["name"]: {row["what"]: row["here"] for row in one["measures"]} for one in records}


def test_every_module_of_figures_is_in_the_order_and_has_a_text() -> None:
    import contact_gallery.figures as figures

    folder = Path(figures.__file__).parent
    assert sorted(names()) == sorted(path.stem for path in folder.glob("[a-z]*.py"))
    for name in names():
        one = figure(name)
        assert one.title and len(one.text) > 80 and one.paper, name
        assert len(one.source.splitlines()) <= 120, f"{name}: an example that long is not read"


def test_the_page_names_every_figure_and_its_pictures_are_there_and_small(repository: Path) -> None:
    page = (repository / "docs" / "gallery.md").read_text(encoding="utf-8")
    total = 0
    for name in names():
        assert f"{{: #{name} }}" in page and figure(name).source.rstrip() in page, (
            f"contact gallery {name} --out docs"
        )
    for picture in re.findall(r"\]\((gallery/[^)]+)\)", page):
        size = (repository / "docs" / picture).stat().st_size
        assert size <= PICTURE, picture
        total += size
    assert 0 < total <= PICTURES


def test_a_figure_leaves_its_pictures_its_measures_and_its_part_of_the_page(
    made: tuple[Path, dict[str, dict[str, str]]],
) -> None:
    out, _ = made
    page = (out / "gallery.md").read_text(encoding="utf-8")
    for name in FAST:
        record = json.loads((out / "gallery" / f"{name}.json").read_text(encoding="utf-8"))
        assert record["measures"] and (record["operations"] > 0 or name == "geodesics")
        for picture in record["pictures"]:
            assert (out / "gallery" / picture).stat().st_size > 1000 and f"gallery/{picture}" in page


def test_the_paper_s_claims_on_transfer_hold(made: tuple[Path, dict[str, dict[str, str]]]) -> None:
    """No folds on the rabbit, in one operation; few on the pole by the axis model and many by one log map."""
    measured = made[1]
    for place in ("onto the head", "onto the back"):
        assert measured["bulk_transfer"][f"{place}: folds, points off the surface"] == "0, 0"
        assert measured["bulk_transfer"][f"{place}: operations"] == "1"
    folds = [int(text.split(",")[0]) for what, text in measured["contact_models"].items() if "folded" in what]
    assert folds[0] == 0 and folds[1] > 50
    assert measured["parameterisation"]["folds on the ball"] == "0"
    lost = [text for what, text in measured["geodesics"].items() if "by chains" in what]
    assert (
        float(lost[0].removesuffix(" cubes")) < 1e-9
    )  # a chain leads back behind a corner, a straight line does not


def test_the_page_counts_what_each_pose_took() -> None:
    effort = {
        "pose": "A grip",
        "tools": {"paint": 2, "rotate": 1, "pair": 2, "solve": 1},
        "undos": 3,
        "seconds": 1.26,
    }
    record = {"pictures": ["x.jpg"], "captions": [["x"]], "measures": [], "seconds": 2.0, "operations": 6}
    written = page([(figure("mug_handle"), {**record, "efforts": [effort]})])
    assert "| [A grip](#mug_handle) | 2 | 0 | 1 | 2 | 1 | 6 | 3 | 1.3 |" in written
    assert "Operations and seconds" not in page([(figure("mug_handle"), record)])


def test_an_unknown_figure_is_one_sentence_and_nothing_is_made(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert main(["gallery", "tool_overview", "mona_lisa", "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr()
    assert said.out == "" and "no figure 'mona_lisa'" in said.err and len(said.err.strip().splitlines()) == 1
    assert main(["gallery", "--out", str(tmp_path / "out")]) == 2
    assert not (tmp_path / "out").exists()


def test_the_figures_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["gallery", "--list", "--json"]) == 0
    assert tuple(json.loads(capsys.readouterr().out)) == names()


def test_the_operation_log_counts_what_is_done_and_undone_and_names_nobody(tmp_path: Path) -> None:
    ticks = iter(range(100))
    with contact.new(secret="sample:baseball", plugins=[contact_builtins], discover=False) as session:
        log = OperationLog(session, clock=lambda: float(next(ticks)))
        session.patches.brush("disk", "private", surface="secret", at=[(0.04, 0.0, 0.0)], radius=0.01)
        session.patches.rotate("private", 0.5)
        with session.stroke() as stroke:  # one operation, however long the drag
            for angle in (0.1, 0.2, 0.3):
                stroke.patches.rotate("private", angle)
        session.undo()
        log.stop()
        session.redo()
        log.write(tmp_path / "log.json")
    kept = json.loads((tmp_path / "log.json").read_text(encoding="utf-8"))
    assert kept["operations"] == 3 and kept["undos"] == 1 and kept["tools"] == {"paint": 1, "rotate": 2}
    assert [one["kind"] for one in kept["log"]] == ["do", "do", "do", "undo"]
    times = [one["at"] for one in kept["log"]]
    assert times == sorted(times) and kept["seconds"] == times[-1]
    text = (tmp_path / "log.json").read_text(encoding="utf-8")
    assert "private" not in text and "secret" not in text


def test_a_session_adds_a_line_per_operation_where_it_was_asked_to(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "operations.jsonl"
    for asked in (None, str(path), str(path), str(tmp_path)):  # a folder cannot be written: the edit goes on
        monkeypatch.setenv("CONTACT_OPERATIONS", asked or "")
        with contact.new(secret="sample:baseball", plugins=[contact_builtins], discover=False) as session:
            session.patches.brush("disk", "private", surface="secret", at=[(0.04, 0.0, 0.0)], radius=0.01)
            session.undo()
            assert not session.document.patches
    assert "the log of operations ends here" in caplog.text
    lines = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    assert [(one["tool"], one["kind"]) for one in lines] == 2 * [("paint", "do"), ("paint", "undo")]
    assert len({one["session"] for one in lines}) == 2 and all(one["at"] >= 0.0 for one in lines)
