"""Figures of motions that are known, and contacts found in animations that are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from contact_core.errors import Cancelled, InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.motion.detection import DetectionOptions, detect_contacts
from contact_core.motion.problem import MotionProblem
from contact_core.motion.reduction import reduce_poses
from contact_core.motion.report import motion_report
from contact_core.motion.solving import solve_motion
from contact_core.progress import CallbackProgress
from contact_core.rig.rig import Pose
from contact_core.solve.body import Body
from contact_core.testing import meshes, rigs
from contact_core.testing.motions import molded

RATE = 24.0


def still_in_a_moving_mold(step: float = 0.05) -> tuple[MotionProblem, np.ndarray]:
    """A tentacle that stays while its mold slides away at an even speed."""
    motion = molded(0.5, degrees=0.0, travel=0.0)
    problems = []
    for row, problem in enumerate(motion.problems):
        placed = np.eye(4)
        placed[0, 3] = step * row
        problems.append(
            replace(problem, bodies=(problem.bodies[0], replace(problem.bodies[1], world_from_rig=placed)))
        )
    theta = solve_motion(motion).thetas[0]
    return replace(motion, problems=tuple(problems)), np.tile(theta, (len(problems), 1))


def test_skate_is_the_speed_over_the_object() -> None:
    motion, thetas = still_in_a_moving_mold()
    report = motion_report(motion, thetas, solids={})
    (pair,) = report.pairs.values()
    assert pair.frames == len(thetas)
    assert pair.skate_max == pytest.approx(0.05 * RATE)
    assert pair.skate_rms == pytest.approx(0.05 * RATE)
    assert pair.worst_frame == motion.frames[-1]
    assert pair.worst >= pair.mean
    assert (report.largest_step, report.jerk_rms, report.pad_acceleration, report.joint_acceleration) == (
        0,
        0,
        0,
        0,
    )


def test_what_rides_along_does_not_skate() -> None:
    solution = solve_motion(molded(1.0, degrees=200.0))
    report = motion_report(solution.motion, solution.thetas, solids={})
    assert max(pair.skate_max for pair in report.pairs.values()) < 0.02 * report.largest_step * RATE
    assert report.pop < 1.2
    reductions = {"tentacle": reduce_poses(
        solution.motion.problems[0].bodies[0].rig, solution.motion.frames, solution.poses("tentacle"), tolerance=0.1
    )}  # fmt: skip
    keyed = motion_report(solution.motion, solution.thetas, solids={}, reductions=reductions)
    assert 2 < keyed.keys["tentacle"] < len(solution.thetas)
    assert 0.0 < keyed.key_error["tentacle"] <= 0.1


def test_a_pop_and_a_jolt_are_seen() -> None:
    motion, thetas = still_in_a_moving_mold(0.0)
    root = np.flatnonzero(motion.problems[0].is_root & motion.problems[0].is_translation)
    hinge = np.flatnonzero(~motion.problems[0].is_root)[0]
    popped = thetas.copy()
    popped[5:, root[0]] += 2.0
    report = motion_report(motion, popped, solids={})
    assert report.largest_step == pytest.approx(2.0)
    assert report.step_frame == motion.frames[5]
    assert report.pop == np.inf
    jolted = thetas.copy()
    jolted[5, hinge] += 0.1
    assert motion_report(motion, jolted, solids={}).joint_acceleration == pytest.approx(0.2 * RATE**2)
    falling = thetas.copy()
    falling[:, root[1]] += 0.5 * 3.0 * (np.arange(len(thetas)) / RATE) ** 2
    assert motion_report(motion, falling, solids={}).pad_acceleration == pytest.approx(3.0, rel=1e-6)
    jerked = thetas.copy()
    jerked[:, root[1]] += 7.0 / 6.0 * (np.arange(len(thetas)) / RATE) ** 3
    assert motion_report(motion, jerked, solids={}).jerk_rms == pytest.approx(7.0, rel=1e-6)


def test_depth_is_told_apart_while_held_and_on_the_way() -> None:
    motion, thetas = still_in_a_moving_mold(0.0)
    rig = motion.problems[0].bodies[0].rig
    ball = meshes.icosphere(3, 3.0)
    tip = motion.problems[0].state(thetas[0]).world[len(rig.joints) - 1, :3, 3]
    problems = []
    for row, problem in enumerate(motion.problems):
        placed = np.eye(4)
        placed[:3, 3] = tip + np.array([0.0, 0.0, 100.0 if row < 3 else 0.0])
        gain = 0.0 if row >= 8 else 1.0
        contacts = tuple(replace(c, gain=gain) for c in problem.contacts)
        mold = Body.rigid("ball", ball, world_from_surface=placed)
        problems.append(replace(problem, bodies=(*problem.bodies, mold), contacts=contacts))
    far, near = (
        replace(motion, problems=tuple(problems[:3] * 4 + problems[:1])),
        replace(motion, problems=tuple(problems)),
    )
    solids = {"ball": (ball,)}
    assert motion_report(far, thetas, solids=solids).penetration_held == 0.0
    report = motion_report(near, thetas, solids=solids)
    assert report.penetration_held == report.penetration_transit
    assert 2.0 < report.penetration_held <= 3.0  # skin of half a unit round the centre of a ball of three
    with pytest.raises(InvalidInput, match="shape"):
        motion_report(motion, thetas[:3])


# --- detection ----------------------------------------------------------------------------------------------

RIG = rigs.tentacle(3)
LOW = float(RIG.surface.points[:, 1].min())


def visiting(noise: float = 0.0, slide: float = 0.0) -> tuple[list[Pose], np.ndarray, np.ndarray]:
    """A tentacle comes down onto a moving floor in 20 frames, rests on it for 30, slides or not, and leaves."""
    random = np.random.default_rng(0)
    poses, placed = [], []
    for frame in range(71):
        height = max(0.25 * (20 - frame), 0.0, 0.25 * (frame - 50))
        carried = np.array([0.3 * frame, 0.0, 0.1 * frame])  # the floor travels, and the tentacle with it
        local = RIG.rest_local.copy()
        over_floor = np.array([slide * max(frame - 20, 0), height, 0.0])
        local[0, :3, 3] += carried + over_floor + random.normal(0.0, noise, 3)
        poses.append(Pose(RIG.joints, local))
        floor = np.eye(4)
        floor[:3, 3] = -carried
        placed.append(floor)
    return poses, np.array(placed), np.arange(71.0)


def floor_below() -> TriangleMesh:
    plane = meshes.plane(24, 60.0)
    flat = plane.points[:, [0, 2, 1]] + [0.0, LOW - plane.points[:, 2].max(), 0.0]
    return TriangleMesh(flat, plane.faces[:, ::-1])


FLOOR = floor_below()
THIN = DetectionOptions(near=0.04, far=0.08)  # of a rig five times as thick for its length as a body


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_contact_is_found_where_it_was_put(noise: float) -> None:
    poses, placed, frames = visiting(noise)
    spans = detect_contacts(RIG, frames, poses, FLOOR, placed, options=THIN)
    assert "link00" in {span.joint for span in spans}
    first = next(span for span in spans if span.joint == "link00")
    assert len([span for span in spans if span.joint == "link00"]) == 1  # noise does not cut it up
    assert abs(first.on - 20.0) <= 3.0
    assert abs(first.off - 50.0) <= 3.0
    assert first.distance < 0.2
    touching = RIG.surface.points[first.vertices]
    assert (touching[:, 1] < LOW + 0.3).all()
    where = first.object_points.positions(FLOOR)
    assert np.abs(where[:, [0, 2]] - touching[:, [0, 2]]).max() < 0.5


def test_what_slides_or_passes_is_no_contact() -> None:
    poses, placed, frames = visiting(slide=0.2)
    slipping = detect_contacts(RIG, frames, poses, FLOOR, placed, options=THIN)
    assert not [span for span in slipping if span.off > 24.0]
    far = placed.copy()
    far[:, 1, 3] += 5.0
    poses, _, frames = visiting()
    assert detect_contacts(RIG, frames, poses, FLOOR, far, options=THIN) == ()
    brief = replace(THIN, shortest=10.0)
    assert detect_contacts(RIG, frames, poses, FLOOR, placed, options=brief) == ()


def test_hysteresis_keeps_what_one_threshold_would_cut() -> None:
    poses, placed, frames = visiting(0.06)
    options = DetectionOptions(near=0.03, far=0.06, slow=0.15, fast=1.5, bridge=1e-9)
    sharp = replace(options, far=options.near, fast=options.slow)
    counts = [
        len([s for s in detect_contacts(RIG, frames, poses, FLOOR, placed, options=o) if s.joint == "link00"])
        for o in (options, sharp)
    ]
    assert counts[0] == 1
    assert counts[1] != 1


def test_detection_refuses_and_cancels() -> None:
    poses, placed, frames = visiting()
    with pytest.raises(InvalidInput, match="placement"):
        detect_contacts(RIG, frames, poses, FLOOR, placed[:4])
    with pytest.raises(InvalidInput, match="near <= far"):
        DetectionOptions(near=0.3)
    assert detect_contacts(RIG, [], [], FLOOR, np.zeros((0, 4, 4))) == ()

    def cancel(*_: object) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        detect_contacts(RIG, frames, poses, FLOOR, placed, progress=CallbackProgress(cancel))
