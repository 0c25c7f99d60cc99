"""Makes the starter library: types of the GRASP taxonomy on the built-in hand and on plain solids.

Feix, Romero, Schmiedmayer, Dollar, Kragic (2016): The GRASP Taxonomy of Human Grasp Types. A type is said in the
words that the taxonomy uses: the thing, how fingers are bent, which touch, and whether they oppose the palm, the
thumb's pad or its side. The hand is bent so, the thing is laid where palm or pads are, the thumb looks for its
place, and all is fitted, solved, settled and judged as any grasp is.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.document.library import ContactSet
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.transform import transform_points
from contact_core.grasp_files.starter import FINGERS, GraspType, starter_types
from contact_core.grasping.closing import close_hands
from contact_core.grasping.finishing import Suggestion, finished
from contact_core.grasping.hand import STRETCH_PRICE, STRETCHED, Hand, stretches, turn_about
from contact_core.grasping.pads import disk
from contact_core.grasping.scene import GraspScene
from contact_core.grasping.slots import GRASP_SCORES
from contact_core.hands.description import Pad
from contact_core.library.capture import bone_ends, captured
from contact_core.library.carrying import palm_in_rig, placed_at
from contact_core.library.fitting import fitted
from contact_core.library.pictures import thumbnail
from contact_core.library.record import PALM, Grasp
from contact_core.library.shelf import Library
from contact_core.library.verbs import library_scene
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.reading import read_asset
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.proposals.draft import Draft
from contact_core.rig.rig import Pose, forward_kinematics
from contact_core.session import Session

HAND, OBJECT = "hand", "object"
SAMPLE = "sample:human_hand"
MM = 1e-3
ROOM = 0.03  # hand lengths that the bones of the thumb keep from the thing
WIDTH = 0.55  # of a pad, of half the middle extent of the thing: what hangs over touches nothing


@dataclass(frozen=True, eq=False)
class Made:
    """A type made: its record, contacts, picture, and how it was judged."""

    type: GraspType
    grasp: Grasp
    contacts: ContactSet
    picture: bytes | None
    suggestion: Suggestion


def write_starter(library: Library, plugins: PluginManager, progress: Progress = NO_PROGRESS) -> list[Made]:
    """Make the starter library into an empty folder. Raises FileRefused, Cancelled."""
    types = starter_types()
    result = []
    for place, one in enumerate(types):
        progress.tell(place / len(types), f"Making {one.name}")
        result.append(made(one, plugins))
        library.add(one.name, result[-1].grasp, result[-1].contacts, result[-1].picture)
    return result


def made(one: GraspType, plugins: PluginManager) -> Made:
    """One type on the built-in hand."""
    asset = read_asset(SAMPLE, plugins)
    assert asset.rig is not None
    session = Session(plugins=plugins)
    session.surfaces.add(HAND, asset.mesh, meters_per_unit=asset.rig.meters_per_unit, rig=asset.rig)
    session.surfaces.add(OBJECT, TriangleMesh(*one.solid()), meters_per_unit=1.0, up_axis="Z")
    scene = library_scene(session, HAND, OBJECT)
    hand = scene.hand
    local = _bent(hand, one)
    object_from_palm = _place(hand, one, local)
    local = placed_at(hand, local, object_from_palm)
    local = _thumb_placed(hand, one, local, object_from_palm, scene)
    used = np.array([digit.role in one.digits for digit in hand.digits])
    if one.closes is not None:
        local = _closed(hand, one, object_from_palm, scene)
        local = _thumb_placed(hand, one, local, object_from_palm, scene)
        alone = used & (np.arange(len(used)) == hand.thumb)
        local = fitted(hand, scene.field, local, alone, object_from_palm[:3, 0], False, False).local
    elif one.fit:
        local = fitted(hand, scene.field, local, used, object_from_palm[:3, 0], one.palm).local
    draft = Draft(scene.document, scene.derived, scene.rigs, scene.evaluated)
    draft.surfaces.set_pose(HAND, Pose(hand.rig.joints, local))
    names = _painted(draft, scene, one)
    score = plugins.make(GRASP_SCORES, plugins.name_for(GRASP_SCORES, "grasp", None))
    found = finished(scene, draft, names, True, one.kind, used, score)
    if found is None:
        raise InvalidInput(f"{one.name}: fewer than two pads touch.")
    session.accept(found.proposal)
    done = library_scene(session, HAND, OBJECT)
    note = f"{one.note} GRASP taxonomy, type {one.number} (Feix et al. 2016)."
    grasp, contacts = captured(done, one.kind, (*one.tags, "starter"), note, "made by the project on its own hand")
    digits = tuple(replace(d, touches=d.role in one.digits) for d in grasp.hand.digits)
    grasp = replace(grasp, hand=replace(grasp.hand, digits=digits), object=replace(grasp.object, name=one.tags[0]))
    return Made(one, grasp, contacts, thumbnail(done, plugins), found)


def _bent(hand: Hand, one: GraspType) -> FloatArray:
    """(j, 4, 4) the rest pose with fingers and thumb bent as a type says."""
    local = hand.rig.rest_local.copy()
    for digit in hand.digits:
        flexing = [bone for bone in digit.bones if bone.flexes]
        if digit.is_thumb:
            twist, spread, *bends = one.thumb_bends
        else:
            place = FINGERS.index(digit.role)
            twist, spread, bends = 0.0, one.spread[place], list(one.bends[place])
        for k, (bone, bend) in enumerate(zip(flexing, bends, strict=True)):
            turn = turn_about(np.eye(3)[2], np.radians(bend))
            if k == 0:
                turn = (
                    turn_about(np.eye(3)[0], np.radians(twist))
                    @ turn_about(np.eye(3)[1], np.radians(spread))
                    @ turn
                )
            local[bone.joint, :3, :3] = local[bone.joint, :3, :3] @ bone.frame @ turn @ bone.frame.T
    return local


def _place(hand: Hand, one: GraspType, local: FloatArray) -> FloatArray:
    """(4, 4) object from palm."""
    middle, normal, line = _fingers_pads(hand, one, local)
    at = np.array(one.at) * MM if one.at is not None else middle + one.half * MM * normal
    ways = {"line": line, "normal": normal}
    z = ways[one.axis] if isinstance(one.axis, str) else np.array(one.axis)
    z = z / np.linalg.norm(z)
    x = np.array(one.across) - (np.array(one.across) @ z) * z
    x /= np.linalg.norm(x)
    palm_from_object = np.eye(4)
    palm_from_object[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    palm_from_object[:3, 3] = at
    return np.asarray(np.linalg.inv(palm_from_object))


def _fingers_pads(hand: Hand, one: GraspType, local: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(3,) each, in the palm's frame: the middle of the pads at the tips of fingers that take part, their normal,
    and the way from the first to the last."""
    own = forward_kinematics(hand.rig.parents, local)
    into = np.linalg.inv(palm_in_rig(hand, own))
    at, normals = [], []
    for d, digit in enumerate(hand.digits):
        if digit.role in (one.lead or one.digits) and not digit.is_thumb:
            b = int(hand.bones[d + 1]) - 1
            frame = into @ own[hand.joints[b]]
            at.append(frame[:3, :3] @ hand.pads[b] + frame[:3, 3])
            normals.append(frame[:3, :3] @ hand.pad_normals[b])
    for role, segment, side in one.sides if one.lead == ("side",) else ():
        pad = side_pad(hand, role, segment, side)
        frame = into @ own[pad.joint] @ np.linalg.inv(hand.rig.rest_world[pad.joint])
        at.append(transform_points(frame, pad.centre.positions(hand.rig.surface))[0])
        normals.append(frame[:3, :3] @ pad.normal)
    normal = np.mean(normals, axis=0)
    line = at[-1] - at[0] if len(at) > 1 else np.eye(3)[2]
    return np.mean(at, axis=0), np.asarray(normal / np.linalg.norm(normal)), line


def _thumb_placed(
    hand: Hand, one: GraspType, local: FloatArray, object_from_palm: FloatArray, scene: GraspScene
) -> FloatArray:
    """The thumb with its pad where the type wants it, of all ways to bend it the one that stretches least."""
    if one.thumb == () or "thumb" not in one.digits:
        return local
    if one.thumb is None:
        middle, normal, _ = _fingers_pads(hand, one, local)
        goal = middle + 2.0 * one.half * MM * normal
    else:
        goal = np.array(one.thumb) * MM
    goal = object_from_palm[:3, :3] @ goal + object_from_palm[:3, 3]
    thumb = next(digit for digit in hand.digits if digit.is_thumb)
    bones = [bone for bone in thumb.bones if bone.flexes]
    own = forward_kinematics(hand.rig.parents, local)
    base = own[hand.rig.parents[bones[0].joint]]
    turns = [
        bones[0].frame
        @ turn_about(np.eye(3)[0], np.radians(a))
        @ turn_about(np.eye(3)[1], np.radians(b))
        @ turn_about(np.eye(3)[2], np.radians(c))
        @ bones[0].frame.T
        for a, b, c in itertools.product((-20, -5, 10, 25, 35), (-45, -30, -15, 0, 15, 30), (-20, 0, 20, 40))
    ]
    stretch = stretches(hand.rig, bones[0].joint, np.array(turns))
    b_last = int(hand.bones[1]) - 1
    best, chosen = np.inf, local
    rest = hand.rig.rest_local
    for turn, much in zip(turns, stretch, strict=True):
        first = base @ rest[bones[0].joint] @ _about(turn)
        for m in (-5.0, 15.0, 35.0, 55.0):
            second = first @ rest[bones[1].joint] @ _bend(bones[1].frame, m)
            for i in (-10.0, 10.0, 30.0, 50.0):
                third = second @ rest[bones[2].joint] @ _bend(bones[2].frame, i)
                at = third[:3, :3] @ hand.pads[b_last] + third[:3, 3]
                cost = float(np.linalg.norm(at - goal)) / hand.length
                if cost > best:
                    continue
                out = third[:3, :3] @ hand.pad_normals[b_last]
                _, slope = scene.field.sample(at[None])
                cost += 0.06 * float(1.0 + out @ slope[0] / max(np.linalg.norm(slope[0]), 1e-9))
                joints = np.array([second[:3, 3], third[:3, 3], 2.0 * at - third[:3, 3]])
                deep = ROOM * hand.length - scene.field.distances(joints)
                cost += 0.5 * float(np.maximum(deep, 0.0).sum()) / hand.length
                cost += STRETCH_PRICE * max(float(much) - STRETCHED, 0.0) + 0.0002 * (abs(m - 15.0) + abs(i - 15.0))
                if cost < best:
                    best, chosen = cost, local.copy()
                    chosen[bones[0].joint] = rest[bones[0].joint] @ _about(turn)
                    chosen[bones[1].joint] = rest[bones[1].joint] @ _bend(bones[1].frame, m)
                    chosen[bones[2].joint] = rest[bones[2].joint] @ _bend(bones[2].frame, i)
    return chosen


def _closed(hand: Hand, one: GraspType, object_from_palm: FloatArray, scene: GraspScene) -> FloatArray:
    """The hand closed joint by joint, as suggestions are: what wraps needs more than one bend a digit."""
    assert one.closes is not None
    rest = placed_at(hand, hand.rig.rest_local, object_from_palm)
    roots = hand.rig.parents < 0
    object_from_rig = rest[roots][0] @ np.linalg.inv(hand.rig.rest_local[roots][0])
    limits = np.array(one.closes)[None]
    way = object_from_palm[None, :3, 0] if one.palm else np.zeros((1, 3))
    closed = close_hands(hand, scene.field, object_from_rig[None], way, limits=limits)
    return hand.pose(closed.placed[0], closed.angles[0], closed.turns[0]).local.copy()


def _about(turn: FloatArray) -> FloatArray:
    result = np.eye(4)
    result[:3, :3] = turn
    return result


def _bend(frame: FloatArray, degrees: float) -> FloatArray:
    return _about(frame @ turn_about(np.eye(3)[2], np.radians(degrees)) @ frame.T)


def _painted(draft: Draft, scene: GraspScene, one: GraspType) -> tuple[str, ...]:
    """The pads of a type painted on the hand; their names."""
    mesh = draft.geometry.mesh(HAND)
    half = 0.5 * np.sort(np.ptp(scene.mesh.points, axis=0))
    largest = max(WIDTH * float(half[1]), 4e-3)
    names = []
    for pad in scene.hand.description.pads:
        by_role = pad.role in one.digits and (one.pads == "all" or pad.name.endswith("tip"))
        wanted = pad.name in one.pads if isinstance(one.pads, tuple) else by_role
        if wanted or (pad.role == PALM and one.palm):
            draft.patches.paint(pad.name, disk(mesh, pad, largest), surface=HAND, axis=pad.axis)
            names.append(pad.name)
    for role, segment, side in one.sides:
        pad = side_pad(scene.hand, role, segment, side)
        draft.patches.paint(pad.name, disk(mesh, pad, largest), surface=HAND, axis=pad.axis)
        names.append(pad.name)
    return tuple(names)


def side_pad(hand: Hand, role: str, segment: str, side: float) -> Pad:
    """A pad on the side of a finger, halfway along a bone. side: 1 for the thumb's, -1 for the other."""
    mesh = hand.rig.surface
    digit = next(digit for digit in hand.digits if digit.role == role)
    place = next(k for k, bone in enumerate(digit.bones) if bone.segment == segment)
    here, end = bone_ends(hand, digit, place)
    thumb = hand.description.thumb
    assert thumb is not None
    across = hand.frame[:, 2] * np.sign((thumb.tip - hand.description.palm.point) @ hand.frame[:, 2]) * side
    along = (end - here) / np.linalg.norm(end - here)
    out = across - (across @ along) * along
    hit = Locator.of(mesh).cast((0.5 * (here + end))[None], out[None])
    at, radius = hit.points.positions(mesh)[0], 0.7 * float(hit.distance[0])
    ends = Locator.of(mesh).closest(np.array([at - radius * along, at + radius * along]))
    normal = hit.points.normals(mesh)[0]
    joint = digit.bones[place].joint
    return Pad(f"{role} side", role, joint, hit.points, normal, ends.points, radius)
