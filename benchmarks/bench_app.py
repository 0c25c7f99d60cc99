"""The application: what a mouse move costs until it is seen, without a screen and in a real browser.

    python benchmarks/bench_app.py [--quick]

The WebXR hand and the bunny (69k faces) where the shared assets are, else the built-in hand and mug. Medians and
95th percentiles: without a screen processor milliseconds, of all threads together, which other programs do not
disturb; in the browser those of the clock, which they do. Without a graphics card the processor draws.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from harness import record
from in_browser import CHROMIUM, seen, view_of, watched

from contact_core.interaction.events import Key, Pointer
from contact_viewer.application import Application
from contact_viewer.canvas import Canvas
from contact_viewer.gl import off_screen_window
from contact_viewer.web.stream import encoded

SIZE = (1280, 720)
ASSETS = Path(os.environ.get("CONTACT_ASSETS", "../shared/assets"))
PANELS = (384, 82)  # width and height of what stands round the view in the browser


def files() -> list[str]:
    """A hand and a large object."""
    hand, bunny = ASSETS / "rigs/webxr_generic_hand_left.glb", ASSETS / "objects/stanford_bunny_35k.obj"
    return [str(hand), str(bunny)] if hand.exists() and bunny.exists() else ["sample:human_hand", "sample:mug"]


def milliseconds(act: Callable[[], object]) -> float:
    """Processor time of all threads."""
    began = time.process_time()
    act()
    return 1e3 * (time.process_time() - began)


def spelt(times: list[float]) -> str:
    return f"{np.median(times):.1f} (95 %: {np.percentile(times, 95):.1f})"


def artist(state: Path) -> tuple[Application, Any, Any]:
    """An application with a patch on the hand and its copy on the object, which the hand follows; a pixel on it."""
    app = Application(Canvas(off_screen_window(SIZE)), files(), state_folder=state)
    app.canvas.eye.look_from("front")
    app.see_all()
    app.frame()
    hand, thing = app.interaction.desk.scene.surfaces.values()

    def pixel_on(seen: Any, share: float) -> Any:
        low, high = seen.points.min(axis=0), seen.points.max(axis=0)
        wanted = low + share * (high - low)
        facing = seen.mesh.vertex_normals @ app.canvas.eye.direction < -0.5
        near = seen.points[facing][np.linalg.norm(seen.points[facing] - wanted, axis=1).argmin()]
        return app.canvas.eye.project(near[None])[0, :2]

    def drag(*path: Any) -> None:
        app.handle(Pointer("move", *path[0]))
        app.handle(Pointer("press", *path[0], "left"))
        for at in path[1:]:
            app.handle(Pointer("move", *at))
            app.frame()
        app.handle(Pointer("release", *path[-1], "left"))
        app.frame()

    app.handle(Key("B"))
    start = pixel_on(hand, 0.5)
    drag(start, start + 4.0, start + 8.0)
    app.handle(Key("T"))
    place = pixel_on(thing, 0.5)
    drag(place, place - np.array([0.0, 15.0]))
    copy = next(patch.name for patch in app.session.document.patches.values() if patch.surface == thing.name)
    app.interaction.select(copy, surface=thing.name)
    where = app.interaction.desk.scene.surfaces[thing.name].positions(app.session.geometry.points(copy))
    return app, app.canvas.eye.project(where.mean(axis=0)[None])[0, :2], hand


def drags(app: Application, start: Any, moves: int) -> dict[str, list[float]]:
    """One long drag of the copy: what handling, uploading, drawing and encoding of each move take."""
    app.handle(Key("G"))
    app.handle(Pointer("move", *start))
    app.handle(Pointer("press", *start, "left"))
    times: dict[str, list[float]] = {"edit and live solve": [], "upload": [], "draw": [], "encode": []}
    for k in range(moves):
        at = start + 12.0 * np.array([np.sin(0.3 * k), 1.0 - np.cos(0.3 * k)])
        times["edit and live solve"].append(
            milliseconds(lambda at=at: (app.handle(Pointer("move", *at)), app.interaction.advance()))
        )
        times["upload"].append(milliseconds(app.drawer.follow))
        kept: list[Any] = []
        times["draw"].append(milliseconds(lambda kept=kept: kept.append(app.canvas.rgba(quick=True))))
        times["encode"].append(milliseconds(lambda kept=kept: encoded(kept[0], 72)))
    app.handle(Pointer("release", *at, "left"))
    app.frame()
    return times


def in_browser(moves: int) -> dict[str, Any]:
    """From a move of the mouse in a real browser to the image that shows it: single moves, each seen before the
    next, and a mouse that does not stop."""
    rows = {}
    with tempfile.TemporaryDirectory() as folder:
        app, _, _ = artist(Path(folder) / "state")
        app.resize(SIZE[0] - PANELS[0], SIZE[1] - PANELS[1])
        app.canvas.eye.look_from("front")
        app.see_all()
        app.frame()
        copy = app.interaction.selection.patches[-1]
        seen_on = app.interaction.desk.scene.surfaces[app.session.document.patches[copy].surface]
        where = seen_on.positions(app.session.geometry.points(copy)).mean(axis=0)
        on_patch = app.canvas.eye.project(where[None])[0, :2]
        scene = Path(folder) / "scene.contactscene"
        app.write(scene)
        app.close()
        with watched([str(scene)], SIZE) as page:
            for key in ("1", "Home"):
                page.keyboard.press(key)
            left, top, width, height = view_of(page)
            beside = np.round([left + 0.3 * width, top + 0.6 * height])
            for what, key, button, start in (
                ("hover", "b", "", beside),
                ("paint", "b", "left", beside),
                ("drag and the hand follows", "g", "left", np.round(on_patch + np.array([left, top]))),
                ("orbit", "b", "middle", beside),
            ):
                for how, count, apart in (
                    ("single moves", moves, 250),
                    ("a mouse that does not stop", 3 * moves, 0),
                ):
                    page.keyboard.press(key)
                    page.mouse.move(*start)
                    page.wait_for_timeout(1000)
                    if button:
                        page.mouse.down(button=button)
                    rows[f"in the browser, {what}, {how}: move to image, ms"] = str(
                        seen(page, [tuple(start + place) for place in wound(count)], apart)
                    )
                    if button:
                        page.mouse.up(button=button)
                    page.keyboard.press("Control+z" if button == "left" else "Escape")
                    page.wait_for_timeout(1000)
    return rows


def wound(count: int) -> Any:
    """(count, 2) whole pixels round a circle that wanders to the right, no two alike in a row."""
    k = np.arange(1, count + 1)
    return np.round(14.0 * np.stack([np.sin(0.3 * k) + 0.09 * k, 1.0 - np.cos(0.3 * k)], axis=1))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    moves = 15 if parser.parse_args().quick else 60
    rows: dict[str, Any] = {"scene": ", ".join(Path(each).name for each in files())}
    with tempfile.TemporaryDirectory() as state:
        app, start, _ = artist(Path(state))
        drags(app, start, 5)  # compiles
        app.interaction.session.undo()
        times = drags(app, start, moves)
        rows |= {f"a move of a drag, {stage}, processor ms": spelt(each) for stage, each in times.items()}
        rows["a frame that stands still, 1280 x 720, processor ms"] = spelt(
            [milliseconds(lambda: app.canvas.render(still=True)) for _ in range(10)]
        )
        rows["drawn by the processor"] = str(app.canvas._software)
        app.close()
    if hasattr(os, "getloadavg"):
        rows["load of the machine meanwhile"] = f"{os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    if CHROMIUM is not None:
        rows |= in_browser(min(moves, 30))
    record("app", rows)


if __name__ == "__main__":
    main()
