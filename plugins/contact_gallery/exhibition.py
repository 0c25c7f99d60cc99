"""Runs figures, draws their sheets, writes the page: gallery.md with gallery/NAME-1.jpg and gallery/NAME.json."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from contact_core.atomic_file import replacing, write_atomic
from contact_core.errors import FileRefused, InvalidInput
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import RENDERERS
from contact_core.plugins.slots import Renderer
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.solve.warm_up import warm_up
from contact_gallery.figure import Figure, figure, names
from contact_gallery.page import page
from contact_gallery.sheet import Row, Sheet

WIDTH, TALLEST = 1200, 0.38  # pixels of a row, and its height at most, of its width
QUALITY = 88  # of JPEG


def exhibit(
    wanted: Sequence[str],
    out: Path,
    plugins: PluginManager,
    progress: Progress = NO_PROGRESS,
    *,
    width: int = WIDTH,
) -> list[dict[str, Any]]:
    """Make figures, and write `out`/gallery.md with all that were ever made there. Returns what was measured.

    width: of a row of pictures, in pixels. Raises InvalidInput, before anything is run, for a name that is none,
    and FileRefused.
    """
    figures = [figure(name) for name in wanted]
    warm_up()  # compiling kernels is no part of what is measured
    made = []
    for place, one in enumerate(figures):
        part = progress.part(place / len(figures), (place + 1) / len(figures))
        part.tell(0.0, one.title)
        made.append(_make(one, out / "gallery", plugins, part, width))
    known = [
        (figure(name), kept) for name in names() if (kept := _kept(out / "gallery" / f"{name}.json")) is not None
    ]
    write_atomic(out / "gallery.md", page(known))
    return made


def _make(one: Figure, folder: Path, plugins: PluginManager, progress: Progress, width: int) -> dict[str, Any]:
    """One figure: run it, draw it, keep what it measured."""
    sheet, began = Sheet(plugins, progress), time.process_time()
    one.draw(sheet)
    seconds = time.process_time() - began
    progress.tell(0.8, f"{one.title}: drawing")
    renderer = best_renderer(plugins)
    pictures = [
        draw_row(renderer, row, folder / f"{one.name}-{place}.png", width)
        for place, row in enumerate(sheet.rows, start=1)
    ]
    record = {
        "name": one.name,
        "seconds": round(seconds, 2),
        "operations": sheet.operations,
        "pictures": [path.name for path in pictures],
        "captions": [[picture.caption for picture in row.pictures] for row in sheet.rows],
        "measures": [asdict(measure) for measure in sheet.measures],
        "efforts": [asdict(effort) for effort in sheet.efforts],
    }
    write_atomic(folder / f"{one.name}.json", json.dumps(record, indent=1, ensure_ascii=False) + "\n")
    return record


def _kept(path: Path) -> dict[str, Any] | None:
    """What a figure measured when it was last made, None where it never was."""
    if not path.exists():
        return None
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise FileRefused(
            f"{path} is not what a gallery wrote: {error}. Delete it and make the figure again."
        ) from error
    return dict(kept)


def best_renderer(plugins: PluginManager) -> Renderer:
    """The best renderer that works here."""
    working = [one for one in plugins.offers(RENDERERS).values() if one.unavailable() is None]
    if not working:
        raise InvalidInput("no renderer works here: install the extra `viewer`.")
    return max(working, key=lambda one: one.priority)


def draw_row(renderer: Renderer, row: Row, path: Path, width: int) -> Path:
    """A row as one image: JPEG where Pillow is there (extra `viewer`), else the renderer's PNG."""
    count = len(row.pictures)
    height = int(min(TALLEST * width, width / count / row.aspect))
    with replacing(path) as drawn:
        renderer.render(row.pictures, drawn, size=(int(height * row.aspect) * count, height))
    try:
        from PIL import Image
    except ImportError:
        return path
    jpeg = path.with_suffix(".jpg")
    with Image.open(path) as image, replacing(jpeg) as written:
        image.convert("RGB").save(written, format="JPEG", quality=QUALITY, optimize=True)
    path.unlink()
    return jpeg
