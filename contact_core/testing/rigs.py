"""Small rigs for laws about posing: skins of tubes, blended at the joints. numpy only, deterministic."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.chart import Chart
from contact_core.rig.rig import JointFreedom, Pose, Rig, skin
from contact_core.rig.rotations import exponential
from contact_core.solve.body import Body, PairedPoints, manipulator_length
from contact_core.solve.problem import PoseProblem
from contact_core.testing.meshes import grid_faces

Freedom = Callable[[int], JointFreedom]


def hand_like(freedom: Freedom | None = None) -> Rig:
    """57 dofs: a wrist that places all (6), two metacarpals, five fingers of three joints; 18 units long."""
    names, parents, starts, ends, radii = ["wrist"], [-1], [np.zeros(3)], [np.array([9.0, 0.0, 0.0])], [2.6]

    def add(name: str, parent: int, start: FloatArray, end: FloatArray, radius: float) -> int:
        names.append(name)
        parents.append(parent)
        starts.append(start)
        ends.append(end)
        radii.append(radius)
        return len(names) - 1

    for finger in range(5):
        z = 1.9 * (finger - 2)
        direction = np.array([0.7, 0.0, -0.7]) / 0.98995 if finger == 0 else np.array([1.0, 0.0, 0.0])
        at = np.array([2.5, 0.0, -3.2]) if finger == 0 else np.array([9.0, 0.0, z])
        parent = 0
        if finger in (3, 4):
            parent = add(f"finger{finger}_metacarpal", 0, np.array([3.0, 0.0, 0.6 * z]), at, 0.9)
        for segment, length in enumerate((4.0, 3.0, 2.0)):
            parent = add(f"finger{finger}_{segment}", parent, at, at + length * direction, 0.85 - 0.05 * segment)
            at = at + length * direction
    return _rig("hand-like", names, parents, starts, ends, radii, freedom)


def tentacle(joints: int = 21, freedom: Freedom | None = None) -> Rig:
    """A chain along x of `joints` ball joints, 66 dofs by default; two units a joint, tapering."""
    names = [f"link{i:02d}" for i in range(joints)]
    starts = [np.array([2.0 * i, 0.0, 0.0]) for i in range(joints)]
    ends = [start + np.array([2.0, 0.0, 0.0]) for start in starts]
    radii = list(np.linspace(1.2, 0.5, joints))
    return _rig("tentacle", names, list(range(-1, joints - 1)), starts, ends, radii, freedom)


def any_freedom(index: int) -> JointFreedom:
    """Every kind in turn: a ball root that translates, then limited hinges, Euler orders, framed balls, locks."""
    if index == 0:
        return JointFreedom("ball", translates=True)
    turn = np.array([[0.0, -1.0, 0.0], [0.6, 0.0, -0.8], [0.8, 0.0, 0.6]])
    kinds = (
        JointFreedom("hinge", frame=turn, lower=np.array([-0.3]), upper=np.array([1.4])),
        JointFreedom("euler", order="ZXY", lower=np.full(3, -0.7), upper=np.array([0.7, 0.5, 1.2])),
        JointFreedom("ball", frame=turn, prior_weight=np.array([10.0, 3.0, 0.3])),
        JointFreedom("euler", order="YZX", locked=np.array([True, False, False])),
        JointFreedom("ball", translates=True),
        JointFreedom("fixed"),
    )
    return kinds[(index - 1) % len(kinds)]


def limited_freedom(index: int) -> JointFreedom:
    """A free root and ball joints within 0.4, 0.5 and 1.3 radians: what planted poses are drawn from."""
    if index == 0:
        return JointFreedom("ball", translates=True)
    return JointFreedom("ball", lower=np.array([-0.4, -0.5, -1.3]), upper=np.array([0.4, 0.5, 1.3]))


def narrow_freedom(index: int) -> JointFreedom:
    """A free root and ball joints that hardly turn: what is reached with them is reached at their limits."""
    if index == 0:
        return JointFreedom("ball", translates=True)
    return JointFreedom("ball", lower=np.array([-0.05, -0.1, -1.0]), upper=np.array([0.05, 0.1, 0.1]))


def scattered_points(rig: Rig, count: int, seed: int) -> SurfacePoints:
    """`count` random points on the skin, by face."""
    random = np.random.default_rng(seed)
    return SurfacePoints(random.integers(0, len(rig.faces), count), random.dirichlet(np.ones(3), count))


def _rig(
    name: str,
    names: list[str],
    parents: list[int],
    starts: list[FloatArray],
    ends: list[FloatArray],
    radii: list[float],
    freedom: Freedom | None,
) -> Rig:
    """A tube per joint from start to end, its first quarter blended with the parent."""
    points, faces, joints, weights = [], [], [], []
    count = 0
    for j, (start, end) in enumerate(zip(starts, ends, strict=True)):
        ring, quads, along = _tube(start, end, radii[j])
        own = np.clip(0.5 + 2.0 * along, 0.0, 1.0) if parents[j] >= 0 else np.ones(len(ring))
        points.append(ring)
        faces.append(quads + count)
        joints.append(np.tile([j, max(parents[j], 0)], (len(ring), 1)))
        weights.append(np.stack([own, 1.0 - own], axis=1))
        count += len(ring)
    world = np.tile(np.eye(4), (len(names), 1, 1))
    world[:, :3, 3] = starts
    local = world.copy()
    for j, parent in enumerate(parents):
        if parent >= 0:
            local[j] = np.linalg.inv(world[parent]) @ world[j]
    give = freedom or (lambda index: JointFreedom("ball", translates=index == 0))
    return Rig(
        name=name,
        joints=tuple(names),
        parents=np.array(parents),
        rest_local=local,
        bind_world=world,
        bind_points=np.concatenate(points),
        faces=np.concatenate(faces),
        skin_joints=np.concatenate(joints),
        skin_weights=np.concatenate(weights),
        freedoms=tuple(give(j) for j in range(len(names))),
    )


def _tube(start: FloatArray, end: FloatArray, radius: float) -> tuple[FloatArray, IntArray, FloatArray]:
    """Points, outward faces and the share of the length (n,) of a tube in the plane y = 0."""
    rings, around = 6, 10
    axis = (end - start) / np.linalg.norm(end - start)
    up = np.array([0.0, 1.0, 0.0])
    side = np.cross(axis, up)
    along = np.linspace(0.0, 1.0, rings)
    angle = 2.0 * np.pi * np.arange(around) / around
    circle = np.cos(angle)[:, None] * up + np.sin(angle)[:, None] * side  # turns against the axis
    points = start + along[:, None, None] * (end - start) + radius * circle
    faces = grid_faces(rings, around, wrap_columns=True)[:, ::-1]
    return points.reshape(-1, 3), faces, np.repeat(along, around)


def planted(
    rig: Rig, seed: int, *, contacts: int = 300, spread: float = 0.6, reach: float = 1.0, movable: bool = False
) -> tuple[PoseProblem, FloatArray]:
    """A problem whose answer is known: the rig, far from a copy of its own skin in a random pose, and that theta.

    Angles are uniform within the limits and `spread` radians of rest; the copy stands up to `reach` manipulator
    lengths away and turned any way. The copy's faces are flipped, so that it is a hollow that the rig fits into.
    movable: the copy moves instead and the rig stays where it is posed.
    """
    random = np.random.default_rng(seed)
    chart = Chart(rig)
    theta = random.uniform(np.maximum(chart.lower, -spread), np.minimum(chart.upper, spread))
    turning = chart.is_root & ~chart.is_translation & (rig.parents[chart.joint_of_dof] < 0)
    theta[turning] = random.uniform(-1.0, 1.0, 3) * np.pi / np.sqrt(3.0)
    theta[chart.locked] = 0.0
    theta[chart.is_translation] = 0.0
    away = random.normal(0.0, 1.0, 3)
    away *= reach * manipulator_length(rig) * random.uniform() / np.linalg.norm(away)
    theta[chart.is_translation & (rig.parents[chart.joint_of_dof] < 0)] = away
    mold = TriangleMesh(skin(rig, chart.motion(theta).world), rig.faces[:, ::-1])
    points = scattered_points(rig, contacts, seed)
    pressed = SurfacePoints(points.faces, points.barycentric[:, ::-1])
    if movable:
        elsewhere = np.eye(4)
        elsewhere[:3, :3] = exponential(random.normal(0.0, 1.0, (1, 3)))[0][0]
        elsewhere[:3, 3] = random.normal(0.0, 10.0, 3)
        posed = Pose(rig.joints, chart.local(theta))
        bodies = (
            Body.skinned(rig, pose=posed),
            Body.rigid("mold", mold, world_from_surface=elsewhere, movable=True),
        )
        pairs = (PairedPoints("all", rig.name, points, "mold", pressed),)
        return PoseProblem(bodies, pairs, free={"mold": ["mold"]}), theta
    pairs = (PairedPoints("all", rig.name, points, "mold", pressed),)
    return PoseProblem((Body.skinned(rig), Body.rigid("mold", mold)), pairs), theta


def mean_gap(problem: PoseProblem, theta: FloatArray) -> float:
    """Mean distance of paired points at theta, as a share of the manipulator's length."""
    gap = problem.state(theta).vectors(problem.pairs.gap)
    return float(np.linalg.norm(gap, axis=1).mean() / problem.manipulator_length)
