"""Time in a document: the range and rate of the film, keys of what changes in it, and spans in which pairs hold.

A value without a track holds throughout. A track is keys in the order of their frames, kept under an address: what
it is of and of which, as in "placement/thumb tip". Frames are numbers as an animator counts them, whole or not.
Everything is plain data; `ContactDocument.at` says what it comes to at a frame.
"""

from __future__ import annotations

import itertools
import math
from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeVar
from weakref import WeakKeyDictionary

import numpy as np

from contact_core.arrays import FloatArray, frozen
from contact_core.contact.placement import Root, Walk
from contact_core.errors import InvalidInput
from contact_core.geometry.transform import is_rigid
from contact_core.motion.placement_keys import INTERPOLATIONS, Interpolation, PlacementKey, PlacementKeys
from contact_core.rig.rig import Pose
from contact_core.solve.body import Hold, check_hold

if TYPE_CHECKING:
    from contact_core.rig.pose_keys import PoseKeys

TrackKind = Literal["placement", "pose", "place", "weight"]
FILM = "film"  # the one timeline that a document has
MOST_FRAMES = 1_000_000  # of a film: eleven hours at 24 frames a second
LARGEST_FRAME = 1e9  # beyond it the parts of a frame are lost to rounding, and then whole frames
CAPTURED = "clip"  # where a key comes from that was captured or animated elsewhere
SURFACE = ("surface",)  # the one "joint" of an object that is placed


@dataclass(frozen=True, slots=True)
class Timeline:
    """rate: frames per second as a fraction, (24000, 1001) for 23.976. first, last: the range of the film."""

    rate: tuple[int, int] = (24, 1)
    first: float = 0.0
    last: float = 0.0

    def __post_init__(self) -> None:
        if len(self.rate) != 2 or not all(0 < part <= 1_000_000 for part in self.rate):
            raise InvalidInput(f"a rate is a fraction of two positive whole numbers, but got {self.rate}.")
        if not -math.inf < self.first <= self.last < math.inf:
            raise InvalidInput(f"a range runs from a frame to a later one, but got {self.first} to {self.last}.")
        if self.last - self.first > MOST_FRAMES or max(abs(self.first), abs(self.last)) > LARGEST_FRAME:
            raise InvalidInput(
                f"a range has at most {MOST_FRAMES} frames, none beyond {LARGEST_FRAME:g}, but got {self.first:g}"
                f" to {self.last:g}."
            )

    @property
    def frames_per_second(self) -> float:
        """The rate as a number."""
        return self.rate[0] / self.rate[1]

    def frames(self) -> tuple[float, ...]:
        """Every whole frame of the range, and its last."""
        count = math.floor(self.last - self.first) + 1
        frames = tuple(self.first + k for k in range(count))
        return frames if frames[-1] == self.last else (*frames, self.last)


@dataclass(frozen=True, slots=True)
class Span:
    """A contact that holds from frame `on` to frame `off`. It fades in over `ease_in` frames before, and out over
    `ease_out` frames after. hold: what holds: the "point", as a ball of the foot that turns, the "direction", as a
    palm over a ball, or "both"."""

    on: float
    off: float
    ease_in: float = 0.0
    ease_out: float = 0.0
    hold: Hold = "both"

    def __post_init__(self) -> None:
        if not -math.inf < self.on <= self.off < math.inf:
            raise InvalidInput(f"a span runs from a frame to a later one, but got {self.on} to {self.off}.")
        if not (0.0 <= self.ease_in < math.inf and 0.0 <= self.ease_out < math.inf):
            raise InvalidInput(f"a span eases over 0 frames or more, but got {self.ease_in}, {self.ease_out}.")
        check_hold(self.hold)

    def gain(self, frame: float) -> float:
        """0..1 how far the contact is on: a minimum-jerk ramp (Flash and Hogan 1985) on either side."""
        if self.on <= frame <= self.off:
            return 1.0
        outside, ramp = (self.on - frame, self.ease_in) if frame < self.on else (frame - self.off, self.ease_out)
        share = 1.0 - outside / ramp if outside < ramp else 0.0
        return min(share**3 * (10.0 - 15.0 * share + 6.0 * share**2), 1.0)  # rounding goes beyond 1


def gain_of(spans: Iterable[Span], frame: float) -> float:
    """The largest gain of any of the spans of a pair."""
    return max((span.gain(frame) for span in spans), default=0.0)


def check_spans(spans: tuple[Span, ...], pair: str) -> None:
    """Spans of a pair follow one another. Raises InvalidInput."""
    for before, then in itertools.pairwise(spans):
        if not before.off < then.on:
            raise InvalidInput(
                f"the spans of {pair!r} follow one another, but one from {then.on:g} begins before frame"
                f" {before.off:g}, where the one before it ends."
            )


@dataclass(frozen=True, slots=True)
class WeightKey:
    """How much a pair counts at a frame. interpolation: up to the next key; smooth rests at both."""

    json_union: ClassVar[bool] = True
    frame: float
    weight: float
    interpolation: Interpolation = "smooth"

    def __post_init__(self) -> None:
        _check_key(self)
        if not 0.0 <= self.weight < math.inf:
            raise InvalidInput(f"the weight of a pair is not negative, but got {self.weight}.")


@dataclass(frozen=True, eq=False)
class PlaceKey:
    """Where a surface stands in the scene at a frame: world_from_surface (4, 4), rigid."""

    json_union: ClassVar[bool] = True
    frame: float
    world_from_surface: FloatArray
    interpolation: Interpolation = "smooth"

    def __post_init__(self) -> None:
        _check_key(self)
        matrix = frozen(self.world_from_surface, np.float64, (4, 4), "world_from_surface")
        object.__setattr__(self, "world_from_surface", matrix)
        if not is_rigid(matrix):
            raise InvalidInput("world_from_surface must be rigid: apply scale and shear to the points instead.")


@dataclass(frozen=True, eq=False)
class PoseKey:
    """The pose of a rig at a frame.

    speeds: (j, 6) of the joints that the pose names, as in `rig.pose_keys.PoseKeys`; None: as the keys beside it
    suggest. source: of a solved key the digest of what it was solved from (`staleness.motion_source`), CAPTURED for
    one that came with a clip, empty for one that a person made: that one is a pin, and no solve moves it.
    """

    json_union: ClassVar[bool] = True
    frame: float
    pose: Pose
    speeds: FloatArray | None = None
    interpolation: Interpolation = "smooth"
    source: str = ""

    def __post_init__(self) -> None:
        _check_key(self)
        if len(set(self.pose.joints)) != len(self.pose.joints):
            raise InvalidInput(f"a pose names each joint once, but that at frame {self.frame:g} names one twice.")
        if self.speeds is not None:
            shape = (len(self.pose.joints), 6)
            object.__setattr__(self, "speeds", frozen(self.speeds, np.float64, shape, "the speeds of a key"))

    @property
    def is_authored(self) -> bool:
        """Whether a person made it."""
        return not self.source


Key = PlacementKey | WeightKey | PlaceKey | PoseKey
K = TypeVar("K", PlacementKey, WeightKey, PlaceKey, PoseKey)
KINDS: dict[str, type[Any]] = {
    "placement": PlacementKey,
    "pose": PoseKey,
    "place": PlaceKey,
    "weight": WeightKey,
}


def address(kind: TrackKind, name: str) -> str:
    """Where the track of a patch (placement), a surface (pose, place) or a pair (weight) is kept."""
    return f"{kind}/{name}"


def of_address(track: str) -> tuple[str, str]:
    """The kind of a track, and the name of what it is of. Raises InvalidInput for what is no address."""
    kind, slash, name = track.partition("/")
    if kind not in KINDS or not slash:
        raise InvalidInput(f'a track is one of {", ".join(KINDS)} and a name, as "pose/hand", but got {track!r}.')
    return kind, name


@dataclass(frozen=True, eq=False)
class Track:
    """Keys of one kind in the order of their frames, at least one. Immutable: edits return new tracks."""

    keys: tuple[Key, ...]

    def __post_init__(self) -> None:
        if not self.keys or len({type(key) for key in self.keys}) > 1:
            raise InvalidInput("a track needs keys of one kind, at least one.")
        if any(not a.frame < b.frame for a, b in itertools.pairwise(self.keys)):
            raise InvalidInput(f"the keys of a track need rising frames, but got {list(self.frames)[:6]}.")
        if isinstance(self.keys[0], PlacementKey):
            PlacementKeys(self.of(PlacementKey))
        joints = {key.pose.joints for key in self.keys if isinstance(key, PoseKey)}
        if len(joints) > 1:
            raise InvalidInput("the keys of a pose name the same joints in the same order.")

    @property
    def frames(self) -> tuple[float, ...]:
        """Of the keys."""
        return tuple(key.frame for key in self.keys)

    def of(self, kind: type[K]) -> tuple[K, ...]:
        """The keys, all of that kind. Raises InvalidInput for keys of another."""
        found = tuple(key for key in self.keys if isinstance(key, kind))
        if len(found) != len(self.keys):
            raise InvalidInput(f"this track has keys of the kind {type(self.keys[0]).__name__}.")
        return found

    def key_at(self, frame: float) -> Key | None:
        """The key at that very frame."""
        return next((key for key in self.keys if key.frame == frame), None)

    def placement_at(self, frame: float) -> Root | Walk:
        """Where a patch is: at a key its root, between keys a walk from one."""
        return PlacementKeys(self.of(PlacementKey)).placement_at(frame)

    def weight_at(self, frame: float) -> float:
        """How much a pair counts."""
        first, second, share = self._between(frame)
        assert isinstance(first, WeightKey)
        assert isinstance(second, WeightKey)
        if first.interpolation == "smooth":
            share = share * share * (3.0 - 2.0 * share)
        return first.weight + share * (second.weight - first.weight)

    def place_at(self, frame: float) -> FloatArray:
        """(4, 4) world_from_surface."""
        keys = tuple(
            PoseKey(key.frame, Pose(SURFACE, key.world_from_surface[None]), None, key.interpolation)
            for key in self.of(PlaceKey)
        )
        return np.asarray(_pose_at(keys, frame).local[0])

    def pose_at(self, frame: float) -> Pose:
        """The pose of a rig; at a key, the key's pose itself. Asked again for a frame, the very same."""
        kept = _poses.get(self)
        if kept is None or kept[0] != frame:
            kept = _poses[self] = frame, _pose_at(self.of(PoseKey), frame)
        return kept[1]

    def edited(self, keys: Iterable[Key] = (), gone: Iterable[float] = ()) -> Track | None:
        """With keys put in, in place of those at their frames, without those at `gone`; None: no key is left."""
        kept: dict[float, Key] = {key.frame: key for key in self.keys}
        for frame in gone:
            kept.pop(frame, None)
        kept |= {key.frame: key for key in keys}
        return Track(tuple(kept[frame] for frame in sorted(kept))) if kept else None

    def _between(self, frame: float) -> tuple[Key, Key, float]:
        """The keys before and after a frame, and how far it is between them; held beyond the ends."""
        at = min(max(bisect_right(self.frames, frame) - 1, 0), len(self.keys) - 1)
        first, second = self.keys[at], self.keys[min(at + 1, len(self.keys) - 1)]
        if frame <= first.frame or first is second or first.interpolation == "hold":
            return first, first, 0.0
        return first, second, (frame - first.frame) / (second.frame - first.frame)


_poses: WeakKeyDictionary[Track, tuple[float, Pose]] = WeakKeyDictionary()


def _pose_at(keys: tuple[PoseKey, ...], frame: float) -> Pose:
    from contact_core.rig.pose_keys import PoseCurves

    at = min(max(bisect_right([key.frame for key in keys], frame) - 1, 0), len(keys) - 1)
    first = keys[at]
    if frame <= first.frame or at == len(keys) - 1 or first.interpolation == "hold":
        return first.pose
    two = keys[at : at + 2]
    speeds = None
    if first.interpolation == "smooth":
        speeds = np.array([_speeds(keys, at), _speeds(keys, at + 1)])
    local = np.array([key.pose.local for key in two])
    curves = PoseCurves.joined([key.frame for key in two], local, speeds)
    return Pose(first.pose.joints, curves.sampled([frame])[0])


def cubic_keys(rig: str, keys: tuple[PoseKey, ...]) -> PoseKeys | None:
    """Keys that smooth curves join, with the speeds of each; None where any two are joined otherwise."""
    from contact_core.rig.pose_keys import PoseKeys

    if any(key.interpolation != "smooth" for key in keys[:-1]):
        return None
    speeds = tuple(_speeds(keys, at) for at in range(len(keys)))
    return PoseKeys(rig, tuple(key.frame for key in keys), tuple(key.pose for key in keys), speeds)


def _speeds(keys: tuple[PoseKey, ...], at: int) -> FloatArray:
    """(j, 6) of a key, its own or what the keys beside it suggest."""
    from contact_core.rig.pose_keys import passing_speeds

    own = keys[at].speeds
    if own is not None:
        return own
    near = keys[max(at - 1, 0) : at + 2]
    return passing_speeds(tuple(k.frame for k in near), tuple(k.pose for k in near), keys[at].frame)


def _check_key(key: Any) -> None:
    if not math.isfinite(key.frame):
        raise InvalidInput(f"a frame is a finite number, but got {key.frame}.")
    if key.interpolation not in INTERPOLATIONS:
        raise InvalidInput(f'keys are joined by "smooth", "linear" or "hold", but got {key.interpolation!r}.')
