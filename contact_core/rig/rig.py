"""The analytic rig: a joint tree, a linear-blend skin and the degrees of freedom a solver may use.

Frames: column vectors, `parent_from_joint` and `world_from_joint` 4x4 matrices, radians. "World" here is
the rig's own space, in surface units; where a host places the rig in its scene is a rigid
`world_from_surface` beside the rig, never inside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray, frozen
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh

RotationKind = Literal["fixed", "hinge", "euler", "ball"]
ROTATION_DOFS: dict[str, int] = {"fixed": 0, "hinge": 1, "euler": 3, "ball": 3}


@dataclass(frozen=True, eq=False)
class JointFreedom:
    """How one joint may move away from its rest transform.

    parent_from_joint(q) = rest_local @ translate(t) @ frame @ R(angles) @ frame.T, with R a turn about the
    frame's x axis (hinge), three turns about the frame's axes in `order`, intrinsic (euler), or the
    exponential map of a rotation vector in the frame (ball). The dofs of a joint are its rotation dofs,
    then three translations (in the rest frame of the joint) when `translates`.

    locked_translation: (3,) translations that a solve never moves.
    lower, upper: (r,) offsets from rest, radians; -inf/inf where free. Translations have no limits.
    follows, ratio: a hinge that is coupled to another (a robot's mimic joint) turns by `ratio` times as much from
    rest as the hinge `follows`; it has no dof that a solve may choose, and its limits bind the other, too.
    prior_weight: (r,) how strongly the prior holds each rotation dof. locked: (r,) dofs a solve never moves.
    """

    kind: RotationKind = "ball"
    frame: FloatArray = field(default_factory=lambda: np.eye(3))
    order: str = "XYZ"
    lower: FloatArray | None = None
    upper: FloatArray | None = None
    prior_weight: FloatArray | None = None
    locked: BoolArray | None = None
    translates: bool = False
    follows: str | None = None
    ratio: float = 1.0
    locked_translation: BoolArray | None = None

    def __post_init__(self) -> None:
        if self.kind not in ROTATION_DOFS:
            raise InvalidInput(f"a joint is one of {sorted(ROTATION_DOFS)}, but got {self.kind!r}.")
        if sorted(self.order) != ["X", "Y", "Z"]:
            raise InvalidInput(f"an Euler order is a permutation of XYZ, but got {self.order!r}.")
        r = ROTATION_DOFS[self.kind]

        def fill(name: str, value: Any, default: Any, dtype: Any, count: int = r) -> None:
            given = np.full(count, default, dtype) if value is None else np.asarray(value, dtype)
            if given.shape != (count,) or (dtype is float and np.isnan(given).any()):
                raise InvalidInput(
                    f"{name} of a {self.kind} joint needs {count} numbers, but got {given.tolist()}."
                )
            given = given.copy()
            given.setflags(write=False)
            object.__setattr__(self, name, given)

        fill("lower", self.lower, -np.inf, float)
        fill("upper", self.upper, np.inf, float)
        fill("prior_weight", self.prior_weight, 1.0, float)
        fill("locked", self.locked, False, bool)
        fill("locked_translation", self.locked_translation, False, bool, 3)
        object.__setattr__(self, "frame", frozen(self.frame, np.float64, (3, 3), "frame of a joint's freedom"))
        if self.follows is not None and (self.kind != "hinge" or not np.isfinite(self.ratio)):
            raise InvalidInput(
                f"a joint that follows another is a hinge with a finite ratio, but got a {self.kind} joint and"
                f" {self.ratio}."
            )

    def is_like(self, other: JointFreedom) -> bool:
        """Whether both let a joint move alike, number by number."""
        return all(np.array_equal(getattr(self, f.name), getattr(other, f.name)) for f in fields(self))


@dataclass(frozen=True, eq=False)
class Rig:
    """A skinned manipulator that evaluates analytically (tier A).

    joints: j unique names, parents before children. parents: (j,) index of each parent, -1 for a root.
    rest_local: (j, 4, 4) parent_from_joint of the rest pose. bind_world: (j, 4, 4) world_from_joint at which
    the skin was bound (may differ from the rest pose). bind_points: (n, 3) skin vertices as bound.
    faces: (m, 3). skin_joints, skin_weights: (n, K) influences per vertex, weights normalised to sum 1
    (a reader normalises and says so in its notes). freedoms: one per joint.
    left_right: pairs of joint names that mirror each other, as far as known.
    """

    name: str
    joints: tuple[str, ...]
    parents: IntArray
    rest_local: FloatArray
    bind_world: FloatArray
    bind_points: FloatArray
    faces: IntArray
    skin_joints: IntArray
    skin_weights: FloatArray
    freedoms: tuple[JointFreedom, ...]
    meters_per_unit: float = 1.0
    up_axis: Literal["X", "Y", "Z"] = "Y"

    def __post_init__(self) -> None:
        j, n = len(self.joints), len(self.bind_points)
        put = object.__setattr__
        put(self, "parents", frozen(self.parents, np.int64, (j,), "parents"))
        put(self, "rest_local", frozen(self.rest_local, np.float64, (j, 4, 4), "rest_local"))
        put(self, "bind_world", frozen(self.bind_world, np.float64, (j, 4, 4), "bind_world"))
        put(self, "bind_points", frozen(self.bind_points, np.float64, (n, 3), "bind_points"))
        put(self, "faces", frozen(self.faces, np.int64, (None, 3), "faces"))
        put(self, "skin_joints", frozen(self.skin_joints, np.int64, (n, None), "skin_joints"))
        put(
            self,
            "skin_weights",
            frozen(self.skin_weights, np.float64, self.skin_joints.shape, "skin_weights"),
        )
        if len(set(self.joints)) != j:
            twice = next(name for name in self.joints if self.joints.count(name) > 1)
            raise InvalidInput(
                f"joint names must be unique, but {twice!r} comes twice; use paths where names repeat."
            )
        if (self.parents >= np.arange(j)).any():
            bad = int(np.argmax(self.parents >= np.arange(j)))
            raise InvalidInput(f"parents must come before children, but joint {self.joints[bad]!r} comes first.")
        if len(self.freedoms) != j:
            raise InvalidInput(
                f"a rig needs one freedom per joint: {j} joints, but got {len(self.freedoms)} freedoms."
            )
        if n and (self.skin_joints.min() < 0 or self.skin_joints.max() >= j):
            wrong = self.skin_joints[(self.skin_joints < 0) | (self.skin_joints >= j)]
            raise InvalidInput(f"skin_joints must be in 0..{j - 1}, but got {int(wrong[0])} among them.")
        self._check_followers()
        off = np.abs(self.skin_weights.sum(axis=1) - 1.0) if n else np.zeros(0)
        if (off > 1e-6).any():
            raise InvalidInput(
                f"skin weights must sum to 1 per vertex, but those of vertex {int(off.argmax())} sum to"
                f" {self.skin_weights[off.argmax()].sum():.6g}; normalise them when reading."
            )

    def _check_followers(self) -> None:
        free = {
            n for n, f in zip(self.joints, self.freedoms, strict=True) if f.kind == "hinge" and f.follows is None
        }
        for name, freedom in zip(self.joints, self.freedoms, strict=True):
            if freedom.follows is not None and freedom.follows not in free:
                raise InvalidInput(
                    f"joint {name!r} follows {freedom.follows!r}, which has to be a hinge that follows none."
                )

    def joint_index(self, name: str) -> int:
        """Index of a joint by name; raises InvalidInput listing near names."""
        try:
            return self.joints.index(name)
        except ValueError:
            import difflib

            near = difflib.get_close_matches(name, self.joints, n=3) or list(self.joints[:5])
            raise InvalidInput(f"{self.name} has no joint {name!r}; near names: {', '.join(near)}.") from None

    @cached_property
    def in_tree_order(self) -> Rig:
        """The same rig with its joints in the order of `tree_order`."""
        order = tree_order(self.parents)
        if order == list(range(len(order))):
            return self
        place = np.argsort(order)  # (j,) new index of each joint
        return replace(
            self,
            joints=tuple(self.joints[k] for k in order),
            parents=np.where(self.parents >= 0, place[self.parents], -1)[order],
            rest_local=self.rest_local[order],
            bind_world=self.bind_world[order],
            skin_joints=place[self.skin_joints],
            freedoms=tuple(self.freedoms[k] for k in order),
        )

    @cached_property
    def rest_world(self) -> FloatArray:
        """(j, 4, 4) world_from_joint of the rest pose."""
        return forward_kinematics(self.parents, self.rest_local)

    @cached_property
    def surface(self) -> TriangleMesh:
        """The skin in the rest pose: the surface that contacts are painted on."""
        return TriangleMesh(skin(self, self.rest_world), self.faces)

    @cached_property
    def bound_surface(self) -> TriangleMesh:
        """The skin as it was bound."""
        return TriangleMesh(self.bind_points, self.faces)

    @classmethod
    def rigid(cls, name: str, mesh: TriangleMesh, *, movable: bool) -> Rig:
        """A rig of one joint at the centre of a mesh that carries all of it. It is kept with the mesh, and the mesh
        is its surface, so that what the mesh has computed once (normals, trees, fields) serves every solve."""
        key = ("rigid rig", name, movable)
        if key not in mesh.kept:
            n = len(mesh.points)
            centre = np.eye(4)
            centre[:3, 3] = mesh.points.mean(axis=0) if n else 0.0
            rig = cls(
                name=name,
                joints=(name,),
                parents=np.array([-1]),
                rest_local=centre[None],
                bind_world=centre[None],
                bind_points=mesh.points,
                faces=mesh.faces,
                skin_joints=np.zeros((n, 1), np.int64),
                skin_weights=np.ones((n, 1)),
                freedoms=(JointFreedom("ball" if movable else "fixed", translates=movable),),
            )
            vars(rig).update(bound_surface=mesh, surface=mesh)  # bound at rest: both are the mesh itself
            mesh.kept[key] = rig
        kept: Rig = mesh.kept[key]
        return kept


def still_following(joints: Sequence[str], freedoms: Sequence[JointFreedom]) -> tuple[JointFreedom, ...]:
    """The freedoms of joints, where those that follow a joint which is no longer there, or no hinge, are held: a
    host may have renamed it."""
    free = {n for n, f in zip(joints, freedoms, strict=True) if f.kind == "hinge" and f.follows is None}
    return tuple(f if f.follows is None or f.follows in free else JointFreedom("fixed") for f in freedoms)


def tree_order(parents: Sequence[int] | IntArray) -> list[int]:
    """The one order in which hosts give joints: depth first, children in the order in which the host has them.

    parents: (j,) index of each joint's parent, -1 for a root. An armature of Blender knows no other order, so a rig
    written breadth first comes the same way from there and from a stage.
    """
    children: dict[int, list[int]] = {}
    for joint in reversed(range(len(parents))):
        children.setdefault(int(parents[joint]), []).append(joint)
    order, waiting = list[int](), children.get(-1, [])
    while waiting:
        order.append(waiting.pop())
        waiting += children.get(order[-1], [])
    return order


def forward_kinematics(parents: IntArray, local: FloatArray) -> FloatArray:
    """(j, 4, 4) world_from_joint out of (j, 4, 4) parent_from_joint, parents first."""
    world = np.array(local, dtype=np.float64)
    for index, parent in enumerate(parents):
        if parent >= 0:
            world[index] = world[parent] @ local[index]
    return world


def skin(rig: Rig, world: FloatArray) -> FloatArray:
    """(n, 3) linear-blend skinned vertices for world_from_joint (j, 4, 4)."""
    moves = (world @ np.linalg.inv(rig.bind_world))[:, :3, :]  # (j, 3, 4)
    homogeneous = np.concatenate([rig.bind_points, np.ones((len(rig.bind_points), 1))], axis=1)
    result = np.zeros_like(rig.bind_points)
    for k in range(rig.skin_joints.shape[1]):
        result += rig.skin_weights[:, k, None] * np.einsum("nij,nj->ni", moves[rig.skin_joints[:, k]], homogeneous)
    return result


@dataclass(frozen=True, eq=False)
class Pose:
    """Local joint transforms by name: the interchange form of a pose. Angles are a chart of it.

    joints: names. local: (j, 4, 4) parent_from_joint.
    """

    joints: tuple[str, ...]
    local: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "local", frozen(self.local, np.float64, (len(self.joints), 4, 4), "local"))

    @classmethod
    def rest(cls, rig: Rig) -> Pose:
        return cls(rig.joints, rig.rest_local)

    def in_tree_order(self, parents: IntArray) -> Pose:
        """The same pose with its joints, of which `parents` (j,) tells the tree, in the order of `tree_order`."""
        order = tree_order(parents)
        return Pose(tuple(self.joints[k] for k in order), self.local[order])
