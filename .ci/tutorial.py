"""Draws the pictures of docs/tutorial.md: runs its blocks in order and draws the session after each step.

    python .ci/tutorial.py

The blocks themselves are run by tests/docs on every change; this is for when what they show has changed.
"""

from __future__ import annotations

import os
import re
import tempfile
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from contact_core.plugins.manager import PluginManager
from contact_core.scene.picture import Picture
from contact_gallery.exhibition import best_renderer, draw_row
from contact_gallery.looks import view
from contact_gallery.sheet import Row

DOCS = Path(__file__).resolve().parents[1] / "docs"
PALM, GRIP = (0.25, 0.1, 1.0), (0.45, 0.8, 1.0)


def after(step: int, session: Any) -> list[Picture]:
    """What a step's picture shows."""
    hand = {"camera_from": PALM, "caption": ""}
    if step == 1:
        return [view(session, name, **hand) for name in ("hand", "ball")]
    if step in (2, 3):
        pads = ("thumb_distal",) if step == 3 else ("index_distal", "middle_distal", "ring_distal")
        near = np.concatenate(
            [session.geometry.points(name).positions(session.geometry.mesh("hand")) for name in pads]
        )
        spread = np.array([[-0.02, -0.02, 0.0], [0.02, 0.02, 0.0]])
        focus = (near[:, None] + spread[None]).reshape(-1, 3)
        return [view(session, "hand", **hand), view(session, "hand", **hand, focus=focus)]
    if step == 4:
        return [view(session, "ball", camera_from=side, caption="") for side in (GRIP, (0.6, -0.9, 0.6))]
    sides = ((1.0, 0.3, 0.2), (-1.0, 0.4, -0.3)) if step == 8 else (GRIP, (1.0, 0.4, 0.3))
    return [view(session, camera_from=side, caption="", frame=["hand", "ball"]) for side in sides]


def main() -> None:
    page = (DOCS / "tutorial.md").read_text(encoding="utf-8")
    renderer, module = best_renderer(PluginManager()), ModuleType("tutorial")
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for step, text in enumerate(page.split("\n## ")[1:9], start=1):
            # A picture stands under a step's first block; the second takes it back, or opens the file again.
            for place, code in enumerate(re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)):
                exec(compile(code, f"step {step}", "exec"), module.__dict__)
                if place == 0:
                    pictures = tuple(after(step, module.__dict__["session"]))
                    draw_row(renderer, Row(pictures, 1.3), DOCS / "tutorial" / f"{step}.png", 880)


if __name__ == "__main__":
    main()
