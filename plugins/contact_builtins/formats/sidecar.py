"""rig.toml: what a skin file cannot say. Parents, hinges, limits, locks, priors, sides (docs/rig-sidecar.md)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Literal

import numpy as np

from contact_builtins.formats.refusal import file_bytes
from contact_core.arrays import FloatArray
from contact_core.errors import FileRefused, InvalidInput, quoted
from contact_core.hands.description import HandWords
from contact_core.rig.rig import ROTATION_DOFS, JointFreedom
from contact_core.strict_table import parse_toml

SCHEMA = 1
LONGEST_NAME = 500  # letters of a joint's name or pattern: matching grows with their square
AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1), "-x": (-1, 0, 0), "-y": (0, -1, 0), "-z": (0, 0, -1)}
ANGLES = ("twist", "spread", "flexion")  # about the frame's x, y, z
TOP_KEYS = {"schema", "meters_per_unit", "up_axis", "guess", "joint", "mirror", "hand"}
HAND_KEYS = {"hub", "thumb", "side", "palm", "digits"}
JOINT_KEYS = {
    "match", "parent", "kind", "order", "bone", "palmar", "axis", "limits", *ANGLES, "lock", "prior", "translates",
}  # fmt: skip


@dataclass(frozen=True)
class Sidecar:
    """A parsed rig.toml. rules: the [[joint]] tables in order; a later rule overrides an earlier one."""

    path: Path
    rules: tuple[dict[str, Any], ...] = ()
    mirror: dict[str, str] = field(default_factory=dict)
    guess: bool = True
    meters_per_unit: float | None = None
    up_axis: Literal["X", "Y", "Z"] | None = None
    hands: tuple[HandWords, ...] = ()

    def parents(self, names: Sequence[str]) -> dict[str, str]:
        """Parent by joint name, for the joints that a rule gives one. Raises FileRefused on unknown parents."""
        found: dict[str, str] = {}
        for rule in self.rules:
            for name in self._matches(rule, names):
                if "parent" in rule:
                    found[name] = rule["parent"]
        for name, parent in found.items():
            if parent and parent not in names:
                raise FileRefused(
                    f"{self.path}: joint {name!r} wants the parent {quoted(parent)}, which the rig has not."
                )
        return found

    def freedoms(self, names: Sequence[str], guessed: Sequence[JointFreedom]) -> tuple[JointFreedom, ...]:
        """The freedoms of joints: the guesses, changed by every rule that matches. Raises FileRefused."""
        result = dict(zip(names, guessed, strict=True))
        for rule in self.rules:
            for name in self._matches(rule, names):
                try:
                    result[name] = _changed(result[name], rule)
                except InvalidInput as error:
                    raise FileRefused(f"{self.path}: the rule for {quoted(rule['match'])}: {error}") from error
                except (TypeError, ValueError, KeyError, OverflowError) as error:
                    raise FileRefused(
                        f"{self.path}: the rule for {quoted(rule['match'])} holds a value of another kind than is"
                        " wanted; docs/rig-sidecar.md has them all."
                    ) from error
        return tuple(result[name] for name in names)

    def _matches(self, rule: dict[str, Any], names: Sequence[str]) -> list[str]:
        patterns = [rule["match"]] if isinstance(rule["match"], str) else rule["match"]
        matched = [name for name in names if any(fnmatchcase(name, pattern) for pattern in patterns)]
        if not matched:
            raise FileRefused(
                f"{self.path}: {quoted(rule['match'])} matches no joint; the rig has {', '.join(list(names)[:6])}"
                f"{', ...' if len(names) > 6 else '.'}"
            )
        return matched


def sidecar_beside(path: Path) -> Path | None:
    """`hand.rig.toml` for `hand.glb`, when it is there."""
    candidate = path.with_name(path.stem + ".rig.toml")
    return candidate if candidate.is_file() else None


def read_sidecar(path: Path) -> Sidecar:
    """Parse and check a rig.toml. Raises FileRefused with the key that is wrong."""
    try:
        table = parse_toml(file_bytes(path).decode(), str(path))
    except UnicodeDecodeError as error:
        raise FileRefused(f"{path} is not TOML: it is not UTF-8 text.") from error
    except InvalidInput as error:
        raise FileRefused(str(error)) from error
    if table.get("schema") != SCHEMA:
        raise FileRefused(
            f"{path} needs the line `schema = {SCHEMA}` first, but got {quoted(table.get('schema'))}."
        )
    _known(path, table, TOP_KEYS, "the top level")
    rules = table.get("joint", [])
    if not isinstance(rules, list) or not all(isinstance(rule, dict) for rule in rules):
        raise FileRefused(f"{path}: joints are written as [[joint]] tables.")
    for rule in rules:
        _known(path, rule, JOINT_KEYS, "a [[joint]]")
        patterns = rule.get("match")
        listed = patterns if isinstance(patterns, list) else [patterns]
        if not all(isinstance(pattern, str) and len(pattern) <= LONGEST_NAME for pattern in listed):
            raise FileRefused(f"{path}: each [[joint]] needs `match`, a joint name or pattern, or a list of them.")
        if not isinstance(rule.get("parent", ""), str):
            raise FileRefused(f'{path}: `parent` of {quoted(patterns)} must be a joint name, or "" for a root.')
    mirror = table.get("mirror", {})
    if not isinstance(mirror, dict) or not all(isinstance(name, str) for name in mirror.values()):
        raise FileRefused(f"{path}: [mirror] maps left joint names to right joint names.")
    scale, up = table.get("meters_per_unit"), table.get("up_axis")
    if scale is not None and not (isinstance(scale, int | float) and 0 < scale < float("inf")):
        raise FileRefused(f"{path}: meters_per_unit must be a positive number, but got {quoted(scale)}.")
    if up not in (None, "X", "Y", "Z"):
        raise FileRefused(f'{path}: up_axis is "X", "Y" or "Z", but got {quoted(up)}.')
    return Sidecar(
        path, tuple(rules), mirror, bool(table.get("guess", True)), scale, up, _hands(path, table.get("hand", []))
    )


def _hands(path: Path, tables: Any) -> tuple[HandWords, ...]:
    """What [[hand]] tables say. Raises FileRefused."""
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        raise FileRefused(f"{path}: hands are written as [[hand]] tables.")
    for table in tables:
        _known(path, table, HAND_KEYS, "a [[hand]]")
        if not isinstance(table.get("hub"), str) or not isinstance(table.get("thumb", ""), str):
            raise FileRefused(
                f"{path}: each [[hand]] needs `hub`, the joint at which its digits part; `thumb` is a joint."
            )
        if table.get("side", "") not in ("", "left", "right"):
            raise FileRefused(f'{path}: side is "left" or "right", but got {quoted(table["side"])}.')
        digits = table.get("digits", {})
        if not isinstance(digits, dict) or not all(isinstance(name, str) for name in digits.values()):
            raise FileRefused(f"{path}: `digits` of a [[hand]] maps roles to joint names.")
    try:
        return tuple(
            HandWords(**{**table, "palm": tuple(_direction(table["palm"]).tolist()) if "palm" in table else None})
            for table in tables
        )
    except (InvalidInput, TypeError, ValueError) as error:
        said = str(error) if isinstance(error, InvalidInput) else f"it is a direction, but got {quoted(tables)}."
        raise FileRefused(f"{path}: `palm` of a [[hand]]: {said}") from error


def _known(path: Path, table: dict[str, Any], keys: set[str], where: str) -> None:
    unknown = sorted(set(table) - keys)
    if unknown:
        raise FileRefused(f"{path}: {where} has no {quoted(unknown[0])}; it knows {', '.join(sorted(keys))}.")


def _changed(freedom: JointFreedom, rule: dict[str, Any]) -> JointFreedom:
    """A freedom after one rule. Raises InvalidInput, TypeError or ValueError."""
    kind = rule.get("kind", "hinge" if "axis" in rule else freedom.kind)
    if kind not in ROTATION_DOFS:
        raise InvalidInput(f"kind is one of {', '.join(ROTATION_DOFS)}, but got {quoted(kind)}")
    if kind != freedom.kind:
        freedom = JointFreedom(kind=kind, frame=freedom.frame, translates=freedom.translates)
    if "axis" in rule:
        x = _direction(rule["axis"])
        freedom = replace(freedom, frame=_frame(x, np.eye(3)[int(np.abs(x).argmin())]))
    if "bone" in rule or "palmar" in rule:
        bone = _direction(rule["bone"]) if "bone" in rule else freedom.frame[:, 0]
        freedom = replace(
            freedom, frame=_frame(bone, _direction(rule["palmar"]) if "palmar" in rule else freedom.frame[:, 1])
        )
    if "order" in rule:
        freedom = replace(freedom, order=rule["order"])
    if "translates" in rule:
        freedom = replace(freedom, translates=bool(rule["translates"]))
    freedom = _limited(freedom, rule)
    if "prior" in rule:
        weights = np.broadcast_to(np.asarray(rule["prior"], float), ROTATION_DOFS[freedom.kind])
        if not (np.isfinite(weights).all() and (weights >= 0).all()):
            raise InvalidInput(f"prior weights are not negative, but got {quoted(rule['prior'])}")
        freedom = replace(freedom, prior_weight=np.array(weights))
    return _locked(freedom, rule["lock"]) if "lock" in rule else freedom


def _limited(freedom: JointFreedom, rule: dict[str, Any]) -> JointFreedom:
    """Limits in degrees: `limits` of a hinge, or twist, spread, flexion of an Euler joint."""
    given = {key: rule[key] for key in (*ANGLES, "limits") if key in rule}
    if not given:
        return freedom
    lower, upper = np.array(freedom.lower), np.array(freedom.upper)
    for key, pair in given.items():
        low, high = (float(value) for value in pair)
        if not low <= high:
            raise InvalidInput(f"{key} goes from a smaller to a larger angle, but got {quoted(pair)}")
        if key in ANGLES and freedom.kind == "euler":
            dof = ANGLES.index(key)
        elif key not in ANGLES and freedom.kind == "hinge":
            dof = 0
        else:
            raise InvalidInput(f'{key} does not fit a {freedom.kind} joint; set kind = "euler" or "hinge"')
        lower[dof], upper[dof] = np.radians(low), np.radians(high)
    return replace(freedom, lower=lower, upper=upper)


def _locked(freedom: JointFreedom, lock: Any) -> JointFreedom:
    """`lock = true` holds every rotation; a list names the angles to hold."""
    if isinstance(lock, bool):
        return replace(freedom, locked=np.full(ROTATION_DOFS[freedom.kind], lock))
    if freedom.kind != "euler" or not set(lock) <= set(ANGLES):
        raise InvalidInput(
            f"lock is true, false, or a list of {', '.join(ANGLES)} on an Euler joint, but got {quoted(lock)}"
        )
    return replace(freedom, locked=np.array([angle in lock for angle in ANGLES]))


def _direction(value: Any) -> FloatArray:
    """(3,) unit vector in joint axes: "x", "-z", or three numbers."""
    vector = np.asarray(AXES[value] if isinstance(value, str) and value in AXES else value, float)
    length = float(np.linalg.norm(vector)) if vector.shape == (3,) else 0.0
    if not (np.isfinite(length) and length > 0):
        raise InvalidInput(f"a direction is one of {', '.join(AXES)} or three numbers, but got {value!r}")
    return vector / length


def _frame(x: FloatArray, y: FloatArray) -> FloatArray:
    """(3, 3) columns x, the part of y across it, and their cross product. Raises InvalidInput when parallel."""
    y = y - (y @ x) * x
    length = float(np.linalg.norm(y))
    if length < 1e-6:
        raise InvalidInput("bone and palmar point the same way")
    y = y / length
    return np.stack([x, y, np.cross(x, y)], axis=1)
