"""A posed hand on an object as a record that can be saved."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.document.library import ContactSet
from contact_core.edit.verbs.sets import ContactSets
from contact_core.errors import InvalidInput
from contact_core.geometry.raycast import Locator
from contact_core.geometry.transform import transform_points
from contact_core.grasping.facts import digits_in_contact
from contact_core.grasping.hand import Hand
from contact_core.library.carrying import bone_frames, palm_in_rig, steps
from contact_core.library.places import main_axes, seen_from_palm
from contact_core.library.record import PALM, Grasp, SavedBone, SavedDigit, SavedHand, SavedObject, SavedPad
from contact_core.proposals.draft import Draft
from contact_core.rig.rig import Pose, forward_kinematics, skin

if TYPE_CHECKING:
    from contact_core.geometry.surface_point import SurfacePoints
    from contact_core.grasping.scene import GraspScene
    from contact_core.grasping.slots import Kind
    from contact_core.hands.description import Digit


def captured(
    scene: GraspScene, kind: Kind | None = None, tags: Sequence[str] = (), note: str = "", origin: str = ""
) -> tuple[Grasp, ContactSet]:
    """The grasp that a scene's document holds. kind: told by how the hand touches where none is given. Raises
    InvalidInput where no patches of hand and object are paired."""
    draft = Draft(scene.document, scene.derived, scene.rigs, scene.evaluated)
    pairs = pairs_between(scene)
    if not pairs:
        ends = f"{scene.hand_name!r} and {scene.object_name!r}"
        raise InvalidInput(f"no patches of {ends} are paired, so there is no grasp to save.")
    hand, rig = scene.hand, scene.rig
    pose = scene.document.poses.get(scene.hand_name) or Pose.rest(rig)
    local = pose.local[[pose.joints.index(name) for name in rig.joints]]
    own = forward_kinematics(rig.parents, local)
    object_from_rig = scene.object_from_rig
    placed = object_from_rig @ palm_in_rig(hand, own)
    names = dict.fromkeys(scene.document.pairs[pair].manipulator for pair in pairs)
    pads = tuple(saved_pad(hand, name, draft.geometry.axis_points(name)) for name in names)
    posed = transform_points(object_from_rig, skin(rig, own))
    near = digits_in_contact(hand, posed, Locator.of(scene.mesh))
    touches = near | np.array([any(pad.role == digit.role for pad in pads) for digit in hand.digits])
    saved = SavedHand(
        rig.name, scene.document.surface(scene.hand_name).digest, hand.description.side,
        hand.length * meters(scene), _digits(hand, own, touches), Pose(rig.joints, local),
    )  # fmt: skip
    seen = seen_from_palm(scene.field, placed[None], hand.length)[0]
    targets = [scene.document.pairs[pair].object for pair in pairs]
    contacts = ContactSets(draft).of(scene.object_name, dict.fromkeys([*names, *targets]))
    grasp = Grasp(
        kind or kind_of(pads, touches, hand), saved, saved_object(scene), in_meters(placed, scene), pads, seen,
        tuple(tags), note, origin,
    )  # fmt: skip
    return grasp, contacts


def pairs_between(scene: GraspScene) -> tuple[str, ...]:
    """The pairs whose manipulator is a patch of the hand and whose object is one of the object."""
    document = scene.document
    ends = (scene.hand_name, scene.object_name)
    return tuple(
        name
        for name, pair in document.pairs.items()
        if (document.patch(pair.manipulator).surface, document.patch(pair.object).surface) == ends
    )


def meters(scene: GraspScene) -> float:
    """Metres per unit of the hand."""
    return scene.document.surface(scene.hand_name).meters_per_unit


def in_meters(placed: FloatArray, scene: GraspScene) -> FloatArray:
    """A rigid placement (4, 4) in the hand's units, in metres."""
    result = placed.copy()
    result[:3, 3] *= meters(scene)
    return result


def saved_object(scene: GraspScene) -> SavedObject:
    """The object's main axes, in metres."""
    frame, half = main_axes(scene.mesh)
    surface = scene.document.surface(scene.object_name)
    frame[:3, 3] *= meters(scene)
    return SavedObject(surface.name, surface.digest, frame, half * meters(scene), surface.up_axis)


def kind_of(pads: Sequence[SavedPad], touches: Sequence[bool] | FloatArray, hand: Hand) -> Kind:
    """Power where the palm touches or a finger does beside its tip; else by how many digits touch."""
    if any(pad.role == PALM or (pad.role != "thumb" and pad.segment != "distal") for pad in pads):
        return "power"
    thumb = any(digit.is_thumb and touch for digit, touch in zip(hand.digits, touches, strict=True))
    if not thumb:
        return "hook"
    return "pinch" if sum(bool(touch) for touch in touches) < 3 else "precision"


def saved_pad(hand: Hand, name: str, axis: SurfacePoints) -> SavedPad:
    """A patch of the hand with its axis at rest, as the bone below it sees it."""
    rig, mesh = hand.rig, hand.rig.surface
    line = axis.positions(mesh)
    middle, way = 0.5 * (line[0] + line[-1]), line[-1] - line[0]
    faces = rig.faces[axis.faces].ravel()
    bones, counts = np.unique(hand.bone_of_skin[faces], return_counts=True)
    b = int(bones[counts.argmax()])
    normal = axis.normals(mesh).mean(axis=0)
    digit, place = _digit_of(hand, b) if b >= 0 else (None, 0)
    if digit is None or not digit.bones[place].flexes:
        at = hand.frame.T @ (middle - hand.description.palm.point) / hand.length
        return SavedPad(name, PALM, "metacarpal", at, _unit(hand.frame.T @ normal), _unit(hand.frame.T @ way))
    frame = bone_frames(hand, digit, rig.rest_world)[place]
    here, end = bone_ends(hand, digit, place)
    along = float((middle - here) @ (end - here) / max((end - here) @ (end - here), 1e-30))
    out = middle - (here + along * (end - here))
    out = out if np.linalg.norm(out) > 1e-9 * hand.length else normal
    at = np.array([along, 0.0, 0.0])
    segment = digit.bones[place].segment
    depth = float(np.linalg.norm(out)) / hand.length
    return SavedPad(name, digit.role, segment, at, _unit(frame.T @ out), _unit(frame.T @ way), depth)


def bone_ends(hand: Hand, digit: Digit, place: int) -> tuple[FloatArray, FloatArray]:
    """(3,) (3,) where a bone of a digit begins and ends, in rig space at rest."""
    here = hand.rig.rest_world[digit.bones[place].joint, :3, 3]
    last = place == len(digit.bones) - 1
    return here, digit.tip if last else hand.rig.rest_world[digit.bones[place + 1].joint, :3, 3]


def _digit_of(hand: Hand, bone: int) -> tuple[Digit, int]:
    digit = int(np.searchsorted(hand.bones, bone, side="right")) - 1
    return hand.digits[digit], bone - int(hand.bones[digit])


def _digits(hand: Hand, own: FloatArray, touches: IntArray | Sequence[bool]) -> tuple[SavedDigit, ...]:
    palm = palm_in_rig(hand, own)[:3, :3]
    result = []
    for digit, touch in zip(hand.digits, touches, strict=True):
        posed = steps(palm, bone_frames(hand, digit, own))
        rest = steps(hand.frame, bone_frames(hand, digit, hand.rig.rest_world))
        bones = []
        for place, bone in enumerate(digit.bones):
            here, end = bone_ends(hand, digit, place)
            length = float(np.linalg.norm(end - here)) / hand.length
            bones.append(SavedBone(bone.segment, posed[place], rest[place], bone.flexes, length))
        result.append(SavedDigit(digit.role, tuple(bones), bool(touch)))
    return tuple(result)


def _unit(vector: FloatArray) -> FloatArray:
    size = float(np.linalg.norm(vector))
    return vector / size if size > 0.0 else np.array([1.0, 0.0, 0.0])
