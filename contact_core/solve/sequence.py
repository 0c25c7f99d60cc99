"""Posing a range of frames: each starts from the last solution, so that poses follow one another smoothly."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from operator import length_hint
from typing import Literal

from contact_core.errors import InvalidInput
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.rig.pose_keys import PoseKeys
from contact_core.rig.rig import Pose
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import PoseSolution, PoseSolver, SolveOptions, SolveStatus


@dataclass(frozen=True, eq=False)
class SequenceSolution:
    """Solutions by frame; fewer than asked for when the user stopped it."""

    frames: tuple[float, ...]
    solutions: tuple[PoseSolution, ...]

    def keys(self, body: str) -> PoseKeys:
        """The poses of one body as keys."""
        poses = tuple(solution.poses[body] for solution in self.solutions)
        return PoseKeys(body, self.frames, poses)


def solve_sequence(
    solver: PoseSolver,
    frames: Iterable[tuple[float, PoseProblem]],
    *,
    prior: Literal["problem", "previous"] = "previous",
    options: SolveOptions | None = None,
    progress: Progress = NO_PROGRESS,
    count: int | None = None,
) -> SequenceSolution:
    """Solve problems at rising frames, each from the last solution's poses.

    The problems may differ in all but what moves: the object stands elsewhere or in another size, contacts slide.
    prior: what each frame's own problem says, or the pose of the frame before (the first frame keeps its own).
    The starting candidates serve the first frame only: a hand must not jump between frames. count: how many frames
    there are, for progress, where `frames` does not say. When it is cancelled, the frames that are done remain.
    """
    options = options or SolveOptions()
    done: list[float] = []
    solutions: list[PoseSolution] = []
    count = length_hint(frames) if count is None else count
    for frame, problem in frames:
        if done and frame <= done[-1]:
            raise InvalidInput(f"frames must rise, but {frame:g} comes after {done[-1]:g}.")
        if solutions:
            problem = _continued(problem, solutions[-1], prior)
            options = replace(options, candidates=("current",))
        part = progress.part(len(done) / max(count, 1), (len(done) + 1) / max(count, 1), f"frame {frame:g}")
        solution = solver.solve(problem, options, part)
        if solution.status is SolveStatus.CANCELLED:
            break
        done.append(float(frame))
        solutions.append(solution)
    return SequenceSolution(tuple(done), tuple(solutions))


def _continued(problem: PoseProblem, last: PoseSolution, prior: Literal["problem", "previous"]) -> PoseProblem:
    """The problem with what moves in it standing where the last solution left it."""
    poses: dict[str, Pose] = {
        body.name: last.poses[body.name]
        for body, free in zip(problem.bodies, problem.free_of_body, strict=True)
        if len(free) and body.name in last.poses
    }
    bodies = tuple(replace(body, pose=poses.get(body.name, body.pose)) for body in problem.bodies)
    return replace(problem, bodies=bodies, prior=poses if prior == "previous" else problem.prior)
