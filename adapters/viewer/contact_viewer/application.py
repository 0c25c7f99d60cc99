"""The application without its window: a session, its interaction, a canvas, and what the front end's own actions
do.

A front end gives `handle` its events and calls `frame` before it draws. Everything here is for one thread.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal, TypeAlias

from contact_core.document.document import named
from contact_core.errors import CommandRejected, ContactError, InvalidInput
from contact_core.interaction.actions import Action, action_of
from contact_core.interaction.events import Event, Pointer
from contact_core.interaction.interaction import Interaction
from contact_core.plugins.manager import PluginManager
from contact_core.session import Session
from contact_viewer import files, panel
from contact_viewer.canvas import Canvas
from contact_viewer.drawer import Drawer
from contact_viewer.file_actions import FileActions
from contact_viewer.film_panel import drag
from contact_viewer.guide import Guide
from contact_viewer.host import ViewerHost
from contact_viewer.look import THEMES
from contact_viewer.navigation import Navigation
from contact_viewer.panes import Panes
from contact_viewer.recovery import Recovery, state_directory
from contact_viewer.shelves import Shelves
from contact_viewer.tree import TreeActions

Want: TypeAlias = Literal["open", "export", "library"]
_SIDES = {"view.front": "front", "view.side": "right", "view.top": "top"}
SHOWN = 3  # notes on what was read, in the line of status


class Application(TreeActions, FileActions):
    """What an artist has before them.

    sources: as for `files.open_files`. beside: the hand that follows a drag is solved on a thread, so that what is
    dragged is drawn at once, and the hand a frame later. notes: sentences on what opening found, and what the last
    action did.
    """

    def __init__(
        self,
        canvas: Canvas,
        sources: Sequence[str] = (),
        plugins: PluginManager | None = None,
        *,
        state_folder: Path | None = None,
        beside: bool = False,
    ) -> None:
        self._beside = beside
        self.canvas, self.panes = canvas, Panes(canvas)
        self.plugins = plugins or PluginManager()
        self.notes: list[str] = []
        self.help_wanted = False
        self.wants: Want | None = None  # what the artist is to name
        self._state_folder = state_folder
        self._session: Session | None = None
        self._interaction: Interaction | None = None
        self._navigation = Navigation()
        self._camera_moved = True
        self._told = False
        self.guide = Guide(state_folder or state_directory())
        self._filmed = False
        self.film_open = False  # whether a timeline is shown, for which the film is measured
        self._meets: list[panel.Residual] | None = None  # until somebody asks
        self.shelves = Shelves(self, state_folder)
        self.open(list(sources))
        if not sources and self.guide.is_new and not self.session.document.patches:
            self.turn_tutorial()

    # -- what is edited ------------------------------------------------------------------------------------------

    @property
    def session(self) -> Session:
        """What is edited now."""
        assert self._session is not None  # `open` in the constructor made one
        return self._session

    @property
    def interaction(self) -> Interaction:
        """What the artist does in it."""
        assert self._interaction is not None
        return self._interaction

    def open(self, sources: Sequence[str]) -> None:
        """Go on with other files; what was not saved of them before comes back. Raises FileRefused, and then
        everything stays as it is."""
        recovery = Recovery(sources or files.START, self._state_folder)
        found = recovery.found()
        try:
            session = files.open_files(sources, self.plugins, found)
        except ContactError:
            if found is None:
                raise
            session = files.open_files(sources, self.plugins)  # what was kept belongs to other meshes
            found = None
        self._let_go()
        self.guide.lesson, self._starts = None, tuple(sources or files.START) == files.START
        self._recovery = recovery
        self._take(session)
        self._path = Path(sources[0]) if len(sources) == 1 and Path(sources[0]).is_file() else None
        self.notes = list(session.notes[:SHOWN])
        if len(session.notes) > SHOWN:
            self.notes.append(f"{len(session.notes) - SHOWN} more notes (contact inspect tells them).")
        if found is not None:
            self.notes.append("what was not saved the last time is back.")

    def add(self, sources: Sequence[str | Path]) -> None:
        """Bring further meshes and rigs into the scene. Raises FileRefused."""
        added = files.add_files(self.session, sources)
        notes = dict.fromkeys(note for each in added.values() for note in each)
        self.say(" ".join([f"{', '.join(added)} stands beside the rest now.", *notes]))
        self.see_all()
        self.interaction.prepare()

    def _take(self, session: Session) -> None:
        meters = 1.0
        if session.host is not None:
            meters = session.host.space().meters_per_unit
            self.canvas.eye.up = session.host.space().up_axis
        if isinstance(session.host, ViewerHost):
            session.host.canvas = self.canvas
        self._session = session
        self._interaction = Interaction(session, meters_per_unit=meters, beside=self._beside)
        self._interaction.film.follows = True
        self._recovery.follow(session)
        self.panes.join()
        self.drawer = Drawer(self._interaction, self.panes, self.guide.overlay)
        self.canvas.keep_surfaces(())
        self.see_all()
        self._interaction.prepare()

    def _let_go(self) -> None:
        if self._interaction is not None:
            self._interaction.close()
        if self._session is not None:
            self._session.close()

    def close(self) -> None:
        """The end: what was not saved is kept for the next time."""
        self._let_go()

    # -- events --------------------------------------------------------------------------------------------------

    def handle(self, event: Event) -> None:
        """Give an event to the tool, then to the camera and to the application's own actions.

        What is refused stands in `line`.
        """
        eye = self.panes.active.eye
        if isinstance(event, Pointer):
            stays = self.interaction.keeps_view or self._navigation.is_dragging
            event, eye = self.panes.local(event, stays=stays)
        if self.interaction.handle(event, eye):
            return
        if isinstance(event, Pointer):
            self._camera_moved |= self._navigation.handle(event, eye)
            return
        action = action_of(event, self.interaction.actions)
        if action is not None and action.by_host:
            self.do(action.id)

    def do(self, action: str) -> None:
        """Do an action of the table by its id; what is refused stands in `line`."""
        known = {each.id: each for each in self.interaction.actions}
        try:
            if action not in known:
                raise InvalidInput(f"there is no action {action!r}.")
            if known[action].by_host:
                self.notes.clear()
                self.interaction.forgive()
                self._own(action)
            else:
                self.interaction.do(action)
        except ContactError as error:
            self.say(str(error))

    def _own(self, action: str) -> None:
        own: dict[str, Callable[[], object]] = {
            "show.help": self._turn_page,
            "show.tutorial": self.turn_tutorial,
            "show.card": lambda: self.turn_card("next"),
            "show.card_before": lambda: self.turn_card("back"),
            "file.open": lambda: self._ask("open"),
            "file.export": lambda: self._ask("export"),
            "file.library": lambda: self._ask("library"),
            "file.save": self.save,
            "pose.key": self.key_pose,
            "pose.next": lambda: self.step_key(+1),
            "pose.previous": lambda: self.step_key(-1),
            "view.home": self.see_all,
            "view.selection": self.see_selection,
            "view.split": self.split,
        }
        if action in _SIDES:
            self.panes.active.eye.look_from(_SIDES[action])
            self._camera_moved = True
        elif action in own:
            own[action]()

    def refusal(self) -> str:
        """What was refused last, "" where nothing was."""
        return self.interaction.status.refusal or self._recovery.failure

    def _turn_page(self) -> None:
        self.help_wanted, self._told = not self.help_wanted, True

    def turn_tutorial(self) -> None:
        """Begin the tutorial on the built-in hand and mug, or end it. What was open and not saved comes back when
        it is opened again."""
        if self.guide.lesson is not None:
            self.guide.end()
        else:
            if not self._starts:
                self.open([])
            self.guide.begin(self.interaction)
        self._redraw()

    def turn_card(self, which: str) -> None:
        """Go on in the tutorial ("next"), go "back", or "end" it."""
        self.guide.turn(which)
        self._redraw()

    def _redraw(self) -> None:
        self.drawer.stale = self._told = True

    def _ask(self, what: Want) -> None:
        self.wants, self._told = what, True

    def attempt(self, act: Callable[[], object]) -> None:
        """Do something; what is refused stands in `line`."""
        try:
            self.notes.clear()
            act()
        except ContactError as error:
            self.say(str(error))

    # -- what is seen --------------------------------------------------------------------------------------------

    def see_all(self) -> None:
        """Bring everything into view."""
        for pane in self.panes.all:
            pane.eye.fit(self.drawer.points(eye=pane.eye))
        self._camera_moved = True

    def see_selection(self) -> None:
        """Bring the selected patches into view, everything where none is."""
        document, chosen = self.session.document, self.interaction.selection.patches
        for pane in self.panes.all:
            here = tuple(name for name in chosen if pane.eye.shows(document.patch(name).surface))
            pane.eye.fit(self.drawer.points(here, pane.eye), margin=3.0 if here else 1.12)
        self._camera_moved = True

    def split(self) -> None:
        """The hands at the left and everything else at the right, each with a camera; or one view again. Raises
        CommandRejected where one of them is missing."""
        if self.panes.is_split:
            self.panes.join()
        else:
            hands, things = self._halves()
            if not hands or not things:
                raise CommandRejected(
                    "a split view shows a hand and an object, but one of them is missing: open it."
                )
            self.panes.split(hands, things)
        self.drawer.anew()
        self.see_all()

    def _halves(self) -> tuple[frozenset[str], frozenset[str]]:
        """The surfaces at the left and at the right of a split view."""
        scene, rigs = self.interaction.desk.scene.surfaces.keys(), self.session.rigs.keys()
        return frozenset(scene & rigs), frozenset(scene - rigs)

    def resize(self, width: int, height: int, ratio: float | None = None) -> bool:
        """The view has another size, in pixels of which `ratio` are one of the screen's own; whether it has."""
        changed = self.panes.resize(width, height, ratio)
        self.drawer.stale |= changed
        return changed

    def set_theme(self, name: str) -> None:
        """dark or light."""
        self.panes.set_theme(THEMES[name])
        self.drawer.stale = True

    # -- time ----------------------------------------------------------------------------------------------------

    @property
    def keys(self) -> tuple[float, ...]:
        """Frames with a pose key of any hand."""
        film = self.session.timeline
        tracks = (film.track("pose", name) for name in self.session.rigs)
        return tuple(sorted({frame for track in tracks if track is not None for frame in track.frames}))

    def key_pose(self) -> None:
        """Key the pose of every hand at the frame that is shown, as one step. Raises InvalidInput."""
        posed = [name for name in self.session.document.poses if name in self.session.rigs]
        if not posed:
            raise InvalidInput("there is no pose to key yet: solve first.")
        at = self.session.timeline.frame
        with self.session.macro(f"Key the pose at frame {at:g}"):
            for name in posed:
                self.session.timeline.key("pose", name)
        self.say(f"keyed the pose at frame {at:g}.")

    def step_key(self, by: int) -> None:
        """Go to the next pose key, or the one before. Raises InvalidInput."""
        at = self.session.timeline.frame
        beyond = [frame for frame in self.keys if (frame > at if by > 0 else frame < at)]
        if not beyond:
            raise InvalidInput(f"there is no pose key {'after' if by > 0 else 'before'} frame {at:g}.")
        self.go_to(beyond[0] if by > 0 else beyond[-1])

    def go_to(self, frame: float) -> None:
        """Show another frame; what plays stops. Raises InvalidInput."""
        self.interaction.film.playback.stop()
        self.session.timeline.go(frame)
        self._filmed = True

    def drag_film(self, what: str, name: str, frame: float, part: Any, to: float) -> None:
        """What was dragged in the timeline: one step, and what is stale round it is solved anew. Raises
        ContactError."""
        drag(self.session, what, name, frame, part, to)
        self.interaction.follow_film(to)

    def play_loop(self, loop: bool) -> None:
        """Whether the film begins again at its end."""
        self.interaction.film.playback.loop, self._filmed = loop, True

    def show_worst(self, frame: float, pair: str) -> None:
        """Go to a frame of a curve, with the pair selected that is meant. Raises ContactError."""
        self.go_to(float(frame))
        if pair:
            self.choose_pair(pair)

    def choose_pair(self, pair: str) -> None:
        """Select both patches of a pair. Raises CommandRejected."""
        found = named(self.session.document.pairs, pair, "pair")
        self.interaction.select(found.manipulator, found.object)

    # -- frames --------------------------------------------------------------------------------------------------

    def frame(self, *, advance: bool = True) -> frozenset[str]:
        """Do what is due, once before each frame: returns what changed, "camera" among it; empty for nothing, so
        that nothing has to be drawn. advance: whether poses follow and long work is taken over first."""
        if advance:
            self.interaction.advance()
        if self.guide.follow():
            self._redraw()
        if self.film_open and not self.interaction.is_busy and not self.interaction.film.playback.is_playing:
            self.interaction.film.measure()
        if self.panes.is_split:
            self.panes.show(*self._halves())
        parts = self.drawer.follow()
        if self._filmed:
            parts |= {"film"}
            self._filmed = False
        if {"document", "surfaces"} & parts:
            self._meets = None
        if self._camera_moved:
            parts |= {"camera"}
        if self._told:
            parts |= {"status"}
        self._camera_moved = self._told = False
        return parts

    @property
    def meets(self) -> list[panel.Residual]:
        """How well each pair meets in what is shown, the worst first."""
        if self._meets is None:
            self._meets = panel.residuals(self.session, self.interaction.desk.scene, self.interaction.desk.document)
        return self._meets

    def line(self) -> str:
        """The line of status: what the tool does, and what was done last."""
        status = self.interaction.status
        where = f"on {status.surface}" if status.surface else ""
        solved = "" if status.solve_ms is None else f"solve {status.solve_ms:.0f} ms"
        told = (status.hint, where, status.proposed, solved, status.remark, *self.notes)
        return " · ".join(part for part in told if part)

    def tree(self) -> list[dict[str, Any]]:
        """The rows of the tree."""
        return panel.tree(
            self.session, self.interaction, self.meets, self.drawer.hidden_surfaces, self.drawer.hidden_patches
        )

    def table(self) -> tuple[Action, ...]:
        """Actions and keys."""
        return self.interaction.actions

    def undo_name(self) -> str:
        """What undo would take back; "" for nothing."""
        done = self.session.history.done
        return done[-1].command.label() if done else ""

    def redo_name(self) -> str:
        """What redo would do again; "" for nothing."""
        history = self.session.history
        return history.steps[len(history.done)].command.label() if history.can_redo else ""

    def say(self, sentence: str) -> None:
        """Let a sentence stand in the line of status."""
        self.notes = [sentence]
        self._told = True
