"""Solving a film beside the window: all that the thread needs of the session and its scene is read before."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from contact_core.document.timeline import PoseKey
from contact_core.interaction.film import drafts_of
from contact_core.progress import Progress
from contact_core.scene.problem import Objective

if TYPE_CHECKING:
    from contact_core.proposals.motion import MotionProposal
    from contact_core.session import Session


@dataclass(frozen=True)
class KeyedFrames:
    """What the rigs of a scene are keyed with (`proposals.motion.KeyedScene`), by surface."""

    frames: Mapping[str, tuple[float, ...]]
    curves: frozenset[str]

    def pose_keys(self, name: str) -> tuple[float, ...]:
        return self.frames.get(name, ())

    def takes_curves(self, name: str) -> bool:
        return name in self.curves


def film_work(
    session: Session, frames: Sequence[float], objective: Objective, solver: str | None
) -> Callable[[Progress], MotionProposal]:
    """The work that proposes the motion through frames. The session is read now and not on the thread."""
    from contact_core.proposals.motion import PINNED, MotionSettings, propose_motion
    from contact_core.proposals.proposal import SolveSettings

    timed, shown, revision, plugins = (
        session.timed_document,
        session.timeline.frame,
        session.revision,
        session.plugins,
    )
    low, high = min(frames), max(frames)
    beside = {low - k for k in range(1, PINNED + 1)} | {high + k for k in range(1, PINNED + 1)}
    tracks = (session.timeline.track("pose", name) for name in session.rigs)
    keyed = {key.frame for track in tracks if track is not None for key in track.of(PoseKey)}
    wanted = sorted({*frames, *beside, *(frame for frame in keyed if low < frame < high)})
    drafts, scene = drafts_of(session, wanted), keyed_frames(session)

    def work(progress: Progress) -> MotionProposal:
        settings = SolveSettings(solver, objective=objective, progress=progress)
        return propose_motion(timed, shown, frames, drafts, plugins, revision, settings, MotionSettings(), scene)

    return work


def keyed_frames(session: Session) -> KeyedFrames | None:
    """Of the scene of a session, None without one."""
    binding = session.binding
    if not binding.has_scene:
        return None
    names = [name for name in session.rigs if name in session.timed_document.surfaces]
    return KeyedFrames(
        {name: binding.pose_keys(name) for name in names},
        frozenset(name for name in names if binding.takes_curves(name)),
    )


def stale_window(session: Session, frame: float) -> tuple[float, ...]:
    """The two seconds round a frame where solved keys within them are stale; else no frames."""
    window = session.timeline.window(frame)
    stale = {at for name in session.rigs for at in session.timeline.stale(name)}
    return window if any(window[0] <= at <= window[-1] for at in stale) else ()
