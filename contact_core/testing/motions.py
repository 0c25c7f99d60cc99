"""Small motions for laws: a tentacle with the mold of its own pose, carried about in time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.motion.problem import MotionProblem
from contact_core.rig.rotations import exponential
from contact_core.solve.problem import PoseProblem
from contact_core.testing import rigs


def eased(share: float) -> float:
    """The minimum-jerk profile from 0 to 1 (Flash and Hogan 1985)."""
    s = min(max(share, 0.0), 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s * s)


def carried(problem: PoseProblem, *, turn: FloatArray, shift: FloatArray, gain: float = 1.0) -> PoseProblem:
    """The problem with its second body turned about its centre by a rotation vector and shifted, and every contact
    at a gain."""
    body = problem.bodies[1]
    centre = body.rig.surface.points.mean(axis=0)
    placed = np.eye(4)
    placed[:3, :3] = exponential(turn[None])[0][0]
    placed[:3, 3] = centre + shift - placed[:3, :3] @ centre
    contacts = tuple(replace(contact, gain=gain) for contact in problem.contacts)
    bodies = (problem.bodies[0], replace(body, world_from_rig=placed))
    return replace(problem, bodies=bodies, contacts=contacts)


def molded(
    seconds: float = 1.0,
    rate: float = 24.0,
    *,
    degrees: float = 60.0,
    travel: float = 4.0,
    joints: int = 4,
    gain: Callable[[float], float] = lambda _: 1.0,
    **more: Any,
) -> MotionProblem:
    """A tentacle in a mold that turns and travels (surface units) in so many seconds. gain: of the contact by the
    share of time. more: of the motion problem."""
    base, _theta = rigs.planted(rigs.tentacle(joints, rigs.limited_freedom), 5, contacts=40, reach=0.3)
    base = replace(base, length=base.manipulator_length)
    frames = np.arange(round(seconds * rate) + 1)
    problems: Sequence[PoseProblem] = [
        carried(
            base,
            turn=np.radians(degrees) * eased(share) * np.array([0.0, 0.6, 0.8]),
            shift=travel * eased(share) * np.array([0.8, 0.0, 0.6]),
            gain=gain(float(share)),
        )
        for share in frames / max(len(frames) - 1, 1)
    ]
    return MotionProblem(tuple(frames.tolist()), tuple(problems), rate, **more)
