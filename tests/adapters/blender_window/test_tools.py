"""The artist's tools in a real window: painting, transferring with the hand following, undo, solve, cancel."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

from blender_driver import Window, in_window


def scene(window: Window) -> Iterator[Any]:
    """A finger of three joints above a ball, seen from the front; tools are ready."""
    bpy, extension = window.bpy, window.enable()
    import numpy as np

    import contact_core as contact
    from contact_blender.extension import rehearsal

    for name in ("Cube", "Light", "Camera"):
        bpy.data.objects.remove(bpy.data.objects[name])
    session = extension.shared.session()
    if os.environ.get("CONTACT_TRY"):
        for name in ("human_hand", "baseball"):
            session.host.add(contact.read_asset(f"sample:{name}"))
        bpy.data.objects["baseball"].location = (0.02, -0.12, 0.1)
    else:
        rig, there = rehearsal.finger(), np.eye(4)
        there[:3, 3] = 5.0, 0.0, -2.6
        session.host.add(contact.Asset("finger", rig.surface, rig=rig, meters_per_unit=1.0, up_axis="Z"))
        session.host.add(contact.Asset("ball", rehearsal.ball(), meters_per_unit=1.0, up_axis="Z"), there)
    bpy.context.view_layer.update()
    with window.override():
        bpy.ops.view3d.view_axis(type="FRONT")
        window.area.spaces.active.region_3d.view_perspective = "PERSP"
        bpy.ops.view3d.view_all()
    yield 5
    from contact_blender.extension.warming import WARMING

    began = time.time()
    WARMING.begin()
    while not WARMING.is_done:
        assert not WARMING.failure, WARMING.failure
        yield 3
    window.said.append(f"ready after {time.time() - began:.1f} s")
    window.base()


def take_up(window: Window, name: str) -> None:
    with window.override():
        window.bpy.ops.wm.tool_set_by_id(name=f"contact.{name}", space_type="VIEW_3D")


def way(window: Window, *places: Any) -> list[tuple[int, int]]:
    """Window pixels along world points, several between each two."""
    import numpy as np

    found = []
    for start, end in pairwise(places):
        found += [window.on_screen(p) for p in np.linspace(start, end, 6)]
    return found


def bones(window: Window) -> Any:
    """All channels of all bones, to compare."""
    rigs = [each for each in window.bpy.data.objects if each.type == "ARMATURE"]
    return [[round(v, 5) for row in bone.matrix_basis for v in row] for rig in rigs for bone in rig.pose.bones]


FINGER = ((4.7, -0.6, 0.0), (5.2, -0.6, 0.0))
BALL = ((4.8, -1.45, -2.5), (5.3, -1.4, -2.5))
if os.environ.get("CONTACT_TRY"):
    FINGER = ((-0.022, -0.02, 0.14), (-0.02, -0.02, 0.155))
    BALL = ((0.0, -0.155, 0.09), (0.01, -0.155, 0.1))


@in_window
def test_a_day_of_an_artist(window: Window) -> Iterator[Any]:
    yield from scene(window)
    window.shown("finger" if "finger" in window.bpy.data.objects else "human_hand")
    from contact_blender.extension import shared

    session = shared.session()
    take_up(window, "paint")
    yield from window.move(*window.on_screen(FINGER[0]))
    yield 10
    yield from window.drag(way(window, *FINGER))
    yield 3
    window.picture("painted")
    assert len(session.document.patches) == 1, shared.artist().status()
    assert not shared.artist().busy
    assert session.revision == 1
    yield from window.undo()
    yield 2
    assert not session.document.patches and not session.document.surfaces and session.revision == 0
    yield from window.redo()
    yield 2
    assert len(session.document.patches) == 1 and session.revision == 1

    at_rest = bones(window)
    take_up(window, "transfer")
    path = way(window, *BALL)
    yield from window.move(*path[0])
    yield 10
    window.send("LEFTMOUSE", "PRESS")
    yield 2
    for place in path[1:]:
        yield from window.move(*place)
        yield 3
    window.picture("transferring")
    assert shared.artist().busy and session.revision == 1
    assert bones(window) != at_rest, "the hand does not follow"
    yield from window.key("Z", ctrl=True)
    assert shared.artist().busy, "Ctrl+Z within a gesture is swallowed"
    yield from window.key("ESC")
    yield 2
    assert not shared.artist().busy and session.revision == 1 and bones(window) == at_rest
    window.send("LEFTMOUSE", "RELEASE")
    yield 2
    yield from window.drag(path)
    yield 5
    assert len(session.document.pairs) == 1 and session.revision == 2, shared.artist().status()
    window.picture("transferred")
    posed = bones(window)
    assert posed != at_rest
    yield from window.undo()
    yield 2
    assert bones(window) == at_rest and not session.document.pairs and session.revision == 1
    yield from window.redo()
    yield 2
    assert bones(window) == posed and len(session.document.pairs) == 1


@in_window
def test_solving_beside_the_window(window: Window) -> Iterator[Any]:
    """Without following: Solve by its key is a ghost on the bones; Escape leaves it, Enter keeps it as one step."""
    yield from scene(window)
    from contact_blender.extension import shared

    session = shared.session()
    window.bpy.context.window_manager.contact_tools.all.live = False
    take_up(window, "paint")
    yield from window.drag(way(window, *FINGER))
    take_up(window, "transfer")
    yield from window.drag(way(window, *BALL))
    yield 3
    artist, at_rest, revision = shared.artist(), bones(window), session.revision
    assert len(session.document.pairs) == 1 and revision == 2, artist.status()
    for kept in (False, True):
        yield from window.over_view()
        yield from window.key("RET", ctrl=True)
        assert artist.busy, "Ctrl+Enter begins to solve"
        for _ in range(2000):
            if artist.interaction.proposing.proposal is not None:
                break
            yield
        yield 3
        assert bones(window) != at_rest and session.revision == revision
        if kept:
            window.picture("proposed")
        yield from window.key("RET" if kept else "ESC")
        yield 3
        assert not artist.busy and session.revision == revision + kept
        assert (bones(window) != at_rest) == kept
    yield from window.undo()
    yield 2
    assert bones(window) == at_rest and session.revision == revision
    yield from window.key("RET", ctrl=True)
    yield from window.key("ESC")  # at once: the work stops
    yield from window.key("ESC")
    for _ in range(200):
        if not artist.busy:
            break
        yield
    assert not artist.busy and bones(window) == at_rest and session.revision == revision


@in_window
def test_what_a_move_of_the_mouse_costs(window: Window) -> Iterator[Any]:
    """Tells milliseconds of our own work in a drag, drawing not counted, by the clock and by the processor time of
    the window's thread. The solver has another; nothing hears the depsgraph, nothing works when nothing moves."""
    yield from scene(window)
    from contact_blender.extension import shared
    from contact_core.interaction.live import LiveSolve

    take_up(window, "paint")
    yield from window.drag(way(window, *FINGER))
    artist, spent, solved = shared.artist(), Spent(window), list[float]()
    for name in ("move", "advance", "_show_poses"):
        spent.watch(artist, name)
    make, threads = LiveSolve._step, set[str]()

    def watched(live: Any, problem: Any) -> Any:
        step = make(live, problem)

        def run() -> Any:
            began = time.thread_time()
            threads.add(threading.current_thread().name)
            found = step()
            solved.append(1e3 * (time.thread_time() - began))
            return found

        return run

    LiveSolve._step = watched
    take_up(window, "transfer")
    path = way(window, *BALL, BALL[0], BALL[1], BALL[0])
    yield from window.move(*path[0])
    window.send("LEFTMOUSE", "PRESS")
    yield
    for place in path[1:]:
        yield from window.move(*place)
    yield 20
    assert len(spent.clock["move"]) > 15 and threads == {"contact Follow"}, threads
    written = len(spent.clock["_show_poses"])
    yield 20
    assert len(spent.clock["_show_poses"]) == written, "bones are written though nothing has moved"
    window.send("LEFTMOUSE", "RELEASE")
    yield 5
    spent.tell()
    window.said.append(f"steps of the pose: {len(solved)}, {_spread(solved)} of the processor on a thread")
    ours = [each for each in window.bpy.app.handlers.depsgraph_update_post if "contact" in str(each.__module__)]
    assert not ours
    built = artist.drawing.rebuilt
    for _ in range(5):
        window.draw()
    assert artist.drawing.rebuilt == built, "batches are made anew though nothing has changed"


@in_window
def test_a_ghost_of_what_has_not_moved_is_not_seen(window: Window) -> Iterator[Any]:
    """Where a proposal leaves the skin alone its ghost lies in the skin, and must not show through in stripes."""
    import numpy as np

    yield from scene(window)
    from contact_blender.extension import shared
    from contact_core.interaction.overlay import NOTHING, Ghost, Overlay

    take_up(window, "paint")
    yield from window.drag(way(window, *FINGER))
    yield from window.move(5, 5)
    artist = shared.artist()
    skin = artist.interaction.desk.scene.surfaces["finger"]
    ghost = Ghost(skin.points, skin.mesh.faces, (0.0, 1.0, 0.0), 1.0)
    artist.drawing.replace(NOTHING)
    without = window.pixels().astype(int)
    artist.drawing.replace(Overlay(ghosts=(ghost,)))
    same = window.pixels().astype(int)
    beside = Ghost(skin.points + np.array([0.0, 0.0, 1.0]), skin.mesh.faces, (0.0, 1.0, 0.0), 1.0)
    artist.drawing.replace(Overlay(ghosts=(beside,)))
    seen = window.pixels().astype(int)
    striped, whole = (int((abs(each - without).max(axis=2) > 40).sum()) for each in (same, seen))
    window.said.append(f"a ghost in the skin changes {striped} pixels, beside it {whole}")
    assert whole > 2000 and striped < 0.03 * whole, (striped, whole)


class Spent:
    """What calls of methods take on the window's thread."""

    def __init__(self, window: Window) -> None:
        self.window = window
        self.clock: dict[str, list[float]] = {}
        self.processor: dict[str, list[float]] = {}

    def watch(self, owner: Any, name: str) -> None:
        original, clock, processor = getattr(owner, name), [], []
        self.clock[name], self.processor[name] = clock, processor

        def timed(*given: Any) -> None:
            began, busy = time.perf_counter(), time.thread_time()
            original(*given)
            clock.append(1e3 * (time.perf_counter() - began))
            processor.append(1e3 * (time.thread_time() - busy))

        setattr(owner, name, timed)

    def tell(self) -> None:
        for name in self.clock:
            self.window.said.append(
                f"{name}: {len(self.clock[name])} times, {_spread(self.processor[name])} of the processor,"
                f" {_spread(self.clock[name])} by the clock"
            )


def _spread(times: list[float]) -> str:
    ordered = sorted(times)
    return f"p50 {ordered[len(ordered) // 2]:.1f} ms, p95 {ordered[int(0.95 * len(ordered))]:.1f} ms"
