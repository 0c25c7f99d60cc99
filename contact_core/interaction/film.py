"""The film as a timeline shows it: bars, keys, curves, and what a drag of them means. Data for any front end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.document.document import ContactDocument
from contact_core.document.timeline import CAPTURED, PoseKey, Track, of_address
from contact_core.errors import InvalidInput
from contact_core.geometry.transform import transform_points
from contact_core.interaction.overlay import Ghost, Overlay
from contact_core.interaction.playback import Playback
from contact_core.interaction.work import Worker
from contact_core.progress import Progress
from contact_core.proposals.draft import Draft
from contact_core.rig.chart import pose_on
from contact_core.rig.rig import forward_kinematics, skin
from contact_core.scene.problem import world_from_surface

if TYPE_CHECKING:
    from contact_core.interaction.desk import Desk
    from contact_core.proposals.film import FilmMeasures
    from contact_core.session import Session

KeyKind: TypeAlias = Literal["authored", "solved", "stale", "clip", "value"]
NEAR, FAR = 0.001, 0.003  # metres between points that are to touch: good up to, bad from
SKATE = 0.0024  # metres per second: a tenth of a millimetre a frame at 24
TURNING = 60.0  # radians per second squared: what a joint of a person seldom exceeds
DEPTH = 0.01  # of the manipulator: what skin may be deep
MOST_MEASURED = 2_000  # frames; of longer films every so many-th is measured
LEVELS = ((0.208, 0.702, 0.490), (0.878, 0.631, 0.0), (0.898, 0.325, 0.294))  # colours: good, fair, bad
BEFORE, AFTER = (0.95, 0.45, 0.35), (0.35, 0.75, 0.55)  # colours of what was and of what comes


@dataclass(frozen=True)
class Bar:
    """A span of a pair. index: among those of the pair; -1 for a pair without spans, which holds throughout.

    levels: (first frame, last frame, 0 good, 1 fair, 2 bad) pieces of it by contact error, empty until measured.
    """

    pair: str
    index: int
    on: float
    off: float
    ease_in: float
    ease_out: float
    color: tuple[float, float, float]
    levels: tuple[tuple[float, float, int], ...] = ()


@dataclass(frozen=True)
class KeyMark:
    """A key. track: its address. kind: of poses who made it (a stale one was solved before something near changed);
    "value" of all others."""

    track: str
    frame: float
    kind: KeyKind


@dataclass(frozen=True, eq=False)
class Curve:
    """Something over time. frames, values: (n,), NaN where there is nothing. limit: above which it is marked.
    worst: the frame of the largest value, and pair the one that it is of ("" for none)."""

    name: str
    unit: str
    frames: FloatArray
    values: FloatArray
    limit: float
    worst: float | None
    pair: str = ""


@dataclass(frozen=True)
class FilmView:
    """All that a timeline shows. measured: whether curves and tints are of the film as it is now."""

    first: float
    last: float
    rate: float
    frame: float
    bars: tuple[Bar, ...]
    keys: tuple[KeyMark, ...]
    curves: tuple[Curve, ...] = ()
    measured: bool = False


@dataclass(eq=False)
class FilmDesk:
    """The film that an interaction works on: what a timeline shows of it, playing it, and ghosts beside the frame.

    onion: how many ghosts are shown before and after the frame, `onion_step` frames apart. follows: whether what
    was dragged begins a solve of what is stale round it; for front ends that advance the interaction all the time.
    """

    desk: Desk
    onion: int = 0
    onion_step: float = 4.0
    follows: bool = False
    playback: Playback = field(default_factory=Playback)
    worker: Worker = field(default_factory=Worker)
    _measures: FilmMeasures | None = None
    _measured: ContactDocument | None = None
    _asked: ContactDocument | None = None
    _kept: tuple[ContactDocument, tuple[KeyMark, ...]] | None = None
    _ghosts: tuple[tuple[object, ...], Overlay] | None = None

    # --- what a timeline shows ----------------------------------------------------------------------------------

    def view(self) -> FilmView:
        """Of the document now; curves as they were measured last."""
        session, measures = self.desk.session, self._measures
        curves = () if measures is None else curves_of(measures)
        return film_view(session, bars_of(session, measures), self._marks(), curves, self._is_measured())

    def _is_measured(self) -> bool:
        return self._measured is self.desk.session.timeline.document

    def _marks(self) -> tuple[KeyMark, ...]:
        """Of all tracks; kept for as long as the document is the same."""
        document = self.desk.session.timeline.document
        if self._kept is None or self._kept[0] is not document:
            self._kept = document, marks_of(self.desk.session)
        return self._kept[1]

    # --- measuring ----------------------------------------------------------------------------------------------

    def measure(self) -> bool:
        """Begin to measure the film beside the window where it has changed since; whether that is under way.

        Nothing where there is nothing to measure: no film, no pair of a rig.
        """
        session = self.desk.session
        document, settings = session.timeline.document, session.timeline.settings
        if document is self._measured or document is self._asked:
            return self.worker.status is not None
        self._asked = document
        if settings.first == settings.last or not document.pairs or not session.rigs:
            self.worker.drop()
            self._measures, self._measured = None, document
            return False
        frames = settings.frames()
        frames = frames[:: 1 + len(frames) // MOST_MEASURED]
        draft_at = drafts_of(session, frames)

        def work(progress: Progress) -> tuple[ContactDocument, FilmMeasures]:
            from contact_core.proposals.film import measure_film

            return document, measure_film(document, frames, draft_at, progress=progress)

        self.worker.begin("Measure the film", work, self._take)
        return True

    def poll(self) -> bool:
        """Take over what was measured; whether anything was. What cannot be measured has no curves."""
        try:
            return self.worker.poll()
        except InvalidInput:
            self._measures, self._measured = None, self._asked
            return True

    def _take(self, found: tuple[ContactDocument, FilmMeasures]) -> None:
        self._measured, self._measures = found

    # --- playing ------------------------------------------------------------------------------------------------

    def play(self, now: float) -> None:
        """Play from the frame that is shown, from the first where that is the last; playing, stop."""
        film = self.desk.session.timeline
        if self.playback.is_playing:
            self.playback.stop()
            return
        if film.settings.first == film.settings.last:
            raise InvalidInput("the film has one frame: say its last frame first.")
        within = film.settings.first <= film.frame < film.settings.last
        self.playback.start(now, film.frame if within else film.settings.first)

    def advance(self, now: float) -> bool:
        """Show the frame that is due, where the film plays; whether it is another one."""
        film = self.desk.session.timeline
        due = self.playback.frame(now, film.settings)
        if due is None or due == film.frame:
            return False
        film.go(due)
        return True

    # --- onion skin ---------------------------------------------------------------------------------------------

    def overlay(self) -> Overlay:
        """Ghosts of what is posed, before and after the frame; none while the film plays."""
        film = self.desk.session.timeline
        if not self.onion or self.playback.is_playing or not film.document.is_timed:
            return Overlay()
        asked = (film.document, film.frame, self.onion, self.onion_step)
        if self._ghosts is None or self._ghosts[0] != asked:
            self._ghosts = asked, Overlay(ghosts=tuple(self._onion(film.frame)))
        return self._ghosts[1]

    def _onion(self, frame: float) -> list[Ghost]:
        session, settings = self.desk.session, self.desk.session.timeline.settings
        ghosts = []
        for k in range(self.onion, 0, -1):
            for side, color in ((-1, BEFORE), (1, AFTER)):
                at = frame + side * k * self.onion_step
                if settings.first <= at <= settings.last:
                    still = session.scene_at(at)
                    ghosts += [
                        Ghost(self._posed(still, name), session.rigs[name].faces, color, 0.4 / (k + 1), name)
                        for name in session.rigs
                        if name in still.surfaces and name in self.desk.scene.surfaces
                    ]
        return ghosts

    def _posed(self, still: ContactDocument, name: str) -> FloatArray:
        """(n, 3) world, in the units of the view."""
        rig = self.desk.session.rigs[name]
        points = rig.surface.points
        if name in still.poses:
            points = skin(rig, forward_kinematics(rig.parents, pose_on(rig, still.poses[name])))
        return transform_points(world_from_surface(still, name, self.desk.scene.meters_per_unit), points)


def film_view(
    session: Session,
    bars: tuple[Bar, ...],
    keys: tuple[KeyMark, ...],
    curves: tuple[Curve, ...] = (),
    measured: bool = False,
) -> FilmView:
    """The film of a session with what is found of it."""
    film = session.timeline
    settings = film.settings
    return FilmView(
        settings.first, settings.last, settings.frames_per_second, film.frame, bars, keys, curves, measured
    )


def bars_of(session: Session, measures: FilmMeasures | None = None) -> tuple[Bar, ...]:
    """A bar for each span of each pair, one for a pair without spans; tinted as the film was measured."""
    film = session.timeline
    document, settings, bars = film.document, film.settings, list[Bar]()
    for name, pair in document.pairs.items():
        color = document.patch(pair.manipulator).color
        given = [(k, s.on, s.off, s.ease_in, s.ease_out) for k, s in enumerate(film.spans(name))]
        given = given or [(-1, settings.first, settings.last, 0.0, 0.0)]
        bars += [Bar(name, *values, color, _levels(measures, name, values[1], values[2])) for values in given]
    return tuple(bars)


def marks_of(session: Session) -> tuple[KeyMark, ...]:
    """The keys of all tracks."""
    return tuple(
        mark
        for where, track in session.timeline.document.tracks.items()
        for mark in _of_track(session, where, track)
    )


def drafts_of(session: Session, frames: Sequence[float]) -> Callable[[float], Draft]:
    """Drafts at frames for a thread: the scene is read here and not there."""
    stills = {frame: session.scene_at(frame) for frame in frames}
    derived, rigs = session.derived.apart(), dict(session.rigs)
    return lambda frame: Draft(stills[frame], derived, rigs)


def _levels(
    measures: FilmMeasures | None, pair: str, on: float, off: float
) -> tuple[tuple[float, float, int], ...]:
    """Stretches of equal level of a pair within a span."""
    if measures is None or pair not in measures.series.errors:
        return ()
    pieces: list[tuple[float, float, int]] = []
    for frame, error in zip(
        measures.series.frames, measures.meters_per_unit * measures.series.errors[pair], strict=True
    ):
        if not on <= frame <= off or np.isnan(error):
            continue
        level = int(error > NEAR) + int(error > FAR)
        if pieces and pieces[-1][2] == level:
            pieces[-1] = pieces[-1][0], frame, level
        else:
            pieces.append((pieces[-1][1] if pieces else frame, frame, level))
    return tuple(pieces)


def _of_track(session: Session, where: str, track: Track) -> list[KeyMark]:
    kind, name = of_address(where)
    if kind != "pose":
        return [KeyMark(where, key.frame, "value") for key in track.keys]
    stale = set(session.timeline.stale(name))
    return [KeyMark(where, key.frame, _kind(key, stale)) for key in track.of(PoseKey)]


def curves_of(measures: FilmMeasures) -> tuple[Curve, ...]:
    """Contact error, skate, acceleration and penetration, with their limits."""
    series, unit = measures.series, measures.meters_per_unit
    frames = np.array(series.frames)
    mm = 1e3 * unit
    return (
        _curve("contact error", "mm", frames, mm * series.error, 1e3 * FAR, series.errors),
        _curve("skate", "mm/s", frames, mm * series.skate, 1e3 * SKATE, series.skates),
        _curve("acceleration", "rad/s²", frames, series.acceleration, TURNING),
        _curve("penetration", "mm", frames, mm * series.depth, mm * DEPTH * measures.length),
    )


def _curve(
    name: str,
    unit: str,
    frames: FloatArray,
    values: FloatArray,
    limit: float,
    by_pair: object = None,
) -> Curve:
    if np.isnan(values).all():
        return Curve(name, unit, frames, values, limit, None)
    row = int(np.nanargmax(values))
    pair = ""
    if isinstance(by_pair, dict):
        at = {key: each[row] for key, each in by_pair.items() if not np.isnan(each[row])}
        pair = max(at, key=lambda key: at[key], default="")
    return Curve(name, unit, frames, values, limit, float(frames[row]), pair)


def _kind(key: PoseKey, stale: set[float]) -> KeyKind:
    if key.is_authored:
        return "authored"
    if key.source == CAPTURED:
        return "clip"
    return "stale" if key.frame in stale else "solved"
