"""The frame and the range of the scene, taken over by the film."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy

if TYPE_CHECKING:
    from contact_core.session import Session


def follow_frame(session: Session) -> None:
    """The frame that the scene shows is the frame at which edits are keys. No edit itself."""
    frame = float(bpy.context.scene.frame_current_final)
    if session.timeline.frame != frame:
        session.timeline.go(frame)


def give_range(session: Session) -> None:
    """A film without a range takes that of the scene, with its rate. Part of a macro."""
    from fractions import Fraction

    film, scene = session.timeline, bpy.context.scene
    if film.settings.first == film.settings.last:
        base = Fraction(scene.render.fps_base).limit_denominator(1001)
        film.set(scene.frame_start, scene.frame_end, scene.render.fps / base)
