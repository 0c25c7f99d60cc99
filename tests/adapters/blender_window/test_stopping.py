"""Escape in a real window: a solve of many frames, settling and suggesting stop, and say so; nothing is changed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from blender_driver import Window, in_window

FRAMES = 60


def bones(window: Window) -> Any:
    """All channels of all bones, to compare."""
    rigs = [each for each in window.bpy.data.objects if each.type == "ARMATURE"]
    return [[round(v, 5) for row in bone.matrix_basis for v in row] for rig in rigs for bone in rig.pose.bones]


def keyed(window: Window) -> bool:
    rigs = [each for each in window.bpy.data.objects if each.type == "ARMATURE"]
    return any(rig.animation_data is not None and rig.animation_data.action is not None for rig in rigs)


def over(artist: Any, ticks: int = 4000) -> Iterator[Any]:
    """Until nothing is under way."""
    for _ in range(ticks):
        if not artist.busy:
            return
        yield
    raise AssertionError(f"it goes on: {artist.status()}")


@in_window
def test_escape_stops_what_is_long(window: Window) -> Iterator[Any]:
    extension = window.enable()
    yield 3
    session = window.hand_and_ball()
    yield from window.open_sidebar()
    window.shown("human_hand", "baseball")
    from contact_blender.extension.warming import WARMING

    WARMING.begin()
    while not WARMING.is_done:
        assert not WARMING.failure, WARMING.failure
        yield 3
    scene, settings = window.bpy.context.scene, window.bpy.context.window_manager.contact
    scene.frame_start, scene.frame_end, settings.keyed = 1, FRAMES, True
    window.base()
    artist, before, at_rest = extension.shared.artist(), session.document, bones(window)
    yield from window.scroll_down()
    yield from window.press("contact.solve(")
    assert artist.busy and artist.interaction.worker.status is not None, "frames are solved beside the window"
    for _ in range(3):
        yield from window.over_view()  # the window goes on
    window.picture("frames")
    yield from window.key("ESC")
    yield from over(artist, 30)
    assert session.document is before and bones(window) == at_rest and not keyed(window)

    for action in ("pose.settle", "pose.suggest"):
        yield from window.over_view()
        with window.override():
            window.bpy.ops.contact.propose("INVOKE_DEFAULT", action=action)
        assert artist.busy
        yield
        yield from window.key("ESC")
        if artist.busy:  # the best so far is shown: Escape leaves that, too
            for _ in range(400):
                if artist.interaction.worker.status is None:
                    break
                yield
            window.said.append(f"{action}: {artist.status()}")
            yield from window.key("ESC")
        yield from over(artist, 30)
        assert session.document is before and bones(window) == at_rest, action

    scene.frame_end = 3
    yield from window.open_sidebar()
    yield from window.scroll_down()
    yield from window.press("contact.solve(")
    yield from over(artist)
    assert session.document is not before and keyed(window)
    yield from window.undo()
    assert session.document is before and not keyed(window)
