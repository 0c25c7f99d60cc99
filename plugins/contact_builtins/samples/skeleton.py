"""Joint trees from positions and directions, the way a rigger draws them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.rig.rig import JointFreedom, Rig


@dataclass(frozen=True, eq=False)
class Bone:
    """A joint and the bone that starts there. position, along, palmar: (3,) in rig space; parent: a name or ''."""

    name: str
    parent: str
    position: Any
    along: Any
    palmar: Any
    freedom: JointFreedom

    @property
    def world(self) -> FloatArray:
        """(4, 4) world_from_joint: x along the bone, y towards the palm side, z = x cross y the flexion axis."""
        frame = np.eye(4)
        frame[:3, :3] = bone_frame(self.along, self.palmar)
        frame[:3, 3] = self.position
        return frame


def bone_frame(along: Any, palmar: Any) -> FloatArray:
    """(3, 3) columns: x along, y the part of palmar across it, z = x cross y."""
    x = np.asarray(along, float) / np.linalg.norm(along)
    y = np.asarray(palmar, float) - (np.asarray(palmar, float) @ x) * x
    y = y / np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)], axis=1)


def limits(twist: float, spread: float, flex_from: float, flex_to: float) -> JointFreedom:
    """Euler freedom in the joint's own frame, degrees: +-twist about x, +-spread about y, flexion about z."""
    return JointFreedom(
        kind="euler",
        lower=np.radians([-twist, -spread, flex_from]),
        upper=np.radians([twist, spread, flex_to]),
    )


def fixed() -> JointFreedom:
    return JointFreedom(kind="fixed")


def root() -> JointFreedom:
    """Six free dofs: a ball joint that translates."""
    return JointFreedom(kind="ball", translates=True)


def rig_of(
    name: str, bones: list[Bone], mesh: TriangleMesh, skin_joints: IntArray, skin_weights: FloatArray
) -> Rig:
    """A rig bound in its rest pose. Parents come before children in `bones`."""
    index = {bone.name: i for i, bone in enumerate(bones)}
    parents = np.array([index[bone.parent] if bone.parent else -1 for bone in bones])
    world = np.stack([bone.world for bone in bones])
    local = np.stack([np.linalg.inv(world[p]) @ w if p >= 0 else w for p, w in zip(parents, world, strict=True)])
    return Rig(
        name=name,
        joints=tuple(index),
        parents=parents,
        rest_local=local,
        bind_world=world,
        bind_points=mesh.points,
        faces=mesh.faces,
        skin_joints=skin_joints,
        skin_weights=skin_weights,
        freedoms=tuple(bone.freedom for bone in bones),
    )
