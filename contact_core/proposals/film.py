"""The film of a document as pose problems, one for each frame, with patches that slide smoothed over time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from contact_core.arrays import IntArray
from contact_core.contact.pairing import correspond
from contact_core.contact.tracer import ShapedPatch
from contact_core.document.document import ContactDocument
from contact_core.document.timeline import address
from contact_core.errors import InvalidInput
from contact_core.motion.placement_keys import PlacementKey, PlacementKeys
from contact_core.motion.problem import MotionProblem
from contact_core.motion.series import MotionSeries, motion_series
from contact_core.motion.sliding import SlidingPatch
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.proposals.draft import Draft
from contact_core.scene.problem import Objective
from contact_core.solve.body import PairedPoints
from contact_core.solve.problem import PoseProblem


class FilmProblems:
    """Makes the problems. timed: the document with its tracks. objective: terms, limits, what is free."""

    def __init__(self, timed: ContactDocument, objective: Objective) -> None:
        self.timed, self.objective = timed, objective
        self._slides = dict[str, SlidingPatch]()

    def over(
        self, frames: Sequence[float], draft_at: Callable[[float], Draft], progress: Progress
    ) -> tuple[list[PoseProblem], Draft]:
        """A problem for each frame, and the first draft. Raises InvalidInput where there is nothing to pose."""
        problems, first = list[PoseProblem](), None
        for row, frame in enumerate(frames):
            progress.tell(row / len(frames), f"frame {frame:g}")
            draft = draft_at(frame)
            first = first or draft
            problem = self.at(draft, frame)
            length = problems[0].length if problems else problem.manipulator_length  # measured once
            problems.append(replace(problem, length=length))
        assert first is not None
        return problems, first

    def at(self, draft: Draft, frame: float) -> PoseProblem:
        if not draft.document.pairs:
            raise InvalidInput("solving needs contact pairs with a rig that can be posed: pair patches first.")
        problem = draft.problem(self.objective)
        return replace(problem, contacts=tuple(self._calmed(draft, c.name, c, frame) for c in problem.contacts))

    def _calmed(self, draft: Draft, pair: str, contact: PairedPoints, frame: float) -> PairedPoints:
        """A contact whose patches slide by keys, with their points smoothed over time."""
        ends = self.timed.pairs[pair]
        changes: dict[str, Any] = {}
        for side, patch, order in (
            ("manipulator_points", ends.manipulator, None),
            ("object_points", ends.object, self._order(pair)),
        ):
            sliding = self._sliding(draft, patch)
            if sliding is not None:
                points = draft.derived.seen(self.timed, self.timed.patch(patch).surface, sliding.points(frame))
                changes[side] = points if order is None else points[order]
        return replace(contact, **changes) if changes else contact

    def _order(self, pair: str) -> IntArray | None:
        """Which point of the object's patch belongs to each of the manipulator's, None for the same ones."""
        shapes = [
            self.timed.patch(end).shape
            for end in (self.timed.pairs[pair].manipulator, self.timed.pairs[pair].object)
        ]
        return None if shapes[0] == shapes[1] else correspond(*(self.timed.shapes[key] for key in shapes))

    def _sliding(self, draft: Draft, name: str) -> SlidingPatch | None:
        """A patch that has placement keys, smooth over time; made once."""
        track = self.timed.tracks.get(address("placement", name))
        if track is None:
            return None
        if name not in self._slides:
            document, patch = self.timed, self.timed.patch(name)
            shaped = ShapedPatch(document.shapes[patch.shape], document.surface_axis(name))
            mesh = draft.derived.carrier(document, patch.surface)
            self._slides[name] = SlidingPatch(mesh, shaped, PlacementKeys(track.of(PlacementKey)))
        return self._slides[name]


@dataclass(frozen=True, eq=False)
class FilmMeasures:
    """A film as it is keyed, frame by frame. series: in world units. meters_per_unit: of those. length: of the
    manipulator, world units."""

    series: MotionSeries
    meters_per_unit: float
    length: float


def measure_film(
    timed: ContactDocument,
    frames: Sequence[float],
    draft_at: Callable[[float], Draft],
    *,
    depth: bool = True,
    progress: Progress = NO_PROGRESS,
) -> FilmMeasures:
    """How well a film meets its contacts, as it is keyed. depth: whether penetration is measured, too.

    Raises InvalidInput without frames, or without a pair of a rig that can be posed, and Cancelled.
    """
    if not len(frames):
        raise InvalidInput("a film needs frames, at least one.")
    problems, first = FilmProblems(timed, Objective()).over(frames, draft_at, progress.part(0.0, 0.6))
    motion = MotionProblem(tuple(frames), tuple(problems), timed.timeline.frames_per_second)
    thetas = np.array([problem.start_state.theta for problem in problems])
    series = motion_series(motion, thetas, solids=None if depth else {}, progress=progress.part(0.6, 1.0))
    unit = first.document.surface(problems[0].bodies[0].name).meters_per_unit
    return FilmMeasures(series, unit, problems[0].manipulator_length)
