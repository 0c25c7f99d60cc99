"""The law of undo: after anything, Ctrl+Z gives the whole scene as it was one step before, redo as it was after.

A model runs beside Blender: the list of what the scene was after each step, and where in it we are. And the add-on
leaves nothing: no handlers, no timers, no memory.
"""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

STEPS = 300


@pytest.fixture
def shot(bpy: Any, scenes: Any) -> Iterator[Any]:
    """An arm with a rig and a sheet, the add-on registered, two patches painted."""
    import blender_walk

    from contact_blender import extension

    blender_walk.set_up(bpy, scenes)
    extension.register()
    bpy.ops.ed.undo_push(message="Set up")
    yield extension.shared
    extension.unregister()


@pytest.mark.parametrize("seed", [0, 1])
def test_three_hundred_steps(bpy: Any, scenes: Any, shot: Any, tmp_path: Path, seed: int) -> None:
    from blender_walk import Walk

    walk = Walk(bpy, scenes, shot, tmp_path, seed)
    for _ in range(STEPS):
        walk.step()
    assert {"paint", "transfer", "solve", "move", "mode POSE", "reload"} <= set(walk.done), walk.done
    assert sum(walk.done.values()) > STEPS / 4, walk.done


def test_a_hundred_cycles_leak_nothing(bpy: Any, shot: Any) -> None:
    """Enabled, used, disabled: no handler, no timer, no lock and no memory over 5 MB stay."""
    import resource
    import threading

    from contact_blender import extension

    def handlers() -> dict[str, int]:
        return {n: len(h) for n in dir(bpy.app.handlers) if isinstance(h := getattr(bpy.app.handlers, n), list)}

    def cycle() -> None:
        extension.register()
        bpy.ops.contact.paint(object="arm", group="tip")
        bpy.ops.ed.undo()
        extension.unregister()

    extension.unregister()
    for _ in range(30):
        cycle()  # Blender fills its own history of undo
    gc.collect()
    before, threads, peak = handlers(), threading.active_count(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    objects = len(gc.get_objects())
    for _ in range(100):
        cycle()
    gc.collect()
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - peak
    assert handlers() == before and threading.active_count() == threads
    assert grown / (1024 if sys.platform == "linux" else 1024**2) < 5.0, f"{grown / 1024:.1f} MB"
    assert len(gc.get_objects()) - objects < 2000
