"""The report of a batch in a real browser, from the disk: a silent console, pictures, worst first, all by keys."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contact_builtins.renderers.png import write_png
from contact_core.farm.page import page_of
from contact_core.farm.task import Result, thumbnail_of
from tests.adapters.viewer.served import CHROMIUM

RESULTS = (
    Result("seq/lost", "failed", "the file is gone."),
    Result(
        "seq/bad", "done", failures=("gap: 3 %",), badness=1.6, rows=(("gap", "3 %", True),), files=("pose.json",)
    ),
    Result(
        "seq/good", "same", badness=0.4, rows=(("gap", "1 %", False),), notes=("a note",), files=("pose #1.json",)
    ),
)


@pytest.fixture
def page(tmp_path: Path) -> Iterator[Any]:
    """A page of a headless Chromium, without the limit of memory that the tests have: it reserves more."""
    api = pytest.importorskip("playwright.sync_api", reason="playwright (extra dev) drives the browser")
    if CHROMIUM is None:
        pytest.skip("there is no Chromium here: apt-get install chromium")
    program = tmp_path / "chromium"
    program.write_text(f'#!/bin/sh\nulimit -S -v unlimited\nexec {CHROMIUM} "$@"\n')
    program.chmod(0o755)
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield browser.new_page()
        browser.close()


def test_the_report_opens_from_the_disk(page: Any, tmp_path: Path) -> None:
    write_png(np.full((90, 120, 3), 200, np.uint8), tmp_path / "a.png")
    picture = thumbnail_of(tmp_path / "a.png")
    results = (RESULTS[0], *(Result(**{**vars(result), "thumbnail": picture}) for result in RESULTS[1:]))
    counts = {"done": 1, "same": 1, "failed": 1, "stopped": 0, "good": 1}
    facts = {"counts": counts, "finished": "now", "seconds": 1.0, "workers": "2 workers", "contact_core": "1"}
    (tmp_path / "report.html").write_text(page_of(results, facts), encoding="utf-8")
    (tmp_path / "seq" / "good").mkdir(parents=True)
    (tmp_path / "seq" / "good" / "pose #1.json").write_text("{}")
    said, asked = list[str](), list[str]()
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto((tmp_path / "report.html").as_uri())
    assert page.eval_on_selector_all("h2", "all => all.map(h => h.textContent)") == [each.name for each in RESULTS]
    assert page.eval_on_selector_all("img", "all => all.map(i => i.complete && i.naturalWidth)") == [120, 120]
    seen = []
    for _ in range(4):  # the two that unfold, and what they unfold
        page.keyboard.press("Tab")
        seen.append(page.evaluate("document.activeElement.tagName"))
        if seen[-1] == "SUMMARY":
            page.keyboard.press("Enter")
    assert seen == ["SUMMARY", "A", "SUMMARY", "A"]
    assert page.evaluate("getComputedStyle(document.activeElement).outlineStyle") != "none"
    assert not said and not [url for url in asked if not url.startswith(("file:", "data:"))]
    page.keyboard.press("Enter")
    page.wait_for_url("**/pose*.json")
    assert page.inner_text("body").strip() == "{}"
