"""Runs inside a Blender that has a window: one act, step by step, with simulated events and pictures of the screen.

An act is a generator function `act(window)`. Each `yield` lets Blender handle what was sent and draw (`yield 5`:
five ticks of 30 ms). What it asserts fails the test outside. Imported outside as well, where nothing runs.
"""

from __future__ import annotations

import importlib.util
import json
import os
import struct
import sys
import traceback
import zlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

TICK = 0.03  # seconds
MODULE = "bl_ext.user_default.contact_core"
Act = Callable[["Window"], Iterator[Any]]


def in_window(act: Act) -> Callable[[Path], None]:
    """Make a test of an act: it passes when the act comes to its end and no traceback was printed meanwhile."""

    def test(tmp_path: Path) -> None:
        import blender_runner

        blender_runner.run_act(Path(act.__code__.co_filename), act.__name__, tmp_path)

    test.__doc__, test.__module__, test.act = act.__doc__, act.__module__, act  # type: ignore[attr-defined]
    return test


class Window:
    """What an act is given: Blender, its window, mouse and keys, and the screen."""

    def __init__(self, folder: Path, screen: Path) -> None:
        import bpy

        self.bpy: Any = bpy
        self.folder = folder
        self._screen = screen
        self._mouse = (0, 0)
        self.said: list[str] = []

    # Where things are

    @property
    def window(self) -> Any:
        return self.bpy.context.window_manager.windows[0]

    @property
    def area(self) -> Any:
        """The 3D view."""
        return next(area for area in self.window.screen.areas if area.type == "VIEW_3D")

    def region(self, kind: str = "WINDOW") -> Any:
        """A region of the 3D view: WINDOW, UI (the sidebar), TOOLS, HEADER."""
        return next(region for region in self.area.regions if region.type == kind)

    def override(self, kind: str = "WINDOW") -> Any:
        """The context that an operator started from the 3D view has: `with window.override(): bpy.ops...`."""
        return self.bpy.context.temp_override(window=self.window, area=self.area, region=self.region(kind))

    def on_screen(self, point: Sequence[float]) -> tuple[int, int]:
        """Window pixels of a point of the world. Fails for one that the 3D view does not show."""
        from bpy_extras.view3d_utils import location_3d_to_region_2d
        from mathutils import Vector

        region = self.region()
        found = location_3d_to_region_2d(region, self.area.spaces.active.region_3d, Vector(point))
        assert found is not None, f"the view does not show {point}"
        inside = 0 <= found.x < region.width and 0 <= found.y < region.height
        assert inside, f"{point} is beside the view, at {tuple(found)}"
        return round(region.x + found.x), round(region.y + found.y)

    def hits(self, name: str, point: Sequence[float]) -> bool:
        """Whether the pixel of a point shows this object: a ray through it meets the object first."""
        from bpy_extras.view3d_utils import region_2d_to_origin_3d, region_2d_to_vector_3d

        region, view = self.region(), self.area.spaces.active.region_3d
        x, y = self.on_screen(point)
        place = (x - region.x, y - region.y)
        origin, direction = region_2d_to_origin_3d(region, view, place), region_2d_to_vector_3d(region, view, place)
        graph = self.bpy.context.evaluated_depsgraph_get()
        met, *_, thing, _ = self.bpy.context.scene.ray_cast(graph, origin, direction)
        return bool(met) and thing.name == name

    def shown(self, *names: str) -> None:
        """Fails unless these objects can be seen: a hidden hand gives believable timings and no hits."""
        for name in names:
            assert self.bpy.data.objects[name].visible_get(), f"{name} is hidden"

    # Mouse and keys

    def send(self, kind: str, value: str, **modifiers: bool) -> None:
        self.window.event_simulate(type=kind, value=value, x=self._mouse[0], y=self._mouse[1], **modifiers)

    def move(self, x: float, y: float) -> Iterator[Any]:
        self._mouse = (round(x), round(y))
        self.send("MOUSEMOVE", "NOTHING")
        yield

    def key(self, kind: str, **modifiers: bool) -> Iterator[Any]:
        """Press and release a key over where the mouse is: `yield from window.key("Z", ctrl=True)`."""
        self.send(kind, "PRESS", **modifiers)
        yield
        self.send(kind, "RELEASE", **modifiers)
        yield 2

    def click(self, x: float, y: float, button: str = "LEFTMOUSE", **modifiers: bool) -> Iterator[Any]:
        yield from self.drag([(x, y)], button, **modifiers)

    def drag(self, way: Sequence[Sequence[float]], button: str = "LEFTMOUSE", **modifiers: bool) -> Iterator[Any]:
        """Press at the first place, move over the others, release at the last; window pixels."""
        yield from self.move(*way[0])
        self.send(button, "PRESS", **modifiers)
        yield
        for place in way[1:]:
            yield from self.move(*place)
        self.send(button, "RELEASE", **modifiers)
        yield 2

    def over_view(self) -> Iterator[Any]:
        """Put the mouse over the middle of the 3D view, where its keys are heard."""
        region = self.region()
        yield from self.move(region.x + region.width // 2, region.y + region.height // 2)

    def undo(self) -> Iterator[Any]:
        yield from self.over_view()
        yield from self.key("Z", ctrl=True)

    def redo(self) -> Iterator[Any]:
        yield from self.over_view()
        yield from self.key("Z", ctrl=True, shift=True)

    # The panel

    def open_sidebar(self, category: str = "Contact") -> Iterator[Any]:
        self.area.spaces.active.show_region_ui = True
        yield 3
        self.region("UI").active_panel_category = category
        self.region("UI").tag_redraw()
        yield 3

    def scroll_down(self) -> Iterator[Any]:
        """To the end of the sidebar."""
        region = self.region("UI")
        yield from self.move(region.x + 10, region.y + region.height // 2)
        with self.override("UI"):
            for _ in range(20):
                self.bpy.ops.view2d.scroll_down()
        yield 3

    def buttons(self, wanted: str = "", step: int = 11) -> Iterator[Any]:
        """Fills `found`: {call: window pixels} of the sidebar's buttons, by the command that Blender would copy of
        what is under the mouse: "bpy.ops.contact.paint(...)". Ends early at a call that begins as `wanted`."""
        self.found: dict[str, tuple[int, int]] = {}
        region, manager = self.region("UI"), self.bpy.context.window_manager
        for x in (region.x + 40, region.x + region.width // 2 + 30, region.x + region.width - 42):
            for y in range(region.y + region.height - 5, region.y, -step):
                yield from self.move(x, y)
                manager.clipboard = ""
                with self.override("UI"):
                    if self.bpy.ops.ui.copy_python_command_button.poll():
                        self.bpy.ops.ui.copy_python_command_button()
                call = manager.clipboard
                if call.startswith("bpy.ops."):
                    self.found.setdefault(call, (x, y))
                    if wanted and call.startswith(f"bpy.ops.{wanted}"):
                        return

    def press(self, call: str) -> Iterator[Any]:
        """Click the sidebar's button of an operator: "contact.paint(", or with how its call begins."""
        yield from self.buttons(call)
        there = [place for said, place in self.found.items() if said.startswith(f"bpy.ops.{call}")]
        assert there, f"no button {call} in the panel; there are {sorted(self.found)}"
        yield from self.click(*there[0])
        yield 3

    # The screen

    def draw(self) -> None:
        with self.bpy.context.temp_override(window=self.window):
            self.bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=2)

    def pixels(self) -> Any:
        """(height, width, 3) uint8: the whole screen as it is now, drawn anew before."""
        self.draw()
        return read_screen(self._screen)

    def picture(self, name: str) -> Any:
        """Keep the screen as NAME.png beside the report; returns its pixels, which are not of one colour."""
        pixels = self.pixels()
        assert pixels.reshape(-1, 3).std(axis=0).max() > 1.0, "the screen is empty"
        write_png(self.folder / f"{name}.png", pixels)
        return pixels

    # Files and the add-on

    def open_file(self, path: str) -> Iterator[Any]:
        with self.bpy.context.temp_override(window=self.window):
            self.bpy.ops.wm.open_mainfile(filepath=path)
        yield 10

    def enable(self) -> Any:
        """Enable the extension and return `contact_blender.extension`."""
        assert self.bpy.ops.preferences.addon_enable(module=MODULE) == {"FINISHED"}, "the add-on was not enabled"
        from contact_blender import extension

        return extension

    def session(self) -> Any:
        from contact_blender.extension import shared

        return shared.session()

    def hand_and_ball(self) -> Any:
        """A sample hand and a ball as the scene, with a pair for the thumb and one for the index finger, in view;
        returns the session. Steps back before it are none."""
        import contact_core as contact

        bpy = self.bpy
        for each in tuple(bpy.data.objects):
            bpy.data.objects.remove(each)
        session = self.session()
        for name in ("human_hand", "baseball"):
            session.host.add(contact.read_asset(f"sample:{name}"))
        meshes = [each for each in bpy.context.scene.objects if each.type == "MESH"]
        for each in meshes:
            each.select_set(True)
            bpy.context.view_layer.objects.active = each
        assert bpy.ops.contact.add_surfaces() == {"FINISHED"}
        rigged, thing = sorted(session.document.surfaces, key=lambda name: name not in session.rigs)
        rig, ball = session.rigs[rigged], session.geometry.mesh(thing)
        size = (ball.points.max(axis=0) - ball.points.min(axis=0)).max()
        for side, name in ((-1.0, "thumb_distal"), (1.0, "index_distal")):
            tip = rig.rest_world[rig.joint_index(name), :3, 3]
            session.patches.brush("disk", name, surface=rigged, at=tip, radius=0.05 * size)
            root = contact.SurfacePoints.at_vertices(ball, [int((side * ball.points[:, 0]).argmax())])
            session.pairs.add(name, session.patches.transfer(name, thing, root, direction=[0.0, 0.0, 1.0]))
        with self.override():
            bpy.ops.view3d.view_all()
        self.base()
        return session

    def base(self, label: str = "Set up") -> None:
        """Push a step after setting a scene up: else the first Ctrl+Z takes the setting up back as well."""
        self.bpy.ops.ed.undo_push(message=label)


def read_screen(path: Path) -> Any:
    """(height, width, 3) uint8 of the frame buffer file that Xvfb keeps (`-fbdir`), an X window dump."""
    import numpy as np

    data = path.read_bytes()
    header = struct.unpack(">25I", data[:100])
    size, width, height, line, colors = header[0], header[4], header[5], header[12], header[19]
    start = size + 12 * colors
    rows = np.frombuffer(data, np.uint8, line * height, start).reshape(height, line)
    return rows[:, : 4 * width].reshape(height, width, 4)[:, :, 2::-1].copy()


def write_png(path: Path, pixels: Any) -> None:
    height, width = pixels.shape[:2]
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)

    def part(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    whole = b"\x89PNG\r\n\x1a\n" + part(b"IHDR", head) + part(b"IDAT", zlib.compress(rows, 9)) + part(b"IEND", b"")
    path.write_bytes(whole)


def _started(act: Act, window: Window) -> Iterator[Any]:
    yield 10
    yield from window.key("ESC")  # the splash
    yield from act(window)


def main() -> None:
    source, name, folder, screen = Path(sys.argv[-4]), sys.argv[-3], Path(sys.argv[-2]), Path(sys.argv[-1])
    import bpy

    sys.path.insert(0, str(Path(__file__).parent))
    sys.modules["blender_driver"] = sys.modules[__name__]
    spec = importlib.util.spec_from_file_location(source.stem, source)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    window, waiting = Window(folder, screen), [0]

    def end(failure: str) -> None:
        report = {"failure": failure, "said": window.said}
        (folder / "report.json").write_text(json.dumps(report), encoding="utf-8")
        sys.stdout.flush(), sys.stderr.flush()
        os._exit(0)

    def tick() -> float:
        if waiting[0] > 1:
            waiting[0] -= 1
            return TICK
        try:
            waiting[0] = next(steps) or 0
        except StopIteration:
            end("")
        except BaseException:
            try:
                window.picture("failure")
            finally:
                end(traceback.format_exc())
        return TICK

    try:
        spec.loader.exec_module(module)
        steps = _started(getattr(module, name).act, window)
    except BaseException:
        end(traceback.format_exc())
    bpy.app.timers.register(tick, first_interval=0.5, persistent=True)


if __name__ == "__main__":
    main()
