"""The record of a saved grasp: where the palm is to the object, how each bone is turned to the one before, which
patches touch. It needs neither of the two meshes, so another hand can take it over (ADR 0055)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from contact_core.arrays import FloatArray, frozen
from contact_core.document.codec import from_json, pretty, to_json
from contact_core.document.document import is_name
from contact_core.document.schema import open_envelope, parse_json
from contact_core.errors import FileRefused, InvalidInput, quoted
from contact_core.geometry.transform import is_rigid
from contact_core.grasping.slots import Kind
from contact_core.hands.description import Segment
from contact_core.rig.rig import Pose
from contact_core.sealed import sealed, unsealed

SCHEMA = "contact-core.grasp"
VERSION = 1
UPGRADES: dict[int, Callable[[dict[str, Any]], dict[str, Any]]] = {}
MAX_BYTES = 8 << 20
MOST_DIGITS, MOST_BONES, MOST_PADS, MOST_TAGS, MOST_JOINTS, MOST_SEEN = 32, 16, 400, 40, 4000, 1000
LONGEST_NOTE = 2000
PALM = "palm"


@dataclass(frozen=True, eq=False)
class SavedBone:
    """A bone of a digit. turn, rest: (3, 3) its frame (x along it, y to the palm, z flexion) as posed and at rest,
    in the frame of the bone before, the first in the palm's. flexes: whether it bends the digit. length: in hand
    lengths."""

    segment: Segment
    turn: FloatArray
    rest: FloatArray
    flexes: bool
    length: float

    def __post_init__(self) -> None:
        for name in ("turn", "rest"):
            object.__setattr__(self, name, _rotation(getattr(self, name), f"the {name} of a bone"))
        if not 0.0 <= self.length < 10.0:
            raise InvalidInput(f"the length of a bone is 0..10 hand lengths, but got {self.length}.")


@dataclass(frozen=True, eq=False)
class SavedDigit:
    """A digit. touches: whether it takes part in the grasp."""

    role: str
    bones: tuple[SavedBone, ...]
    touches: bool

    def __post_init__(self) -> None:
        _check_word(self.role, "the role of a digit")
        _check_count(self.bones, 1, MOST_BONES, "bones of a digit")


@dataclass(frozen=True, eq=False)
class SavedHand:
    """The hand that the grasp was made with. digest: of its surface. length: metres. pose: of its whole rig."""

    name: str
    digest: str
    side: Literal["left", "right", ""]
    length: float
    digits: tuple[SavedDigit, ...]
    pose: Pose

    def __post_init__(self) -> None:
        _check_count(self.digits, 1, MOST_DIGITS, "digits of a hand")
        _check_length(self.length, "the length of a hand")
        _check_count(self.pose.joints, 1, MOST_JOINTS, "joints of a pose")
        roles = [digit.role for digit in self.digits]
        if len(set(roles)) != len(roles):
            raise InvalidInput(f"the digits of a hand have roles of their own, but got {', '.join(roles)}.")
        if len(set(self.pose.joints)) != len(self.pose.joints):
            raise InvalidInput("the pose of a hand names a joint twice.")


@dataclass(frozen=True, eq=False)
class SavedPad:
    """A patch of the hand that touches, as bones see it.

    role: of its digit, or "palm". segment: of the bone below it. at: (3,) the middle of its axis: along the bone in
    bone lengths and zero twice for a digit, in the palm's frame in hand lengths for the palm. out: (3,) unit, from
    there to the skin; axis: (3,) unit, the way its axis runs; both in the frame of the bone or the palm. depth: of
    the bone under the skin, in hand lengths: how thick the digit is; 0 for the palm.
    """

    patch: str
    role: str
    segment: Segment
    at: FloatArray
    out: FloatArray
    axis: FloatArray
    depth: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.depth < 10.0:
            raise InvalidInput(f"the depth of a bone is 0..10 hand lengths, but got {self.depth}.")
        _check_word(self.patch, "a pad")
        _check_word(self.role, "the digit of a pad")
        object.__setattr__(self, "at", _numbers(self.at, (3,), "where a pad is"))
        for name in ("out", "axis"):
            object.__setattr__(self, name, _unit(getattr(self, name), f"{name} of a pad"))


@dataclass(frozen=True, eq=False)
class SavedObject:
    """The object. digest: of its surface. frame: (4, 4) rigid, metres, its own space from that of its main axes,
    the middle of its box between them at the origin. half: (3,) half its extents along them, metres. up_axis: its
    scene's."""

    name: str
    digest: str
    frame: FloatArray
    half: FloatArray
    up_axis: Literal["X", "Y", "Z"] = "Y"

    def __post_init__(self) -> None:
        object.__setattr__(self, "frame", _rigid(self.frame, "the frame of an object"))
        half = _numbers(self.half, (3,), "the extents of an object")
        object.__setattr__(self, "half", half)
        if half.min() < 0.0 or half.max() <= 0.0:
            raise InvalidInput(f"the extents of an object are positive, but got {half.tolist()}.")


@dataclass(frozen=True, eq=False)
class Grasp:
    """A saved grasp.

    placed: (4, 4) rigid, metres: object space from the palm's frame (x out of the palm, y along the fingers, z
    across; the palm's own point at its origin). seen: (p,) signed distances of the object at `places.seen_points`,
    hand lengths. origin: who or what made it, in words.
    """

    kind: Kind
    hand: SavedHand
    object: SavedObject
    placed: FloatArray
    pads: tuple[SavedPad, ...]
    seen: FloatArray
    tags: tuple[str, ...] = ()
    note: str = ""
    origin: str = field(default="")

    def __post_init__(self) -> None:
        object.__setattr__(self, "placed", _rigid(self.placed, "the place of the palm"))
        object.__setattr__(self, "seen", _numbers(self.seen, (None,), "what a hand sees"))
        _check_count(self.seen, 1, MOST_SEEN, "distances that a hand sees")
        _check_count(self.pads, 0, MOST_PADS, "pads of a grasp")
        _check_count(self.tags, 0, MOST_TAGS, "tags of a grasp")
        for tag in self.tags:
            _check_word(tag, "a tag")
        if max(len(self.note), len(self.origin)) > LONGEST_NOTE:
            raise InvalidInput(f"a note has at most {LONGEST_NOTE} letters, but got {len(self.note)}.")

    @property
    def touching(self) -> tuple[str, ...]:
        """The roles of the digits that take part."""
        return tuple(digit.role for digit in self.hand.digits if digit.touches)


def dump_grasp(grasp: Grasp) -> str:
    """JSON text, sorted, the same for the same grasp."""
    return pretty(sealed({"schema": SCHEMA, "version": VERSION, **to_json(grasp, Grasp)})) + "\n"


def parse_grasp(text: bytes, source: str) -> Grasp:
    """The grasp in JSON. Raises FileRefused for what is none, is damaged, or is newer than this release."""
    if len(text) > MAX_BYTES:
        raise FileRefused(f"{source} has {len(text)} bytes; a grasp has at most {MAX_BYTES}.")
    data = parse_json(text, source)
    open_envelope(data, SCHEMA, VERSION, UPGRADES, source)  # what it is comes before whether it is whole
    body = open_envelope(unsealed(data, source), SCHEMA, VERSION, UPGRADES, source)
    found: Grasp = from_json(Grasp, body, source)
    return found


def _numbers(values: Any, shape: tuple[int | None, ...], what: str) -> FloatArray:
    array = frozen(values, np.float64, shape, what)
    if not np.isfinite(array).all() or np.abs(array).max(initial=0.0) > 1e6:
        raise InvalidInput(f"{what} is made of finite numbers of a sensible size.")
    return array


def _rotation(values: Any, what: str) -> FloatArray:
    turn = _numbers(values, (3, 3), what)
    if np.abs(turn @ turn.T - np.eye(3)).max() > 1e-6 or np.linalg.det(turn) < 0.0:
        raise InvalidInput(f"{what} is a rotation, a right-handed matrix of unit axes.")
    return turn


def _rigid(values: Any, what: str) -> FloatArray:
    matrix = _numbers(values, (4, 4), what)
    if not is_rigid(matrix):
        raise InvalidInput(f"{what} turns and moves, and does nothing else, but got a matrix that does.")
    return matrix


def _unit(values: Any, what: str) -> FloatArray:
    way = _numbers(values, (3,), what)
    if abs(float(np.linalg.norm(way)) - 1.0) > 1e-6:
        raise InvalidInput(f"{what} is a unit direction, but got {way.tolist()}.")
    return way


def _check_word(word: str, what: str) -> None:
    if not is_name(word):
        raise InvalidInput(f"{what} is printable text without spaces at its ends, but got {quoted(word)}.")


def _check_count(items: Any, least: int, most: int, what: str) -> None:
    if not least <= len(items) <= most:
        raise InvalidInput(f"{least} to {most} {what} are taken, but got {len(items)}.")


def _check_length(length: float, what: str) -> None:
    if not 1e-6 < length < 1e6:
        raise InvalidInput(f"{what} is a positive number of metres, but got {length}.")
