"""Kernels of charts: forward kinematics with its velocity fields, joint by joint (see chart.py).

Per joint j: kind (no turns, a rotation vector, an Euler chain), count of its turning dofs, first of them,
moving: the first of its translating dofs or -1, euler: (3,) axes, frame: (3, 3) of its freedom.
"""

from __future__ import annotations

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.jit import constant, inner, kernel

VECTOR, EULER = constant(1), constant(2)  # kinds, as Chart lays them out; 0 does not turn


@kernel
def turns(
    theta: FloatArray,
    kind: IntArray,
    count: IntArray,
    first: IntArray,
    moving: IntArray,
    euler: IntArray,
    frames: FloatArray,
    turn: FloatArray,
    left: FloatArray,
    motion: FloatArray,
    axes: FloatArray,
) -> None:
    """Write motions (j, 4, 4), turning axes (d, 3) at theta (d,), in rest frames. turn, left: (3, 3) scratch."""
    for j in range(len(kind)):
        frame = frames[j]
        if kind[j] == EULER:
            _write_identity(turn)
            for i in range(3):
                axis = euler[j, i]
                for a in range(3):
                    axes[first[j] + i, a] = (
                        frame[a, 0] * turn[0, axis] + frame[a, 1] * turn[1, axis] + frame[a, 2] * turn[2, axis]
                    )
                sine, cosine = np.sin(theta[first[j] + i]), np.cos(theta[first[j] + i])
                p, q = (axis + 1) % 3, (axis + 2) % 3
                for a in range(3):
                    x, y = turn[a, p], turn[a, q]
                    turn[a, p], turn[a, q] = cosine * x + sine * y, cosine * y - sine * x
        elif kind[j] == VECTOR:
            x = theta[first[j]]
            y = theta[first[j] + 1] if count[j] > 1 else 0.0
            z = theta[first[j] + 2] if count[j] > 1 else 0.0
            _write_exponential(x, y, z, turn, left)
            for i in range(count[j]):
                for a in range(3):
                    axes[first[j] + i, a] = (
                        frame[a, 0] * left[0, i] + frame[a, 1] * left[1, i] + frame[a, 2] * left[2, i]
                    )
        else:
            _write_identity(turn)
        for a in range(3):
            for b in range(3):
                left[a, b] = frame[a, 0] * turn[0, b] + frame[a, 1] * turn[1, b] + frame[a, 2] * turn[2, b]
        for a in range(3):
            for b in range(3):
                motion[j, a, b] = left[a, 0] * frame[b, 0] + left[a, 1] * frame[b, 1] + left[a, 2] * frame[b, 2]
            motion[j, a, 3] = theta[moving[j] + a] if moving[j] >= 0 else 0.0
            motion[j, 3, a] = 0.0
        motion[j, 3, 3] = 1.0


@inner
def _write_identity(turn: FloatArray) -> None:
    for a in range(3):
        for b in range(3):
            turn[a, b] = 1.0 if a == b else 0.0


@inner
def _write_exponential(x: float, y: float, z: float, turn: FloatArray, left: FloatArray) -> None:
    """Write the rotation of a rotation vector, and its left Jacobian, as `rotations.exponential` has them."""
    square = x * x + y * y + z * z
    angle = np.sqrt(square)
    if angle < 1e-4:  # series, where the quotients cancel
        one, two, three = 1.0 - square / 6.0, 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0
    else:
        one = np.sin(angle) / angle
        two = (1.0 - np.cos(angle)) / square
        three = (angle - np.sin(angle)) / (square * angle)
    v = (x, y, z)
    for a in range(3):
        for b in range(3):
            outer = v[a] * v[b] - (square if a == b else 0.0)  # of the squared cross matrix
            cross = 0.0
            if b == (a + 1) % 3:
                cross = -v[(a + 2) % 3]
            elif b == (a + 2) % 3:
                cross = v[(a + 1) % 3]
            same = 1.0 if a == b else 0.0
            turn[a, b] = same + one * cross + two * outer
            left[a, b] = same + two * cross + three * outer


@kernel
def move(
    count: IntArray,
    first: IntArray,
    moving: IntArray,
    order: IntArray,
    parents: IntArray,
    world_from_rig: FloatArray,
    rest: FloatArray,
    motion: FloatArray,
    leftover: FloatArray,
    axes: FloatArray,
    is_rigid: bool,
    frame: FloatArray,
    moved: FloatArray,
    world: FloatArray,
    generators: FloatArray,
) -> None:
    """Write world_from_joint (j, 4, 4) and the velocity fields (d, 3, 4) of dofs that move a joint.

    order: joints, parents first. leftover: (j, 4, 4), or (0, 4, 4) for none. frame, moved: (4, 4) scratch.
    """
    for j in order:
        _write_product(world_from_rig if parents[j] < 0 else world[parents[j]], rest[j], frame)
        if len(leftover):
            _write_product(frame, motion[j], moved)
            _write_product(moved, leftover[j], world[j])
        else:
            _write_product(frame, motion[j], world[j])
        x, y, z = motion[j, 0, 3], motion[j, 1, 3], motion[j, 2, 3]
        for a in range(3):  # the centre of the turns
            moved[a, 3] = frame[a, 3] + frame[a, 0] * x + frame[a, 1] * y + frame[a, 2] * z
        for q in range(first[j], first[j] + count[j]):
            if is_rigid:
                _write_cross(frame, axes[q], generators[q])
            else:
                _write_sheared(frame, axes[q], moved, generators[q])
            for a in range(3):
                generators[q, a, 3] = -(
                    generators[q, a, 0] * moved[0, 3]
                    + generators[q, a, 1] * moved[1, 3]
                    + generators[q, a, 2] * moved[2, 3]
                )
        if moving[j] >= 0:
            for q in range(3):
                for a in range(3):
                    generators[moving[j] + q, a, 3] = frame[a, q]


@inner
def _write_product(one: FloatArray, two: FloatArray, product: FloatArray) -> None:
    """Write the product of two affine transforms (4, 4)."""
    for a in range(3):
        for b in range(4):
            product[a, b] = one[a, 0] * two[0, b] + one[a, 1] * two[1, b] + one[a, 2] * two[2, b]
        product[a, 3] += one[a, 3]
        product[3, a] = 0.0
    product[3, 3] = 1.0


@inner
def _write_cross(frame: FloatArray, axis: FloatArray, field: FloatArray) -> None:
    """Write how points turn about an axis (3,) of a rigid frame (4, 4)."""
    x = frame[0, 0] * axis[0] + frame[0, 1] * axis[1] + frame[0, 2] * axis[2]
    y = frame[1, 0] * axis[0] + frame[1, 1] * axis[1] + frame[1, 2] * axis[2]
    z = frame[2, 0] * axis[0] + frame[2, 1] * axis[1] + frame[2, 2] * axis[2]
    field[2, 1], field[1, 2] = x, -x
    field[0, 2], field[2, 0] = y, -y
    field[1, 0], field[0, 1] = z, -z


@inner
def _write_sheared(frame: FloatArray, axis: FloatArray, scratch: FloatArray, field: FloatArray) -> None:
    """Write A [axis] A^-1 with A the linear part of a frame (4, 4): a scaled parent makes a shear of a turn."""
    for c in range(3):
        p, q = (c + 1) % 3, (c + 2) % 3
        for a in range(3):  # A [axis], column c of which is A (axis x e_c)
            scratch[a, c] = frame[a, p] * axis[q] - frame[a, q] * axis[p]
    determinant = 0.0
    for c in range(3):
        p, q = (c + 1) % 3, (c + 2) % 3
        determinant += frame[0, c] * (frame[1, p] * frame[2, q] - frame[1, q] * frame[2, p])
    for a in range(3):
        for b in range(3):
            p, q = (b + 1) % 3, (b + 2) % 3
            value = 0.0
            for c in range(3):  # A^-1[c, b] is the cofactor of A[b, c] by the determinant
                r, s = (c + 1) % 3, (c + 2) % 3
                value += scratch[a, c] * (frame[p, r] * frame[q, s] - frame[p, s] * frame[q, r])
            field[a, b] = value / determinant
