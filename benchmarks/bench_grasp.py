"""Grasps from two files: `python benchmarks/bench_grasp.py [--count 8] [--hand NAME] [--object NAME] [--sheets
DIR] [--table FILE]`.

Prints, for every hand and object, whether the first grasp passes GRASP and the verdict, how many of those shown do,
and processor seconds, to the first and for all. Objects without units are taken in the hand's; a scale is given
where a file has another size than its object, and the chair is to be held by its backrest. `--table` writes the
same as the table of docs/grasp.md.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from contact_core.errors import ContactError
from contact_core.grasp_files.grasp import HAND, OBJECT, prepare, sheet
from contact_core.grasping.searching import GraspSettings
from contact_core.grasping.suggest import ranked
from contact_core.grasping.suggest import suggest as suggested
from contact_core.grasping.verbs import grasp_scene
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import RENDERERS

ASSETS = Path(os.environ.get("CONTACT_ASSETS", Path(__file__).resolve().parents[2] / "shared" / "assets"))
HANDS = {
    "human": "sample:human_hand",
    "webxr": "webxr_generic_hand_left.glb",
    "makehuman": "makehuman_body_53_joints.glb",
    "alien": "sample:alien_hand",
}
BACKREST = (0.0, 0.85, -0.19)
OBJECTS: dict[str, tuple[str, float, tuple[float, float, float] | None]] = {
    "mug": ("sample:mug", 1.0, None),
    "baseball": ("sample:baseball", 1.0, None),
    "pole": ("sample:pole", 1.0, None),
    "scissors": ("sample:scissors", 1.0, None),
    "bunny": ("stanford_bunny_7k_closed.obj", 0.065, None),  # ten eighteenths of a hand high, as in the demos
    "ycb mug": ("ycb_mug.obj", 1.0, None),
    "cup": ("cup_with_handle_genus1.obj", 1.0, None),
    "column": ("column_pole.glb", 1.0, None),
    "chair": ("chair_kitchen_union_closed.obj", 0.5, BACKREST),  # the file is 1.76 m high
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=8)
    parser.add_argument("--hand", action="append", choices=HANDS)
    parser.add_argument("--object", action="append", choices=OBJECTS)
    parser.add_argument("--table", type=Path, help="a file for the table")
    parser.add_argument("--sheets", type=Path, help="a folder for the contact sheets")
    arguments = parser.parse_args()
    plugins = PluginManager()
    hands, things = arguments.hand or list(HANDS), arguments.object or list(OBJECTS)
    cells: dict[tuple[str, str], Cell] = {}
    print(f"{'hand':<10} {'object':<9} {'top 1':<6} {'good':<6} {'first cpu s':>11} {'cpu s':>6}")
    for thing in things:
        for hand in hands:
            cell = cells[hand, thing] = one(hand, thing, arguments.count, plugins, arguments.sheets)
            print(f"{hand:<10} {thing:<9} {cell.row()}", flush=True)
    text = table(hands, things, cells)
    print(text)
    if arguments.table is not None:
        arguments.table.write_text(text, encoding="utf-8")
    return 0


@dataclass(frozen=True)
class Cell:
    """What one hand found on one object. why: the first failure of the best, where it fails."""

    top: bool
    good: int
    shown: int
    first: float
    seconds: float
    why: str = ""

    def row(self) -> str:
        top = "yes" if self.top else "NO"
        good = f"{self.good}/{self.shown}"
        return f"{top:<6} {good:<6} {self.first:11.1f} {self.seconds:6.1f}  {self.why}"

    def brief(self) -> str:
        return f"{'' if self.top else 'NO, '}{self.good} of {self.shown}"


def table(hands: list[str], things: list[str], cells: dict[tuple[str, str], Cell]) -> str:
    """Markdown: a row for each object, how many of the shown pass, misses named below, and seconds."""
    lines = [f"| object | {' | '.join(hands)} |", "|---" * (len(hands) + 1) + "|"]
    lines += [f"| {thing} | {' | '.join(cells[hand, thing].brief() for hand in hands)} |" for thing in things]
    every = list(cells.values())
    top, best = sum(cell.top for cell in every), sum(cell.good > 0 for cell in every)
    lines += ["", f"The first passes in {top} of {len(every)} cells, one of those shown in {best}."]
    lines += [
        f"Processor seconds: {np.median([c.first for c in every]):.1f} to the first (at most"
        f" {max(c.first for c in every):.1f}), {np.median([c.seconds for c in every]):.1f} for all (at most"
        f" {max(c.seconds for c in every):.1f}), medians over the cells.",
    ]
    misses = [f"- {hand}, {thing}: {cell.why}" for (hand, thing), cell in cells.items() if not cell.top]
    return "\n".join([*lines, *(["", "Misses:", "", *misses] if misses else [])]) + "\n"


def one(hand: str, thing: str, count: int, plugins: PluginManager, sheets: Path | None) -> Cell:
    """The grasps of one hand and object, their sheet drawn."""
    name, scale, at = OBJECTS[thing]
    try:
        job = prepare(found(HANDS[hand]), found(name), scale, plugins)
        began, seen = time.process_time(), 0.0
        scene = grasp_scene(job.session, HAND, OBJECT, job.words)
        grasps = []
        for grasp in suggested(scene, GraspSettings(count, at=at)):
            seen = seen or time.process_time() - began
            grasps.append(grasp)
    except ContactError as error:
        return Cell(False, 0, 0, 0.0, 0.0, f"refused: {error}")
    used = time.process_time() - began
    grasps = ranked(grasps)
    if sheets is not None and grasps:
        sheets.mkdir(parents=True, exist_ok=True)
        pictures = sheet(scene, grasps)
        columns, rows = min(4, len(grasps)), 1 + max(picture.row for picture in pictures)
        path = sheets / f"{thing.replace(' ', '_')}__{hand}.png"
        plugins.get(RENDERERS, "software").render(pictures, path, size=(300 * columns, 260 * rows))
    top = bool(grasps) and grasps[0].is_grasp
    why = "" if top or not grasps else grasps[0].verdict.failures[0]
    return Cell(top, sum(grasp.is_grasp for grasp in grasps), len(grasps), seen, used, why)


def found(name: str) -> str:
    """A sample's name, or the path of an asset."""
    return name if name.startswith("sample:") else str(next(iter(sorted(ASSETS.rglob(name))), ASSETS / name))


if __name__ == "__main__":
    sys.exit(main())
