"""Grasps of the library on other hands and objects: `python benchmarks/bench_library.py [--sheet FILE]`.

A mug grip of the built-in hand is suggested, saved, and applied to every hand and object; then what the WebXR
hand holds is saved again and applied to the alien one. Prints processor seconds, how unlike the place is, and the
verdict.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from dataclasses import replace
from pathlib import Path

from contact_core.errors import ContactError
from contact_core.grasp_files.grasp import HAND, OBJECT, prepare, sheet
from contact_core.library.applying import Applied, apply
from contact_core.library.capture import captured
from contact_core.library.verbs import library_scene
from contact_core.plugins.drawing import draw
from contact_core.plugins.manager import PluginManager

ASSETS = Path(os.environ.get("CONTACT_ASSETS", Path(__file__).resolve().parents[2] / "shared" / "assets"))
HANDS = {
    "human": "sample:human_hand",
    "webxr": str(ASSETS / "rigs" / "webxr_generic_hand_left.glb"),
    "alien": "sample:alien_hand",
}
OBJECTS = {
    "mug": "sample:mug",
    "cup": str(ASSETS / "objects" / "cup_with_handle_genus1.obj"),
    "ycb mug": str(ASSETS / "objects" / "ycb_mug.obj"),
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sheet", type=Path, help="a picture of all of them")
    arguments = parser.parse_args()
    plugins, pictures = PluginManager(), []
    job = prepare(HANDS["human"], OBJECTS["mug"], 1.0, plugins)
    best = max(job.session.suggest(HAND, OBJECT, count=3, kinds=("power",)), key=lambda one: one.score)
    job.session.accept(best.proposal)
    grasp, contacts = captured(library_scene(job.session, HAND, OBJECT))
    good = runs = 0
    print(f"{'hand':<8} {'object':<8} {'cpu s':>6} {'unlike':>7}  verdict")
    for hand in HANDS:
        for thing in OBJECTS:
            job = prepare(HANDS[hand], OBJECTS[thing], 1.0, plugins)
            began = time.process_time()
            scene = library_scene(job.session, HAND, OBJECT, job.words)
            try:
                (found,) = apply(scene, grasp, contacts)
            except ContactError as error:
                print(f"{hand:<8} {thing:<8} refused: {error}")
                continue
            told(hand, thing, time.process_time() - began, found)
            good, runs = good + found.suggestion.is_grasp, runs + 1
            row = 2 * len(pictures) // 6
            pictures += [replace(p, row=2 * (row // 2) + p.row) for p in sheet(scene, [found.suggestion])]
            if (hand, thing) == ("webxr", "mug"):
                job.session.accept(found.suggestion.proposal)
                second = captured(library_scene(job.session, HAND, OBJECT, job.words))
    job = prepare(HANDS["alien"], OBJECTS["mug"], 1.0, plugins)
    began = time.process_time()
    (found,) = apply(library_scene(job.session, HAND, OBJECT), *second)
    told("-> alien", "mug", time.process_time() - began, found)
    print(f"{good} of {runs} pass")
    if arguments.sheet is not None:
        pictures.sort(key=lambda picture: picture.row)
        rows = 1 + max(picture.row for picture in pictures)
        draw(pictures, arguments.sheet, plugins, size=(1140, 300 * rows))
    return 0


def told(hand: str, thing: str, seconds: float, found: Applied) -> None:
    one = found.suggestion
    verdict = "passes" if one.is_grasp else one.verdict.failures[0]
    print(f"{hand:<8} {thing:<8} {seconds:6.2f} {100 * found.unlike:6.1f}%  {verdict}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
