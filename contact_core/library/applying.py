"""A saved grasp applied: to its own hand and object as it was, to others by roles, bones and like places."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.contact.placement import Link, Root
from contact_core.contact.shape import PatchShape
from contact_core.document.document import ContactDocument, Patch
from contact_core.document.frozen_map import FrozenMap
from contact_core.document.library import ContactSet
from contact_core.edit.commands import Import
from contact_core.errors import ContactError, InvalidInput
from contact_core.geometry.raycast import Locator
from contact_core.geometry.tangent import direction_to_heading, heading_to_direction
from contact_core.geometry.tracing import trace_geodesic
from contact_core.grasping.finishing import Suggestion, finished, judged
from contact_core.grasping.scene import GraspScene
from contact_core.grasping.slots import GRASP_SCORES
from contact_core.hands.description import Digit
from contact_core.library.capture import bone_ends, meters, pairs_between
from contact_core.library.carrying import (
    MIRROR,
    Carried,
    bone_frames,
    carried,
    is_other_side,
    is_own_rig,
    placed_at,
)
from contact_core.library.fitting import fitted
from contact_core.library.places import CANDIDATES, like_places
from contact_core.library.record import PALM, Grasp, SavedPad
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.proposals.draft import Draft
from contact_core.rig.rig import Pose
from contact_core.scene.problem import Objective
from contact_core.solve.solver import PoseSolution, SolveStatus

THICKER = 0.3, 3.0  # how far the ratio of a digit's thickness goes from that of the hands
SOLVED, MOST = 2, 4  # of the fitted places for one grasp: where one of them is good, and where none is
SURE = 0.5  # margin from which a grasp is good for sure


@dataclass(frozen=True, eq=False)
class Applied:
    """A saved grasp on a hand and an object. suggestion: as `Session.suggest` gives them; its proposal is accepted
    as one step. unlike: how differently the hand sees the object than the grasp's own did, in hand lengths, 0 for
    the same. notes: in sentences, what the hand lacks and what was left out."""

    suggestion: Suggestion
    unlike: float
    notes: tuple[str, ...]


def apply(
    scene: GraspScene,
    grasp: Grasp,
    contacts: ContactSet,
    *,
    at: FloatArray | None = None,
    count: int = 1,
    progress: Progress = NO_PROGRESS,
) -> list[Applied]:
    """A grasp on a scene's hand and object, at most `count` ways, the best first. at: (3,) the place that is to be
    held, in the object's surface space.

    On the hand and the object that it was made with, it is what was saved. Raises InvalidInput where the hand lacks
    all digits that take part, or the object has no place at which two of the pads touch; Cancelled.
    """
    progress.tell(0.0, "Carrying the grasp to the hand")
    own_hand, own_object = is_own_hand(scene, grasp), is_own_object(scene, grasp)
    pose = carried(grasp, scene.hand)
    notes = _notes(scene, grasp, pose)
    if not pose.used.any():
        raise InvalidInput(f"{scene.rig.name} has none of the digits that take part: {', '.join(grasp.touching)}.")
    if own_hand and own_object and at is None:
        return [Applied(_as_it_was(scene, grasp, contacts, pose), 0.0, notes)]
    base, pads, left = with_pads(scene, grasp, contacts)
    notes = (*notes, *(f"{name}: {why}." for name, why in left.items()))
    if len(pads) < 2:
        raise InvalidInput(f"only {len(pads)} of {len(grasp.pads)} pads find a place on {scene.rig.name}.")
    progress.tell(0.1, "Looking for like places")
    ranked = _ranked(scene, grasp, pose, at, max(CANDIDATES, 2 * count))
    score = scene.plugins.make(GRASP_SCORES, scene.plugins.name_for(GRASP_SCORES, "grasp", None))
    found = list[Applied]()
    for place, (unlike, local) in enumerate(ranked):
        sure = any(one.suggestion.is_grasp and one.suggestion.facts.margin >= SURE for one in found)
        enough = len(found) >= (SOLVED if count == 1 else count) and sure
        if enough or place >= max(MOST, count):
            break
        progress.tell(0.3 + 0.7 * place / len(ranked), "Solving and settling")
        draft = base.copy()
        draft.surfaces.set_pose(scene.hand_name, Pose(scene.rig.joints, _in_world(scene, local)))
        one = finished(scene, draft, pads, True, grasp.kind, pose.used, score)
        if one is not None:
            out = tuple(f"{name} was left out: {why}." for name, why in one.left_out.items())
            found.append(Applied(one, unlike, (*notes, *out)))
    if not found:
        raise InvalidInput("the object has no place at which two pads of the grasp touch; is it in its units?")
    progress.tell(1.0, "Done")
    found.sort(key=lambda one: (not one.suggestion.is_grasp, -one.suggestion.score + 10.0 * one.unlike))
    return found[:count]


def is_own_hand(scene: GraspScene, grasp: Grasp) -> bool:
    """Whether a scene's hand is the one that the grasp was made with."""
    return is_own_rig(grasp, scene.hand) and scene.document.surface(scene.hand_name).digest == grasp.hand.digest


def is_own_object(scene: GraspScene, grasp: Grasp) -> bool:
    """Whether a scene's object is the one that the grasp was made with."""
    return scene.document.surface(scene.object_name).digest == grasp.object.digest


def carried_places(
    scene: GraspScene, grasp: Grasp, pose: Carried, at: FloatArray | None = None, count: int = CANDIDATES
) -> Iterator[tuple[float, FloatArray]]:
    """How unlike its own a place is, and the carried pose there (j, 4, 4), its root in the object's space in the
    hand's units; the likeliest first."""
    hand = scene.hand
    saved = grasp.placed, grasp.seen
    places = like_places(
        grasp.object, *saved, scene.mesh, scene.field, hand.length, meters(scene),
        up_axis=scene.document.surface(scene.object_name).up_axis, flip=is_other_side(grasp, hand), at=at,
        count=count,
    )  # fmt: skip
    for unlike, placed in zip(places.unlike, places.placed, strict=True):
        yield float(unlike), placed_at(hand, pose.local, placed)


def _ranked(
    scene: GraspScene, grasp: Grasp, pose: Carried, at: FloatArray | None, count: int
) -> list[tuple[float, FloatArray]]:
    """Places with the pose fitted to each, what fits and is like first."""
    at = None if at is None else at * _units(scene)
    touching = any(pad.role == PALM for pad in grasp.pads)
    result = []
    for unlike, local in carried_places(scene, grasp, pose, at, count):
        roots = scene.rig.parents < 0
        way = (local[roots][0] @ np.linalg.inv(scene.rig.rest_local[roots][0]))[:3, :3] @ scene.hand.frame[:, 0]
        fit = fitted(scene.hand, scene.field, local, pose.used, way, touching)
        result.append((unlike + fit.misfit, unlike, fit.local))
    result.sort(key=lambda each: each[0])
    return [(unlike, local) for _, unlike, local in result]


def _units(scene: GraspScene) -> float:
    """Hand units per unit of the object."""
    return scene.document.surface(scene.object_name).meters_per_unit / meters(scene)


def _in_world(scene: GraspScene, local: FloatArray) -> FloatArray:
    """A pose whose root is in the object's space, with its root in the hand's surface space."""
    hand_from_object = np.linalg.inv(scene.object_from_rig)
    result = local.copy()
    roots = scene.rig.parents < 0
    result[roots] = hand_from_object @ result[roots]
    return result


def _as_it_was(scene: GraspScene, grasp: Grasp, contacts: ContactSet, pose: Carried) -> Suggestion:
    """The saved contacts and pose, for the hand and the object that they were saved with: nothing is solved."""
    draft = cleared(scene)
    names = {contacts_name(contacts, grasp.hand.digest): scene.hand_name}
    names[contacts_name(contacts, grasp.object.digest)] = scene.object_name
    imported(draft, contacts, names)
    placed = grasp.placed.copy()
    placed[:3, 3] /= meters(scene)
    local = placed_at(scene.hand, pose.local, placed)
    draft.surfaces.set_pose(scene.hand_name, Pose(scene.rig.joints, _in_world(scene, local)))
    score = scene.plugins.make(GRASP_SCORES, scene.plugins.name_for(GRASP_SCORES, "grasp", None))
    solution = _unsolved(draft, scene)
    return judged(scene, draft, solution, grasp.kind, pose.used, {}, len(grasp.pads), True, score)


def _unsolved(draft: Draft, scene: GraspScene) -> PoseSolution:
    """The pose that a draft has, as a solution: what was saved needs no solve."""
    problem = draft.problem(Objective(free={scene.hand_name: ()}, length=scene.hand.length))
    theta = problem.start
    value = problem.value(problem.state(theta))
    return PoseSolution("library", SolveStatus.NOTHING_FREE, problem, theta, value, value, (), 0, 0.0)


def cleared(scene: GraspScene) -> Draft:
    """A draft without contacts between hand and object; the hand's patches stay."""
    draft = Draft(scene.document, scene.derived, scene.rigs, scene.evaluated)
    for name in pairs_between(scene):
        target = draft.document.pairs[name].object
        draft.pairs.remove(name)
        draft.patches.remove(target)
    return draft


def contacts_name(contacts: ContactSet, digest: str) -> str:
    """The name that a surface has in a contact set. Raises InvalidInput where the set knows no such surface."""
    for name, surface in contacts.surfaces.items():
        if surface.digest == digest:
            return name
    raise InvalidInput(f"the contacts {contacts.title!r} are not those of this grasp: they lie on other surfaces.")


def imported(draft: Draft, contacts: ContactSet, onto: dict[str, str]) -> dict[str, str]:
    """Bring the patches of a set that lie on the surfaces of `onto`, with their pairs; by their name in the set the
    name that they have. A patch that is there already, the very same, is not brought again."""
    document = draft.document
    chosen = [patch for patch in contacts.parents_first() if patch.surface in onto]
    names: dict[str, str] = {}
    taken = dict.fromkeys(document.patches)
    keys = _fresh(document, contacts.shapes, document.shapes)
    fresh = []
    for patch in chosen:
        there = document.patches.get(patch.name)
        if there is not None and _is_same(document, contacts, there, patch, onto):
            names[patch.name] = there.name
            keys[patch.shape] = there.shape
            continue
        names[patch.name] = document.free_name(patch.name, taken)
        taken[names[patch.name]] = None
        fresh.append(patch)
    patches = []
    for patch in fresh:
        place = patch.placement
        place = replace(place, parent=names[place.parent]) if isinstance(place, Link) else place
        patches.append(replace(patch, name=names[patch.name], shape=keys[patch.shape], placement=place))
        patches[-1] = replace(patches[-1], surface=onto[patch.surface])
    pairs = [p for p in contacts.pairs.values() if {p.manipulator, p.object} <= set(names)]
    shapes = {keys[p.shape]: contacts.shapes[p.shape] for p in fresh if keys[p.shape] not in document.shapes}
    called = _fresh(document, [p.name for p in pairs], document.pairs)
    brought = tuple(
        replace(p, name=called[p.name], manipulator=names[p.manipulator], object=names[p.object]) for p in pairs
    )
    draft.do(Import(tuple(patches), FrozenMap(shapes), brought, FrozenMap(), contacts.title))
    return names


def _fresh(document: ContactDocument, wanted: Iterable[str], among: Mapping[str, object]) -> dict[str, str]:
    """By each wanted name one that nothing has, nor any other of them."""
    taken, names = dict.fromkeys(among), {}
    for name in wanted:
        names[name] = document.free_name(name, taken)
        taken[names[name]] = None
    return names


def _is_same(
    document: ContactDocument, contacts: ContactSet, there: Patch, patch: Patch, onto: Mapping[str, str]
) -> bool:
    """Whether a patch of a document is the very one of a set."""
    same = replace(patch, surface=onto[patch.surface], shape=there.shape) == there
    return same and document.shapes[there.shape].digest == contacts.shapes[patch.shape].digest


# -- the pads on another hand ------------------------------------------------------------------------------------


def with_pads(
    scene: GraspScene, grasp: Grasp, contacts: ContactSet
) -> tuple[Draft, tuple[str, ...], dict[str, str]]:
    """A draft with the patches of the grasp on the scene's hand, their names, and why others were left out."""
    draft = cleared(scene)
    home = contacts_name(contacts, grasp.hand.digest)
    if is_own_hand(scene, grasp):
        names = imported(draft, contacts, {home: scene.hand_name})
        return draft, tuple(names[pad.patch] for pad in grasp.pads if pad.patch in names), {}
    moved, left = dict[str, Patch](), dict[str, str]()
    shapes = dict[str, PatchShape]()
    ratio = scene.hand.length * meters(scene) / grasp.hand.length
    for pad in grasp.pads:
        patch = contacts.patches.get(pad.patch)
        if patch is None:
            left[pad.patch] = "the contacts of the grasp lack it"
            continue
        try:
            root, shape = _seat(
                draft, scene, pad, contacts.shapes[patch.shape], ratio, is_other_side(grasp, scene.hand)
            )
        except ContactError as error:
            left[pad.patch] = str(error).rstrip(".")
            continue
        other = patch.mirrored != is_other_side(grasp, scene.hand)
        moved[pad.patch] = replace(patch, surface=home, placement=root, mirrored=other)
        shapes[patch.shape] = shape
    pairs = {n: p for n, p in contacts.pairs.items() if {p.manipulator, p.object} <= set(moved)}
    kept = ContactSet(contacts.title, contacts.surfaces, FrozenMap(moved), FrozenMap(shapes), FrozenMap(pairs))
    names = imported(draft, kept, {home: scene.hand_name}) if moved else {}
    return draft, tuple(names.values()), left


def scaled(shape: PatchShape, factor: float) -> PatchShape:
    """The same shape `factor` times as large."""
    axis, points = shape.axis, shape.coordinates
    return replace(
        shape,
        axis=replace(axis, lengths=factor * axis.lengths),
        coordinates=replace(points, legs=factor * points.legs, chain_lengths=factor * points.chain_lengths),
    )


def _seat(
    draft: Draft, scene: GraspScene, pad: SavedPad, shape: PatchShape, ratio: float, flip: bool
) -> tuple[Root, PatchShape]:
    """Where the axis of a pad begins on another hand, and its shape as large as the digit there is thick. ratio: of
    the lengths of the hands. Raises InvalidInput where the hand has no such digit or no skin there."""
    hand, mesh = scene.hand, scene.rig.surface
    side = MIRROR if flip else np.ones(3)
    if pad.role == PALM:
        frame = hand.frame
        at = hand.description.palm.point + frame @ (side * pad.at) * hand.length
        out = frame @ (side * pad.out)
        near = Locator.of(mesh).closest(at[None], facing=-out[None], facing_limit=-0.1)
        found, centre = bool(near.found[0]), near.points
    else:
        digit, place = _bone_of(hand.digits, pad)
        frame = bone_frames(hand, digit, hand.rig.rest_world)[place]
        here, end = bone_ends(hand, digit, place)
        at = here + min(float(pad.at[0]), 0.95) * (end - here)
        hit = Locator.of(mesh).cast(at[None], (frame @ (side * pad.out))[None])
        found, centre = bool(hit.found[0]), hit.points
        if found and pad.depth > 0.0:
            ratio *= float(np.clip(hit.distance[0] / hand.length / pad.depth, *THICKER))
    if not found:
        raise InvalidInput(f"{hand.rig.name} has no skin there")
    heading = direction_to_heading(mesh, centre, (frame @ (side * pad.axis))[None])
    shape = scaled(shape, ratio)
    half = 0.5 * shape.axis.length * shape.meters_per_unit / meters(scene)
    if half <= 0.0:
        return draft.geometry.root_at(scene.hand_name, centre, heading=complex(heading[0])), shape
    back = trace_geodesic(mesh, centre, -heading * half)
    way = heading_to_direction(mesh, back.points, -back.headings)[0]
    return draft.geometry.root_at(scene.hand_name, back.points, direction=way), shape


def _bone_of(digits: tuple[Digit, ...], pad: SavedPad) -> tuple[Digit, int]:
    """The bone of a hand on which a pad belongs. Raises InvalidInput where it has no such digit."""
    digit = next((digit for digit in digits if digit.role == pad.role), None)
    if digit is None:
        raise InvalidInput(f"the hand has no {pad.role} finger")
    for place, bone in enumerate(digit.bones):
        if bone.segment == pad.segment:
            return digit, place
    bending = [place for place, bone in enumerate(digit.bones) if bone.flexes] or [len(digit.bones) - 1]
    return digit, bending[-1] if pad.segment == "distal" else bending[0]


def _notes(scene: GraspScene, grasp: Grasp, pose: Carried) -> tuple[str, ...]:
    name = scene.rig.name
    notes = []
    touching = [role for role in pose.missing if role in grasp.touching]
    if touching:
        notes.append(f"{name} has no {' and no '.join(touching)}: the grasp is made without.")
    for role, other in pose.followed.items():
        notes.append(f"the {role} of {name} does as the {other}: the grasp was made by a hand without it.")
    return tuple(notes)
