"""Strips of the NLA editor: the times of the action that is edited, and whether what is keyed in it is seen.

Measured on 5.0: an action lies above all tracks; a track that is solo silences it; in tweak mode the action is that
of a strip, `keyframe_insert` takes frames of the scene, and curves hold frames of the action.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from contact_blender.evaluation import graph_at
from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput

NEAR = 1e-4  # of a channel's number, by which what is seen may be off what was keyed
Values = Mapping[tuple[str, int], float]  # numbers by path of the armature object and place in it


def has_strips(armature: Any) -> bool:
    """Whether strips take part in what animates an armature."""
    animation = armature.animation_data
    return animation is not None and animation.use_nla and any(len(track.strips) for track in animation.nla_tracks)


def scene_frames(armature: Any, frames: Any) -> FloatArray:
    """(k,) frames of the scene at which frames (k,) of the edited action are played."""
    return _mapped(armature, frames, back=False)


def action_frames(armature: Any, frames: Any) -> FloatArray:
    """(k,) frames of the edited action that are played at frames (k,) of the scene."""
    return _mapped(armature, frames, back=True)


def rate(armature: Any, frames: FloatArray) -> float:
    """Frames of the edited action for one of the scene, over frames (k,) of the scene.

    Raises InvalidInput for a strip that repeats, runs backwards, or changes its speed there.
    """
    wide = np.append(frames, frames[-1] + 1.0) if len(frames) < 2 else frames
    rates = np.diff(action_frames(armature, wide)) / np.diff(wide)
    if rates.min() <= 0.0 or np.ptp(rates) > 1e-3 * rates.max():
        raise InvalidInput(
            f"the strip of {armature.name} that is tweaked repeats, ends or runs otherwise than its action between"
            f" frames {frames[0]:g} and {frames[-1]:g}, so no curve can be keyed there: leave the tweak mode (Tab"
            " in the NLA editor) or make the strip long enough and plain."
        )
    return float(rates.mean())


def check_seen(armature: Any, wanted: Mapping[float, Values]) -> None:
    """Raises InvalidInput where strips keep the numbers that were keyed at frames from being seen there."""
    if not has_strips(armature):
        return
    for frame, values in wanted.items():
        for (path, place), value in seen(armature, frame, tuple(values)).items():
            if abs(value - values[path, place]) > NEAR * max(1.0, abs(value)):
                raise InvalidInput(
                    f"strips of the NLA show another pose of {armature.name} at frame {frame:g} than what would be"
                    f" keyed there ({path} is {value:.3g}, not {values[path, place]:.3g}): {_why(armature)}"
                )


def seen(armature: Any, frame: float, numbers: Sequence[tuple[str, int]]) -> dict[tuple[str, int], float]:
    """What Blender shows of numbers at a frame, with everything that animates them."""
    with graph_at(frame, armature) as depsgraph:
        shown = armature.evaluated_get(depsgraph)
        return {(path, place): float(shown.path_resolve(path)[place]) for path, place in numbers}


def _mapped(armature: Any, frames: Any, *, back: bool) -> FloatArray:
    animation, at = armature.animation_data, np.asarray(frames, float)
    if animation is None or not animation.use_tweak_mode:
        return at
    return np.array([animation.nla_tweak_strip_time_to_scene(float(each), invert=back) for each in at])


def _why(armature: Any) -> str:
    """What an artist can do about it."""
    animation = armature.animation_data
    solo = next((track.name for track in animation.nla_tracks if track.is_solo), None)
    if solo is not None:
        return f"the track {solo!r} is solo; end that in the NLA editor."
    if animation.use_tweak_mode:
        return "the strip that is tweaked is blended, or lies under others; leave the tweak mode."
    return (
        f"the action is blended over them ({animation.action_blend_type.lower()}, influence"
        f" {animation.action_influence:g}); set it to Replace and 1 in the NLA editor."
    )
