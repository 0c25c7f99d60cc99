"""What fills the plugin slots of grasping: samplers, which say where a hand may come from, and scores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol, get_args, runtime_checkable

import numpy as np

from contact_core.arrays import BoolArray, FloatArray
from contact_core.errors import InvalidInput
from contact_core.geometry.distance_field import DistanceField
from contact_core.geometry.mesh import TriangleMesh
from contact_core.grasping.hand import Hand
from contact_core.plugins.slot import SLOTS, Slot

Kind = Literal["power", "precision", "hook", "lateral", "pinch"]
KINDS: tuple[Kind, ...] = get_args(Kind)


def lacks(hand: Hand, kind: Kind) -> str | None:
    """What a hand has not that this kind of grasp needs, None where it can."""
    if kind in ("precision", "pinch", "lateral") and hand.thumb < 0:
        return "a thumb that is told from its fingers"
    if kind == "lateral" and hand.side_pad is None:
        return "a finger beside its thumb with two bones that bend"
    return None


@dataclass(frozen=True, eq=False)
class GraspRequest:
    """What a sampler gets. mesh, field: the object, in the hand's units, in its own space. kinds: the wanted ones.
    at: (3,) the place that is to be held, None for anywhere. seed: of everything random."""

    hand: Hand
    mesh: TriangleMesh
    field: DistanceField
    kinds: tuple[Kind, ...] = KINDS
    at: FloatArray | None = None
    seed: int = 0


@dataclass(frozen=True, eq=False)
class Approaches:
    """Where a hand may come from, N ways. placed: (N, 4, 4) rigid object_from_rig. kinds: N of them.

    ways: (N, 3) unit direction in which the hand then moves until it touches, zero to stay. bars: (N, 7) middle,
    axis, radius of a round bar on which it closes; radius 0 for the object itself. curls: (N,) how far digits are
    bent beforehand, and limits: (N, D) at most, as shares of their room.
    """

    placed: FloatArray
    kinds: tuple[Kind, ...]
    ways: FloatArray
    bars: FloatArray
    curls: FloatArray
    limits: FloatArray

    def __post_init__(self) -> None:
        n = len(self.kinds)
        rigid = self.placed.shape == (n, 4, 4) and np.allclose(
            self.placed[:, :3, :3] @ self.placed[:, :3, :3].transpose(0, 2, 1), np.eye(3), atol=1e-6
        )
        shapes = self.ways.shape == (n, 3) and self.bars.shape == (n, 7) and self.curls.shape == (n,)
        if not (rigid and shapes and self.limits.shape[:1] == (n,)):
            raise InvalidInput(f"{n} approaches need as many rigid placements, ways, bars, curls and limits.")
        if not all(np.isfinite(a).all() for a in (self.placed, self.ways, self.bars, self.curls, self.limits)):
            raise InvalidInput("an approach is made of finite numbers.")

    def used(self, hand: Hand) -> BoolArray:
        """(N, D) which digits take part: those that close all the way, and the finger whose side a thing is held
        against, which is bent beforehand."""
        result = self.limits >= 1.0
        if hand.first_finger >= 0:
            result[np.array([kind == "lateral" for kind in self.kinds], bool), hand.first_finger] = True
        return result

    def __getitem__(self, rows: Any) -> Approaches:
        rows = np.atleast_1d(rows)
        kinds = tuple(self.kinds[int(row)] for row in rows)
        return Approaches(
            self.placed[rows], kinds, self.ways[rows], self.bars[rows], self.curls[rows], self.limits[rows]
        )

    @classmethod
    def joined(cls, parts: Sequence[Approaches]) -> Approaches:
        """Several as one."""
        names = ("placed", "ways", "bars", "curls", "limits")
        together = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
        return cls(kinds=tuple(kind for part in parts for kind in part.kinds), **together)


@runtime_checkable
class GraspSampler(Protocol):
    """Chooses approaches (hook `contact_grasp_samplers`). Settings are fields, see `contact_core.settings`."""

    @property
    def name(self) -> str: ...

    @property
    def summary(self) -> str: ...

    def sample(self, request: GraspRequest) -> Approaches:
        """Approaches of the wanted kinds, the same for the same seed; none where the object offers nothing."""
        ...


@dataclass(frozen=True, eq=False)
class GraspFacts:
    """What is known of one solved grasp. metrics: those of `report.json`. kind: the one asked for.

    closure: Ferrari-Canny quality. comfort: 0 to 1, 1 where joints are in the middle of their room and bent alike.
    clearance: 0 to 1, the share of the way back out that the open hand finds free. margin: 0 to 1, how clear it is
    of the verdict's limits (`verdict.margin`).
    """

    kind: Kind
    metrics: Mapping[str, Any]
    closure: float
    comfort: float
    clearance: float
    failures: tuple[str, ...]
    margin: float = 1.0


@runtime_checkable
class GraspScore(Protocol):
    """Ranks grasps (hook `contact_grasp_scores`). Settings are fields, see `contact_core.settings`."""

    @property
    def name(self) -> str: ...

    @property
    def summary(self) -> str: ...

    def score(self, facts: GraspFacts) -> float:
        """How good a grasp is: finite, the higher the better; one that fails is worse than the same that does
        not."""
        ...


GRASP_SAMPLERS: Slot[GraspSampler] = SLOTS["contact_grasp_samplers"]
GRASP_SCORES: Slot[GraspScore] = SLOTS["contact_grasp_scores"]
