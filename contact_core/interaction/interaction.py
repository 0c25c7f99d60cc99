"""The interaction: events in, edits of the session out, and what a front end has to draw again.

interaction = Interaction(session)
taken = interaction.handle(Pointer("press", 412.5, 300.5, "left"), view)   # not taken: the camera gets it
...
if interaction.advance():            # once a frame, before drawing: the live solve, work that is over
    changes = interaction.changes()  # what to send to the screen
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from contact_core.errors import ContactError, InvalidInput
from contact_core.interaction.actions import action_of
from contact_core.interaction.drawing import DocumentDrawing
from contact_core.interaction.editing import EDITS
from contact_core.interaction.events import Event, Key, Pointer
from contact_core.interaction.film import FilmDesk
from contact_core.interaction.film_solving import stale_window
from contact_core.interaction.heat import HeatMap
from contact_core.interaction.holding import Holding
from contact_core.interaction.live import LiveSolve
from contact_core.interaction.overlay import NOTHING, Overlay
from contact_core.interaction.preparing import preparation
from contact_core.interaction.proposing import Proposing
from contact_core.interaction.radius import RadiusGesture
from contact_core.interaction.status import Changes, Status
from contact_core.interaction.tool import Gesture
from contact_core.interaction.view import View
from contact_core.interaction.work import Worker

if TYPE_CHECKING:
    from contact_core.edit.listeners import DocumentChanged
    from contact_core.session import Session


class Interaction(Holding):
    """One artist at one session, in one or several views. It is for the session's thread.

    session: what is edited. meters_per_unit: of the world that views look at. A tool is in the hand from the start:
    `select`, or the first that is offered. beside: the pose that follows a drag is solved on a thread, so that
    `advance` does not wait for it.
    """

    def __init__(self, session: Session, *, meters_per_unit: float = 1.0, beside: bool = False) -> None:
        super().__init__(session, meters_per_unit)
        self._beside = beside
        self.worker = Worker()
        self.proposing = Proposing(self.desk, self.worker)
        self.film = FilmDesk(self.desk)
        self._heat = HeatMap(self.desk)
        self._drawing = DocumentDrawing(self.desk)
        self._gesture: Gesture | None = None
        self._button = "none"
        self._live: LiveSolve | None = None
        self._camera_has: set[str] = set()
        self._hover: Overlay = NOTHING
        self._refusal = ""
        self._moved: set[str] = set(self.desk.scene.surfaces)
        self._stop_listening = session.listen(self._follow)

    def close(self) -> None:
        """Put back what is under way, stop the work, and listen no more. The session stays open."""
        self.cancel()
        self.worker.close()
        self.film.worker.close()
        self._stop_listening()

    # -- what is in the hand ---------------------------------------------------------------------------------

    def take_up(self, name: str) -> None:
        """Take up a tool; a gesture under way is put back. Raises InvalidInput for a name that is not offered."""
        self.tool_named(name)
        self.cancel()
        self._tool, self._hover = name, NOTHING
        self._touch("tool", "overlay", "status")

    # -- events ----------------------------------------------------------------------------------------------

    @property
    def is_busy(self) -> bool:
        """Whether a gesture is under way."""
        return self._gesture is not None

    @property
    def keeps_view(self) -> bool:
        """Whether events of the pointer are for the view of the press, wherever the pointer goes."""
        return self._gesture is not None and not self._gesture.crosses

    def handle(self, event: Event, view: View) -> bool:
        """Take an event, or leave it to the camera and the front end's own actions: whether it was taken.

        What is refused is told by `status`; no ContactError comes out of here, and whatever is raised leaves the
        document of the press and no open stroke.
        """
        self.desk.view = view
        try:
            return self._key(event) if isinstance(event, Key) else self._pointer(event)
        except ContactError as error:
            self._refused(error)
            return True
        except BaseException:
            self.cancel()
            raise

    def advance(self) -> bool:
        """Do what is due, once a frame: the live solve for the newest state, and what long work has found.

        Whether anything is to be drawn again.
        """
        try:
            if self._live is not None and self._live.follow():
                self._touch("status")
            if self.worker.status is not None:
                self._touch("work", "status")
            self.worker.poll()
            if self.film.poll():
                self._touch("status", "film")
            if self.film.advance(time.monotonic()):
                self._touch("film")
        except ContactError as error:
            self._refused(error)
        except BaseException:
            self.cancel()
            raise
        return bool(self._moved or self._parts)

    def look(self) -> None:
        """Look at the scene of the session's host again, where others move things and pose hands; a gesture keeps
        the scene of its press. For front ends whose scene is not theirs alone. Raises InvalidInput."""
        moved = frozenset() if self.is_busy else self.desk.look()
        if moved:
            self._moved |= moved
            self._touch("overlay")

    def prepare(self) -> None:
        """Build beside the window what the first drag would wait for: trees, normals, and what is solid.

        For front ends, when files are open. It steps back for a solve, and changes nothing but the waiting.
        """
        if self.worker.status is None:
            self.worker.begin("Prepare", preparation(self.desk), lambda _: None)

    @property
    def is_due(self) -> bool:
        """Whether `advance` has something to do: a pose to follow up, work that is under way."""
        long = self.worker.status is not None or self.film.worker.status is not None
        return (self._live is not None and self._live.is_due) or long or self.film.playback.is_playing

    def cancel(self) -> None:
        """Put back the gesture that is under way: the document is the very one of the press."""
        gesture = self._gesture
        if gesture is not None:
            self._over()
            self.desk.roll_back()
            gesture.cancel()

    def _pointer(self, event: Pointer) -> bool:
        if self._gesture is not None:
            return self._in_gesture(self._gesture, event)
        if event.kind == "press":
            return self._press(event)
        if event.kind == "release":
            self._camera_has.discard(event.button)
        elif event.kind == "leave":
            self._show_hover(NOTHING)
        elif event.kind == "move" and not self._camera_has and self._tool:
            self._show_hover(self.tool_named(self._tool).hover(self.desk, event))
        return False

    def _press(self, event: Pointer) -> bool:
        if event.button != "left" or not self._tool:
            self._camera_has.add(event.button)
            return False
        self._refusal = self.desk.remark = ""
        if self.film.playback.is_playing:
            self.film.playback.stop()
            self._touch("film")
        selection = self.desk.selection
        try:
            gesture = self.tool_named(self._tool).press(self.desk, event)
        except ContactError:
            self.desk.roll_back()
            raise
        if self.desk.selection is not selection:
            self._touch("selection", "visibility")
        if gesture is None:
            self.desk.roll_back()
            self._camera_has.add(event.button)
            if self.desk.remark:
                self._touch("status")
            return False
        self._begin(gesture, event.button)
        return True

    def _begin(self, gesture: Gesture, button: str) -> None:
        """button: which ends it; "none" where the next press does."""
        self._gesture, self._button, self._hover = gesture, button, NOTHING
        self._live = LiveSolve(self.desk, beside=self._beside)
        self._touch("overlay", "status")

    def _in_gesture(self, gesture: Gesture, event: Pointer) -> bool:
        """Every event is the gesture's while it lasts: a camera that moved meanwhile would move what is dragged."""
        if event.kind == "move":
            gesture.move(event)
            self.desk.check_locks()
            self._refusal = ""
            self._touch("overlay", "status")
        elif event.kind == "press" and event.button == "right":
            self.cancel()
        elif (event.kind == "press" and self._button == "none") or (
            event.kind == "release" and event.button == self._button
        ):
            self._release(gesture, event)
        return True

    def _release(self, gesture: Gesture, event: Pointer) -> None:
        """Commit what the gesture leaves, with the pose that follows, as one step; nothing where it refuses."""
        live = self._live
        selection = self.desk.selection
        try:
            gesture.release(event)
            self.desk.check_locks()
            if live is not None:
                live.finish()
        except ContactError:
            self.cancel()
            raise
        self._over()
        self.desk.commit()
        self.follow_film(self.session.timeline.frame)
        if self.desk.selection is not selection:
            self._touch("selection", "visibility")

    def _over(self) -> None:
        if self._live is not None:
            self._live.close()
        self._gesture, self._live, self._button = None, None, "none"
        self._touch("overlay", "status")

    def _show_hover(self, overlay: Overlay) -> None:
        if overlay is not self._hover:
            self._hover = overlay
            self._touch("overlay")

    # -- keys ------------------------------------------------------------------------------------------------

    def _key(self, key: Key) -> bool:
        action = action_of(key, self.actions)
        if action is None or action.by_host:
            return self._gesture is not None
        self.do(action.id)
        return True

    def do(self, action: str) -> None:
        """Do an action by its id. Raises ContactError with a sentence, InvalidInput for one that is not known or
        is the host's."""
        found = next((each for each in self.actions if each.id == action and not each.by_host), None)
        if found is None:
            raise InvalidInput(f"the interaction has no action {action!r}; see `Interaction.actions`.")
        self._refusal = self.desk.remark = ""
        if found.group == "tool":
            self.take_up(action.removeprefix("tool."))
        elif action == "edit.cancel":
            self._cancel_something()
        elif action == "edit.accept" and self._gesture is not None:
            pass  # a gesture is accepted by letting go
        else:
            if self._gesture is not None:
                self.cancel()
                if action == "edit.undo":
                    return  # the gesture was the last thing done
            self._own_actions().get(action, lambda: EDITS[action](self.desk))()
        self._touch("overlay", "selection", "status", "settings", "visibility", "work", "film")

    def forgive(self) -> None:
        """What was refused last is told no more: for front ends, when an action of their own comes after it."""
        if self._refusal:
            self._refusal = ""
            self._touch("status")

    def solve_frames(self, frames: Sequence[float]) -> None:
        """Begin to solve frames beside the window; see `Proposing.solve_frames`, and what it raises."""
        self.cancel()
        self._refusal = self.desk.remark = ""
        self.proposing.solve_frames(frames)
        self._touch("overlay", "status", "work")

    def _own_actions(self) -> dict[str, Callable[[], object]]:
        settings = self.settings
        return {
            "edit.undo": self.session.undo,
            "edit.redo": self.session.redo,
            "edit.accept": self.proposing.accept,
            "edit.larger": lambda: self.resize(1.15),
            "edit.smaller": lambda: self.resize(1.0 / 1.15),
            "edit.radius": self._begin_radius,
            "pose.solve": self.proposing.solve,
            "pose.settle": self.proposing.settle,
            "pose.slide": self.proposing.slide,
            "pose.suggest": self.proposing.suggest,
            "pose.another": lambda: self.proposing.step(+1),
            "pose.before": lambda: self.proposing.step(-1),
            "pose.live": lambda: self.set(live=not settings.live),
            "film.play": lambda: self.film.play(time.monotonic()),
            "film.first": lambda: self._show_frame(self.session.timeline.settings.first),
            "film.solve": self.proposing.solve_film,
            "film.window": lambda: self.proposing.solve_film(self.session.timeline.window()),
            "film.onion": lambda: self.show_onion(0 if self.film.onion else 3),
            "show.xray": lambda: self.set(xray=not settings.xray),
            "show.isolate": lambda: self.set(isolate=not settings.isolate),
            "show.heat": self._turn_heat,
        }

    def _turn_heat(self) -> None:
        if not self.settings.heat:
            self._heat.check()
        self.set(heat=not self.settings.heat)

    def _show_frame(self, frame: float) -> None:
        self.film.playback.stop()
        self.session.timeline.go(frame)

    def follow_film(self, frame: float) -> None:
        """After something was dragged at a frame: propose the two seconds round it anew where solved keys are stale
        now, and the hand follows what is dragged (the setting `live`, and `FilmDesk.follows`)."""
        film = self.session.timeline
        if self.film.follows and self.settings.live and film.document.is_timed and self.session.document.pairs:
            window = stale_window(self.session, frame)
            if window:
                self.proposing.solve_film(window)

    def show_onion(self, count: int, step: float | None = None) -> None:
        """So many ghosts of the film before and after the frame, so many frames apart. Raises InvalidInput."""
        if not 0 <= count <= 12 or not (step is None or 0.0 < step < 1e6):
            raise InvalidInput(f"0 to 12 ghosts, some frames apart, were expected, but got {count} and {step}.")
        self.film.onion = count
        self.film.onion_step = self.film.onion_step if step is None else float(step)
        self._touch("overlay", "film")

    def _cancel_something(self) -> None:
        """The innermost thing: the gesture, the work, the proposal."""
        if self._gesture is not None:
            self.cancel()
        elif self.film.playback.is_playing:
            self.film.playback.stop()
        elif self.worker.status is not None:
            self.worker.cancel()
        else:
            self.proposing.dismiss()
        self._touch("overlay", "status", "work", "film")

    def _begin_radius(self) -> None:
        self._begin(RadiusGesture(self), "none")

    # -- what a front end shows ------------------------------------------------------------------------------

    def overlay(self) -> Overlay:
        """All that is drawn over the scene now."""
        own = self._hover if self._gesture is None else self._gesture.overlay()
        behind = self._drawing.overlay().joined(self.film.overlay())
        if self.settings.heat:
            moving = self.is_busy or self.film.playback.is_playing
            behind = behind.joined(self._heat.overlay(fresh=not moving))
        return behind.joined(self.proposing.overlay()).joined(own)

    def changes(self) -> Changes:
        """What changed since the last call."""
        found = Changes(frozenset(self._moved), frozenset(self._parts))
        self._moved, self._parts = set(), set()
        return found

    @property
    def status(self) -> Status:
        """For the line of status."""
        hint = self.tool_named(self._tool).hint if self._tool else ""
        if self._gesture is not None:
            hint = self._gesture.hint() or hint
        solve_ms = self._live.milliseconds if self._live is not None and self._live.solves else None
        return Status(self._tool, hint, self.selection.surface, self._refusal, solve_ms, self.worker.status,
                      self.proposing.summary, self.desk.remark)  # fmt: skip

    # -- inside ----------------------------------------------------------------------------------------------

    def _follow(self, change: DocumentChanged) -> None:
        """The session's document changed, by whomever."""
        if change.kind != "preview":
            self.proposing.forget()
            if self._gesture is not None and change.kind != "do":
                self._over()
                self.desk.roll_back()
            self._keep_selection()
        moved = self.desk.follow()
        self._moved |= moved
        self._touch("document", "overlay", "film")

    def _refused(self, error: ContactError) -> None:
        self._refusal = str(error)
        self._touch("status")
