"""Balance: the centre of mass stays above what bears, so that a body leans forward to sit down and to rise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.rig.capsules import fit_capsules
from contact_core.rig.rig import Rig
from contact_core.rig.skinning import joint_track
from contact_core.rig.track import Track
from contact_core.settings import HasSettings, setting
from contact_core.solve.body import PairedPoints
from contact_core.solve.state import PoseState
from contact_core.solve.term import BoundTerm, LeastSquares

if TYPE_CHECKING:
    from contact_core.solve.bare_problem import BareProblem

Vector = tuple[float, float, float]
BEARS = 0.5  # the cosine of normal and up from which a surface bears what stands on it


@dataclass(frozen=True)
class BalanceTerm(HasSettings):
    """(distance / l)^2 of the centre of mass, seen from above, from the support of each body that moves.

    The support is the convex hull of what bears: points of contacts on bodies that stand still and face up. A
    contact that fades counts by its gain: its points lie that far on the way from the middle of all that bears, so
    that a seat takes over smoothly. `inside` draws the hull together about its middle; a person keeps clear of its
    rim. The mass is that of capsules along the bones: volumes, of flesh that weighs the same everywhere. Where
    nothing bears, as in a jump, nothing is said. up: in the world.
    """

    summary: ClassVar[str] = "the centre of mass stays above what bears"
    up: Vector = (0.0, 1.0, 0.0)
    weight: float = setting(1.0, low=0.0, help="how much it counts beside the other terms")
    inside: float = setting(0.8, low=0.0, high=1.0, help="share of the support that is free to stand over")
    name: str = "balance"

    def bind(self, problem: BareProblem) -> BoundTerm:
        length = float(np.linalg.norm(self.up))
        if not length > 0.0 or not np.isfinite(length):
            raise InvalidInput(f"up is a direction, but got {self.up}.")
        return _Balance(self, np.array(self.up) / length, problem)


class _Balance(LeastSquares):
    def __init__(self, term: BalanceTerm, up: FloatArray, problem: BareProblem) -> None:
        self.ground = np.linalg.svd(up[None])[2][1:]  # (2, 3) axes of the plane seen from above
        self.factor = np.sqrt(2.0 * term.weight) / problem.unit
        self.standing: list[tuple[Track, FloatArray]] = []
        for index, body in enumerate(problem.bodies):
            if body.black_box is None and len(problem.free_of_body[index]) and len(body.rig.joints) > 1:
                hull = self._support(problem, body.name, up, term.inside)
                if len(hull):
                    self.standing.append((_centre_of_mass(body.rig, int(problem.bone_offsets[index])), hull))

    def _support(self, problem: BareProblem, body: str, up: FloatArray, inside: float) -> FloatArray:
        """(h, 2) corners of what bears a body, counter-clockwise; none where nothing does."""
        points, gains = list[FloatArray](), list[FloatArray]()
        for contact in problem.contacts:
            if contact.manipulator == body and contact.gain > 0.0:
                held = _bearing(problem, contact, up) @ self.ground.T
                points.append(held)
                gains.append(np.full(len(held), contact.gain))
        if not points or not sum(map(len, points)):
            return np.zeros((0, 2))
        places, share = np.concatenate(points), np.concatenate(gains)
        middle = share @ places / share.sum()
        return convex_hull(middle + inside * share[:, None] * (places - middle))

    def residuals(self, state: PoseState) -> FloatArray:
        if not self.standing:
            return np.zeros(0)
        return self.factor * np.concatenate([self._off(state, *each)[0] for each in self.standing])

    def jacobian(self, state: PoseState) -> FloatArray:
        rows = [self._off(state, *each)[1] @ self.ground @ state.jacobian(each[0])[0] for each in self.standing]
        return self.factor * (np.concatenate(rows) if rows else np.zeros((0, len(state.theta))))

    def _off(self, state: PoseState, mass: Track, hull: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(2,) from the nearest point of the hull to the centre of mass, and its derivative (2, 2) by that."""
        return away_from(hull, self.ground @ state.vectors(mass)[0])


def _centre_of_mass(rig: Rig, first_bone: int) -> Track:
    """The track of one point: the middles of capsules by their volumes, over their sum."""
    capsules = fit_capsules(rig)
    lengths = np.linalg.norm(capsules.ends[:, 1] - capsules.ends[:, 0], axis=1)
    volumes = np.pi * capsules.radii**2 * (lengths + 4.0 / 3.0 * capsules.radii)
    middles = joint_track(capsules.joints, capsules.ends.mean(axis=1), first_bone)
    return middles.summed(volumes / volumes.sum())


def _bearing(problem: BareProblem, contact: PairedPoints, up: FloatArray) -> FloatArray:
    """(k, 3) points of a contact's object that stand still and face up, world."""
    index = problem.body_index(contact.object)
    body = problem.bodies[index]
    if body.black_box is not None or len(problem.free_of_body[index]) or not len(contact.object_points):
        return np.zeros((0, 3))
    rows = problem.pairs.rows[contact.name]
    normals = problem.start_state.vectors(problem.pairs.object_normals)[rows]
    facing = normals @ up > BEARS * np.linalg.norm(normals, axis=1)
    return problem.start_state.vectors(problem.pairs.object_points)[rows][facing]


def convex_hull(points: FloatArray) -> FloatArray:
    """(h, 2) corners of the hull of points (n, 2), n > 0, counter-clockwise (Andrew 1979)."""
    ordered = np.unique(points, axis=0)
    if len(ordered) < 3:
        return ordered

    def half(rows: FloatArray) -> list[FloatArray]:
        chain = list[FloatArray]()
        for point in rows:
            while len(chain) > 1 and _cross(chain[-1] - chain[-2], point - chain[-2]) <= 0.0:
                chain.pop()
            chain.append(point)
        return chain[:-1]

    return np.array(half(ordered) + half(ordered[::-1]))


def away_from(hull: FloatArray, point: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(2,) from the nearest point of a hull (h, 2) to a point (2,), zero within; and its derivative (2, 2)."""
    if len(hull) == 1:
        return point - hull[0], np.eye(2)
    edges = np.roll(hull, -1, axis=0) - hull
    sides = edges[:, 0] * (point - hull)[:, 1] - edges[:, 1] * (point - hull)[:, 0]
    if len(hull) > 2 and (sides >= 0.0).all():
        return np.zeros(2), np.zeros((2, 2))
    share = np.clip(((point - hull) * edges).sum(axis=1) / (edges**2).sum(axis=1), 0.0, 1.0)
    from_edges = point - (hull + share[:, None] * edges)
    nearest = int((from_edges**2).sum(axis=1).argmin())
    if 0.0 < share[nearest] < 1.0:
        along = edges[nearest] / np.linalg.norm(edges[nearest])
        return from_edges[nearest], np.eye(2) - np.outer(along, along)
    return from_edges[nearest], np.eye(2)


def _cross(one: FloatArray, two: FloatArray) -> float:
    return float(one[0] * two[1] - one[1] * two[0])
