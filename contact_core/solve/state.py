"""A pose problem at one theta: what terms ask for points, forces and Gauss-Newton matrices.

Everything is computed when first asked for and kept, so that a trial step costs forward kinematics and one
product, and an accepted step adds the derivatives.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.rig.chart import Motion
from contact_core.rig.skinning import outward_carrier
from contact_core.rig.track import Gram, Track
from contact_core.solve.black_box import BlackBoxMotion
from contact_core.solve.layout import DofLayout


class PoseState:
    """All bodies of a layout at theta (d,), the values of its free dofs. Read-only for terms."""

    def __init__(self, layout: DofLayout, theta: FloatArray) -> None:
        self.layout = layout
        self.theta: FloatArray = np.array(theta, dtype=np.float64)  # a copy: solvers reuse their buffers
        # By identity; the track is kept beside its vectors so that its id stays its own.
        self._vectors: dict[int, tuple[Track, FloatArray]] = {}
        self._derivatives: dict[tuple[int, bytes], FloatArray] = {}
        self._differences: dict[int, FloatArray] = {}  # of black boxes, by the width of a track
        self.memory: dict[object, Any] = {}  # what bound terms keep of this state for themselves

    @cached_property
    def motions(self) -> tuple[Motion | BlackBoxMotion, ...]:
        """The motion of every body, in the layout's order."""
        return self.layout.motions(self.theta)

    @cached_property
    def world(self) -> FloatArray:
        """(j, 4, 4) world_from_joint of all bones of all bodies."""
        return np.concatenate([motion.world for motion in self.motions])

    def vectors(self, track: Track) -> FloatArray:
        """(k, 3) what a track carries here: points, or normals that are not normalised."""
        if not self.layout.is_still(track):
            return self.carried(track)
        kept = self.layout.still_tracks  # the same at every theta
        if id(track) not in kept:
            kept[id(track)] = track, self.carried(track)
        return kept[id(track)][1]

    def carried(self, track: Track) -> FloatArray:
        """(k, 3) the vectors of a track, computed here, whether or not they move."""
        key = id(track)
        if key not in self._vectors:
            carrier = self._bones if track.width == 4 else self._carriers
            vectors = track.carried(carrier)
            if track.watched is not None:
                vectors = vectors + track.watched @ self._watched[track.width]
            self._vectors[key] = track, vectors
        return self._vectors[key][1]

    def pull(self, track: Track, forces: FloatArray) -> FloatArray:
        """(d,) gradient of an energy whose derivative by the track's vectors is `forces` (k, 3).

        The virtual work of the forces: accumulated per bone first, so the cost hardly knows d or k.
        """
        if self.layout.is_still(track):
            return np.zeros(len(self.theta))
        result = self._pull_on_bones(track, forces)
        if self._moves_watched(track):
            moved = self._watched_derivative(track.width)  # (q, m, 3)
            result[self.layout.watched_dofs] += moved.reshape(len(moved), -1) @ (track.watched.T @ forces).ravel()
        return result

    def _pull_on_bones(self, track: Track, forces: FloatArray) -> FloatArray:
        """(d,) the virtual work of forces (k, 3) through the bones alone."""
        per_bone = track.gathered_by_bones(forces)  # (width b, 3)
        result: FloatArray = self._derivative(track).reshape(len(self.theta), -1) @ per_bone.T.ravel()
        return result

    def quadratic(self, track: Track, gram: Gram) -> FloatArray:
        """(d, d) sum_i w_i J_i^T J_i over the track's rows, from `track.gram(w)`; costs nothing per row that is not
        watched."""
        d = len(self.theta)
        moved = self._derivative(track)  # (d, 3, width b)
        result = (moved.reshape(3 * d, -1) @ gram.matrix).reshape(d, -1) @ moved.reshape(d, -1).T
        if self._moves_watched(track):
            own = self._watched_rows(track)  # (q, k, 3)
            weighted, dofs = own * gram.weights[:, None], self.layout.watched_dofs
            cross = np.stack([self._pull_on_bones(track, forces) for forces in weighted], axis=1)  # (d, q)
            result[:, dofs] += cross
            result[dofs] += cross.T
            result[np.ix_(dofs, dofs)] += weighted.reshape(len(own), -1) @ own.reshape(len(own), -1).T
        return result

    def jacobian(self, track: Track) -> FloatArray:
        """(k, 3, d) derivative of the track's vectors."""
        d = len(self.theta)
        flat = track.times(self._derivative(track).reshape(3 * d, -1).T)  # (k, 3 d)
        result: FloatArray = flat.reshape(len(track), d, 3).transpose(0, 2, 1)
        if self._moves_watched(track):
            result[:, :, self.layout.watched_dofs] += self._watched_rows(track).transpose(1, 2, 0)
        return result

    @cached_property
    def _watched(self) -> dict[int, FloatArray]:
        """(m, 3) what black boxes evaluate: points under 4, normals under 3, as the widths of tracks."""
        boxes = [motion for motion in self.motions if isinstance(motion, BlackBoxMotion)]
        return {4: np.concatenate([b.points for b in boxes]), 3: np.concatenate([b.normals for b in boxes])}

    def _moves_watched(self, track: Track) -> bool:
        """Whether free dofs of black boxes move what a track carries."""
        return track.watched is not None and len(self.layout.watched_dofs) > 0

    def _watched_rows(self, track: Track) -> FloatArray:
        """(q, k, 3) derivative by the q dofs of black boxes of what a track takes from them."""
        moved = self._watched_derivative(track.width)  # (q, m, 3)
        q, m, _ = moved.shape
        rows = track.watched @ moved.transpose(1, 0, 2).reshape(m, 3 * q)
        return np.asarray(rows.reshape(-1, q, 3).transpose(1, 0, 2))

    def _watched_derivative(self, width: int) -> FloatArray:
        """(q, m, 3) derivative of what black boxes evaluate by their q dofs, all others leave it where it is."""
        if not self._differences:
            shape = len(self.layout.watched_dofs), len(self._watched[4]), 3
            self._differences.update({4: np.zeros(shape), 3: np.zeros(shape)})
            first = row = 0
            for index, motion in enumerate(self.motions):
                if isinstance(motion, BlackBoxMotion):
                    free = self.layout.free_of_body[index]
                    rows, columns = slice(row, row + len(free)), slice(first, first + len(motion.points))
                    moved, turned = motion.derivatives(free)
                    self._differences[4][rows, columns], self._differences[3][rows, columns] = moved, turned
                    first, row = first + len(motion.points), row + len(free)
        return self._differences[width]

    @cached_property
    def _bones(self) -> FloatArray:
        """(4 j, 3) all bone matrices, transposed, below one another."""
        return self.world[:, :3].transpose(0, 2, 1).reshape(-1, 3)

    @cached_property
    def _carriers(self) -> FloatArray:
        """(3 j, 3) what carries outward normals, transposed, below one another."""
        linear = self.world[:, :3, :3] if self.layout.is_rigid else outward_carrier(self.world)
        return linear.transpose(0, 2, 1).reshape(-1, 3)

    @cached_property
    def _generators(self) -> FloatArray:
        """(e, 3, 4) velocity fields of the free dofs and of those that follow them."""
        parts = [m.generators[rows] for m, rows in zip(self.motions, self.layout.fields_of_body, strict=True)]
        return np.concatenate(parts)

    def _derivative(self, track: Track) -> FloatArray:
        """(d, 3, width b) derivative of the bones (or normal carriers) that a track uses."""
        key = (track.width, track.bones.tobytes())
        if key not in self._derivatives:
            d, b = len(self.layout.field_moves), len(track.bones)
            if track.width == 4:
                fields, carrier = self._generators, self.world.transpose(1, 0, 2)[:, track.bones].reshape(4, -1)
            else:
                linear = self._generators[:, :, :3]
                fields = np.einsum("daa->d", linear)[:, None, None] * np.eye(3) - linear.transpose(0, 2, 1)
                carrier = self._carriers[track.columns].T
            moved = (fields.reshape(3 * d, -1) @ carrier).reshape(d, 3, b, track.width)
            moved *= self.layout.field_moves[:, None, track.bones, None]
            coupling = self.layout.coupling
            moved = moved.reshape(d, -1) if coupling is None else coupling @ moved.reshape(d, -1)
            self._derivatives[key] = moved.reshape(len(self.theta), 3, -1)
        return self._derivatives[key]
