"""Which bones of an armature a solve poses, and which move of themselves.

Constraints and drivers take bones over: a deforming bone of a control rig copies what its control does. What poses
such a rig is its controls, and Blender evaluates the rest. An artist says which bones are posed:

    "automatic"         every bone that nothing takes over; the controls, where the skin's own bones are taken over
    "deform"            the bones that deform the skin
    "controls"          the bones that the artist sees and can select, as far as the skin follows them
    "collection:NAME"   those of a bone collection and of the collections in it

Bones that are taken over are never among them.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from contact_blender import compat
from contact_blender.channels import rotation_channel
from contact_blender.freedom import AXES, freedom_of
from contact_core.arrays import BoolArray
from contact_core.errors import InvalidInput
from contact_core.rig.rig import JointFreedom

AUTOMATIC, DEFORM, CONTROLS, COLLECTION = "automatic", "deform", "controls", "collection:"
_AIMS = frozenset(("DAMPED_TRACK", "LOCKED_TRACK", "STRETCH_TO", "TRACK_TO"))
_REPLACES = _AIMS | {"COPY_TRANSFORMS", "COPY_ROTATION"}  # what the bone's own channels would turn
_CHAINS = frozenset(("IK", "SPLINE_IK"))
_REACHES = _AIMS | {"COPY_LOCATION", "IK"}  # where the place of the target counts
_NAMED = re.compile(r'pose\.bones\["((?:[^"\\]|\\.)*)"\](?:\.(\w+)|)')


@dataclass(frozen=True)
class BoneDrivers:
    """Of an armature's drivers. driven: (bone, channel, index) that they set. read: (bone that is moved, bone that
    is read)."""

    driven: frozenset[tuple[str, str, int]]
    read: frozenset[tuple[str, str]]


def check_choice(armature: Any, choice: str) -> None:
    """Raises InvalidInput for a choice that this armature has not."""
    if choice in (AUTOMATIC, DEFORM, CONTROLS):
        return
    there = [each.name for each in armature.data.collections_all]
    name = choice.removeprefix(COLLECTION)
    if choice == name or name not in there:
        near = difflib.get_close_matches(name, there, n=3) or there[:5]
        raise InvalidInput(
            f"the bones that are posed are {AUTOMATIC!r}, {DEFORM!r}, {CONTROLS!r} or {COLLECTION + 'NAME'!r} for a"
            f" bone collection of {armature.name}, but got {choice!r}; there are {', '.join(near) or 'none'}."
        )


def listed(armature: Any) -> list[tuple[str, str]]:
    """(choice, what an artist reads) of all choices of an armature."""
    collections = [(COLLECTION + each.name, each.name) for each in armature.data.collections_all]
    return [(AUTOMATIC, "Automatic"), (DEFORM, "Deforming"), (CONTROLS, "Controls"), *collections]


def freedoms(scene_object: Any, armature: Any, joints: Iterable[str], choice: str) -> list[JointFreedom]:
    """What a solve may do with each bone: what locks, limits and drivers leave of a posed one; others rest."""
    drivers = bone_drivers(armature)
    posed = _posed(scene_object, armature, choice, drivers)
    movers = _movers(armature, posed)
    return [
        freedom_of(armature.pose.bones[name], name in movers, _driven(armature.pose.bones[name], drivers))
        if name in posed
        else JointFreedom("fixed")
        for name in joints
    ]


def posed_bones(scene_object: Any, armature: Any, choice: str) -> frozenset[str]:
    """The names of the bones that a solve poses. Raises InvalidInput as `check_choice`."""
    return _posed(scene_object, armature, choice, bone_drivers(armature))


def bone_drivers(armature: Any) -> BoneDrivers:
    """What the drivers of an armature object set of its bones, and which bones they read."""
    driven, read = set[tuple[str, str, int]](), set[tuple[str, str]]()
    for curve in compat.drivers(armature):
        found = _NAMED.match(curve.data_path)
        if found is None:
            continue
        name, channel = found.group(1), found.group(2) or ""
        driven.add((name, channel, int(curve.array_index)))
        read.update((name, other) for other in _read_by(curve.driver, armature))
    return BoneDrivers(frozenset(driven), frozenset(read))


def _posed(scene_object: Any, armature: Any, choice: str, drivers: BoneDrivers) -> frozenset[str]:
    check_choice(armature, choice)
    bones = armature.pose.bones
    taken = _taken_over(armature, drivers)
    skin = {b.name for b in bones if b.bone.use_deform and b.name in scene_object.vertex_groups}
    if choice.startswith(COLLECTION):
        chosen = {b.name for b in armature.data.collections_all[choice.removeprefix(COLLECTION)].bones_recursive}
    elif choice == DEFORM:
        chosen = skin
    elif choice == CONTROLS or not skin.isdisjoint(taken):
        chosen = {b.name for b in bones if compat.is_shown(b)} & _followed(scene_object, armature, skin, drivers)
    else:
        chosen = {b.name for b in bones}
    return frozenset(chosen - taken)


def _acting(pose_bone: Any) -> Iterator[Any]:
    return (each for each in pose_bone.constraints if not each.mute and each.influence > 0.0)


def _taken_over(armature: Any, drivers: BoneDrivers) -> set[str]:
    """Bones whose rotation is another's: by a constraint at full influence, in a chain of IK, by drivers."""
    found = {bone.name for bone in armature.pose.bones if _driven_axes(bone, drivers).all()}
    for bone in armature.pose.bones:
        for each in _acting(bone):
            if each.influence == 1.0 and each.type in _CHAINS and each.target is not None:
                found.update(_chain(bone, each))
            elif each.influence == 1.0 and _replaces(each):
                found.add(bone.name)
    return found


def _replaces(constraint: Any) -> bool:
    if constraint.type not in _REPLACES or constraint.target is None:
        return False
    if constraint.type == "COPY_ROTATION" and not (constraint.use_x and constraint.use_y and constraint.use_z):
        return False
    return getattr(constraint, "mix_mode", "REPLACE") == "REPLACE"


def _chain(pose_bone: Any, constraint: Any) -> list[str]:
    """The bones that an IK constraint turns."""
    whole = [pose_bone, *pose_bone.parent_recursive]
    if constraint.type == "IK" and not constraint.use_tail:
        whole = whole[1:]
    return [bone.name for bone in (whole[: constraint.chain_count] if constraint.chain_count else whole)]


def _followed(scene_object: Any, armature: Any, skin: set[str], drivers: BoneDrivers) -> set[str]:
    """The bones that move the skin's bones or its shape keys, through parents, constraints and drivers."""
    above: dict[str, set[str]] = {bone.name: set() for bone in armature.pose.bones}
    for bone in armature.pose.bones:
        above[bone.name].update({bone.parent.name} if bone.parent else ())
        for each in _acting(bone):
            followers = _chain(bone, each) if each.type in _CHAINS else [bone.name]
            for name in followers:
                above[name].update(_targets(each, armature))
    for moved, read in drivers.read:
        above.get(moved, set[str]()).add(read)
    found, waiting = set[str](), [*skin, *_read_by_shapes(scene_object, armature)]
    while waiting:
        name = waiting.pop()
        if name in above and name not in found:
            found.add(name)
            waiting += above[name]
    return found


def _targets(constraint: Any, armature: Any) -> set[str]:
    """The bones of the armature that a constraint follows."""
    pairs = [
        (getattr(constraint, "target", None), getattr(constraint, "subtarget", "")),
        (getattr(constraint, "pole_target", None), getattr(constraint, "pole_subtarget", "")),
        *((each.target, each.subtarget) for each in getattr(constraint, "targets", ())),
    ]
    return {name for target, name in pairs if target == armature and name}


def _read_by_shapes(scene_object: Any, armature: Any) -> set[str]:
    """Bones that drive shape keys of the mesh."""
    shapes = scene_object.data.shape_keys
    found = () if shapes is None else compat.drivers(shapes)
    return {name for curve in found for name in _read_by(curve.driver, armature)}


def _read_by(driver: Any, armature: Any) -> Iterator[str]:
    for target in (target for variable in driver.variables for target in variable.targets):
        named = _NAMED.search(target.data_path)
        name = named.group(1) if named is not None else target.bone_target
        if target.id == armature and name:
            yield name


def _driven_axes(pose_bone: Any, drivers: BoneDrivers) -> BoolArray:
    """(3,) turns about x, y, z that drivers set; any number of a quaternion or of axis and angle is all three."""
    channel = rotation_channel(pose_bone)
    indices = {index for name, what, index in drivers.driven if (name, what) == (pose_bone.name, channel)}
    if channel != "rotation_euler":
        return np.full(3, bool(indices))
    return np.array([place in indices for place in range(len(AXES))])


def _driven(pose_bone: Any, drivers: BoneDrivers) -> BoolArray:
    """(6,) turns about and shifts along x, y, z that drivers set."""
    shifts = [(pose_bone.name, "location", place) in drivers.driven for place in range(len(AXES))]
    return np.concatenate([_driven_axes(pose_bone, drivers), np.array(shifts, bool)])


def _movers(armature: Any, posed: Collection[str]) -> set[str]:
    """Of the posed bones, those that a solve may also shift: roots, and what carries a place that others reach for.

    The paper gives only the root a translation; the hand of an arm with IK is moved by the place of its target.
    """
    reached = {
        name
        for bone in armature.pose.bones
        for each in _acting(bone)
        if each.type in _REACHES
        for name in _targets(each, armature)
    }
    carriers = {bone.name for bone in armature.pose.bones if bone.parent is None}
    for name in reached:
        bone = armature.pose.bones.get(name)
        while bone is not None and bone.name not in posed:
            bone = bone.parent
        carriers.update({bone.name} if bone is not None else ())
    return {name for name in carriers & set(posed) if _can_shift(armature.pose.bones[name])}


def _can_shift(pose_bone: Any) -> bool:
    held = any(each.type == "COPY_LOCATION" and each.influence == 1.0 for each in _acting(pose_bone))
    return not (held or pose_bone.bone.use_connect or all(pose_bone.lock_location))
