"""The degrees of freedom of a pose problem: which there are, within which limits, and which bones they move."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.chart import Chart, Motion
from contact_core.rig.rig import Pose
from contact_core.rig.track import Track
from contact_core.solve.black_box import BlackBoxChart, BlackBoxMotion
from contact_core.solve.body import Body, PairedPoints

Limits = Literal["rig", "none", "paper"]


@dataclass(frozen=True, eq=False)
class DofLayout:
    """The bodies of a problem, and theta (d,): the values of the dofs that may move. Immutable; everything derived
    is made when first asked for.

    bodies: any number, names unique. contacts: pairs between any two of them, or within one, whose points black
    boxes watch. free: joints or single dofs (names) that may move, per body; None: all. held: names taken out of
    that again. limits: those of the rigs within -pi..pi, none at all, or the paper's 0..2 pi (harmful; for
    comparison).
    """

    bodies: tuple[Body, ...]
    contacts: tuple[PairedPoints, ...]
    _: KW_ONLY
    free: Mapping[str, Iterable[str]] | None = None
    held: Mapping[str, Iterable[str]] | None = None
    limits: Limits = "rig"

    def __post_init__(self) -> None:
        names = [body.name for body in self.bodies]
        if len(set(names)) != len(names) or not names:
            raise InvalidInput(f"a pose problem needs bodies with unique names, but got {names}.")
        if self.limits not in ("rig", "none", "paper"):
            raise InvalidInput(f'limits are "rig", "none" or "paper", but got {self.limits!r}.')
        for given in (self.free, self.held):
            for body in given or {}:
                self.body_index(body)
        twice = {c.name for c in self.contacts if sum(c.name == other.name for other in self.contacts) > 1}
        if twice:
            raise InvalidInput(f"contacts need unique names, but {sorted(twice)[0]!r} comes twice.")

    def body_index(self, name: str) -> int:
        """Index of a body by name; raises InvalidInput listing what exists."""
        names = [body.name for body in self.bodies]
        if name not in names:
            raise InvalidInput(f"the problem has no body {name!r}; it has {', '.join(names)}.")
        return names.index(name)

    @cached_property
    def charts(self) -> tuple[Chart | BlackBoxChart, ...]:
        """One chart per body."""
        return tuple(
            Chart(body.rig, body.world_from_rig)
            if body.black_box is None
            else BlackBoxChart(body.black_box, body.rig, self._points_on(body.name))
            for body in self.bodies
        )

    def _points_on(self, body: str) -> SurfacePoints:
        """All contact points on a body: first as manipulator, then as object, contact by contact."""
        mine = [contact.manipulator_points for contact in self.contacts if contact.manipulator == body]
        theirs = [contact.object_points for contact in self.contacts if contact.object == body]
        return SurfacePoints.concatenate([*mine, *theirs])

    @cached_property
    def is_rigid(self) -> bool:
        """Whether no body scales or shears, so that rotations carry normals."""
        return all(c.is_rigid and left is None for c, left in zip(self.charts, self._leftovers, strict=True))

    @cached_property
    def free_of_body(self) -> tuple[IntArray, ...]:
        """Per body, the indices into its chart of the dofs that may move."""
        result = []
        for body, chart in zip(self.bodies, self.charts, strict=True):
            free = ~chart.locked
            if self.free is not None:
                free &= _named(chart, self.free.get(body.name, ()))
            if self.held is not None:
                free &= ~_named(chart, self.held.get(body.name, ()))
            result.append(np.flatnonzero(free))
        return tuple(result)

    @cached_property
    def dof_slices(self) -> tuple[slice, ...]:
        """Per body, where its free dofs are in theta."""
        ends = np.cumsum([0, *(len(free) for free in self.free_of_body)])
        return tuple(slice(int(a), int(b)) for a, b in itertools.pairwise(ends))

    @cached_property
    def dof_names(self) -> tuple[str, ...]:
        """(d,) names "body/joint.axis" of theta."""
        return tuple(
            f"{body.name}/{chart.dof_names[q]}"
            for body, chart, free in zip(self.bodies, self.charts, self.free_of_body, strict=True)
            for q in free
        )

    @cached_property
    def limits_of_theta(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper (d,); translations are free, and so is the turning of a root unless its rig says."""
        lower, upper = self._gather([c.lower for c in self.charts]), self._gather([c.upper for c in self.charts])
        translation, root = self.is_translation, self.is_root
        if self.limits == "none":
            return np.full_like(lower, -np.inf), np.full_like(upper, np.inf)
        if self.limits == "paper":
            return np.where(translation, -np.inf, 0.0), np.where(translation, np.inf, 2.0 * np.pi)
        inner = ~translation & ~root
        return np.where(inner, np.maximum(lower, -np.pi), lower), np.where(inner, np.minimum(upper, np.pi), upper)

    @cached_property
    def is_translation(self) -> BoolArray:
        """(d,) which dofs are lengths rather than angles."""
        return self._gather([c.is_translation for c in self.charts]).astype(bool)

    @cached_property
    def is_root(self) -> BoolArray:
        """(d,) which dofs place a whole body."""
        return self._gather([c.is_root for c in self.charts]).astype(bool)

    def _gather(self, per_body: Sequence[FloatArray | BoolArray]) -> FloatArray:
        """(d,) the free entries of per-body dof arrays."""
        parts = [np.asarray(values)[free] for values, free in zip(per_body, self.free_of_body, strict=True)]
        return np.concatenate(parts).astype(np.float64)

    @cached_property
    def _charted(self) -> tuple[tuple[FloatArray, FloatArray | None], ...]:
        return tuple(chart.theta_of(body.pose) for body, chart in zip(self.bodies, self.charts, strict=True))

    @cached_property
    def _leftovers(self) -> tuple[FloatArray | None, ...]:
        return tuple(leftover for _, leftover in self._charted)

    @cached_property
    def start(self) -> FloatArray:
        """(d,) theta of the bodies' poses, brought into the limits."""
        return np.clip(self._gather([theta for theta, _ in self._charted]), *self.limits_of_theta)

    def full_theta(self, index: int, theta: FloatArray) -> FloatArray:
        """All dofs of one body: the free ones from theta (d,), the others as they stand."""
        full = self._charted[index][0].copy()
        full[self.free_of_body[index]] = theta[self.dof_slices[index]]
        chart = self.charts[index]
        return chart.coupled(full) if isinstance(chart, Chart) and len(chart.followers) else full

    def pose_names(self, index: int) -> tuple[str, ...]:
        """What a pose of a body names: the joints of a rig, the dofs of a black box."""
        body = self.bodies[index]
        return body.rig.joints if body.black_box is None else self.charts[index].dof_names

    def poses(self, theta: FloatArray) -> dict[str, Pose]:
        """The pose of every body at theta (d,)."""
        return {
            body.name: Pose(self.pose_names(i), self.charts[i].local(self.full_theta(i, theta), self._leftovers[i]))
            for i, body in enumerate(self.bodies)
        }

    def theta_of(self, poses: Mapping[str, Pose]) -> FloatArray:
        """(d,) theta of poses by body, within the limits; bodies not named stay where they start."""
        thetas = [
            chart.theta_of(poses[body.name])[0] if body.name in poses else charted[0]
            for body, chart, charted in zip(self.bodies, self.charts, self._charted, strict=True)
        ]
        return np.clip(self._gather(thetas), *self.limits_of_theta)

    @cached_property
    def bone_offsets(self) -> IntArray:
        """(bodies + 1,) the first bone column of each body."""
        return np.cumsum([0, *(len(b.rig.joints) if b.black_box is None else 0 for b in self.bodies)])

    @cached_property
    def watched_offsets(self) -> IntArray:
        """(bodies + 1,) the first watched contact point of each black box."""
        return np.cumsum([0, *(c.watched if isinstance(c, BlackBoxChart) else 0 for c in self.charts)])

    @cached_property
    def watched_dofs(self) -> IntArray:
        """(q,) the free dofs of black boxes, as indices into theta."""
        boxes = [self.dof_slices[i] for i, body in enumerate(self.bodies) if body.black_box is not None]
        return np.concatenate([np.zeros(0, np.int64), *(np.arange(box.start, box.stop) for box in boxes)])

    @cached_property
    def moves(self) -> FloatArray:
        """(d, j) 1 where a free dof moves a bone (over all bodies), else 0."""
        result = np.zeros((len(self.dof_names), int(self.bone_offsets[-1])))
        for i, chart in enumerate(self.charts):
            columns = slice(int(self.bone_offsets[i]), int(self.bone_offsets[i + 1]))
            result[self.dof_slices[i], columns] = chart.moves[self.free_of_body[i]]
        return result

    @cached_property
    def fields_of_body(self) -> tuple[IntArray, ...]:
        """Per body, the dofs of its chart that theta moves: the free ones, then those that follow them."""
        return tuple(
            np.concatenate([free, chart.followers[np.isin(chart.leaders, free)]])
            if isinstance(chart, Chart)
            else free
            for chart, free in zip(self.charts, self.free_of_body, strict=True)
        )

    @cached_property
    def field_moves(self) -> FloatArray:
        """(e, j) as `moves`, for each of `fields_of_body` by itself."""
        result = np.zeros((sum(map(len, self.fields_of_body)), int(self.bone_offsets[-1])))
        row = 0
        for i, (chart, fields) in enumerate(zip(self.charts, self.fields_of_body, strict=True)):
            alone = chart.moves_alone if isinstance(chart, Chart) else chart.moves
            columns = slice(int(self.bone_offsets[i]), int(self.bone_offsets[i + 1]))
            result[row : row + len(fields), columns] = alone[fields]
            row += len(fields)
        return result

    @cached_property
    def coupling(self) -> FloatArray | None:
        """(d, e) by how much each of `fields_of_body` moves when a free dof grows; None where nothing follows."""
        if all(map(np.array_equal, self.fields_of_body, self.free_of_body)):
            return None
        result = np.zeros((len(self.dof_names), len(self.field_moves)))
        column = 0
        for chart, free, fields, rows in zip(
            self.charts, self.free_of_body, self.fields_of_body, self.dof_slices, strict=True
        ):
            own = np.eye(chart.size)
            if isinstance(chart, Chart):
                own[chart.leaders, chart.followers] = chart.ratios
            result[rows, column : column + len(fields)] = own[np.ix_(free, fields)]
            column += len(fields)
        return result

    @cached_property
    def _still(self) -> dict[int, Motion | BlackBoxMotion]:
        """Motions of the bodies that do not move."""
        return {
            i: chart.motion(self._charted[i][0], self._leftovers[i])
            for i, chart in enumerate(self.charts)
            if not len(self.free_of_body[i])
        }

    def motions(self, theta: FloatArray) -> tuple[Motion | BlackBoxMotion, ...]:
        """The motion of every body at theta (d,)."""
        return tuple(
            self._still[i] if i in self._still else chart.motion(self.full_theta(i, theta), self._leftovers[i])
            for i, chart in enumerate(self.charts)
        )

    def is_still(self, track: Track) -> bool:
        """Whether no free dof moves what a track carries."""
        if track.watched is not None:
            return False
        key = track.bones.tobytes()
        if key not in self._moved_bones:
            self._moved_bones[key] = not self.moves[:, track.bones].any()
        return self._moved_bones[key]

    @cached_property
    def _moved_bones(self) -> dict[bytes, bool]:
        return {}

    @cached_property
    def still_tracks(self) -> dict[int, tuple[Track, FloatArray]]:
        """What still tracks carry, by identity; each is kept beside it, so that its id stays its own."""
        return {}


def _named(chart: Chart | BlackBoxChart, names: Iterable[str]) -> BoolArray:
    """(dofs,) those of the named joints, and single dofs by name."""
    result = np.zeros(chart.size, bool)
    for name in names:
        if name in chart.dof_names:
            result[chart.dof_names.index(name)] = True
        else:
            result |= chart.joint_of_dof == chart.rig.joint_index(name)
    return result
