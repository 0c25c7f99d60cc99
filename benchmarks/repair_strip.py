"""The strip of docs/motion.md on repairing a clip: the feet of examples/15_repair_a_clip.py, before and after.

python benchmarks/repair_strip.py docs/images/repair-strip.png

Lines on the floor are the ways that the soles have gone until each frame.
"""

from __future__ import annotations

import contextlib
import os
import runpy
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

import contact_core as contact
from contact_core.arrays import FloatArray
from contact_core.film.film import SKIN, picture_at
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import RENDERERS
from contact_core.scene.picture import Picture

EXAMPLE = Path(__file__).parents[1] / "examples" / "15_repair_a_clip.py"
FRAMES, LAST = (0, 6, 12, 18, 24), 24
LOW, LIFT = 0.02, 0.004  # of the body: what counts as a sole, and how far above the floor its way is drawn
BEFORE, AFTER = (0.86, 0.2, 0.16), (0.1, 0.6, 0.38)


def soles(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(n,) which vertices are the left sole, and which the right."""
    low = points[:, 1] < points[:, 1].min() + LOW * np.ptp(points[:, 1])
    return low & (points[:, 0] > 0.0), low & (points[:, 0] <= 0.0)


def row(scene: Path, number: int, title: str, color: tuple[float, float, float]) -> list[Picture]:
    """The pictures of one scene. The body is y-up and looks along z."""
    with contact.open(scene) as session:
        every = [picture_at(session, float(frame)) for frame in range(LAST + 1)]
    bodies = [next(each.mesh.points for each in picture.meshes if each.color == SKIN) for picture in every]
    feet, size = soles(bodies[0]), np.ptp(bodies[0][:, 1])
    ways = [np.array([body[foot].mean(axis=0) for body in bodies]) for foot in feet]
    for way in ways:
        way[:, 1] = bodies[0][:, 1].min() + LIFT * size
    middle = 0.5 * (ways[0][0] + ways[1][0])
    focus = middle + size * np.array([[-0.16, 0.0, -0.1], [0.16, 0.0, -0.1], [-0.16, 0.3, 0.1], [0.16, 0.0, 0.12]])
    found = []
    for frame in FRAMES:
        lines = [np.stack([way[:frame], way[1 : frame + 1]], axis=1) for way in ways if frame]
        beside = 0.0008 * size * np.eye(3)[2]  # lines are a pixel wide
        drawn = [(each + side * beside, color) for each in lines for side in (-2, -1, 0, 1, 2)]
        found.append(replace(
            every[frame], points=(), lines=tuple(drawn), focus=focus, row=number, camera_from=(0.35, 0.75, 1.0),
            caption=f"{title}, frame {frame}", up=(0.0, 1.0, 0.0),
        ))  # fmt: skip
    return found


if __name__ == "__main__":
    target = Path(sys.argv[1]).absolute()
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        runpy.run_path(str(EXAMPLE))
        pictures = row(Path("clip.contactscene"), 0, "before", BEFORE)
        pictures += row(Path("repaired/clip.keyed.contactscene"), 1, "after", AFTER)
        os.chdir(target.parent)
    plugins = PluginManager()
    renderer = plugins.get(RENDERERS, plugins.name_for(RENDERERS, "thumbnail"))
    renderer.render(pictures, target, size=(1500, 640))
