"""Contacts over time in Blender: operators on spans, and what the timeline draws, as values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import contact_core as contact
from contact_core.testing import meshes
from contact_core.testing.host_scenes import arm_rig


@pytest.fixture
def shared(bpy: Any, empty: Any) -> Iterator[Any]:
    """The add-on on a scene with an arm whose tip is paired with a ball; frames 1 to 24."""
    from contact_blender import extension

    rig, small = arm_rig(), meshes.icosphere(2)
    empty.add(contact.Asset("arm", rig.surface, rig, meters_per_unit=1.0, up_axis="Z"))
    ball = contact.TriangleMesh(0.2 * small.points + [0.6, 0.5, 0.1], small.faces)
    empty.add(contact.Asset("ball", ball, meters_per_unit=1.0, up_axis="Z"))
    bpy.context.scene.frame_start, bpy.context.scene.frame_end, bpy.context.scene.render.fps = 1, 24, 25
    extension.register()
    from contact_blender.extension import where

    session = extension.shared.session()
    for item in session.host.objects():
        where.surface_for(session, item.id)
    arm, thing = (session.geometry.mesh(name) for name in ("arm", "ball"))
    tip = contact.SurfacePoints.at_vertices(arm, [int(np.argmax(arm.points[:, 1] + arm.points[:, 0]))])
    session.patches.paint("tip", tip, surface="arm", axis=tip, heading=1.0)
    side = contact.SurfacePoints.at_vertices(thing, [int(np.argmin(thing.points[:, 0]))])
    session.pairs.add("tip", session.patches.transfer("tip", "ball", side, heading=1.0), name="touch")
    yield extension.shared
    extension.unregister()


def spans(shared: Any) -> list[tuple[float, ...]]:
    found = shared.session().timeline.spans("touch")
    return [(span.on, span.off, span.ease_in, span.ease_out) for span in found]


def test_each_operator_on_a_span_is_one_step(bpy: Any, shared: Any) -> None:
    ops = bpy.ops.contact
    session = shared.session()
    for frame, run, wanted in (
        (8, lambda: ops.span_add(frames=6.0, ease_in=3.0), [(8, 14, 3, 10)]),  # out over 0.4 s at 25 a second
        (10, lambda: ops.span_move(frames=2.0), [(10, 16, 3, 10)]),
        (12, lambda: ops.span_trim(end="on"), [(12, 16, 3, 10)]),
        (20, lambda: ops.span_trim(end="off"), [(12, 20, 3, 10)]),  # the nearest one grows
        (15, lambda: ops.span_ease(ease_in=1.0, ease_out=2.0), [(12, 20, 1, 2)]),
        (15, lambda: ops.span_remove(), []),
    ):
        bpy.context.scene.frame_set(frame)  # an undo has put another scene there
        before, revision = spans(shared), session.revision
        assert run() == {"FINISHED"} and spans(shared) == wanted
        assert session.timeline.settings.frames() == tuple(map(float, range(1, 25)))
        bpy.ops.ed.undo()
        assert spans(shared) == before and session.revision == revision
        bpy.ops.ed.redo()
        assert spans(shared) == wanted
    assert session.timeline.settings.rate == (25, 1)


def test_what_cannot_be_is_refused_in_words(bpy: Any, shared: Any) -> None:
    with pytest.raises(RuntimeError, match="no span yet"):
        bpy.ops.contact.span_move()
    with pytest.raises(RuntimeError, match="no pair 'other'"):
        bpy.ops.contact.span_add(pair="other")
    bpy.context.scene.frame_set(3)
    bpy.ops.contact.span_add(frames=2.0)
    bpy.context.scene.frame_set(20)
    with pytest.raises(RuntimeError, match="goes over frame 20"):
        bpy.ops.contact.span_remove()


def test_the_frame_of_the_scene_is_the_one_at_which_contacts_count(bpy: Any, shared: Any) -> None:
    bpy.context.scene.frame_set(12)
    bpy.ops.contact.span_add(frames=4.0, ease_in=2.0, ease_out=2.0)
    session, revision = shared.session(), shared.session().revision
    bpy.context.scene.frame_set(3)
    shared.artist().look()
    assert session.document.pairs["touch"].gain == 0.0 and session.revision == revision  # no edit
    bpy.context.scene.frame_set(13)
    shared.artist().look()
    assert session.document.pairs["touch"].gain == 1.0


def test_the_timeline_draws_what_the_core_makes(bpy: Any, shared: Any) -> None:
    from contact_blender.extension import film
    from contact_core.interaction.film import LEVELS

    assert film.shapes() is None  # nothing over time yet
    bpy.context.scene.frame_set(8)
    bpy.ops.contact.span_add(frames=6.0, ease_in=4.0, ease_out=4.0)
    made = film.shapes()
    assert made is not None and made.lanes == ("touch",) and made is film.shapes()  # kept until something changes
    assert made.triangles[..., 0].min() == 4.0 and made.triangles[..., 0].max() == 18.0
    bpy.ops.contact.solve(keyed=True, first=1, last=24)
    assert bpy.ops.contact.film_measure() == {"FINISHED"}
    made = film.shapes()
    assert {"touch", "pose of arm"} <= set(made.lanes) and len(made.keys) >= 2
    assert made.lanes[-1].startswith("contact error") and len(made.segments) > 24
    assert bpy.ops.contact.film_worst(curve="contact error") == {"FINISHED"}
    assert 8 <= bpy.context.scene.frame_current <= 14 and f"at {bpy.context.scene.frame_current}" in made.lanes[-1]
    held = {tuple(color[:3]) for color in made.colors if color[3] > 0.9}
    assert held and held <= set(LEVELS)  # tinted by the error that was measured
