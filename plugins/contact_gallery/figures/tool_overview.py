"""The tools: paint, axis, transfer, translate, rotate, bend.

A stroke along the index finger is painted once, and measured against its axis once. Everything after that only
traces geodesics: onto the mug, up the mug, turned about the axis's start, bent at the axis's middle.
"""

import time

import numpy as np

import contact_core as contact
from contact_core.geometry.raycast import Locator
from contact_gallery.looks import view
from contact_gallery.sheet import Sheet

PAPER = "Figures 2 and 4"


def draw(sheet: Sheet) -> None:
    with contact.new(hand="sample:human_hand", mug="sample:mug", plugins=sheet.plugins) as session:
        rig, mug = session.rigs["hand"], Locator.of(session.geometry.mesh("mug"))
        joints = [rig.joint_index(f"index_{part}") for part in ("proximal", "intermediate", "distal")]
        along = rig.rest_world[joints, :3, 3] + [0.0, 0.0, 0.012]  # over the palm side of the finger
        fingers = np.concatenate([along + np.array([-0.04, -0.02, 0.0]), along + np.array([0.02, 0.025, 0.0])])
        pictures, seconds = [], {}

        def did(name: str, caption: str, surface: str, began: float) -> None:
            seconds[name] = 1000.0 * (time.perf_counter() - began)
            side = (0.35, 0.1, 1.0) if surface == "hand" else (0.3, 0.35, 1.0)
            shown = ["finger"] if surface == "hand" else [n for n in session.document.patches if n != "finger"]
            near = fingers if surface == "hand" else session.geometry.mesh(surface).points
            pictures.append(
                view(
                    session,
                    surface,
                    patches=shown,
                    camera_from=side,
                    caption=caption,
                    focus=near,
                    axes=name != "paint",
                )
            )

        with sheet.counting(session):
            now = time.perf_counter()
            session.patches.brush("disk", "finger", surface="hand", at=along, radius=0.006, spacing=0.0012)
            did("paint", "(a) paint", "hand", now)
            now = time.perf_counter()
            session.patches.set_axis("finger", Locator.of(session.geometry.mesh("hand")).closest(along).points)
            did("axis", "(b) draw an axis", "hand", now)
            now = time.perf_counter()
            on_mug = session.patches.transfer(
                "finger", "mug", mug.closest([(-0.02, 0.03, 0.04)]).points, direction=(1, 0, 0)
            )
            did("transfer", "(c) transfer", "mug", now)
            now = time.perf_counter()
            session.patches.translate(on_mug, mug.closest([(-0.03, 0.06, 0.03)]).points)
            did("translate", "(d) translate", "mug", now)
            now = time.perf_counter()
            session.patches.rotate(on_mug, np.radians(-40.0))
            did("rotate", "(e) rotate", "mug", now)
            now = time.perf_counter()
            session.patches.bend(on_mug, len(session.geometry.axis(on_mug)) // 2, np.radians(45.0))
            did("bend", "(f) bend", "mug", now)
        sheet.show(*pictures[:3])
        sheet.show(*pictures[3:])
        edits = max(seconds[name] for name in ("transfer", "translate", "rotate", "bend"))
        sheet.measure("points", f"{len(session.geometry.points('finger'))}")
        sheet.measure("paint and measure", f"{seconds['paint']:.0f} ms", "the expensive step, once")
        sheet.measure("slowest edit", f"{edits:.1f} ms", "real time")
        sheet.measure(
            "folds after the bend, in its inner corner", f"{session.geometry.distortion('finger', on_mug).folds}"
        )
