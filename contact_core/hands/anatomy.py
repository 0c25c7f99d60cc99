"""A rig as limbs: where joints are, which skin they hold, and the chains that leave a joint."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.hands.names import DigitJoint, digit_joints
from contact_core.rig.rig import Rig

NO_SKIN = 1e-3  # vertices' worth of weight below which a joint holds no skin


@dataclass(frozen=True, eq=False)
class Anatomy:
    """What is asked of a rig again and again while its hands are looked for."""

    rig: Rig

    @cached_property
    def position(self) -> FloatArray:
        """(j, 3) of the joints at rest."""
        return np.asarray(self.rig.rest_world[:, :3, 3])

    @cached_property
    def names(self) -> list[DigitJoint | None]:
        """(j,) what the names say."""
        return digit_joints(self.rig.joints)

    @cached_property
    def skin_of(self) -> FloatArray:
        """(j,) how many vertices' worth of weight a joint holds."""
        total = np.bincount(
            self.rig.skin_joints.ravel(), weights=self.rig.skin_weights.ravel(), minlength=len(self.rig.joints)
        )
        return np.asarray(total, np.float64)

    @cached_property
    def holds_skin(self) -> BoolArray:
        """(j,) whether a joint holds skin itself."""
        return np.asarray(self.skin_of > NO_SKIN)

    @cached_property
    def moves_skin(self) -> BoolArray:
        """(j,) whether a joint or anything below it holds skin."""
        moves = self.holds_skin.copy()
        for index in range(len(moves) - 1, -1, -1):
            parent = int(self.rig.parents[index])
            if parent >= 0:
                moves[parent] |= moves[index]
        return moves

    @cached_property
    def owner(self) -> IntArray:
        """(n,) the joint that holds each vertex strongest."""
        strongest = self.rig.skin_weights.argmax(axis=1)
        return np.asarray(self.rig.skin_joints[np.arange(len(strongest)), strongest])

    @cached_property
    def children(self) -> list[list[int]]:
        """Joints below each joint, bare markers included where their parent holds skin (tips)."""
        result: list[list[int]] = [[] for _ in self.rig.joints]
        for index, parent in enumerate(self.rig.parents):
            if parent >= 0 and (self.moves_skin[index] or self.moves_skin[parent]):
                result[int(parent)].append(index)
        return result

    @cached_property
    def depth(self) -> IntArray:
        """(j,) number of joints of the longest chain below and including each joint."""
        depth = np.ones(len(self.rig.joints), np.int64)
        for index in range(len(depth) - 1, -1, -1):
            parent = int(self.rig.parents[index])
            if parent >= 0 and index in self.children[parent]:
                depth[parent] = max(depth[parent], depth[index] + 1)
        return depth

    def chain(self, first: int) -> list[int] | None:
        """The joints from `first` to its tip, short helpers beside it left out; None where it forks."""
        chain = [first]
        while True:
            below = self.children[chain[-1]]
            if not below:
                return chain
            deep = [child for child in below if self.depth[child] >= 2]
            if len(deep) > 1:
                return None
            chain.append(deep[0] if deep else self._end(chain[-1], below))

    def _end(self, joint: int, leaves: list[int]) -> int:
        """Which of several last joints goes on with a chain: a tip by name, else the farthest."""
        named = [leaf for leaf in leaves if self.names[leaf] is not None]
        far = np.linalg.norm(self.position[named or leaves] - self.position[joint], axis=1)
        return int((named or leaves)[int(far.argmax())])

    def vertices(self, joints: list[int]) -> FloatArray:
        """(k, 3) rest skin that any of the joints holds strongest."""
        return np.asarray(self.rig.surface.points[np.isin(self.owner, joints)])


def unit(vector: FloatArray) -> FloatArray:
    """A vector (3,) of length 1; zero stays zero."""
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-300))


def across(vector: FloatArray, direction: FloatArray) -> FloatArray:
    """The part of a vector (3,) square to a unit direction (3,)."""
    return np.asarray(vector - (vector @ direction) * direction)
