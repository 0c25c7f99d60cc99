"""Proposing a motion: the document at every frame as one motion problem, solved as a whole, reduced to few keys.

What is keyed already round a range stays: two frames on either side are pinned to what the keys there say, so that
the film runs on with its speed. Keys that a person made within it are pins, and solved ones give way.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.document.document import ContactDocument
from contact_core.document.staleness import motion_source
from contact_core.document.timeline import PoseKey, address
from contact_core.edit.command import Command, Macro, apply_command
from contact_core.edit.commands import SetKeys
from contact_core.errors import Cancelled, InvalidInput
from contact_core.motion.depth import HELD
from contact_core.motion.problem import MotionBounds, MotionProblem, MotionWeights
from contact_core.motion.reduction import MILLIMETRE, Reduction, reduce_poses
from contact_core.motion.report import MotionReport, motion_report
from contact_core.motion.solving import MotionOptions, MotionSolution, solve_motion
from contact_core.progress import Progress
from contact_core.proposals.draft import Draft
from contact_core.proposals.film import FilmProblems
from contact_core.proposals.proposal import Proposal, SolveSettings
from contact_core.rig.pose_keys import PoseKeys
from contact_core.rig.rig import Pose, Rig
from contact_core.scene.evaluated_rig import EvaluatedRig
from contact_core.solve.penetration import Solids
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import PoseSolution, SolveStatus

if TYPE_CHECKING:
    from contact_core.plugins.manager import PluginManager

PINNED = 2  # frames on either side of a range that run on as they are keyed


class KeyedScene(Protocol):
    """What a motion asks of a scene (`scene.binding.Binding`)."""

    def pose_keys(self, name: str) -> tuple[float, ...]:
        """Frames at which the rig of a surface is keyed already."""

    def takes_curves(self, name: str) -> bool:
        """Whether its keys are joined by cubic curves."""


@dataclass(frozen=True)
class MotionSettings:
    """How frames are solved together, and how their poses become keys.

    weights, bounds, options: of the joint solve; with a weight `follow` the poses that are keyed now are followed,
    which keeps the style of a clip that is repaired. tolerance: metres that any point of the skin may be off with
    the keys. grounded: the poses that are followed are first moved as a whole to where their contacts are.
    """

    weights: MotionWeights = field(default_factory=MotionWeights)
    bounds: MotionBounds = field(default_factory=MotionBounds)
    options: MotionOptions = field(default_factory=MotionOptions)
    tolerance: float = MILLIMETRE
    grounded: bool = False

    def __post_init__(self) -> None:
        if not 0.0 < self.tolerance < np.inf:
            raise InvalidInput(f"the tolerance of keys is a positive number of metres, but got {self.tolerance}.")


@dataclass(frozen=True, eq=False)
class MotionProposal(Proposal):
    """A motion that is not yet committed. motion: all frames as solved. reductions: by surface, the keys that the
    document gets (cubic); `keys` are those of the scene, which are joined by straight blends."""

    motion: MotionSolution | None = None
    reductions: Mapping[str, Reduction] = field(default_factory=dict)

    def report(self, *, depth: bool = True) -> MotionReport:
        """What it is worth, in figures. depth: whether penetration is measured, too."""
        assert self.motion is not None
        solids: Solids | None = None if depth else {}
        return motion_report(self.motion.motion, self.motion.thetas, solids=solids, reductions=self.reductions)


def propose_motion(
    timed: ContactDocument,
    frame: float,
    frames: Sequence[float],
    draft_at: Callable[[float], Draft],
    plugins: PluginManager,
    revision: int,
    settings: SolveSettings,
    motion: MotionSettings,
    scene: KeyedScene | None = None,
) -> MotionProposal:
    """The motion through frames. timed: the document with its tracks. frame: which one a ghost shows. draft_at: the
    document at a frame, as the scene has it there. scene: None without one, which then gets no keys.

    Raises InvalidInput without a pair of a rig that can be posed, Cancelled where nothing was solved.
    """
    return _Motion(timed, frames, draft_at, plugins, settings, motion, scene).proposal(frame, revision)


class _Motion:
    """One motion while it is made."""

    def __init__(
        self,
        timed: ContactDocument,
        frames: Sequence[float],
        draft_at: Callable[[float], Draft],
        plugins: PluginManager,
        settings: SolveSettings,
        motion: MotionSettings,
        scene: KeyedScene | None,
    ) -> None:
        self.timed, self.draft_at, self.plugins, self.scene = timed, draft_at, plugins, scene
        self.settings, self.motion = settings, motion
        self.rate = timed.timeline.frames_per_second
        asked = sorted({float(frame) for frame in frames})
        if not asked or not np.isfinite(asked).all() or len(asked) != len(list(frames)):
            raise InvalidInput(f"frames to solve are numbers, each once, at least one, but got {list(frames)[:6]}.")
        self.before, self.after = self._pinned_beside(asked)
        authored = {f for track in self._tracks().values() for f in _authored(track) if asked[0] < f < asked[-1]}
        self.frames = tuple(sorted({*asked, *self.before, *self.after, *authored}))

    def proposal(self, frame: float, revision: int) -> MotionProposal:
        """Solve, reduce, and say what accepting does."""
        progress = self.settings.progress
        problem = self._problem(progress.part(0.0, 0.2))
        start = self._start(problem)
        solver = self.settings.solver_of(self.plugins)
        solution = solve_motion(
            problem, solver=solver, options=self.motion.options, start=start, progress=progress.part(0.2, 0.9)
        )
        if solution.status is SolveStatus.CANCELLED and not solution.evaluations:
            raise Cancelled("it was cancelled before the first frame was solved; nothing is proposed.")
        poses = {name: self._poses(solution, name) for name in self.posed}
        self.held = {name: held_vertices(problem, name, len(self.rigs[name].faces)) for name in self.posed}
        cubic = {name: self._reduced(name, poses[name], "cubic") for name in self.posed}
        command = self._command({name: done.keys for name, done in cubic.items()})
        by_frame = _solutions(solution)
        return MotionProposal(
            command=command,
            ghost=apply_command(command, self.timed).at(frame),
            revision=revision,
            before=by_frame[-1],
            after=by_frame[-1],
            keys={} if self.scene is None else self._scene_keys(poses, self.scene),
            curves={name: done.keys for name, done in cubic.items() if self._has_curves(name)},
            solutions=tuple(by_frame[row] for row, f in enumerate(self.frames) if self._is_asked(f)),
            motion=solution,
            reductions=cubic,
        )

    # --- the problem ----------------------------------------------------------------------------------------

    def _problem(self, progress: Progress) -> MotionProblem:
        problems, first = FilmProblems(self.timed, self.settings.objective).over(
            self.frames, self.draft_at, progress
        )
        self.rigs: dict[str, Rig] = first.rigs
        bodies, free = problems[0].bodies, problems[0].free_of_body
        self.posed = [b.name for b, dofs in zip(bodies, free, strict=True) if b.name in self.rigs and len(dofs)]
        if not self.posed:
            raise InvalidInput("solving needs contact pairs with a rig that can be posed: pair patches first.")
        reference = None
        if self.motion.weights.follow > 0.0:
            reference = {name: tuple(_pose_in(problem, name) for problem in problems) for name in self.posed}
        return MotionProblem(
            self.frames, tuple(problems), self.rate, self.motion.weights, self.motion.bounds,
            self._pins(), reference, self.motion.grounded,
        )  # fmt: skip

    # --- what is keyed already ------------------------------------------------------------------------------

    def _tracks(self) -> dict[str, tuple[PoseKey, ...]]:
        """By surface, the pose keys that the document has."""
        tracks = self.timed.tracks
        names = (name for name in self.timed.surfaces if address("pose", name) in tracks)
        return {name: tracks[address("pose", name)].of(PoseKey) for name in names}

    def _pinned_beside(self, asked: list[float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Frames before and after a range that keys go over."""
        keyed = [key.frame for keys in self._tracks().values() for key in keys]
        before = [asked[0] - k for k in range(1, PINNED + 1)] if any(f < asked[0] for f in keyed) else []
        after = [asked[-1] + k for k in range(1, PINNED + 1)] if any(f > asked[-1] for f in keyed) else []
        return tuple(before), tuple(after)

    def _pins(self) -> dict[float, dict[str, Pose]]:
        pins: dict[float, dict[str, Pose]] = {}
        for name in self.posed:
            keys = self._tracks().get(name, ())
            pinned = {key.frame for key in keys if key.is_authored} | {*self.before, *self.after}
            for frame in pinned & set(self.frames) if keys else ():
                track = self.timed.tracks[address("pose", name)]
                pins.setdefault(frame, {})[name] = track.pose_at(frame)
        return pins

    def _start(self, problem: MotionProblem) -> FloatArray | None:
        """(n, d) the motion as it is keyed, where keys go over the whole range: a key was dragged."""
        if not all(self._is_covered(name) for name in self.posed):
            return None
        rows = []
        for frame, posed in zip(self.frames, problem.posed, strict=True):
            poses = {n: self.timed.tracks[address("pose", n)].pose_at(frame) for n in self.posed}
            rows.append(posed.theta_of(poses))
        return np.array(rows)

    def _is_covered(self, name: str) -> bool:
        keys = self._tracks().get(name, ())
        solved = [key.frame for key in keys if not key.is_authored]
        return bool(solved) and solved[0] <= self.frames[0] and self.frames[-1] <= solved[-1]

    def _is_asked(self, frame: float) -> bool:
        return frame not in self.before and frame not in self.after

    # --- keys -----------------------------------------------------------------------------------------------

    def _poses(self, solution: MotionSolution, name: str) -> tuple[Pose, ...]:
        poses = []
        for problem, pose in zip(solution.motion.problems, solution.poses(name), strict=True):
            box = problem.bodies[problem.body_index(name)].black_box
            poses.append(box.pose(pose) if isinstance(box, EvaluatedRig) else pose)
        return tuple(poses)

    def _has_curves(self, name: str) -> bool:
        return self.scene is not None and self.scene.takes_curves(name)

    def _scene_keys(self, poses: Mapping[str, tuple[Pose, ...]], scene: KeyedScene) -> dict[float, dict[str, Pose]]:
        """What a scene of straight blends gets, by frame: the keys, and the pose at each key that it has within the
        range already, or what lies between would stay as it was."""
        result: dict[float, dict[str, Pose]] = {}
        for name in (name for name in self.posed if not scene.takes_curves(name)):
            found = self._reduced(name, poses[name], "linear").keys
            solved = dict(zip(self.frames, poses[name], strict=True))
            there = {f for f in scene.pose_keys(name) if self.frames[0] <= f <= self.frames[-1]}
            for frame in {*found.frames, *there}:
                pose = solved[frame] if frame in solved else found.at(self.rigs[name], frame)
                result.setdefault(frame, {})[name] = pose
        return dict(sorted(result.items()))

    def _reduced(self, name: str, poses: tuple[Pose, ...], kind: str) -> Reduction:
        rig = self.rigs[name]
        keep = [key.frame for key in self._tracks().get(name, ()) if key.is_authored and key.frame in self.frames]
        return reduce_poses(
            rig, self.frames, poses, tolerance=self.motion.tolerance / rig.meters_per_unit,
            interpolation="cubic" if kind == "cubic" else "linear", keep=keep, held=self.held[name],
        )  # fmt: skip

    def _command(self, keys: Mapping[str, PoseKeys]) -> Command:
        """The keys of all rigs: solved ones in the range give way, those of a person stay what they are."""
        commands: list[Command] = []
        for name, found in keys.items():
            known = {key.frame: key for key in self._tracks().get(name, ())}
            put = []
            for row, (frame, pose) in enumerate(zip(found.frames, found.poses, strict=True)):
                old, speeds = known.get(frame), found.speeds[row] if found.is_cubic else None
                if old is not None and old.is_authored:
                    put.append(replace(old, speeds=speeds))
                else:
                    put.append(PoseKey(frame, pose, speeds, "smooth", motion_source(self.timed, frame)))
            low, high = self.frames[0], self.frames[-1]
            gone = tuple(f for f, key in known.items() if low <= f <= high and not key.is_authored)
            commands.append(SetKeys(address("pose", name), tuple(put), gone, "Solve"))
        return commands[0] if len(commands) == 1 else Macro("Solve the motion", tuple(commands))


def _authored(keys: Sequence[PoseKey]) -> list[float]:
    return [key.frame for key in keys if key.is_authored]


def held_vertices(motion: MotionProblem, name: str, faces: int) -> list[IntArray]:
    """Per frame, the vertices of a rig's skin in contacts that are on; none where it is posed by a proxy."""
    none = np.zeros(0, np.int64)
    found = []
    for problem in motion.problems:
        surface = problem.bodies[problem.body_index(name)].rig.surface
        on = [c.manipulator_points for c in problem.contacts if c.manipulator == name and c.gain >= HELD]
        known = len(surface.faces) == faces
        found.append(np.unique(np.concatenate([none, *(surface.faces[p.faces].ravel() for p in on if known)])))
    return found


def _pose_in(problem: PoseProblem, name: str) -> Pose:
    return problem.bodies[problem.body_index(name)].pose


def _solutions(solution: MotionSolution) -> list[PoseSolution]:
    """Each frame as the solution of a pose problem."""
    return [
        PoseSolution(
            solver="motion",
            status=solution.status,
            problem=problem,
            theta=theta,
            value=problem.value(problem.state(theta)),
            start_value=problem.value(problem.start_state),
            trace=solution.trace,
            evaluations=solution.evaluations,
            seconds=solution.seconds,
        )
        for problem, theta in zip(solution.motion.posed, solution.thetas, strict=True)
    ]
