"""Motion: contacts over time on built-in samples, each with what is wanted of it.

    python benchmarks/bench_motion.py [--quick]

--quick leaves out the body and the long flights. Times are processor time, which other processes hardly change.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from harness import record
from motion_scenes import RATE, ball_grip, baseball, growing, reach, regrasping, sitting, skating

from contact_core.arrays import FloatArray
from contact_core.motion.problem import MotionProblem
from contact_core.motion.reduction import reduce_poses
from contact_core.motion.report import motion_report
from contact_core.motion.solving import MotionSolution, solve_motion
from contact_core.proposals.motion import held_vertices
from contact_core.rig.rig import Pose, skin

MM = 1e3


def timed(motion: MotionProblem, **more: Any) -> tuple[MotionSolution, float]:
    """The solution, and the milliseconds per frame."""
    began = time.process_time()
    solution = solve_motion(motion, **more)
    return solution, 1e3 * (time.process_time() - began) / len(motion.frames)


def inner(motion: MotionProblem) -> FloatArray:
    """(d,) the angles of joints, root apart."""
    problem = motion.problems[0]
    return ~problem.is_root & ~problem.is_translation


def flight(degrees: float) -> dict[str, Any]:
    """The hand on the ball that flies and turns."""
    motion = baseball(120, degrees)
    solution, ms = timed(motion)
    report, causal = (motion_report(motion, t, solids={}) for t in (solution.thetas, solution.causal))
    gaps = [np.mean([pair.mean for pair in r.pairs.values()]) for r in (report, causal)]
    skate = max(pair.skate_max for pair in report.pairs.values()) / RATE
    name = f"baseball, {degrees:g} degrees: "
    return {
        name + "gap over per-frame optimum (<= 1.1)": float(gaps[0] / gaps[1]),
        name + "gap, mm": float(MM * gaps[0]),
        name + "skate max, mm/frame (<= 0.045)": MM * skate,
        name + "joint acceleration max, degrees/frame^2 (<= 0.07)": float(
            np.degrees(report.joint_acceleration) / RATE**2
        ),
        name + "pop (largest step over its neighbours)": report.pop,
        name + f"ms a frame in all, d = {motion.pinned.shape[1]} (<= 30)": ms,
        name + "iterations": solution.iterations,
    }


def lengths(counts: tuple[int, ...]) -> dict[str, Any]:
    """The same flight in more frames."""
    rows: dict[str, Any] = {}
    for count in counts:
        motion = baseball(count, 90.0)
        solution, ms = timed(motion)
        rows[f"{count} frames: ms a frame; evaluations and models a frame"] = (
            f"{ms:.1f}; {solution.evaluations / count:.1f}, {solution.models / count:.1f}"
        )
    return rows


def reaching() -> dict[str, Any]:
    """Reach, grasp, hold, let go."""
    motion = reach()
    solution, ms = timed(motion)
    problem = motion.problems[0]
    root = problem.is_root & problem.is_translation
    away = solution.thetas[:, root] - solution.thetas[len(solution.thetas) // 2, root]
    far = float(np.linalg.norm(away, axis=1).max())
    frames = 0.35 * (len(solution.thetas) - 1)  # until the contacts begin
    steps, pops = (
        float(np.linalg.norm(np.diff(thetas[:, root], axis=0), axis=1).max())
        for thetas in (solution.thetas, solution.causal)
    )
    report = motion_report(motion, solution.thetas)
    length = problem.manipulator_length
    return {
        "reach: largest step over a minimum-jerk reach of that length (<= 1.6)": steps / (1.875 * far / frames),
        "reach: largest step, mm; frame by frame": f"{MM * steps:.1f}; {MM * pops:.1f} of {MM * far:.0f}",
        "reach: penetration in transit, % of the hand (<= 0.3)": 100.0 * report.penetration_transit / length,
        "reach: penetration while held, % of the hand": 100.0 * report.penetration_held / length,
        "reach: gap while held, mm": MM * float(np.mean([pair.mean for pair in report.pairs.values()])),
        "reach: ms a frame": ms,
    }


def grips() -> dict[str, Any]:
    """Knuckleball, two-seam, curveball: the fingers regrasp one after another."""
    motion = regrasping()
    solution, ms = timed(motion)
    report, alone = (motion_report(motion, t) for t in (solution.thetas, solution.causal))
    errors = [np.mean([pair.mean for pair in r.pairs.values()]) for r in (report, alone)]
    hand, length = motion.problems[0].bodies[0], motion.problems[0].manipulator_length
    keys = reduce_poses(hand.rig, motion.frames, solution.poses(hand.name))
    steps, deep = (
        [r.largest_step for r in (report, alone)],
        max(report.penetration_held, report.penetration_transit),
    )
    return {
        "regrasps: pop of the joint solve; frame by frame": f"{report.pop:.2f}; {alone.pop:.2f}",
        "regrasps: largest step, mm; frame by frame": "; ".join(f"{MM * step:.1f}" for step in steps),
        "regrasps: gap while held over per-frame optimum": float(errors[0] / errors[1]),
        "regrasps: gap while held, mm": float(MM * errors[0]),
        "regrasps: skate while held, max, mm/frame": MM * max(p.skate_max for p in report.pairs.values()) / RATE,
        "regrasps: penetration, % of the hand": 100.0 * deep / length,
        f"regrasps: {len(motion.frames)} frames to cubic keys": len(keys.keys.frames),
        "regrasps: ms a frame": ms,
    }


def sphere() -> dict[str, Any]:
    """The ball grows under the grip."""
    motion = growing()
    solution, ms = timed(motion)
    report = motion_report(motion, solution.thetas, solids={})
    return {
        "growing ball, 73 frames: seconds in all": ms * len(motion.frames) / 1e3,
        "growing ball: gap mean, worst frame, mm": f"{MM * np.mean([p.mean for p in report.pairs.values()]):.2f},"
        f" {MM * max(p.worst for p in report.pairs.values()):.2f}",
        "growing ball: pop": report.pop,
    }


def sitting_down(leaning: bool = False) -> tuple[dict[str, Any], MotionSolution]:
    """The body sits down and stands up, its back upright or leaning forward to keep its balance."""
    motion, title = sitting(leaning=leaning), "sitting, leaning" if leaning else "sitting"
    solution, ms = timed(motion)
    report = motion_report(motion, solution.thetas)
    problem = motion.problems[0]
    size = problem.manipulator_length
    hips = [problem.bodies[0].rig.joints.index("hips")]
    places = np.array(
        [p.state(t).world[hips[0], :3, 3] for p, t in zip(motion.posed, solution.thetas, strict=True)]
    )
    feet = [pair for name, pair in report.pairs.items() if name.startswith("foot")]
    seat = [pair for name, pair in report.pairs.items() if name.startswith("seat")]
    return {
        f"{title}: skate of the feet max, mm/frame (<= 0.15)": MM * max(pair.skate_max for pair in feet) / RATE,
        f"{title}: hips' largest step, mm (<= 30)": MM
        * float(np.linalg.norm(np.diff(places, axis=0), axis=1).max()),
        f"{title}: seat error, % of the body (<= 1)": 100.0 * float(np.mean([pair.mean for pair in seat])) / size,
        f"{title}: penetration held, % of the body (<= 1)": 100.0 * report.penetration_held / size,
        f"{title}: ms a frame, d = {motion.pinned.shape[1]}": ms,
    }, solution


def repairing(seated: MotionSolution) -> dict[str, Any]:
    """Skate put into a clip, and taken out again."""
    motion, clip, truth = skating(seated)
    solution, ms = timed(motion, start=clip)
    before, after, true = (motion_report(motion, thetas, solids={}) for thetas in (clip, solution.thetas, truth))
    skates = [max(pair.skate_max for pair in r.pairs.values()) / RATE for r in (before, after, true)]
    rms = [max(pair.skate_rms for pair in r.pairs.values()) / RATE for r in (before, after)]
    rig = motion.problems[0].bodies[0].rig

    def off(thetas: FloatArray) -> float:
        distances = []
        for problem, one, two in zip(motion.problems, thetas, truth, strict=True):
            both = (skin(rig, problem.state(theta).motions[0].world) for theta in (one, two))
            distances.append(np.linalg.norm(np.subtract(*both), axis=1).mean())
        return MM * float(np.mean(distances))

    return {
        "repair: skate max before, after, in truth, mm/frame": ", ".join(f"{MM * s:.2f}" for s in skates),
        "repair: skate down by (>= 10), rms": rms[0] / rms[1],
        "repair: skin off the truth before, after, mm mean (<= 2)": f"{off(clip):.2f}, {off(solution.thetas):.2f}",
        "repair: ms a frame": ms,
    }


def keying() -> dict[str, Any]:
    """120 frames to keys, and a dragged key."""
    motion = baseball(120, 90.0)
    solution, _ = timed(motion)
    body = next(
        b.name for b, free in zip(ball_grip().bodies, motion.problems[0].free_of_body, strict=True) if len(free)
    )
    rig = motion.problems[0].bodies[motion.problems[0].body_index(body)].rig
    poses = solution.poses(body)
    rows: dict[str, Any] = {}
    kinds: tuple[Literal["cubic", "linear"], ...] = ("cubic", "linear")
    for kind in kinds:
        began = time.process_time()
        done = reduce_poses(rig, motion.frames, poses, interpolation=kind)
        seconds = time.process_time() - began
        rows[f"120 frames to {kind} keys at 1 mm{' (<= 12)' if kind == 'cubic' else ''}: keys; skin mm; s"] = (
            f"{len(done.keys.frames)}; {MM * rig.meters_per_unit * done.error:.2f}; {seconds:.2f}"
        )
    held = held_vertices(motion, body, len(rig.faces))
    done = reduce_poses(rig, motion.frames, poses, held=held)
    at_frames = zip(motion.posed, motion.frames, strict=True)
    keyed = np.array([problem.theta_of({body: done.keys.at(rig, frame)}) for problem, frame in at_frames])
    skate = max(pair.skate_max for pair in motion_report(motion, keyed, solids={}).pairs.values()) / RATE
    rows["120 frames to cubic keys, contacts within 0.1 mm (<= 12): keys; skate max, mm/frame"] = (
        f"{len(done.keys.frames)}; {MM * skate:.3f}"
    )
    window = slice(30, 82)  # two seconds, and two pinned frames on either side
    pins = {f: {body: solution.by_frame[int(f)][body]} for f in (*motion.frames[30:32], *motion.frames[80:82])}
    local = solution.by_frame[55][body].local.copy()
    local[0, :3, 3] += 0.005 / rig.meters_per_unit
    pins[55.0] = {body: Pose(rig.joints, local)}
    dragged = replace(motion, frames=motion.frames[window], problems=motion.problems[window], pins=pins)
    began = time.process_time()
    solve_motion(dragged, start=solution.thetas[window])
    rows["a dragged key, 2 s of film solved again, s (<= 1)"] = time.process_time() - began
    return rows


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    quick = parser.parse_args().quick
    timed(baseball(4))  # compiles and warms
    rows = flight(90.0) | flight(300.0) | reaching() | grips() | sphere() | keying()
    rows |= lengths((30, 60) if quick else (30, 60, 120, 240, 480))
    if not quick:
        seated, truth = sitting_down()
        rows |= seated | sitting_down(leaning=True)[0] | repairing(truth)
    record("motion", rows)
