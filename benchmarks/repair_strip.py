"""The strip of docs/motion.md on repairing a clip: examples/15_repair_a_clip.py, before and after.

python benchmarks/repair_strip.py docs/images/repair-strip.png [FOLDER]

Some frames are drawn over one another: what slips is smeared, what stands is sharp. FOLDER: where the example has
run already; else it runs.
"""

from __future__ import annotations

import contextlib
import runpy
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

import contact_core as contact
from contact_core.film.film import SKIN, THING, picture_at
from contact_core.geometry.mesh import TriangleMesh
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import RENDERERS
from contact_core.scene.picture import Picture, PictureMesh

EXAMPLE = Path(__file__).parents[1] / "examples" / "15_repair_a_clip.py"
CLIP, REPAIRED = "clip.contactscene", "repaired/clip.keyed.contactscene"
FRAMES = range(0, 25, 4)
FIRST = (0.45, 0.6, 0.9)  # the colour of the first frame, which goes over into that of skin


def pictures(scene: Path, title: str) -> list[Picture]:
    """The body, and its feet. It is y-up and looks along z."""
    with contact.open(scene) as session:
        every = [picture_at(session, float(frame)) for frame in FRAMES]
    bodies = [each.mesh for picture in every for each in picture.meshes if each.color == SKIN]
    floor = [each for each in every[0].meshes if each.color == THING]
    points = bodies[0].points
    low, size = points[:, 1].min(), np.ptp(points[:, 1])
    feet = points[points[:, 1] < low + 0.05 * size]
    reach = np.array([feet.min(axis=0), feet.max(axis=0)]) + size * np.array([[-0.02], [0.02]])
    drawn = replace(
        every[0], points=(), meshes=(*floor, *map(tinted, bodies, np.linspace(0.0, 1.0, len(bodies)))),
        camera_from=(0.3, 0.35, 1.0), focus=np.concatenate([points, points + 0.03]), caption=title,
    )  # fmt: skip
    near = replace(
        drawn,
        meshes=drawn.meshes[len(floor) :],
        focus=reach,
        camera_from=(0.3, 0.9, 1.0),
        caption=f"{title}, its feet",
    )
    return [drawn, near]


def tinted(body: TriangleMesh, share: float) -> PictureMesh:
    r, g, b = ((1.0 - share) * one + share * two for one, two in zip(FIRST, SKIN, strict=True))
    return PictureMesh(body, (r, g, b))


def run(folder: Path) -> None:
    with contextlib.chdir(folder):
        runpy.run_path(str(EXAMPLE))


if __name__ == "__main__":
    target = Path(sys.argv[1]).absolute()
    with tempfile.TemporaryDirectory() as made:
        there = Path(sys.argv[2]) if len(sys.argv) > 2 else Path(made)
        if not (there / REPAIRED).is_file():
            run(there)
        drawn = [*pictures(there / CLIP, "before"), *pictures(there / REPAIRED, "after")]
    plugins = PluginManager()
    renderer = plugins.get(RENDERERS, plugins.name_for(RENDERERS, "thumbnail"))
    renderer.render(drawn, target, size=(1600, 460))
