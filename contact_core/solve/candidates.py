"""Where a solve may start from: the pose as it is, and rigid fits of the manipulator onto its contacts.

The paper's solver "struggles with large wrist movement". The paired points themselves say where the wrist
belongs: the weighted rigid fit (Kabsch 1976) of the posed manipulator points to their partners, with or
without the normals as further directions to fit.
"""

from __future__ import annotations

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.rig.rig import Pose
from contact_core.solve.problem import PoseProblem


def starting_thetas(problem: PoseProblem, names: tuple[str, ...]) -> dict[str, FloatArray]:
    """theta (d,) per candidate; fits are left out where no root is wholly free or nothing is paired with it."""
    result: dict[str, FloatArray] = {}
    if "current" in names:
        result["current"] = problem.start
    for name, with_normals in (("positions", False), ("normals", True)):
        if name in names:
            theta = fitted(problem, problem.start, with_normals=with_normals)
            if theta is not None:
                result[name] = theta
    return result or {"current": problem.start}


def fitted(problem: PoseProblem, theta: FloatArray, *, with_normals: bool) -> FloatArray | None:
    """theta with the root of the first wholly free body moved to the rigid fit of its contacts, else None."""
    for index in range(len(problem.bodies)):
        joint = free_root(problem, index)
        if joint is not None:
            moved = _fit_body(problem, theta, index, joint, with_normals)
            if moved is not None:
                return moved
    return None


def free_root(problem: PoseProblem, index: int) -> int | None:
    """The root joint of a body if a solve may place it by all six dofs, else None."""
    chart = problem.charts[index]
    free = np.zeros(chart.size, bool)
    free[problem.free_of_body[index]] = True
    for joint in np.flatnonzero(chart.rig.parents < 0):
        freedom = chart.rig.freedoms[joint]
        placed = freedom.translates and freedom.kind in ("ball", "euler")
        if placed and free[chart.joint_of_dof == joint].all():
            return int(joint)
    return None


def _fit_body(
    problem: PoseProblem, theta: FloatArray, index: int, joint: int, with_normals: bool
) -> FloatArray | None:
    if not problem.contacts:
        return None
    sources, targets, source_normals, target_normals, weights = _ends(problem, theta, problem.bodies[index].name)
    if weights.sum() <= 0.0:
        return None
    world_move = rigid_fit(
        sources, targets, weights,
        (source_normals, -target_normals, problem.unit) if with_normals else None,
    )  # fmt: skip
    body, poses = problem.bodies[index], problem.poses(theta)
    local = poses[body.name].local.copy()
    local[joint] = np.linalg.inv(body.world_from_rig) @ world_move @ body.world_from_rig @ local[joint]
    return problem.theta_of({**poses, body.name: Pose(body.rig.joints, local)})


def _ends(
    problem: PoseProblem, theta: FloatArray, body: str
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """World points, then normals, of all contacts, those of `body` first; weights (k,), 0 where not its own."""
    state, pairs = problem.state(theta), problem.pairs
    mine = np.concatenate([np.full(len(c.weights), c.manipulator == body) for c in problem.contacts])
    other = np.concatenate([np.full(len(c.weights), c.object == body) for c in problem.contacts])
    between = mine != other  # a contact of the body with itself does not say where it belongs
    flipped = (other & between)[:, None]
    first, second = state.vectors(pairs.manipulator_points), state.vectors(pairs.object_points)
    first_normal, second_normal = (
        vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)
        for vectors in (state.vectors(pairs.manipulator_normals), state.vectors(pairs.object_normals))
    )
    return (
        np.where(flipped, second, first),
        np.where(flipped, first, second),
        np.where(flipped, second_normal, first_normal),
        np.where(flipped, first_normal, second_normal),
        np.where(between, pairs.weights, 0.0),
    )


def rigid_fit(
    sources: FloatArray,
    targets: FloatArray,
    weights: FloatArray,
    directions: tuple[FloatArray, FloatArray, float] | None = None,
) -> FloatArray:
    """(4, 4) the rigid motion that brings sources (k, 3) nearest to targets (k, 3) in weighted least squares.

    directions: (source unit vectors, target unit vectors, length): also turn these onto each other, counting
    a unit vector like a lever of that length.
    """
    w = weights / weights.sum()
    source_mean, target_mean = w @ sources, w @ targets
    covariance = (targets - target_mean).T @ (w[:, None] * (sources - source_mean))  # (3, 3)
    if directions is not None:
        source_directions, target_directions, length = directions
        covariance = covariance + length**2 * target_directions.T @ (w[:, None] * source_directions)
    u, _, vt = np.linalg.svd(covariance)
    rotation = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    motion = np.eye(4)
    motion[:3, :3] = rotation
    motion[:3, 3] = target_mean - rotation @ source_mean
    return motion
