"""Grasps from two files: `python benchmarks/bench_grasp.py [--count 8] [--hand NAME] [--object NAME] [--sheets
DIR]`.

Prints, for every hand and object, whether the first grasp passes the verdict, how many of those shown do, and
seconds: wall clock and processor, for the first and for all. Objects without units are taken in the hand's; a
scale is given where a file has another size than its object.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path

from contact_core.errors import ContactError
from contact_core.grasping.suggest import GraspSettings
from contact_core.grasping.suggest import suggest as suggested
from contact_core.grasping.verbs import grasp_scene
from contact_core.job.grasp import HAND, OBJECT, prepare, sheet
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import RENDERERS

ASSETS = Path(os.environ.get("CONTACT_ASSETS", Path(__file__).resolve().parents[2] / "shared" / "assets"))
HANDS = {
    "human": "sample:human_hand",
    "webxr": "webxr_generic_hand_left.glb",
    "makehuman": "makehuman_body_53_joints.glb",
    "alien": "sample:alien_hand",
}
OBJECTS = {
    "mug": ("sample:mug", 1.0),
    "baseball": ("sample:baseball", 1.0),
    "pole": ("sample:pole", 1.0),
    "scissors": ("sample:scissors", 1.0),
    "bunny": ("stanford_bunny_7k_closed.obj", 0.065),  # ten units of eighteen of a hand high, as in the demos
    "ycb mug": ("ycb_mug.obj", 1.0),
    "cup": ("cup_with_handle_genus1.obj", 1.0),
    "column": ("column_pole.glb", 1.0),
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=8)
    parser.add_argument("--hand", action="append", choices=HANDS)
    parser.add_argument("--object", action="append", choices=OBJECTS)
    parser.add_argument("--sheets", type=Path, help="a folder for the contact sheets")
    arguments = parser.parse_args()
    plugins = PluginManager()
    first, best, runs = 0, 0, 0
    print(f"{'hand':<10} {'object':<9} {'top 1':<6} {'good':<6} {'tried s':>8} {'first s':>8} {'cpu s':>6}")
    for hand in arguments.hand or HANDS:
        for thing in arguments.object or OBJECTS:
            top, good, text = one(hand, thing, arguments.count, plugins, arguments.sheets)
            first, best, runs = first + top, best + (good > 0), runs + 1
            print(f"{hand:<10} {thing:<9} {text}", flush=True)
    print(f"top 1 passes in {first} of {runs}, best of {arguments.count} in {best} of {runs}")
    return 0


def one(hand: str, thing: str, count: int, plugins: PluginManager, sheets: Path | None) -> tuple[bool, int, str]:
    """Whether the first passes, how many do, and the row."""
    name, scale = OBJECTS[thing]
    try:
        job = prepare(found(HANDS[hand]), found(name), scale, plugins)
        began, cpu, seen = time.perf_counter(), time.process_time(), 0.0
        scene = grasp_scene(job.session, HAND, OBJECT, job.words)
        grasps = []
        for grasp in suggested(scene, GraspSettings(count)):
            seen = seen or time.perf_counter() - began
            grasps.append(grasp)
    except ContactError as error:
        return False, 0, f"refused: {error}"
    taken, used = time.perf_counter() - began, time.process_time() - cpu
    grasps.sort(key=lambda grasp: -grasp.score)
    good = sum(grasp.is_grasp for grasp in grasps)
    top = bool(grasps) and grasps[0].is_grasp
    if sheets is not None and grasps:
        sheets.mkdir(parents=True, exist_ok=True)
        pictures = sheet(scene, grasps)
        columns, rows = min(4, len(grasps)), 1 + max(picture.row for picture in pictures)
        path = sheets / f"{hand}_{thing.replace(' ', '_')}.png"
        plugins.get(RENDERERS, "software").render(pictures, path, size=(300 * columns, 260 * rows))
    why = "" if top or not grasps else f"  {grasps[0].verdict.failures[0]}"
    row = f"{'yes' if top else 'NO':<6} {good}/{len(grasps):<4} {taken:8.1f} {seen:8.1f} {used:6.1f}{why}"
    return top, good, row


def found(name: str) -> str:
    """A sample's name, or the path of an asset."""
    return name if name.startswith("sample:") else str(next(iter(sorted(ASSETS.rglob(name))), ASSETS / name))


if __name__ == "__main__":
    sys.exit(main())
