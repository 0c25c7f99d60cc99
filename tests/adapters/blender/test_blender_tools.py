"""The artist's tools as far as they need no window: the table, the keys, the view, and gestures as values."""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

ADAPTER = Path(__file__).parents[3] / "adapters" / "blender"
SIZE = (800, 600)


@pytest.fixture
def artist(bpy: Any, empty: Any) -> Iterator[Any]:
    """The interaction of a scene with a finger above a ball, neither of which is a surface yet."""
    import contact_core as contact
    from contact_blender import extension
    from contact_blender.extension import rehearsal

    extension.register()
    host, there = extension.shared.session().host, np.eye(4)
    there[:3, 3] = 5.0, 0.0, -2.6
    rig = rehearsal.finger()
    host.add(contact.Asset("finger", rig.surface, rig=rig, meters_per_unit=1.0, up_axis="Z"))
    host.add(contact.Asset("ball", rehearsal.ball(), meters_per_unit=1.0, up_axis="Z"), there)
    bpy.context.view_layer.update()
    yield extension.shared.artist()
    extension.unregister()


FINGER = ((4.7, -0.6, 0.0), (5.2, -0.6, 0.0))
BALL = ((4.8, -1.45, -2.5), (5.3, -1.4, -2.5))


def drag(bpy: Any, artist: Any, tool: str, ends: Any, *, let_go: bool = True) -> None:
    from contact_blender.extension.rehearsal import VIEW
    from contact_core.interaction.events import Pointer

    artist.take_up(tool)
    pixels = VIEW.project(np.linspace(*ends, 5))[:, :2]
    assert artist.press(bpy.context, Pointer("press", *pixels[0], "left"), VIEW), artist.status()
    for pixel in pixels[1:]:
        artist.move(Pointer("move", *pixel), VIEW)
        artist.advance()
    until = time.monotonic() + 60.0
    while artist.interaction.is_due and time.monotonic() < until:  # the pose is solved on a thread
        artist.advance()
        time.sleep(0.002)
    if let_go:
        artist.release(Pointer("release", *pixels[-1], "left"), VIEW)


def channels(bpy: Any) -> list[tuple[float, ...]]:
    bones = [bone for each in bpy.data.objects if each.type == "ARMATURE" for bone in each.pose.bones]
    return [(*bone.location, *bone.rotation_quaternion, *bone.rotation_euler, *bone.scale) for bone in bones]


def test_the_table_beside_the_extension_is_that_of_the_core() -> None:
    spec = importlib.util.spec_from_file_location("tool_table", ADAPTER / "tool_table.py")
    assert spec is not None and spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    assert made.TABLE.read_text(encoding="utf-8") == made.text(), "run python adapters/blender/tool_table.py"


def test_every_tool_is_in_the_toolbars(bpy: Any, artist: Any) -> None:
    from bl_ui.space_toolsystem_common import ToolSelectPanelHelper
    from bl_ui.space_toolsystem_toolbar import VIEW3D_PT_tools_active

    for mode in ("OBJECT", "POSE"):
        there = ToolSelectPanelHelper._tools_flatten(VIEW3D_PT_tools_active._tools[mode])
        ids = [tool.idname for tool in there if tool is not None and hasattr(tool, "idname")]
        wanted = [f"contact.{tool.name}" for tool in artist.interaction.tools if tool.name != "place"]
        assert "contact.place" not in ids  # the scene says where things stand, and Blender's own Move moves them
        assert len(wanted) > 10 and set(wanted) <= set(ids) and len(ids) == len(set(ids))


def test_every_action_has_an_operator_and_no_key_twice(bpy: Any, artist: Any) -> None:
    from contact_blender.extension import chords, settings, toolbar

    actions = settings.table()["actions"]
    assert chords.taken_twice(actions) == []
    keys = [bpy.types.Event.bl_rna.properties["type"].enum_items]
    for action in actions:
        if chords.is_blenders(action) or action["id"] in chords.WHILE_PROPOSED:
            continue
        name = toolbar.operator_of(action["id"]).removeprefix("contact.")
        assert hasattr(bpy.types, f"CONTACT_OT_{name}"), action
        for chord in chords.chords_of(action):
            assert chords.item_of(chord)["type"] in keys[0], chord


def test_what_runs_beside_the_window_can_be_begun(bpy: Any, artist: Any) -> None:
    from contact_blender.extension import settings, toolbar

    known = bpy.ops.contact.propose.get_rna_type().properties["action"].enum_items.keys()
    assert set(toolbar.OF_ITS_OWN) == set(known) <= {action["id"] for action in settings.table()["actions"]}


def test_keys_that_blender_needs_are_left_to_it() -> None:
    from contact_blender.extension import chords, settings

    found = {chord for action in settings.table()["actions"] for chord in chords.chords_of(action)}
    assert found.isdisjoint({"N", "T", "Q", "Tab", "Space", "X", "Z", "Ctrl+Z", "Ctrl+S", "Ctrl+O", "Shift+Space"})


@pytest.mark.parametrize("perspective", [True, False])
def test_the_view_agrees_with_blenders_own(bpy: Any, perspective: bool) -> None:
    from bpy_extras import view3d_utils
    from mathutils import Matrix, Quaternion, Vector

    from contact_blender.extension.region_view import RegionView
    from contact_core.interaction.view import View

    view = Matrix.LocRotScale(
        Vector((2.0, -7.0, 3.0)), Quaternion((0.7, 0.6, 0.2, 0.3)).normalized(), None
    ).inverted()
    near, far, slope = 0.1, 100.0, 0.4
    window = Matrix.Identity(4)
    if perspective:
        window[0][0], window[1][1] = 1.0 / slope, SIZE[0] / SIZE[1] / slope
        window[2][2], window[2][3] = -(far + near) / (far - near), -2.0 * far * near / (far - near)
        window[3][2], window[3][3] = -1.0, 0.0
    else:
        window[0][0], window[1][1], window[2][2] = 0.2, 0.2 * SIZE[0] / SIZE[1], -2.0 / (2.0 * far)
    data = SimpleNamespace(
        is_perspective=perspective, view_perspective="PERSP", view_matrix=view, perspective_matrix=window @ view
    )
    region = SimpleNamespace(width=SIZE[0], height=SIZE[1])
    ours = RegionView.of(region, data)
    assert isinstance(ours, View)
    for x, y in ((0.0, 0.0), (123.0, 456.0), (799.0, 20.0)):
        origins, directions = ours.rays([[x, SIZE[1] - y]])
        direction = np.array(view3d_utils.region_2d_to_vector_3d(region, data, (x, y)))
        origin = np.array(view3d_utils.region_2d_to_origin_3d(region, data, (x, y)))
        assert directions[0] == pytest.approx(direction, abs=2e-5)
        beside = (origin - origins[0]) - (origin - origins[0]) @ direction * direction
        assert np.linalg.norm(beside) < 2e-3
        place = origins[0] + 5.0 * directions[0]
        assert ours.project(place[None])[0, :2] == pytest.approx([x, SIZE[1] - y], abs=1e-2)
        seen = view3d_utils.location_3d_to_region_2d(region, data, Vector(place))
        if seen is not None:
            assert ours.project(place[None])[0, :2] == pytest.approx([seen.x, SIZE[1] - seen.y], abs=1e-2)
    behind = np.array(ours.rays([[400.0, 300.0]]))[:, 0]
    assert ours.project((behind[0] - behind[1])[None])[0, 2] < 0.0


def test_a_first_stroke_adds_its_object_in_the_same_step(bpy: Any, artist: Any) -> None:
    session = artist.session
    drag(bpy, artist, "paint", FINGER)
    assert session.revision == 1 and list(session.document.surfaces) == ["finger"]
    assert len(session.document.patches) == 1
    bpy.ops.ed.undo()
    assert session.revision == 0 and not session.document.surfaces
    bpy.ops.ed.redo()
    drag(bpy, artist, "paint", ((4.7, -0.6, 0.1), (5.5, -0.6, 0.1)))
    assert session.revision == 2 and len(session.document.patches) == 1


def test_a_cancelled_first_stroke_leaves_nothing(bpy: Any, artist: Any) -> None:
    before = artist.session.document
    drag(bpy, artist, "paint", FINGER, let_go=False)
    assert artist.interaction.is_busy
    artist.cancel()
    assert artist.session.document is before and artist.session.revision == 0
    drag(bpy, artist, "measure", FINGER)  # changes nothing, so the object is no surface either
    assert artist.session.document is before


def test_bones_follow_a_drag_and_a_step_takes_all_of_it_back(bpy: Any, artist: Any) -> None:
    drag(bpy, artist, "paint", FINGER)
    session, at_rest = artist.session, channels(bpy)
    painted = session.document
    drag(bpy, artist, "transfer", BALL, let_go=False)
    assert channels(bpy) != at_rest, "the finger does not follow"
    artist.cancel()
    assert channels(bpy) == at_rest and session.document is painted
    drag(bpy, artist, "transfer", BALL)
    posed = channels(bpy)
    assert posed != at_rest and len(session.document.pairs) == 1 and session.revision == 2
    bpy.ops.ed.undo()
    assert channels(bpy) == at_rest and session.document is painted
    bpy.ops.ed.redo()
    assert channels(bpy) == posed and len(session.document.pairs) == 1


def test_a_proposal_is_seen_on_the_bones_and_left_or_kept(bpy: Any, artist: Any) -> None:
    drag(bpy, artist, "paint", FINGER)
    artist.interaction.set(live=False)
    bpy.context.window_manager.contact_tools.all.live = False
    drag(bpy, artist, "transfer", BALL)
    session, at_rest = artist.session, channels(bpy)
    for kept in (False, True):
        artist.do("pose.solve")
        assert artist.interaction.worker.wait(60.0)
        artist.advance()
        assert artist.interaction.proposing.proposal is not None and channels(bpy) != at_rest
        (artist.accept if kept else artist.leave)()
        assert (channels(bpy) != at_rest) == kept
        assert session.revision == 2 + kept
    bpy.ops.ed.undo()
    assert channels(bpy) == at_rest and session.revision == 2


def test_what_blender_moved_is_where_the_next_gesture_meets_it(bpy: Any, artist: Any) -> None:
    drag(bpy, artist, "paint", FINGER)
    bpy.data.objects["finger rig"].location.z += 1.0
    bpy.context.view_layer.update()
    artist.look()
    at = artist.interaction.desk.scene.surfaces["finger"].points
    assert at[:, 2].min() == pytest.approx(0.4, abs=0.05)
    raised = tuple((x, y, z + 1.0) for x, y, z in FINGER)
    drag(bpy, artist, "paint", raised)
    assert artist.session.revision == 2 and len(artist.session.document.patches) == 1


def test_hidden_objects_are_neither_picked_nor_drawn(bpy: Any, artist: Any) -> None:
    drag(bpy, artist, "paint", FINGER)
    assert artist.interaction.overlay().decals
    bpy.data.objects["finger"].hide_set(True)
    artist.look()
    assert not artist.interaction.overlay().decals
    from contact_blender.extension.rehearsal import VIEW
    from contact_core.interaction.events import Pointer

    pixel = VIEW.project([FINGER[0]])[0, :2]
    assert not artist.press(bpy.context, Pointer("press", *pixel, "left"), VIEW)
    bpy.data.objects["finger"].hide_set(False)
    artist.look()
    assert artist.interaction.overlay().decals


def test_settings_of_the_header_reach_the_tool(bpy: Any, artist: Any) -> None:
    held = bpy.context.window_manager.contact_tools
    held.paint.radius, held.paint.fresh = 0.25, True
    drag(bpy, artist, "paint", FINGER)
    drag(bpy, artist, "paint", FINGER)
    tool = artist.interaction.tool_named("paint")
    assert tool.radius == pytest.approx(0.25) and tool.fresh
    assert len(artist.session.document.patches) == 2
    artist.do("edit.larger")
    assert held.paint.radius == pytest.approx(0.25 * 1.15, rel=1e-5)


class Row:
    """Keeps what is drawn into a header: property and text."""

    def __init__(self, drawn: list[tuple[str, str | None]]) -> None:
        self.drawn = drawn

    def row(self, align: bool = False) -> Row:
        return self

    def prop(self, group: Any, name: str, text: str | None = None, icon: str = "", toggle: bool = False) -> None:
        assert name in group.bl_rna.properties
        self.drawn.append((name, text))


@pytest.mark.parametrize("unit", [1.0, 0.01])
def test_a_radius_that_is_left_open_says_automatic(bpy: Any, artist: Any, unit: float) -> None:
    """Not "0 m"; a click gives a number of one's own, a centimetre first, another one leaves it open again."""
    from contact_blender.extension import settings

    held, (told,) = bpy.context.window_manager.contact_tools, [t for t in settings.tools() if t["name"] == "paint"]
    bpy.context.scene.unit_settings.scale_length = unit

    def header() -> list[tuple[str, str | None]]:
        drawn: list[tuple[str, str | None]] = []
        settings.draw(Row(drawn), held.paint, told["settings"])
        return [each for each in drawn if "radius" in each[0]]

    held.paint.radius = 0.0
    assert header() == [("radius_is_automatic", "Radius: automatic")]
    assert settings.values_of_tools(bpy.context)["paint"]["radius"] is None
    held.paint.radius_is_automatic = False
    assert held.paint.radius == pytest.approx(0.01 / unit) and header()[0] == ("radius", None)
    held.paint.radius_is_automatic = True
    assert held.paint.radius == 0.0 and len(header()) == 1


# Maps that are heard in the 3D view of these modes; a tool's own keymap comes before them.
HEARD = ("Window", "Screen", "Screen Editing", "Frames", "3D View Generic", "3D View", "Object Non-modal")
MODES = {"OBJECT": "Object Mode", "POSE": "Pose", "PAINT_WEIGHT": "Weight Paint"}
# What a tool in the hand must leave to Blender, whatever it does: undo, files, playback, views, modes, sidebars.
NEVER = frozenset((
    "ed.undo", "ed.redo", "wm.save_mainfile", "wm.save_as_mainfile", "wm.open_mainfile", "wm.read_homefile",
    "wm.search_menu", "wm.quit_blender", "screen.animation_play", "screen.repeat_last", "object.mode_set",
    "view3d.object_mode_pie_or_toggle", "wm.toolbar", "view3d.rotate", "view3d.move", "view3d.zoom",
    "view3d.view_axis", "view3d.view_selected", "view3d.view_all", "view3d.localview", "view3d.view_camera",
    "screen.frame_jump", "screen.keyframe_jump", "screen.frame_offset", "wm.call_menu_pie_snap",
))  # fmt: skip


def chord(item: Any) -> tuple[Any, ...]:
    held = ("shift", "ctrl", "alt", "oskey")
    return (item["type"], *(bool(item.get(name)) and item.get(name) != -1 for name in held))


def blenders(bpy: Any) -> dict[str, list[tuple[tuple[Any, ...], str]]]:
    """Blender's default keys by map: those that it would make with a window, from the Python that says them."""
    there = Path(bpy.utils.resource_path("LOCAL")) / "scripts/presets/keyconfig/keymap_data/blender_default.py"
    spec = importlib.util.spec_from_file_location("blender_default", there)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    maps = {name: content["items"] for name, _, content in module.generate_keymaps()}
    assert sum(map(len, maps.values())) > 2500  # not the few that a Blender without a window has
    pressed = ("PRESS", "CLICK", "DOUBLE_CLICK", "CLICK_DRAG", "ANY")
    return {
        name: [(chord(item), operator) for operator, item, _ in items if item["value"] in pressed]
        for name, items in maps.items()
    }


def test_the_key_that_acts_everywhere_is_free(bpy: Any) -> None:
    """The pie menu's, in the 3D view of Object, Pose and Weight Paint mode; and tools are in no other mode."""
    from contact_blender.extension import toolbar

    maps, pie = blenders(bpy), chord(toolbar.PIE_CHORD)
    for name in (*HEARD, *MODES.values()):
        assert [operator for key, operator in maps[name] if key == pie] == [], name
    assert set(toolbar.MODES) == {"OBJECT", "POSE"}  # so in Weight Paint mode nothing else of ours is heard


def test_what_a_tool_in_the_hand_takes_from_blender_is_told(bpy: Any) -> None:
    """Keys of tools act only while one is in the hand; what they take then is on the page, and nothing vital."""
    from contact_blender.extension import chords, settings, toolbar

    maps = blenders(bpy)
    ours = {c: chord(chords.item_of(c)) for a in settings.table()["actions"] for c in chords.chords_of(a)}
    page = (ADAPTER / "README.md").read_text(encoding="utf-8")
    told = page.partition("takes from Blender while it is in the hand:")[2].partition(".\n")[0]
    for name in (*HEARD, *(MODES[mode] for mode in toolbar.MODES)):
        taken = {ours_: op for ours_, key in ours.items() for theirs, op in maps[name] if theirs == key}
        assert NEVER.isdisjoint(taken.values()), (name, taken)
        unsaid = {c: op for c, op in taken.items() if f"`{c}`" not in told}
        assert not unsaid, f"{name}: say in adapters/blender/README.md that a tool takes {unsaid}"


def test_the_end_of_the_file_ends_the_interaction(bpy: Any, artist: Any, tmp_path: Path) -> None:
    from contact_blender.extension import shared

    drag(bpy, artist, "paint", FINGER)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "finger.blend"))
    drag(bpy, artist, "transfer", BALL, let_go=False)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert shared.held() is None and not artist.is_shown()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "finger.blend"))
    again = shared.artist()
    assert again is not artist and list(again.session.document.patches) == ["contact"]
    assert {"ball", "finger"} >= set(again.interaction.desk.scene.surfaces) == {"finger"}
