"""Photographs the application in a real browser: docs/images/app-*.jpg, at two sizes, dark and light.

    python .ci/app_stills.py [--out FOLDER]

The hand takes the mug by a grasp of the library; then its panel, the split view and the heat map are taken. Needs
what app_film.py does.
"""

from __future__ import annotations

import argparse
import io
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import sync_playwright

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from tests.adapters.viewer.served import CHROMIUM, Page, serving

SHOWN = ("app-library.jpg", "app-split.jpg", "app-split-large.jpg", "app-heat-large.jpg")  # by README and docs
SMALL, LARGE = (1280, 720), (1920, 1080)
GRASP, MOST = "power sphere", 300_000  # bytes of a picture


def until(page: Page, condition: str) -> None:
    """Wait for a condition in the page, on a machine that does much else."""
    page.page.wait_for_function(condition, timeout=400_000, polling=100)


def taken(page: Page) -> Any:
    """The page once it stands still."""
    page.page.mouse.move(page.page.viewport_size["width"] - 400, 60)
    page.page.wait_for_timeout(6000)
    return Image.open(io.BytesIO(page.page.screenshot())).convert("RGB")


def turn(page: Page, share: float) -> None:
    """Turn the camera to the right by a share of the view's width."""
    width, height = page.size()
    left, top = page.corner()
    page.page.mouse.move(left + 0.5 * width, top + 0.9 * height)
    page.page.mouse.down(button="middle")
    page.page.mouse.move(left + (0.5 + share) * width, top + 0.9 * height, steps=12)
    page.page.mouse.up(button="middle")


def stills(page: Page) -> Iterator[tuple[str, Any]]:
    """Names and pictures, of a page that a hand and a mug are open in."""
    page.page.locator("button[title^='Library']").click()
    until(page, "() => trame.state.get('shelves').length > 10")
    page.page.locator(f".grasp:has-text('{GRASP}')").click()
    until(page, "() => trame.state.get('proposed')")
    yield "app-library", taken(page)
    page.key("Enter")
    until(page, "() => !trame.state.get('proposed')")
    page.page.locator("button[title^='Library']").click()
    page.key("Shift+X")
    until(page, "() => trame.state.get('split')")
    page.page.locator(".contact-row:has-text('middle tip')").first.click()
    yield "app-split", taken(page)
    page.key("Shift+X")
    page.key("Shift+H")
    until(page, "() => trame.state.get('heat') && !trame.state.get('split')")
    page.page.locator(".contact-row:has-text('mug')").first.locator("i[class*=mdi-eye]").click()
    until(page, "() => trame.state.get('tree').some((row) => row.hidden)")
    page.key("Home")
    turn(page, -0.22)  # the palm
    page.key("Home")
    yield "app-heat", taken(page)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path(__file__).resolve().parents[1] / "docs" / "images")
    out = parser.parse_args().out
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        for size, theme, ending in ((SMALL, "dark", ""), (LARGE, "light", "-large")):
            with (
                tempfile.TemporaryDirectory() as folder,
                serving(Path(folder), "sample:human_hand", "sample:mug") as served,
            ):
                page = Page.opened(browser, served.address, size=size)
                page.page.evaluate(f"() => trame.state.set('theme', '{theme}')")
                page.key("Home")
                until(page, "() => !trame.state.get('work')")
                for name, picture in stills(page):
                    path = out / f"{name}{ending}.jpg"
                    if path.name not in SHOWN:
                        continue
                    picture.save(path, quality=88, optimize=True)
                    sys.stdout.write(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB\n")
                    assert path.stat().st_size < MOST, "more than a page should load"
                page.page.close()
        browser.close()


if __name__ == "__main__":
    main()
