"""The application's tutorial, done in Blender's window by mouse and keys: a grasp, keyed on the timeline."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from blender_driver import Window, in_window

MUG = 0.14811  # metres, where it stands beside the hand
FRONT = (0.08, 0.0, 0.08), (0.08, -0.52, 0.08)  # what is looked at, and from where
BEHIND = (0.1, 0.0, 0.08), (-0.36, 0.31, 0.08)


def look(window: Window, target: Any, eye: Any) -> None:
    """Turn the view as an artist turns it."""
    from mathutils import Vector

    data = window.area.spaces.active.region_3d
    back = Vector(eye) - Vector(target)
    data.view_perspective, data.view_location = "PERSP", target
    data.view_distance, data.view_rotation = back.length, back.to_track_quat("Z", "Y")
    data.update()


def take_up(window: Window, name: str) -> None:
    with window.override():
        window.bpy.ops.wm.tool_set_by_id(name=f"contact.{name}", space_type="VIEW_3D")


def drag_the_mark(window: Window, lesson: Any, artist: Any, **held: bool) -> Iterator[Any]:
    """Drag along what the card marks, after a turn of the view where it lies on the far side."""
    from contact_blender.extension.region_view import RegionView

    for target, eye in (FRONT, BEHIND):
        look(window, target, eye)
        yield 2
        artist.interaction.desk.view = RegionView.of(window.region(), window.area.spaces.active.region_3d)
        if not lesson.card().far_side:
            break
    shown = lesson.marked()
    assert shown is not None and not lesson.card().far_side, lesson.card()
    some = shown[0][sorted({*range(0, len(shown[0]), 3), len(shown[0]) - 1})]
    places = [window.on_screen(point) for point in some]
    yield from window.move(*places[0])
    yield 6  # the scene is looked at while the pointer hovers
    yield from window.drag(places, **held)
    yield 2
    assert not artist.interaction.status.refusal, artist.status()
    lesson.follow()


def settled(window: Window, artist: Any, lesson: Any) -> Iterator[Any]:
    """Shift+Enter, and Enter when the pose is there."""
    yield from window.over_view()
    yield from window.key("RET", shift=True)
    assert artist.busy, artist.status()
    for _ in range(4000):
        if artist.interaction.proposing.proposal is not None:
            break
        yield
    yield 2
    window.picture(f"proposed-{lesson.number}")
    yield from window.key("RET")
    yield 3
    lesson.follow()


@in_window
def test_the_tutorial_ends_in_a_grasp_on_the_timeline(window: Window) -> Iterator[Any]:
    bpy, extension = window.bpy, window.enable()
    import contact_core as contact
    from contact_blender.extension.warming import WARMING
    from contact_core.grasping.judging import verdict
    from contact_core.interaction.lesson import STEPS, Lesson

    for each in tuple(bpy.data.objects):
        bpy.data.objects.remove(each)
    session = extension.shared.session()
    for name in ("human_hand", "mug"):
        session.host.add(contact.read_asset(f"sample:{name}"))
    bpy.data.objects["mug"].location.x += MUG
    bpy.context.view_layer.update()
    WARMING.begin()
    while not WARMING.is_done:
        assert not WARMING.failure, WARMING.failure
        yield 3
    window.shown("human_hand", "mug")
    for name in ("mug", "human_hand"):
        bpy.data.objects[name].select_set(True)
        bpy.context.view_layer.objects.active = bpy.data.objects[name]
    assert bpy.ops.contact.add_surfaces() == {"FINISHED"}
    yield from window.open_sidebar()
    window.base()
    artist = extension.shared.artist()
    lesson = Lesson(artist.interaction)

    def step() -> str:
        return STEPS[lesson.number].name

    look(window, *FRONT)
    take_up(window, "paint")
    yield from window.over_view()
    for _ in range(2):
        yield from window.key("LEFT_BRACKET")
    while step() == "paint":
        yield from drag_the_mark(window, lesson, artist, shift=True)
    window.picture("painted")
    take_up(window, "axis")
    yield from drag_the_mark(window, lesson, artist)
    assert step() == "transfer", lesson.card()
    take_up(window, "transfer")
    for _ in range(4):
        if artist.interaction.selection.surface == "mug":
            break
        yield from window.over_view()
        yield from window.key("Y")
    for number in range(4):
        assert step() == "transfer", (number, lesson.card())
        yield from drag_the_mark(window, lesson, artist)
        if number == 1:
            window.picture("transferred")
    lesson.next()
    look(window, *FRONT)
    yield 2
    yield from settled(window, artist, lesson)
    first = verdict(session)
    window.said.append(f"settled: {first.failures or 'a grasp'}")
    take_up(window, "move")
    yield from drag_the_mark(window, lesson, artist)
    look(window, *FRONT)
    yield 2
    yield from settled(window, artist, lesson)
    assert lesson.is_over, lesson.card()
    second = verdict(session)
    window.said.append(f"again: {second.failures or 'a grasp'}")
    yield from window.over_view()
    yield from window.key("I")
    yield 3
    window.picture("grasp")
    rig = next(each for each in bpy.data.objects if each.type == "ARMATURE")
    assert rig.animation_data is not None and rig.animation_data.action is not None, "nothing is keyed"
    hand = next(iter(session.rigs))
    assert session.host.pose_keys(session.binding.surfaces[hand].object_id) == (1.0,)
    assert first.is_grasp, first.failures
    assert second.is_grasp, second.failures
    bpy.context.scene.frame_set(1)
    assert verdict(session).is_grasp, "the keyed pose is another"
