"""The motion problem: a pose problem per frame, what couples the frames, and what is given in advance."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from contact_core.arrays import BoolArray, FloatArray
from contact_core.errors import InvalidInput
from contact_core.motion.grounding import grounded
from contact_core.motion.steps import Clock, StepChart
from contact_core.rig.rig import Pose
from contact_core.solve.problem import PoseProblem


@dataclass(frozen=True)
class MotionWeights:
    """What couples the frames, per second and so the same at every rate.

    acceleration: cost of 1 rad/s^2 (or 1 manipulator length/s^2) squared, during a second; the fourth root, 0.13 s
    by default, is about the shortest movement that is left in. skate: cost of a contact that slips 1 l/s (l: a
    centimetre on an 18 cm hand), squared, during a second. follow: cost of being 1 rad (or 1 length) away from the
    reference, squared, during a second; it needs a reference. follow_root: the share of it for dofs that place a
    whole body.
    """

    acceleration: float = 3e-4
    skate: float = 0.05
    follow: float = 0.0
    follow_root: float = 1.0

    def __post_init__(self) -> None:
        for name in ("acceleration", "skate", "follow", "follow_root"):
            value = getattr(self, name)
            if not 0.0 <= value < math.inf:
                raise InvalidInput(
                    f"the weight {name} of a motion must be 0 or a positive number, but got {value}."
                )


@dataclass(frozen=True)
class MotionBounds:
    """The fastest that anything may move; infinite: no bound.

    turning_speed, turning_acceleration: of every angle (of a freely turning ball: of each component of its angular
    velocity), rad/s and rad/s^2. travel_speed, travel_acceleration: of every translation, world units/s
    and /s^2. depth: how deep any skin may be at frames at which no contact is fully on, world units.
    """

    turning_speed: float = math.inf
    turning_acceleration: float = math.inf
    travel_speed: float = math.inf
    travel_acceleration: float = math.inf
    depth: float = math.inf

    def __post_init__(self) -> None:
        for name in ("turning_speed", "turning_acceleration", "travel_speed", "travel_acceleration", "depth"):
            value = getattr(self, name)
            if not value > 0.0:
                raise InvalidInput(f"the bound {name} of a motion must be above 0, but got {value}.")

    def of(self, problem: PoseProblem) -> tuple[FloatArray, FloatArray]:
        """Bounds (d,) of speeds and of accelerations, in natural units of the dofs."""
        translation, scale = problem.is_translation, problem.scale
        return (
            np.where(translation, self.travel_speed, self.turning_speed) / scale,
            np.where(translation, self.travel_acceleration, self.turning_acceleration) / scale,
        )


@dataclass(frozen=True, eq=False)
class MotionProblem:
    """What is solved: n frames at rising times, each with a pose problem over the same free dofs.

    frames: numbers as an animator counts them, whole or not. problems: one per frame; objects may stand elsewhere
    and be of another size, contacts may slide, fade (`gain`) and be absent. rate: frames per second.
    pins: authored poses by frame and body; those bodies stay exactly there. Frames pinned as a whole before and
    after a range make what is solved between them start and end with their speed. reference: a pose per frame, by
    body, whose movement is kept: accelerations are then counted against its own. grounded: whether the reference is
    first moved as a whole to where its contacts are (`grounding`), as for clips that wander.
    """

    frames: tuple[float, ...]
    problems: tuple[PoseProblem, ...]
    rate: float = 24.0
    weights: MotionWeights = MotionWeights()
    bounds: MotionBounds = MotionBounds()
    pins: Mapping[float, Mapping[str, Pose]] = field(default_factory=dict)
    reference: Mapping[str, tuple[Pose, ...]] | None = None
    grounded: bool = False

    def __post_init__(self) -> None:
        frames = tuple(float(frame) for frame in self.frames)
        object.__setattr__(self, "frames", frames)
        object.__setattr__(self, "problems", tuple(self.problems))
        object.__setattr__(self, "rate", float(self.rate))
        if not frames or len(frames) != len(self.problems):
            raise InvalidInput(
                f"a motion needs one pose problem per frame, at least one, but got {len(self.problems)} problems"
                f" for {len(frames)} frames."
            )
        if any(not a < b for a, b in itertools.pairwise(frames)) or not np.isfinite(frames).all():
            raise InvalidInput(f"the frames of a motion must rise, but got {list(frames[:6])} and so on.")
        if not 0.0 < self.rate < math.inf:
            raise InvalidInput(f"the rate is a positive number of frames per second, but got {self.rate}.")
        first = self.problems[0].dof_names
        for frame, problem in zip(frames, self.problems, strict=True):
            if problem.dof_names != first:
                odd = sorted(set(first) ^ set(problem.dof_names))[:3] or "the same in another order"
                raise InvalidInput(
                    f"all frames of a motion must free the same dofs, but frame {frame:g} differs from the first in"
                    f" {odd}; hold a body at some frames with pins."
                )
        strangers = sorted(set(self.pins) - set(frames))
        if strangers:
            raise InvalidInput(
                f"a pose is pinned at frame {strangers[0]:g}, which is not among the motion's frames."
            )
        for body, poses in (self.reference or {}).items():
            self.problems[0].body_index(body)
            if len(poses) != len(frames):
                raise InvalidInput(
                    f"a reference needs one pose per frame, but {body} has {len(poses)} for {len(frames)} frames."
                )
        if self.weights.follow > 0.0 and self.reference is None:
            raise InvalidInput("the weight follow needs a reference to follow; give the poses of each frame.")

    @cached_property
    def clock(self) -> Clock:
        """When the frames are."""
        return Clock(np.array(self.frames) / self.rate)

    @cached_property
    def chart(self) -> StepChart:
        """How theta goes from frame to frame."""
        return StepChart.of(self.problems[0])

    @cached_property
    def pinned(self) -> BoolArray:
        """(n, d) which dofs are given in advance."""
        result = np.zeros((len(self.frames), len(self.problems[0].dof_names)), bool)
        for row, (frame, problem) in enumerate(zip(self.frames, self.problems, strict=True)):
            for body in self.pins.get(frame, {}):
                result[row, problem.dof_slices[problem.body_index(body)]] = True
        return result

    @cached_property
    def posed(self) -> tuple[PoseProblem, ...]:
        """The problems with pinned bodies in their pinned poses, so that what their freedoms cannot express of
        those poses is kept."""
        return tuple(
            replace(
                problem,
                bodies=tuple(
                    replace(body, pose=self.pins[frame].get(body.name, body.pose)) for body in problem.bodies
                ),
            )
            if self.pins.get(frame)
            else problem
            for frame, problem in zip(self.frames, self.problems, strict=True)
        )

    @cached_property
    def reference_thetas(self) -> FloatArray | None:
        """(n, d) theta of the reference; of bodies that it does not name, where each frame's problem starts."""
        if self.reference is None:
            return None
        thetas = np.array(
            [
                problem.theta_of({body: poses[row] for body, poses in self.reference.items()})
                for row, problem in enumerate(self.posed)
            ]
        )
        return grounded(self.posed, thetas, self.clock, self.weights.acceleration) if self.grounded else thetas
