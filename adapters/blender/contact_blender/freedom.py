"""What a bone may do: rotation mode, locks, Limit Rotation and IK limits as a `JointFreedom`, and back.

A Blender bone's channels are its `matrix_basis` = translation @ rotation @ scale, beside the rest matrix: just the
frame of a `JointFreedom`. Blender's Euler order XYZ turns about x first, in fixed axes, which is the intrinsic
order ZYX: orders are read backwards here.
"""

from __future__ import annotations

import contextlib
import json
import math
from typing import Any

import numpy as np

from contact_core.arrays import BoolArray, FloatArray
from contact_core.rig.rig import JointFreedom

AXES = "XYZ"
_KEPT = "contact_freedom"


def freedom_of(pose_bone: Any, translates: bool, driven: BoolArray | None = None) -> JointFreedom:
    """The freedom of a pose bone: what `write_freedom` gave it, or what the artist has set since or before.

    driven: (6,) the turns about and shifts along x, y, z that drivers set, which are locked.
    """
    native = _native(pose_bone, translates, np.zeros(6, bool) if driven is None else driven)
    kept = pose_bone.get(_KEPT)
    if isinstance(kept, str) and (driven is None or not driven.any()):
        with contextlib.suppress(
            ValueError, KeyError, TypeError
        ):  # somebody else's or damaged: Blender's view counts
            exact, then = json.loads(kept)
            if then == _seen(pose_bone):
                return from_json(exact)
    return native


def _native(pose_bone: Any, translates: bool, driven: BoolArray) -> JointFreedom:
    """Blender's own view of a bone: a ball, or Euler angles as soon as a lock or a limit speaks of single axes.

    Limits are those of an enabled Limit Rotation constraint in local space; on the axes that it leaves free,
    the bone's IK limits. Locked: transform locks and IK locks. A bone that is stiff for IK is held to its rest the
    more. All angles are offsets from rest, radians.
    """
    lower, upper = limits_of(pose_bone)
    locked, prior = locks_of(pose_bone) | driven[:3], 1.0 / (1.0 - stiffness_of(pose_bone))
    still = np.array(pose_bone.lock_location, bool) | driven[3:] if translates else np.zeros(3, bool)
    limited = bool(np.isfinite(lower).any() or np.isfinite(upper).any())
    if not limited and (locked.all() or not locked.any()):
        return JointFreedom(
            "ball", locked=locked, prior_weight=prior, translates=translates, locked_translation=still
        )
    order = euler_order(pose_bone)[::-1]
    places = [AXES.index(axis) for axis in order]
    return JointFreedom(
        "euler", order=order, lower=lower[places], upper=upper[places], locked=locked[places],
        prior_weight=prior[places], translates=translates, locked_translation=still,
    )  # fmt: skip


def euler_order(pose_bone: Any) -> str:
    """Blender's order of the Euler angles in which the bone's limits are meant."""
    constraint = limit_rotation(pose_bone)
    chosen = getattr(constraint, "euler_order", "AUTO") if constraint else "AUTO"
    mode = pose_bone.rotation_mode if chosen == "AUTO" else chosen
    return str(mode) if sorted(mode) == list(AXES) else "XYZ"


def limit_rotation(pose_bone: Any) -> Any:
    """The enabled Limit Rotation constraint that limits the bone's own channels, or None."""
    return next((each for each in pose_bone.constraints if is_plain_limit(each)), None)


def is_plain_limit(constraint: Any) -> bool:
    """Whether a constraint only clamps the channels, so that a pose within its limits passes unchanged."""
    return bool(
        constraint.type == "LIMIT_ROTATION"
        and not constraint.mute
        and constraint.influence == 1.0
        and constraint.owner_space == "LOCAL"
    )


def limits_of(pose_bone: Any) -> tuple[Any, Any]:
    """(3,) lower and upper limits about x, y, z, radians; infinite where free."""
    lower, upper = np.full(3, -np.inf), np.full(3, np.inf)
    constraint = limit_rotation(pose_bone)
    for place, axis in enumerate(AXES.lower()):
        if constraint is not None and getattr(constraint, f"use_limit_{axis}"):
            lower[place], upper[place] = getattr(constraint, f"min_{axis}"), getattr(constraint, f"max_{axis}")
        elif getattr(pose_bone, f"use_ik_limit_{axis}"):
            lower[place], upper[place] = getattr(pose_bone, f"ik_min_{axis}"), getattr(pose_bone, f"ik_max_{axis}")
    return np.minimum(lower, upper), np.maximum(lower, upper)


def locks_of(pose_bone: Any) -> Any:
    """(3,) bool: rotation about x, y, z is locked, by the transform locks or for IK."""
    ik = [getattr(pose_bone, f"lock_ik_{axis}") for axis in AXES.lower()]
    return np.array(pose_bone.lock_rotation, bool) | np.array(ik, bool)


def stiffness_of(pose_bone: Any) -> FloatArray:
    """(3,) how stiff the bone is for IK about x, y, z: 0 .. 0.99, as Blender has it."""
    return np.array([min(getattr(pose_bone, f"ik_stiffness_{axis}"), 0.99) for axis in AXES.lower()])


def write_freedom(pose_bone: Any, freedom: JointFreedom) -> None:
    """Give a new bone this freedom: by Blender's own means as far as they reach, and exactly beside them.

    A frame other than the bone's axes has no likeness in Blender. So the freedom is kept on the bone as well,
    with Blender's own view of it: it counts until the artist changes a lock or a limit.
    """
    order = freedom.order if freedom.kind == "euler" else "XYZ"
    about = {"fixed": "", "hinge": "X", "euler": order, "ball": "XYZ"}[freedom.kind]
    locks, lower, upper = np.ones(3, bool), np.full(3, -np.inf), np.full(3, np.inf)
    along_bone = np.allclose(freedom.frame, np.eye(3), atol=1e-12)
    if freedom.kind in ("ball", "fixed") or along_bone:
        places = [AXES.index(axis) for axis in about]
        locks[places] = freedom.locked
        if freedom.kind != "ball" and places:
            lower[places], upper[places] = freedom.lower, freedom.upper
    else:
        locks[:] = False  # a turned hinge moves all three channels
    if freedom.kind in ("euler", "hinge"):
        pose_bone.rotation_mode = order[::-1]
    pose_bone.lock_rotation = tuple(bool(lock) for lock in locks)
    _add_limits(pose_bone, lower, upper)
    if pose_bone.parent is None:
        held = np.asarray(freedom.locked_translation) | (not freedom.translates)
        pose_bone.lock_location = tuple(bool(lock) for lock in held)
    pose_bone[_KEPT] = json.dumps([to_json(freedom), _seen(pose_bone)])


def _seen(pose_bone: Any) -> list[Any]:
    """What an artist can change of a bone's freedom, as plain values."""
    return [to_json(_native(pose_bone, False, np.zeros(6, bool))), list(pose_bone.lock_location)]


def _add_limits(pose_bone: Any, lower: Any, upper: Any) -> None:
    """A Limit Rotation constraint on the axes where (3,) lower or upper is finite."""
    limited = np.isfinite(lower) | np.isfinite(upper)
    if not limited.any():
        return
    constraint = pose_bone.constraints.new("LIMIT_ROTATION")
    constraint.owner_space = "LOCAL"
    for place in np.flatnonzero(limited):
        axis = AXES[place].lower()
        setattr(constraint, f"use_limit_{axis}", True)
        setattr(constraint, f"min_{axis}", max(float(lower[place]), -math.pi))
        setattr(constraint, f"max_{axis}", min(float(upper[place]), math.pi))


def to_json(freedom: JointFreedom) -> dict[str, Any]:
    """Plain values; infinite limits as None."""

    def plain(values: Any) -> list[float | None]:
        return [float(v) if math.isfinite(v) else None for v in values]

    return {
        "kind": freedom.kind, "order": freedom.order, "frame": np.asarray(freedom.frame).tolist(),
        "lower": plain(freedom.lower), "upper": plain(freedom.upper), "prior": plain(freedom.prior_weight),
        "locked": [bool(lock) for lock in np.asarray(freedom.locked)], "translates": freedom.translates,
        "follows": freedom.follows, "ratio": freedom.ratio,
        "locked_translation": [bool(lock) for lock in np.asarray(freedom.locked_translation)],
    }  # fmt: skip


def from_json(values: dict[str, Any]) -> JointFreedom:
    """The inverse of `to_json`. Raises InvalidInput or KeyError when the values are of something else."""

    def bounds(name: str, missing: float) -> list[float]:
        return [missing if v is None else float(v) for v in values[name]]

    return JointFreedom(
        values["kind"], np.array(values["frame"]), values["order"], np.array(bounds("lower", -np.inf)),
        np.array(bounds("upper", np.inf)), np.array(bounds("prior", 1.0)), np.array(values["locked"], bool),
        bool(values["translates"]), values.get("follows"), float(values.get("ratio", 1.0)),
        np.array(values.get("locked_translation", (False, False, False)), bool),
    )  # fmt: skip
