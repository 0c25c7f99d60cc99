"""One script for every host: read, paint, transfer, edit, pair, solve, key, undo, save, reopen; and the outcome.

Host-agnostic: memory, USD and Blender run it word for word and must give the same document and the same pose. What
may differ: keys of the host (up axis), and the last bits of positions, which hosts hold in single precision; so
surfaces are rounded to float32 before anything is painted on them.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset
from contact_core.document.schema import document_to_json
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import Pose, Rig
from contact_core.session import Session
from contact_core.solve.body import Body, PairedPoints
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import SolveOptions

FRAME = 12.0
PATCH_POINTS = 24


@dataclass(frozen=True)
class Outcome:
    """document: JSON text without poses and host keys. pose, keyed: local matrices by joint. skin: (n, 3) points
    of the solved pose, by the host's own evaluation; surface space of the rig. length: the rig's size. gap: mean
    distance of the paired points, first at rest and then solved, by length."""

    document: str
    pose: dict[str, FloatArray]
    keyed: dict[str, FloatArray]
    skin: FloatArray
    length: float
    keys: tuple[float, ...]
    revision: int
    gap: tuple[float, float]


def prepared(asset: Asset) -> Asset:
    """A rig as it goes to every host: in meters, in single precision, its joints free, bound in its rest pose.

    Skinning from another bind pose would let the weights, which each host rounds in its own way, into the surface.
    """
    rig = asset.rig
    assert rig is not None
    points = rig.surface.points.astype(np.float32)
    rig = replace(rig, bind_points=points, bind_world=rig.rest_world, meters_per_unit=1.0, up_axis="Y", name="hand")
    return Asset("hand", rig.surface, rig, meters_per_unit=1.0)


def build_scene(host: Any, hand: Asset, joint: str) -> None:
    """The rig, and a ball in front of the tip of a joint's skin."""
    assert hand.rig is not None
    tip, normal = _tip(hand.rig, joint)
    size = hand.mesh.bounding_box_diagonal
    radius = 0.12 * size
    world = np.eye(4)
    world[:3, 3] = np.float32(tip + normal * (radius + 0.02 * size))
    ball = Asset("ball", _ball(float(np.float32(radius))), meters_per_unit=1.0)
    host.add(hand, np.eye(4))
    host.add(ball, world)


def run(host: Any, joint: str, path: Path) -> Outcome:
    """The script. path: where to save; it is opened anew at the end and must hold the same."""
    ids = {item.name: item.id for item in host.objects()}
    rig_asset, thing = host.read_rig(ids["hand"]), host.read_surface(ids["ball"])
    rig, place = rig_asset.rig, host.placement(ids["ball"])
    session = Session(host=host, discover=False)
    hand = _add(session, "hand", rig_asset, host.placement(ids["hand"]))
    ball = _add(session, "ball", thing, place)

    patch, axis = _patch(rig, hand, joint)
    session.patches.paint("tip", patch, surface="hand", axis=axis)
    start = session.geometry.reconstruction("tip").points.positions(hand)[0]
    to_ball = np.linalg.inv(place) @ host.placement(ids["hand"])
    nearest = Locator(ball).closest((start @ to_ball[:3, :3].T + to_ball[:3, 3])[None]).points
    copy = session.patches.transfer("tip", "ball", nearest, heading=1.0 + 0.0j)
    session.patches.rotate(copy, 0.4)
    session.patches.rotate(copy, 3.0)  # a slip, taken back by the host's own undo
    assert host.undo()
    session.pairs.add("tip", copy)
    solution = _solve(session, rig, ball, place)
    with host.step("Solve and key"):
        session.surfaces.set_pose("hand", solution)
        host.write_pose(ids["hand"], solution, FRAME)
    after = session.revision
    session.undo()
    assert host.pose_keys(ids["hand"]) == () and "hand" not in session.document.poses
    session.redo()
    assert session.revision == after

    host.save(path)
    session.close()
    (pair,) = session.geometry.pairs()
    target = pair.object_points.positions(ball) @ place[:3, :3].T + place[:3, 3]
    return _outcome(type(host).open(path), ids, rig, session, pair.manipulator_points, target)


def _outcome(
    again: Any, ids: dict[str, str], rig: Rig, session: Session, points: SurfacePoints, target: FloatArray
) -> Outcome:
    """What the reopened file holds, which must be what the session had."""
    reopened = Session(host=again, discover=False)
    assert _comparable(reopened) == _comparable(session) and reopened.revision == session.revision
    pose = reopened.document.poses["hand"]
    skin = again.skin_points(ids["hand"], pose)
    shapes = (rig.surface, rig.surface.with_points(skin))
    gaps = [float(np.linalg.norm(points.positions(shape) - target, axis=1).mean()) for shape in shapes]
    length = rig.surface.bounding_box_diagonal
    return Outcome(
        document=_comparable(reopened),
        pose=_by_joint(pose),
        keyed=_by_joint(again.read_pose(ids["hand"], FRAME)),
        skin=skin,
        length=length,
        keys=again.pose_keys(ids["hand"]),
        revision=reopened.revision,
        gap=(gaps[0] / length, gaps[1] / length),
    )


def differences(ours: Outcome, theirs: Outcome) -> dict[str, float]:
    """Angles between solved rotations (rad), keyed and solved, and distance of skins by length; 0 when equal."""
    return {
        "documents": float(ours.document != theirs.document),
        "revisions": float(ours.revision != theirs.revision or ours.keys != theirs.keys),
        "solved rotations": _angle(ours.pose, theirs.pose),
        "keyed rotations": max(_angle(ours.pose, ours.keyed), _angle(theirs.pose, theirs.keyed)),
        "skins": float(np.abs(ours.skin - theirs.skin).max() / ours.length),
    }


LIMITS = {
    "documents": 0.0,
    "revisions": 0.0,
    "solved rotations": 1e-4,
    "keyed rotations": 1e-4,
    "skins": 1e-5,
}


def _add(session: Session, name: str, asset: Asset, place: FloatArray) -> TriangleMesh:
    """The surface in single precision, in the session; nothing to undo in the host but the document."""
    mesh = TriangleMesh(asset.mesh.points.astype(np.float32), asset.mesh.faces)
    session.surfaces.add(name, mesh, rig=asset.rig, world_from_surface=np.round(place, 5))
    return mesh


def _tip(rig: Rig, joint: str) -> tuple[FloatArray, FloatArray]:
    """Position and normal of the vertex that a joint moves most and that lies farthest from it."""
    weight = np.where(rig.skin_joints == rig.joint_index(joint), rig.skin_weights, 0.0).sum(axis=1)
    away = np.linalg.norm(rig.surface.points - rig.rest_world[rig.joint_index(joint), :3, 3], axis=1)
    vertex = int(np.argmax(np.where(weight > 0.6, away, -1.0)))
    return rig.surface.points[vertex], rig.surface.vertex_normals[vertex]


def _patch(rig: Rig, surface: TriangleMesh, joint: str) -> tuple[SurfacePoints, SurfacePoints]:
    """The vertices round the tip, and an axis of two of them."""
    tip, _ = _tip(rig, joint)
    count = min(PATCH_POINTS, len(surface.points) // 10)
    order = np.argsort(np.linalg.norm(surface.points - tip, axis=1), kind="stable")[:count]
    points = SurfacePoints.at_vertices(surface, order)
    return points, SurfacePoints.at_vertices(surface, order[[0, count // 2]])


def _solve(session: Session, rig: Rig, ball: TriangleMesh, place: FloatArray) -> Pose:
    (pair,) = session.geometry.pairs()
    problem = PoseProblem(
        bodies=(Body.skinned(rig, name="hand"), Body.rigid("ball", ball, world_from_surface=place)),
        contacts=(PairedPoints("tip", "hand", pair.manipulator_points, "ball", pair.object_points, pair.weights),),
    )
    options = SolveOptions(max_iterations=100, tolerance=1e-12, candidates=("current",))
    return LevenbergMarquardt().solve(problem, options).poses["hand"]


def _comparable(session: Session) -> str:
    """The document without what hosts name and round for themselves: poses, up axes, the keys of hosts."""
    data = document_to_json(session.document)
    data.pop("poses")
    data.pop("extras")
    for surface in data["surfaces"].values():
        surface.pop("up_axis")
    return json.dumps(data, sort_keys=True)


def _by_joint(pose: Pose) -> dict[str, FloatArray]:
    return dict(zip(pose.joints, pose.local, strict=True))


def _angle(ours: dict[str, FloatArray], theirs: dict[str, FloatArray]) -> float:
    """Largest angle between rotations of equal joints, radians."""
    assert set(ours) == set(theirs), (sorted(ours), sorted(theirs))
    worst = 0.0
    for name, matrix in ours.items():
        turn = np.linalg.solve(matrix[:3, :3], theirs[name][:3, :3])
        axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
        worst = max(worst, float(np.arctan2(np.linalg.norm(axis), np.trace(turn) - 1.0)))
    return worst


def _ball(radius: float) -> TriangleMesh:
    """An octahedron cut three times, in single precision."""
    points = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    faces = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    for _ in range(3):
        edges, edge_of = np.unique(
            np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)), axis=0, return_inverse=True
        )
        middle = points[edges].mean(axis=1)
        new = edge_of.reshape(-1, 3) + len(points)
        points = np.concatenate([points, middle / np.linalg.norm(middle, axis=1, keepdims=True)])
        a, b, c = faces.T
        ab, bc, ca = new.T
        faces = np.concatenate([np.c_[a, ab, ca], np.c_[ab, b, bc], np.c_[ca, bc, c], np.c_[ab, bc, ca]])
    return TriangleMesh((radius * points).astype(np.float32), faces)
