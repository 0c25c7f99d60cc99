"""Motions for the benchmark, out of built-in samples: a hand on a baseball, a body on a chair."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from pose_grips import Grip
from pose_scenes import chair

from contact_builtins.terms.balance import BalanceTerm
from contact_core.arrays import FloatArray
from contact_core.document.timeline import Span
from contact_core.geometry.raycast import Locator
from contact_core.motion.problem import MotionBounds, MotionProblem, MotionWeights
from contact_core.motion.solving import MotionSolution, solve_motion
from contact_core.rig.rig import Pose
from contact_core.rig.rotations import exponential
from contact_core.solve.body import PairedPoints
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.penetration import PenetrationTerm
from contact_core.solve.problem import PoseProblem
from contact_core.solve.state import PoseState
from contact_core.solve.terms import DistanceTerm, paper_terms

RATE = 24.0


def ease(share: FloatArray | float) -> FloatArray:
    """The minimum-jerk profile from 0 to 1 (Flash and Hogan 1985)."""
    s = np.clip(share, 0.0, 1.0)
    return np.asarray(s**3 * (10.0 - 15.0 * s + 6.0 * s**2))


def moved(shift: FloatArray, turn: FloatArray, about: FloatArray) -> FloatArray:
    """(4, 4) a turn by a rotation vector about a point, then a shift."""
    result = np.eye(4)
    result[:3, :3] = exponential(turn[None])[0][0]
    result[:3, 3] = about + shift - result[:3, :3] @ about
    return result


@lru_cache(maxsize=1)
def ball_grip() -> PoseProblem:
    """The five fingertips of the hand on the baseball, solved."""
    grip = Grip("baseball").problem
    tips = tuple(contact for contact in grip.contacts if "distal" in contact.name)
    problem = replace(grip, contacts=tips, terms=paper_terms(), length=grip.manipulator_length)
    return problem.at(LevenbergMarquardt().solve(problem).theta)


def slid(contact: PairedPoints, problem: PoseProblem, angle: float) -> PairedPoints:
    """A contact whose points on the ball are turned about its centre, along the surface."""
    mesh = problem.bodies[problem.body_index(contact.object)].rig.surface
    centre = mesh.points.mean(axis=0)
    points = contact.object_points.positions(mesh) - centre
    normal = points.mean(axis=0) / np.linalg.norm(points.mean(axis=0))
    axis = np.cross(normal, [0.0, 0.0, 1.0] if abs(normal[2]) < 0.9 else [1.0, 0.0, 0.0])
    turn = exponential((angle * axis / np.linalg.norm(axis))[None])[0][0]
    return replace(contact, object_points=Locator.of(mesh).closest(points @ turn.T + centre).points)


def baseball(frames: int = 120, degrees: float = 90.0, rate: float = RATE) -> MotionProblem:
    """Fingertips that slide 8 to 10 mm over a ball that flies 25 cm and turns, in five seconds at 24 fps."""
    grip = ball_grip()
    index = next(i for i, body in enumerate(grip.bodies) if body.name == grip.contacts[0].object)
    body, unit = grip.bodies[index], grip.manipulator_length / 0.18
    centre = body.world_from_rig[:3, :3] @ body.rig.surface.points.mean(axis=0) + body.world_from_rig[:3, 3]
    problems = []
    for share in np.linspace(0.0, 1.0, frames):
        s = float(ease(share))
        flight = moved(
            unit * 0.25 * s * np.array([0.6, 0.8, 0.0]), np.radians(degrees) * s * np.array([0, 0.6, 0.8]), centre
        )
        bodies = list(grip.bodies)
        bodies[index] = replace(body, world_from_rig=flight @ body.world_from_rig)
        contacts = tuple(slid(contact, grip, (0.22 + 0.015 * k) * s) for k, contact in enumerate(grip.contacts))
        problems.append(replace(grip, bodies=tuple(bodies), contacts=contacts))
    return MotionProblem(tuple(map(float, range(frames))), tuple(problems), rate)


def reach(seconds: float = 4.0, away: float = 0.31, rate: float = RATE) -> MotionProblem:
    """The hand reaches a resting ball from `away` metres, holds it, lets go and goes back: pinned at both ends."""
    grip = ball_grip()
    grip = replace(grip, terms=(*grip.terms, PenetrationTerm(40.0, samples=600)))
    unit, frames = grip.manipulator_length / 0.18, np.arange(round(seconds * rate) + 1)
    hand = grip.bodies[grip.body_index(grip.contacts[0].manipulator)]
    up = _outwards(grip)
    open_local = hand.rig.rest_local.copy()
    open_local[0] = hand.pose.local[0]
    open_local[0, :3, 3] += np.linalg.inv(hand.world_from_rig)[:3, :3] @ (unit * away * up)
    resting = {hand.name: Pose(hand.rig.joints, open_local)}
    problems = []
    for share in frames / frames[-1]:
        gain = float(ease((share - 0.35) * 8.0) * (1.0 - ease((share - 0.55) * 8.0)))
        problems.append(replace(grip, contacts=tuple(replace(c, gain=gain) for c in grip.contacts)))
    return MotionProblem(
        tuple(frames.astype(float)), tuple(problems), rate,
        bounds=MotionBounds(depth=0.003 * grip.manipulator_length),
        pins={0.0: resting, float(frames[-1]): resting},
    )  # fmt: skip


GRIPS = {  # how far each fingertip's contact is turned over the ball, rad: thumb and fingers in their order
    "knuckleball": (0.12, -0.22, -0.22, -0.22, -0.16),
    "two-seam": (0.0, 0.0, 0.0, 0.0, 0.0),
    "curveball": (-0.12, 0.22, 0.26, 0.1, 0.06),
}


def regrasping(hold: int = 24, lag: int = 5, lift: int = 8, ramp: int = 6) -> MotionProblem:
    """Three grips of a baseball; in between, the fingers let go and take hold again one after another.

    A finger leaves `lag` frames after the one before it, and is off the ball for `lift` frames. ramp: frames over
    which a contact fades. Each finger has a contact in each grip, on while a span of the document would be.
    """
    grip = ball_grip()
    fingers = len(grip.contacts)
    length = hold + lag * (fingers - 1) + lift  # from one grip to the next
    last = length * len(GRIPS) - lift
    contacts, spans = [], []
    for number, (title, angles) in enumerate(GRIPS.items()):
        for finger, (contact, angle) in enumerate(zip(grip.contacts, angles, strict=True)):
            contacts.append(replace(slid(contact, grip, angle), name=f"{contact.name} {title}"))
            on = 0.0 if number == 0 else float(length * number + lag * finger)
            off = float(last) if number == len(GRIPS) - 1 else float(length * (number + 1) + lag * finger - lift)
            spans.append(Span(on, off, ramp, ramp))
    problems = []
    for frame in range(last + 1):
        gains = [span.gain(float(frame)) for span in spans]
        now = tuple(replace(c, gain=gain) for c, gain in zip(contacts, gains, strict=True))
        problems.append(replace(grip, contacts=now))
    return MotionProblem(tuple(map(float, range(last + 1))), tuple(problems), RATE)


def _outwards(grip: PoseProblem) -> FloatArray:
    """(3,) from the ball to the hand that holds it."""
    hand, ball = (grip.bodies[grip.body_index(getattr(grip.contacts[0], end))] for end in ("manipulator", "object"))
    centre = ball.world_from_rig[:3, :3] @ ball.rig.surface.points.mean(axis=0) + ball.world_from_rig[:3, 3]
    wrist = (hand.world_from_rig @ hand.pose.local[0])[:3, 3]
    return np.asarray((wrist - centre) / np.linalg.norm(wrist - centre))


def growing(frames: int = 73) -> MotionProblem:
    """The ball grows by half under the grip over four keys, and shrinks again."""
    grip = ball_grip()
    index = grip.body_index(grip.contacts[0].object)
    body = grip.bodies[index]
    centre = body.rig.surface.points.mean(axis=0)
    keys = [1.0, 1.2, 1.5, 1.1]
    problems = []
    for share in np.linspace(0.0, len(keys) - 1.0, frames):
        k = min(int(share), len(keys) - 2)
        size = keys[k] + (keys[k + 1] - keys[k]) * float(ease(share - k))
        grown = np.eye(4)
        grown[:3, :3] *= size
        grown[:3, 3] = centre - size * centre
        bodies = list(grip.bodies)
        bodies[index] = replace(body, world_from_rig=body.world_from_rig @ grown)
        problems.append(replace(grip, bodies=tuple(bodies)))
    return MotionProblem(tuple(map(float, range(frames))), tuple(problems), RATE)


def sitting(seconds: float = 5.0, heels: float = 0.3, leaning: bool = False) -> MotionProblem:
    """The body stands, sits down with its hands on its thighs, and stands up again; its feet are held throughout.

    The soles stand where they are at rest; the chair comes under the body. leaning: its centre of mass stays above
    what bears (the term `balance`), so it leans forward on the way and comes upright where the seat has taken over;
    without, it keeps its back upright, as nobody who is in balance can.
    """
    scene = chair().problem
    body = scene.bodies[0]
    foot = body.rig.rest_world[body.rig.joint_index("foot_l"), 2, 3]
    local = body.rig.rest_local.copy()
    local[0, 2, 3] += heels - foot  # heels below the knees of who sits
    body = replace(body, pose=Pose(body.rig.joints, local))
    scene = replace(scene, bodies=(body, *scene.bodies[1:]))
    feet = tuple(_in_place(contact, scene) for contact in scene.contacts if contact.name.startswith("foot"))
    others = tuple(contact for contact in scene.contacts if not contact.name.startswith("foot"))
    terms = (*scene.terms, BalanceTerm()) if leaning else scene.terms
    base = replace(scene, contacts=(*feet, *others), terms=terms, length=scene.manipulator_length)
    frames = np.arange(round(seconds * RATE) + 1)
    on, off, speed = (0.17, 0.58, 4.0) if leaning else (0.3, 0.6, 8.0)  # who leans swings the hips farther
    problems = []
    for share in frames / frames[-1]:
        gain = float(ease((share - on) * speed) * (1.0 - ease((share - off) * speed)))
        problems.append(replace(base, contacts=(*feet, *(replace(c, gain=gain) for c in others))))
    standing = {body.name: body.pose}
    return MotionProblem(
        tuple(frames.astype(float)), tuple(problems), RATE, MotionWeights(acceleration=3e-4, skate=2.0),
        pins={0.0: standing, float(frames[-1]): standing},
    )  # fmt: skip


def _in_place(contact: PairedPoints, scene: PoseProblem, state: PoseState | None = None) -> PairedPoints:
    """A contact of soles with the floor right below where they stand in a state, by default at the start."""
    state = state or scene.start_state
    points = state.vectors(scene.pairs.manipulator_points)[scene.pairs.rows[contact.name]]
    floor = scene.bodies[scene.body_index(contact.object)]
    into = np.linalg.inv(floor.world_from_rig)
    below = Locator.of(floor.rig.surface).closest(points @ into[:3, :3].T + into[:3, 3])
    return replace(contact, object_points=below.points)


def skating(seated: MotionSolution) -> tuple[MotionProblem, FloatArray, FloatArray]:
    """A clip made of a true motion by putting skate in, the motion problem that repairs it, and the true thetas.

    The truth is that of who sits down, but with soles that stay: they crept by 2 mm, which nobody can know of a
    clip. The whole body then wanders over the floor by centimetres, at 0.3 to 1.5 Hz, and takes its feet along.
    What the repair knows is the clip, and where the soles belong.
    """
    motion, random = seated.motion, np.random.default_rng(6)
    problem, seconds = motion.problems[0], motion.clock.seconds
    truth = solve_motion(_repair(seated, seated.thetas), start=seated.thetas).thetas
    wander = np.zeros_like(truth)
    for frequency in (0.3, 0.7, 1.5):
        phase = random.uniform(0.0, 2.0 * np.pi, wander.shape[1])
        size = np.where(problem.is_root & problem.is_translation, 0.01, 0.0)
        wander += size * np.sin(2.0 * np.pi * frequency * seconds[:, None] + phase)
    clip = np.array([np.clip(theta, *problem.limits_of_theta) for theta in truth + wander])
    return _repair(seated, clip), clip, truth


def _repair(seated: MotionSolution, clip: FloatArray) -> MotionProblem:
    """What keeps to a clip (n, d), with soles that stay where they belong."""
    motion = seated.motion
    problem, body = motion.problems[0], motion.problems[0].bodies[0].name
    poses = tuple(p.poses(theta)[body] for p, theta in zip(motion.problems, clip, strict=True))
    standing = problem.state(seated.thetas[len(seated.thetas) // 2])
    feet = tuple(_in_place(c, problem, standing) for c in problem.contacts if c.name.startswith("foot"))
    frames = tuple(
        replace(p, contacts=feet, terms=(DistanceTerm(),), length=problem.manipulator_length)
        for p in motion.problems
    )
    weights = MotionWeights(acceleration=3e-4, skate=50.0, follow=100.0)
    return MotionProblem(motion.frames, frames, RATE, weights, reference={body: poses}, grounded=True)
