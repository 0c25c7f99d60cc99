"""The modal operators: one for gestures of every tool, one for hovering, one for what is found beside the window.

They are thin: events become the interaction's values, and whatever happens ends in `_end`, which puts timers and
the line of status back. What a gesture changes is one step, which the session's host pushes; so they have no flag
UNDO. None is derived from another: registering a child of a registered operator breaks its parent.
"""

from __future__ import annotations

import logging
from typing import Any

import bpy

from contact_blender.extension import shared
from contact_blender.extension.declaring import why_not
from contact_blender.extension.warming import WARMING

log = logging.getLogger(__name__)
TICK = 1.0 / 60.0  # seconds between looks at what a hand has to follow
_MOVES = ("MOUSEMOVE", "INBETWEEN_MOUSEMOVE")
_NAVIGATION = frozenset(
    ("MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "WHEELINMOUSE", "WHEELOUTMOUSE", "TRACKPADPAN",
     "TRACKPADZOOM", "MOUSEROTATE", "MOUSESMARTZOOM", "NDOF_MOTION", *(f"NUMPAD_{digit}" for digit in range(10)))
)  # fmt: skip
# Actions of the table that run beside the window.
OF_ITS_OWN = ("pose.solve", "pose.settle", "pose.slide", "pose.suggest", "film.solve", "film.window")
_LEFT = "Stopped: pose and contacts are as they were"
_PREPARING = "Contact is being made ready; the first time on a machine that takes a minute or two"


class _Modal:
    """What the modal operators share, as a plain mixin. It reads the mode and the area of the start only."""

    _timer: Any = None
    _mode = ""

    def _start(self, context: Any, artist: Any) -> set[str]:
        manager = context.window_manager
        self._timer = manager.event_timer_add(TICK, window=context.window)
        self._mode, artist.busy = context.mode, True
        manager.modal_handler_add(self)
        self._say(context, artist.status())
        return {"RUNNING_MODAL"}

    def modal(self, context: Any, event: Any) -> set[str]:
        """Blender's call for each event: `_event` says what comes of it."""
        if self._is_lost(context):
            self._put_back()
            return self._end(context, "CANCELLED")
        try:
            return self._event(context, event)
        except Exception as error:
            return self._failed(context, error)

    def _event(self, context: Any, event: Any) -> set[str]:
        raise NotImplementedError

    def cancel(self, context: Any) -> None:
        """Blender ends it: the window closes, or another file is opened."""
        self._put_back()
        self._end(context, "CANCELLED")

    def _is_lost(self, context: Any) -> bool:
        """Whether the view or the mode that this began in has gone, or the session with its scene."""
        held = shared.held()
        return context.area is None or context.mode != self._mode or held is None or held.artist is None

    def _say(self, context: Any, text: str | None) -> None:
        workspace = getattr(context, "workspace", None)
        if workspace is not None:
            workspace.status_text_set(text)

    def _end(self, context: Any, result: str) -> set[str]:
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
        self._say(context, None)
        held = shared.held()
        if held is not None and held.artist is not None:
            held.artist.busy = False
        if context.area is not None:
            context.area.tag_redraw()
        return {result}

    def _put_back(self) -> None:
        held = shared.held()
        if held is not None and held.artist is not None:
            held.artist.cancel()

    def _failed(self, context: Any, error: Exception) -> set[str]:
        """Nothing stays open, and the reason is told: a refusal as it is, a fault of the program as one."""
        from contact_core.errors import ContactError

        try:
            self._put_back()
        except Exception:
            log.exception("putting back failed")
        if isinstance(error, ContactError):
            refuse(self, context, str(error))
        else:
            log.error("a tool failed", exc_info=error)
            refuse(self, context, f"this is a fault of the add-on, and nothing was changed ({error!r}).")
        return self._end(context, "CANCELLED")


def refuse(operator: Any, context: Any, sentence: str) -> None:
    """Say why something was refused, in Blender's line of reports."""
    operator.report({"WARNING"}, sentence[:1].upper() + sentence[1:])


class CONTACT_OT_gesture(_Modal, bpy.types.Operator):  # noqa: N801 (Blender's spelling)
    """Use the contact tool in the hand: press, drag and let go. Escape and the right button put everything back"""

    bl_idname = "contact.gesture"
    bl_label = "Contact Tool"
    bl_options = {"BLOCKING"}  # noqa: RUF012 (Blender's spelling)
    tool: bpy.props.StringProperty(options={"HIDDEN", "SKIP_SAVE"})  # type: ignore[valid-type]  # so Blender declares

    @classmethod
    def poll(cls, context: Any) -> bool:
        reason = "" if context.area and context.area.type == "VIEW_3D" else "Contact tools work in the 3D view"
        reason = reason or shared.missing() or why_not(context, "")
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def invoke(self, context: Any, event: Any) -> set[str]:
        if not is_ready(self, context):
            return {"CANCELLED"}
        from contact_blender.extension.chords import pointer_of
        from contact_blender.extension.region_view import view_of

        view = view_of(context)
        if view is None:
            return {"PASS_THROUGH"}
        try:
            artist = shared.artist()
            artist.take_up(self.tool)
            begun = artist.press(context, pointer_of(event, view.viewport[1], "press", "left"), view)
        except Exception as error:
            return self._failed(context, error)
        if begun:
            return self._start(context, artist)
        if artist.interaction.status.refusal:
            refuse(self, context, artist.interaction.status.refusal)
        return {"CANCELLED"}

    def _event(self, context: Any, event: Any) -> set[str]:
        from contact_blender.extension.chords import pointer_of
        from contact_blender.extension.region_view import view_of

        artist, view = shared.artist(), view_of(context)
        if view is None or not artist.interaction.is_busy:  # the session went elsewhere, by an undo or a script
            self._put_back()
            return self._end(context, "CANCELLED")
        if event.type in ("ESC", "RIGHTMOUSE") and event.value == "PRESS":
            artist.cancel()
            return self._end(context, "CANCELLED")
        if event.type == "LEFTMOUSE" and event.value == "RELEASE":
            artist.release(pointer_of(event, view.viewport[1], "release", "left"), view)
            if artist.interaction.status.refusal:
                refuse(self, context, artist.interaction.status.refusal)
                return self._end(context, "CANCELLED")
            shared.follow_selection()
            return self._end(context, "FINISHED")
        if event.type in _MOVES:
            artist.move(pointer_of(event, view.viewport[1], "move"), view)
            self._say(context, artist.status())
        elif event.type == "TIMER":
            artist.advance()
            self._say(context, artist.status())
        return {"RUNNING_MODAL"}  # Ctrl+Z among them: a gesture is taken back by Escape


class CONTACT_OT_hover(bpy.types.Operator):  # noqa: N801 (Blender's spelling)
    """Show what the contact tool in the hand would do here"""

    bl_idname = "contact.hover"
    bl_label = "Contact Tool Hover"
    bl_options = {"INTERNAL"}  # noqa: RUF012 (Blender's spelling)
    tool: bpy.props.StringProperty(options={"HIDDEN", "SKIP_SAVE"})  # type: ignore[valid-type]  # so Blender declares

    def invoke(self, context: Any, event: Any) -> set[str]:
        if shared.missing() or why_not(context, ""):
            return {"PASS_THROUGH"}
        WARMING.begin()
        if WARMING.is_done:
            self._show(context, event)
        return {"PASS_THROUGH"}

    def _show(self, context: Any, event: Any) -> None:
        """Nothing here may stop the pointer; a scene that cannot be read is told by the next press."""
        from contact_blender.extension.chords import pointer_of
        from contact_blender.extension.region_view import view_of
        from contact_core.errors import ContactError

        view = view_of(context)
        if view is None:
            return
        try:
            artist = shared.artist()
            if artist.busy:
                return
            artist.take_up(self.tool)
            artist.look(patient=True)
            artist.move(pointer_of(event, view.viewport[1], "move"), view)
        except ContactError as error:
            log.debug("hovering: %s", error)


class CONTACT_OT_propose(_Modal, bpy.types.Operator):  # noqa: N801 (Blender's spelling)
    """Let the solver look beside the window. Enter keeps what it proposes, Escape leaves it"""

    bl_idname = "contact.propose"
    bl_label = "Propose a Pose"
    bl_options = {"BLOCKING"}  # noqa: RUF012 (Blender's spelling)
    action: bpy.props.EnumProperty(  # type: ignore[valid-type]  # so Blender declares
        name="What",
        items=[(each, each.partition(".")[2].capitalize(), "") for each in OF_ITS_OWN],
    )
    at_once: bpy.props.BoolProperty(  # type: ignore[valid-type]  # so Blender declares
        name="Keep at once", description="Keep what is found without asking", options={"SKIP_SAVE"}
    )
    keyed: bpy.props.BoolProperty(  # type: ignore[valid-type]  # so Blender declares
        name="Key frames", description="Solve the frames and key them", options={"SKIP_SAVE"}
    )
    first: bpy.props.IntProperty(name="First frame", default=1)  # type: ignore[valid-type]  # so Blender declares
    last: bpy.props.IntProperty(name="Last frame", default=1)  # type: ignore[valid-type]  # so Blender declares

    @classmethod
    def poll(cls, context: Any) -> bool:
        reason = shared.missing() or why_not(context, "")
        if reason:
            cls.poll_message_set(reason)
        return not reason

    _waits = False  # for the libraries, before the solver can begin
    _stopped = False  # by Escape, while it worked

    def invoke(self, context: Any, event: Any) -> set[str]:
        WARMING.begin()
        try:
            artist = shared.artist()
            self._waits = not WARMING.is_done
            if not self._waits:
                self._begin(artist)
        except Exception as error:
            return self._failed(context, error)
        return self._start(context, artist)

    def _begin(self, artist: Any) -> None:
        if self.keyed:
            artist.solve_frames(self.first, self.last)
        else:
            artist.do(self.action)

    def _event(self, context: Any, event: Any) -> set[str]:
        artist = shared.artist()
        hands = artist.interaction
        if self._waits:
            return self._wait(context, event, artist)
        if event.type == "TIMER":
            artist.advance()
            self._say(context, self._line(hands))
            return self._after(context, artist)
        proposed = hands.proposing.proposal is not None
        if event.type in ("ESC", "RIGHTMOUSE") and event.value == "PRESS":
            return self._left(context, artist)
        if proposed and event.value == "PRESS":
            if event.type in ("RET", "NUMPAD_ENTER", "LEFTMOUSE"):
                return self._kept(context, artist)
            if event.type in ("DOWN_ARROW", "UP_ARROW") and hands.proposing.suggestions:
                hands.do("pose.another" if event.type == "DOWN_ARROW" else "pose.before")
                artist.show()
        if event.type in _NAVIGATION or event.type in _MOVES or not proposed:
            return {"PASS_THROUGH"}  # while it works, the window is the artist's
        return {"RUNNING_MODAL"}

    def _wait(self, context: Any, event: Any, artist: Any) -> set[str]:
        """Until everything is loaded and compiled; then the solver begins."""
        if event.type == "ESC" and event.value == "PRESS":
            return self._end(context, "CANCELLED")
        if WARMING.failure:
            refuse(self, context, WARMING.failure)
            return self._end(context, "CANCELLED")
        if WARMING.is_done:
            self._waits = False
            self._begin(artist)
        self._say(context, f"{_PREPARING} ({WARMING.doing}) · Esc cancels" if self._waits else artist.status())
        return {"PASS_THROUGH"}

    def _after(self, context: Any, artist: Any) -> set[str]:
        """What a tick of the timer found."""
        hands = artist.interaction
        if hands.status.refusal:
            refuse(self, context, hands.status.refusal)
            self._put_back()
            return self._end(context, "CANCELLED")
        if hands.proposing.proposal is None and hands.worker.status is None:
            if self._stopped:
                self.report({"INFO"}, _LEFT)
            return self._end(context, "CANCELLED")  # an edit meanwhile made it void, or nothing was found
        if self.at_once and hands.proposing.proposal is not None and hands.worker.status is None:
            return self._kept(context, artist)
        return {"PASS_THROUGH"}

    def _kept(self, context: Any, artist: Any) -> set[str]:
        proposal = artist.interaction.proposing.proposal
        artist.accept()
        shared.keep_residuals(proposal)
        return self._end(context, "FINISHED")

    def _left(self, context: Any, artist: Any) -> set[str]:
        """Escape: the work stops, and what it has is shown, to be kept or left; once more leaves it. What a button
        began would be kept at once, and is left."""
        hands = artist.interaction
        if hands.worker.status is not None and hands.proposing.proposal is None and not self.at_once:
            self._stopped = True
            hands.do("edit.cancel")
            return self._after(context, artist) if hands.worker.status is None else {"RUNNING_MODAL"}
        artist.leave()
        self.report({"INFO"}, _LEFT)
        return self._end(context, "CANCELLED")

    def _line(self, hands: Any) -> str:
        return hands.status.line() + (" · Esc cancels" if hands.worker.status is not None else "")

    def _put_back(self) -> None:
        held = shared.held()
        if held is not None and held.artist is not None:
            held.artist.leave()


class CONTACT_OT_radius(_Modal, bpy.types.Operator):  # noqa: N801 (Blender's spelling)
    """Set the radius of the brush in the hand by moving the pointer; a click keeps it, Escape puts it back"""

    bl_idname = "contact.radius"
    bl_label = "Contact Brush Radius"
    bl_options = {"BLOCKING"}  # noqa: RUF012 (Blender's spelling)

    @classmethod
    def poll(cls, context: Any) -> bool:
        return not (shared.missing() or why_not(context, ""))

    def invoke(self, context: Any, event: Any) -> set[str]:
        if not is_ready(self, context):
            return {"CANCELLED"}
        try:
            artist = shared.artist()
            artist.do("edit.radius")
        except Exception as error:
            return self._failed(context, error)
        return self._start(context, artist)

    def _event(self, context: Any, event: Any) -> set[str]:
        from contact_blender.extension.chords import pointer_of
        from contact_blender.extension.region_view import view_of

        artist, view = shared.artist(), view_of(context)
        if view is None or (event.type in ("ESC", "RIGHTMOUSE") and event.value == "PRESS"):
            self._put_back()
            return self._end(context, "CANCELLED")
        if event.type in ("LEFTMOUSE", "RET") and event.value == "PRESS":
            artist.keep_radius(pointer_of(event, view.viewport[1], "press", "left"), view)
            return self._end(context, "FINISHED")
        if event.type in _MOVES:
            artist.move(pointer_of(event, view.viewport[1], "move"), view)
            self._say(context, artist.status())
        return {"RUNNING_MODAL"}


def is_ready(operator: Any, context: Any) -> bool:
    """Whether the libraries are loaded and compiled; else that has been begun, and the artist is told."""
    WARMING.begin()
    if WARMING.is_done:
        return True
    refuse(operator, context, WARMING.failure or f"{_PREPARING} ({WARMING.doing}).")
    return False


CLASSES = (CONTACT_OT_gesture, CONTACT_OT_hover, CONTACT_OT_propose, CONTACT_OT_radius)
