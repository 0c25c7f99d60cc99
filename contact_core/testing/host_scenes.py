"""The scene that a host under test opens: made natively by its fixture, with known volumes, areas and poses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from contact_core.arrays import FloatArray, IntArray
from contact_core.rig.rig import JointFreedom, Pose, Rig, forward_kinematics
from contact_core.scene.host import SceneSpace

FINGERS = ("wrist", "thumb")  # joints of `arm_rig` that both its instances have in a group "fingers"


@dataclass(frozen=True, eq=False)
class SceneMesh:
    """A polygon mesh to make in the host. parent_from_local: (4, 4), relative to `parent` (the world for None).
    selections: vertices to select under a name, where the host has named selections or vertex groups."""

    name: str
    points: FloatArray
    face_sizes: IntArray
    face_indices: IntArray
    parent_from_local: FloatArray = field(default_factory=lambda: np.eye(4))
    parent: str | None = None
    selections: Mapping[str, tuple[int, ...]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class SceneRig:
    """A skinned rig to make in the host, bound in its rest pose. world_from_local: (4, 4). groups: joints to put
    together under a name, where the host has groups or collections of bones."""

    name: str
    rig: Rig
    world_from_local: FloatArray = field(default_factory=lambda: np.eye(4))
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class HostScene:
    """What the fixture makes, in this order."""

    space: SceneSpace
    meshes: tuple[SceneMesh, ...] = ()
    rigs: tuple[SceneRig, ...] = ()

    def world_of(self, name: str) -> FloatArray:
        """(4, 4) world_from_local of a mesh or rig."""
        for rig in self.rigs:
            if rig.name == name:
                return rig.world_from_local
        mesh = next(mesh for mesh in self.meshes if mesh.name == name)
        above = np.eye(4) if mesh.parent is None else self.world_of(mesh.parent)
        return above @ mesh.parent_from_local


def contract_scene(space: SceneSpace) -> HostScene:
    """Meshes plain, polygonal, moved, scaled, mirrored and parented; a rig as it is and one scaled and turned."""
    triangles = octahedron()
    step = step_prism()
    moved = affine((0.3, -0.8, 0.4), (1.0, 1.0, 1.0), (5.0, -2.0, 1.0))
    rig, groups = arm_rig(), {"fingers": FINGERS}
    return HostScene(
        space,
        meshes=(
            SceneMesh("plain", *triangles),
            SceneMesh("step", *step, selections={"grip": (1, 7, 4)}),
            SceneMesh("moved", *step, moved),
            SceneMesh("scaled", *step, affine((0.0, 0.9, -0.5), (2.0, 3.0, 0.5), (0.0, 8.0, 0.0))),
            SceneMesh("mirrored", *step, affine((0.7, 0.1, 0.2), (-1.5, 1.5, 1.5), (0.0, 0.0, 6.0))),
            SceneMesh("child", *triangles, affine((0.0, 0.0, 0.5), (0.5, 0.5, 0.5), (0.0, 3.0, 0.0)), "moved"),
        ),
        rigs=(
            SceneRig("arm", rig, affine((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (-4.0, 0.0, 0.0)), groups),
            SceneRig("half_arm", rig, affine((0.4, 0.0, 1.0), (0.5, 0.5, 0.5), (-8.0, 1.0, 0.0)), groups),
        ),
    )


def affine(angles: Any, scale: Any, shift: Any) -> FloatArray:
    """(4, 4) shift @ turn about x, y, z (radians) @ scale."""
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_euler("xyz", angles).as_matrix() * np.asarray(scale, float)
    matrix[:3, 3] = shift
    return matrix


def octahedron() -> tuple[FloatArray, IntArray, IntArray]:
    """A lopsided octahedron: 8 triangles, no symmetry that could hide a wrong order."""
    points = np.array([[1, 0, 0], [-2, 0, 0], [0, 1.5, 0], [0, -1, 0], [0, 0, 2.5], [0, 0, -0.5]])
    faces = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    return points, np.full(8, 3), faces.ravel()


STEP_AREA, STEP_VOLUME = 14.0, 3.0


def step_prism() -> tuple[FloatArray, IntArray, IntArray]:
    """A step (an L pushed up by 1): two concave hexagons and six quads; area 14, volume 3, normals outward."""
    outline = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], float)  # counter-clockwise
    points = np.concatenate([np.c_[outline, np.zeros(6)], np.c_[outline, np.ones(6)]])
    sides = [[k, (k + 1) % 6, 6 + (k + 1) % 6, 6 + k] for k in range(6)]
    indices = [*range(5, -1, -1), *range(6, 12), *np.ravel(sides).tolist()]
    return points, np.array([6, 6, *[4] * 6]), np.array(indices)


def arm_rig() -> Rig:
    """A tube along y with a chain of three joints and a thumb beside it; turned rest frames, blended weights."""
    joints = ("shoulder", "elbow", "wrist", "thumb")
    parents = np.array([-1, 0, 1, 1])
    local = np.stack(
        [
            affine((0.2, 0.0, 0.0), (1, 1, 1), (0.0, 0.0, 0.0)),
            affine((-0.3, 0.4, 0.0), (1, 1, 1), (0.0, 1.0, 0.0)),
            affine((0.1, 0.0, 0.2), (1, 1, 1), (0.0, 1.0, 0.0)),
            affine((0.0, 0.0, -0.9), (1, 1, 1), (0.0, 0.5, 0.0)),
        ]
    )
    sides, rings = 5, 7
    turn = 2 * np.pi * np.arange(sides) / sides
    ring = np.c_[0.3 * np.cos(turn), np.zeros(sides), -0.3 * np.sin(turn)]  # outward for a tube up y
    points = np.concatenate([np.add(ring, [0.0, 3.0 * k / (rings - 1), 0.0]) for k in range(rings)])
    corner = np.arange(sides)
    quads = [
        np.c_[corner, (corner + 1) % sides, (corner + 1) % sides + sides, corner + sides] + k * sides
        for k in range(rings - 1)
    ]
    faces = np.concatenate([np.concatenate([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]]) for quad in quads])
    height = np.repeat(np.linspace(0.0, 2.999, rings), sides)
    upper = np.minimum(height.astype(int), 1) + 1  # elbow, then wrist
    blend = np.clip(height - np.minimum(height.astype(int), 1), 0.0, 1.0)
    thumb = 0.25 * (points[:, 0] > 0.2)
    weights = np.stack([(1 - blend) * (1 - thumb), blend * (1 - thumb), thumb], axis=1)  # (n, 3)
    return Rig(
        name="arm",
        joints=joints,
        parents=parents,
        rest_local=local,
        bind_world=forward_kinematics(parents, local),
        bind_points=np.round(points * 1024) / 1024,  # the same in single precision
        faces=faces,
        skin_joints=np.stack([upper - 1, upper, np.full(len(points), 3)], axis=1),
        skin_weights=weights,
        freedoms=(JointFreedom(),) * 4,
    )


def bent(rig: Rig, seed: int) -> Pose:
    """A pose well away from rest: every joint turned about a random axis by up to 1.2 rad, roots shifted."""
    rng = np.random.default_rng(seed)
    local = np.array(rig.rest_local)
    for k, parent in enumerate(rig.parents):
        local[k, :3, :3] = local[k, :3, :3] @ Rotation.from_rotvec(rng.uniform(-0.7, 0.7, 3)).as_matrix()
        local[k, :3, 3] += 0.3 * rng.normal(size=3) if parent < 0 else 0.0
    return Pose(rig.joints, local)
