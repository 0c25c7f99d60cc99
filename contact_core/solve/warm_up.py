"""Compile every kernel of geodesics and of the solve, or load it, before somebody waits for it."""

from __future__ import annotations

import time

import numpy as np

from contact_core.geometry import warm_up as geodesics
from contact_core.geometry.distance_field import DistanceField
from contact_core.rig.chart import Chart
from contact_core.rig.rig import JointFreedom, Rig
from contact_core.rig.skinning import joint_track


def warm_up() -> float:
    """One small call of every kernel, with the array types that real calls have; returns the seconds it took."""
    began = time.perf_counter()
    geodesics.warm_up()
    points, local = np.eye(3), np.tile(np.eye(4), (1, 1, 1))
    skin = np.zeros((3, 1), np.int64), np.ones((3, 1))
    rig = Rig(
        "one joint",
        ("joint",),
        np.array([-1]),
        local,
        local,
        points,
        np.array([[0, 1, 2]]),
        *skin,
        (JointFreedom("ball"),),
    )
    chart = Chart(rig)
    for leftover in (None, local):
        motion = chart.motion(np.zeros(chart.size), leftover)
    track = joint_track(np.zeros(3, np.int64), points)
    carrier = motion.world[:, :3].transpose(0, 2, 1).reshape(-1, 3)
    track.gathered_by_bones(track.carried(carrier) + track.times(carrier))
    track.gram(np.ones(3))
    DistanceField(np.zeros(3), 1.0, np.zeros((2, 2, 2))).sample(points)
    return time.perf_counter() - began
