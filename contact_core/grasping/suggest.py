"""`suggest`: many different grasps of an object by a hand, each solved, measured and judged, the best first.

Many approaches are closed quickly and looked at once (`screening`); those that seem best and are not alike become
documents one after the other: pads are placed where the closed hand has them, the pose is solved with penetration
and self-collision, contacts settle, and the result is measured as any job's is.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.document.document import ContactDocument
from contact_core.edit.command import Macro
from contact_core.errors import ContactError, InvalidInput
from contact_core.geometry.distance_field import DistanceField
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.transform import transform_points
from contact_core.grasping.closing import Closed, close_hands, relaxed
from contact_core.grasping.facts import (
    clearance,
    closure,
    comfort,
    contact_wrenches,
    crossing,
    digits_in_contact,
    opposition,
    skin_through,
    through_loops,
    uneven_curl,
)
from contact_core.grasping.filled import KeepOutTerm, filled
from contact_core.grasping.hand import Hand
from contact_core.grasping.metrics import Contact, PosedScene, measure
from contact_core.grasping.pads import painted_pads, remark_on_size
from contact_core.grasping.screening import distinct, elsewhere, first_look, seen_from
from contact_core.grasping.slots import KINDS, Approaches, GraspFacts, GraspRequest, GraspScore, Kind, lacks
from contact_core.grasping.verdict import Verdict, judge, judge_hold
from contact_core.plugins.registry import GRASP_SAMPLERS, GRASP_SCORES, PLACERS, POSE_TERMS
from contact_core.plugins.slots import PlacementRequest
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.proposals.draft import Draft
from contact_core.proposals.proposal import AGAIN, Proposal, SolveSettings, settle
from contact_core.rig.bones import bone_segments
from contact_core.rig.rig import Pose, forward_kinematics, skin
from contact_core.scene.problem import Objective, world_from_surface
from contact_core.solve.body import uniform_scale
from contact_core.solve.solver import PoseSolution, SolveOptions
from contact_core.solve.terms import PoseTerm, paper_terms

if TYPE_CHECKING:
    from contact_core.edit.derived import Derived
    from contact_core.plugins.manager import PluginManager
    from contact_core.rig.rig import Rig
    from contact_core.scene.evaluated_rig import HostRig

CELL = 0.014  # hand lengths: of the distance field, where the object is small enough for it
NODES = 1_500_000  # of the field, at most
MOST_TRIED = 3  # times as many as are wanted are solved at most
SECOND_LOOK = 220  # approaches that are closed with all starts of the thumb
MORE = {"power": 3.0}  # times as many approaches of a kind as of others
TURNS = ("power", "power", "precision", "power", "pinch", "power", "hook")  # one after the other
THREADED = 0.3  # what each finger through a loop at the place to hold is worth to a first look
WORSE, HOPELESS = 1.1, -0.6  # a first look that is worse than the best by so much, and below that, is not tried
NEAR_CELL, NEAR_ROOM = 0.02, 0.12  # hand lengths: of a field round one hand, and how far beyond its skin it goes
FILLED = 0.2  # hand lengths: what a ball of this radius does not reach is filled
REACHED = 0.5  # hand lengths: a place to hold that is farther from the object is none of its
OUTSIDE = 0.015  # hand lengths: a closed hand that is no deeper in the filled object keeps out of all of it
UNFIT = 0.03  # hand lengths from its place, after solving, at which a proposed pad is given up
FACES = 0.35  # share of a pad that has to face the object within 45 degrees
PENETRATION = 16.0
USUAL: tuple[Kind, ...] = ("power", "precision", "pinch", "hook")


@dataclass(frozen=True, eq=False)
class Suggestion:
    """One grasp. proposal: what `Session.accept` commits. facts: its metrics and what an eye sees. verdict: which
    of them fail, in words. score: of the score plugin, the higher the better. skin: the posed skin in the object's
    space, in the hand's units; placed: (4, 4) its rig space there; way: (3,) unit, from the palm into the object.
    seen: the object's distances from points of the hand, by which grasps are alike."""

    proposal: Proposal
    kind: Kind
    facts: GraspFacts
    verdict: Verdict
    score: float
    left_out: Mapping[str, str]
    skin: TriangleMesh
    placed: FloatArray
    way: FloatArray
    seen: FloatArray

    @property
    def is_grasp(self) -> bool:
        return self.verdict.is_grasp


@dataclass(frozen=True)
class GraspSettings:
    """count: how many are wanted. kinds: which; usual ones by default. at: (3,) the place of the object that is
    to be held, in its surface space. sampler, score: plugins by name, the defaults without."""

    count: int = 8
    kinds: tuple[Kind, ...] = ()
    at: tuple[float, float, float] | None = None
    seed: int = 0
    sampler: str | None = None
    score: str | None = None
    sampler_settings: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not 1 <= self.count <= 64:
            raise InvalidInput(f"from 1 to 64 grasps can be asked for, but {self.count} were.")
        wrong = [kind for kind in self.kinds if kind not in KINDS]
        if wrong:
            raise InvalidInput(f"a grasp is one of {', '.join(KINDS)}, but {wrong[0]!r} was asked for.")
        if self.at is not None and not np.isfinite(self.at).all():
            raise InvalidInput(f"the place to hold is three finite numbers, but got {list(self.at)}.")
        if not 0 <= self.seed < 2**32:
            raise InvalidInput(f"the seed is a whole number from 0 to 2^32 - 1, but got {self.seed}.")


@dataclass(frozen=True, eq=False)
class GraspScene:
    """The document, its hand and its object, and what solves there. hand_name, object_name: of their surfaces.
    prior: what draws the digits that touch nothing: the closed hand with its thumb at rest ("closed"), or
    the pose from which a solve starts ("current"). at: (3,) the place that is to be held, in the object's space in
    the hand's units, if one was named."""

    document: ContactDocument
    derived: Derived
    rigs: Mapping[str, Rig]
    hand: Hand
    hand_name: str
    object_name: str
    plugins: PluginManager
    revision: int = 0
    evaluated: Mapping[str, HostRig] | None = None
    prior: Literal["closed", "current"] = "closed"
    at: FloatArray | None = None

    @property
    def rig(self) -> Rig:
        return self.hand.rig

    @cached_property
    def object_from_world(self) -> FloatArray:
        """(4, 4) rigid; world lengths are the hand's units, and so is the object's space here."""
        world = world_from_surface(self.document, self.object_name, self._unit)
        world = world.copy()
        world[:3, :3] /= uniform_scale(world)
        return np.asarray(np.linalg.inv(world))

    @property
    def _unit(self) -> float:
        return self.document.surface(self.hand_name).meters_per_unit

    @cached_property
    def mesh(self) -> TriangleMesh:
        """The object in the hand's units."""
        mesh = self.derived.mesh(self.document, self.object_name)
        scale = self.document.surface(self.object_name).meters_per_unit / self._unit
        return mesh if scale == 1.0 else TriangleMesh(mesh.points * scale, mesh.faces)

    @cached_property
    def resolution(self) -> int:
        """Nodes of the distance field along the object's longest side."""
        sides = np.ptp(self.mesh.points[np.unique(self.mesh.faces)], axis=0) + 0.3 * self.mesh.bounding_box_diagonal
        fine = float(sides.max()) / (CELL * self.hand.length)
        share = float(np.prod(sides / sides.max()))
        return int(np.clip(min(fine, (NODES / share) ** (1.0 / 3.0)), 48, 256))

    @cached_property
    def field(self) -> DistanceField:
        return DistanceField.of(self.mesh, resolution=self.resolution)

    @cached_property
    def solid(self) -> DistanceField:
        """The object with its hollows filled (`filled`)."""
        return filled(self.field, FILLED * self.hand.length)

    def near(self, skin: FloatArray) -> DistanceField:
        """The field round skin of the hand (n, 3): where the object is so large that its own is too coarse, a finer
        one of that part."""
        fine = NEAR_CELL * self.hand.length
        if self.field.spacing <= fine:
            return self.field
        room = NEAR_ROOM * self.hand.length
        part = DistanceField.within(self.mesh, skin.min(axis=0) - room, skin.max(axis=0) + room, fine)
        return part or self.field

    def terms(self, kept: DistanceField) -> tuple[PoseTerm, ...]:
        """The paper's, depth in what is kept out of, and self-collision where a plugin offers it."""
        result: tuple[PoseTerm, ...] = paper_terms()
        scale = uniform_scale_of(self)
        own = DistanceField(kept.origin / scale, kept.spacing / scale, kept.values / scale)
        result += (KeepOutTerm(weight=PENETRATION, resolution=48, fields={self.object_name: own}),)
        if "self-collision" in self.plugins.offers(POSE_TERMS):
            result += (self.plugins.make(POSE_TERMS, "self-collision"),)
        return result

    def settings(self, kept: DistanceField, closed: Pose) -> SolveSettings:
        """How grasps are solved: from the closed hand and near it, digits and root free, a body's other joints as
        they are. kept: what it keeps out of. closed: the pose that digits without a contact keep.
        """
        rig = self.rig
        moving = [rig.joints[j] for j in {*np.flatnonzero(rig.parents < 0).tolist(), *self.hand.joints.tolist()}]
        prior = self.prior if self.prior == "current" else {self.hand_name: self._drawn_to(closed)}
        objective = Objective(self.terms(kept), free={self.hand_name: moving}, prior=prior, length=self.hand.length)
        return SolveSettings(objective=objective, options=SolveOptions(candidates=AGAIN, max_iterations=60))

    def _drawn_to(self, closed: Pose) -> Pose:
        """The closed hand with its thumb at rest: what its root was searched over stretches the skin there."""
        if self.hand.thumb < 0:
            return closed
        local = closed.local.copy()
        for joint in self.hand.joints[self.hand.bones[self.hand.thumb] : self.hand.bones[self.hand.thumb + 1]]:
            local[closed.joints.index(self.rig.joints[joint])] = self.rig.rest_local[joint]
        return Pose(closed.joints, local)


def suggest(scene: GraspScene, settings: GraspSettings, progress: Progress = NO_PROGRESS) -> Iterator[Suggestion]:
    """Grasps as they come, good ones first as far as a first look tells; those that fail the verdict only where
    there are not enough others. Raises InvalidInput where the hand can come near the object nowhere, Cancelled."""
    progress.tell(0.0, "Looking at the hand and the object")
    at = None if settings.at is None else np.array(settings.at) * uniform_scale_of(scene)
    kinds = settings.kinds or tuple(kind for kind in USUAL if lacks(scene.hand, kind) is None)
    _check(scene, settings, at)
    scene = replace(scene, at=at)
    base, pads, proposed = painted_pads(scene, at, "lateral" in kinds)
    approaches, closed, value, seen = screened(scene, settings, progress.part(0.02, 0.3))
    order = chosen(scene.hand, approaches, value, seen, MOST_TRIED * settings.count)
    if not len(order):
        what = f"for a {' or '.join(settings.kinds)} grasp " if settings.kinds else ""
        raise InvalidInput(f"the hand found no place {what}at which it touches the object. {remark_on_size(scene)}")
    score = scene.plugins.make(GRASP_SCORES, scene.plugins.name_for(GRASP_SCORES, "grasp", settings.score))
    given, poor = list[Suggestion](), list[Suggestion]()
    for place, n in enumerate(order):
        if len(given) >= settings.count:
            break
        share = max(place / len(order), len(given) / settings.count)
        progress.tell(0.3 + 0.7 * share, f"Solving grasp {len(given) + 1} of {settings.count}")
        one = _finished(scene, base, pads, proposed, approaches[n], closed[np.array([n])], score)
        if one is None or any(_alike(scene, one, other) for other in given):
            continue
        if one.is_grasp:
            given.append(one)
            yield one
        else:
            poor.append(one)
    poor.sort(key=lambda one: -one.score)
    yield from poor[: max(settings.count - len(given), 0)]
    progress.tell(1.0, "Done")


def _check(scene: GraspScene, settings: GraspSettings, at: FloatArray | None) -> None:
    """Raises InvalidInput for kinds that the hand cannot do, and a place that is not on the object."""
    for kind in settings.kinds:
        if missing := lacks(scene.hand, kind):
            name = scene.rig.name
            raise InvalidInput(f"a {kind} grasp needs {missing}, which {name} has not; ask for power or hook.")
    if at is not None:
        away = float(Locator.of(scene.mesh).closest(at[None]).distance[0]) / scene.hand.length
        if away > REACHED:
            raise InvalidInput(
                f"the place to hold is {away:.3g} hand lengths away from the object; name one on it, in its file's"
                " units."
            )


def screened(
    scene: GraspScene, settings: GraspSettings, progress: Progress = NO_PROGRESS
) -> tuple[Approaches, Closed, FloatArray, FloatArray]:
    """Approaches closed in full, what a first look makes of them (N,), and what each hand sees (N, p)."""
    hand, field = scene.hand, scene.field
    name = scene.plugins.name_for(GRASP_SAMPLERS, "grasp", settings.sampler)
    sampler = scene.plugins.make(GRASP_SAMPLERS, name, **settings.sampler_settings)
    at = None if settings.at is None else np.array(settings.at) * uniform_scale_of(scene)
    kinds = settings.kinds or tuple(kind for kind in USUAL if lacks(hand, kind) is None)
    approaches = sampler.sample(GraspRequest(hand, scene.mesh, field, kinds, at, settings.seed))
    progress.tell(0.3, "Closing the hand in many places")
    values = np.zeros(0)
    if len(approaches.kinds):
        rough = _closed(hand.quick, field, approaches)
        values = (
            first_look(hand, scene.mesh, approaches, rough) - elsewhere(hand, rough, at) + _threaded(scene, rough)
        )
        best = _shared_out(approaches, values, SECOND_LOOK)
        approaches = approaches[best]
    progress.tell(0.6, "Turning the thumb")
    closed = _closed(hand, field, approaches)
    value = values
    if len(approaches.kinds):
        value = (
            first_look(hand, scene.mesh, approaches, closed)
            - elsewhere(hand, closed, at)
            + _threaded(scene, closed)
        )
    return approaches, closed, value, seen_from(hand, field, closed.placed)


def _threaded(scene: GraspScene, closed: Closed) -> FloatArray:
    """(N,) what fingers through a loop at the place that is to be held are worth; nothing without a place."""
    if scene.at is None:
        return np.zeros(len(closed.placed))
    frames = scene.hand.frames(closed.placed, closed.angles, closed.starts)
    through = through_loops(scene.hand, frames, scene.field, scene.solid, scene.at)
    return np.asarray(THREADED * np.minimum(through.sum(axis=1), 4))


def uniform_scale_of(scene: GraspScene) -> float:
    """Hand units per unit of the object's surface."""
    surfaces = scene.document.surfaces
    return surfaces[scene.object_name].meters_per_unit / surfaces[scene.hand_name].meters_per_unit


def _closed(hand: Hand, field: DistanceField, approaches: Approaches) -> Closed:
    closed = close_hands(
        hand, field, approaches.placed, approaches.ways, approaches.bars, approaches.curls, approaches.limits
    )
    return relaxed(hand, closed)


def _shared_out(approaches: Approaches, values: FloatArray, most: int) -> IntArray:
    """Indices of the best of every kind, `most` in all."""
    kinds = sorted(set(approaches.kinds), key=approaches.kinds.index)
    names = np.array(approaches.kinds)
    shares = np.array([MORE.get(kind, 1.0) for kind in kinds])
    taken = []
    for kind, share in zip(kinds, shares / shares.sum(), strict=True):
        own = np.flatnonzero((names == kind) & np.isfinite(values))
        taken.append(own[np.argsort(-values[own], kind="stable")][: max(8, int(share * most))])
    return np.concatenate(taken) if taken else np.zeros(0, np.int64)


def chosen(hand: Hand, approaches: Approaches, value: FloatArray, seen: FloatArray, count: int) -> IntArray:
    """The approaches worth solving, in the order in which they are: two of three are power grasps, where there are
    such; none is like one before it."""
    names = np.array(approaches.kinds)
    queues: dict[str, list[int]] = {}
    for kind in dict.fromkeys(approaches.kinds):
        own = np.flatnonzero((names == kind) & (value >= min(value.max() - WORSE, HOPELESS)))
        order = own[np.argsort(-value[own], kind="stable")]
        queues[kind] = distinct(seen, order, count, hand.length).tolist()
    turn = [*(kind for kind in TURNS if kind in queues), *(kind for kind in queues if kind not in TURNS)]
    result: list[int] = []
    while any(queues.values()) and len(result) < count:
        result.extend(queues[kind].pop(0) for kind in turn if queues[kind])
    return distinct(seen, np.array(result, np.int64), count, hand.length)


def _alike(scene: GraspScene, one: Suggestion, other: Suggestion) -> bool:
    return float(np.abs(one.seen - other.seen).mean()) < 0.5 * 0.022 * scene.hand.length


def _finished(
    scene: GraspScene,
    base: Draft,
    pads: tuple[str, ...],
    proposed: bool,
    approach: Approaches,
    closed: Closed,
    score: GraspScore,
) -> Suggestion | None:
    """A closed hand as a solved document; None where too few pads find a place."""
    hand, draft = scene.hand, base.copy()
    world = world_from_surface(scene.document, scene.hand_name)
    in_rig = np.linalg.inv(world) @ np.linalg.inv(scene.object_from_world) @ closed.placed[0]
    start = hand.pose(in_rig, closed.angles[0], closed.starts[0])
    draft.surfaces.set_pose(scene.hand_name, start)
    wanted = _taking_part(scene, approach, pads)
    return finished(scene, draft, wanted, proposed, approach.kinds[0], approach.used(hand)[0], score)


def finished(
    scene: GraspScene,
    draft: Draft,
    wanted: tuple[str, ...],
    proposed: bool,
    kind: Kind,
    used: BoolArray,
    score: GraspScore,
) -> Suggestion | None:
    """A hand that a draft has posed, as a solved and judged document; None where fewer than two pads find a place.

    wanted: patches of the hand that shall touch. proposed: whether those that do not may be left out. used: (D,)
    which digits take part.
    """
    left_out = _place(scene, draft, wanted)
    if len(wanted) - len(left_out) < 2:
        return None
    kept = _kept_out_of(scene, _stands(scene, draft)[1].points)
    start = draft.document.poses[scene.hand_name]
    try:
        solution = _settled(scene, draft, kept, start)
        if proposed and (bad := _unfit(scene, solution)) and len(draft.document.pairs) - len(bad) >= 2:
            for name, why in bad.items():
                target = draft.document.pairs[name].object
                draft.pairs.remove(name)
                draft.patches.remove(target)
                left_out[name] = why
            solution = _settled(scene, draft, kept, start)
    except InvalidInput:
        return None
    return judged(scene, draft, solution, kind, used, left_out, len(wanted), proposed, score)


def _kept_out_of(scene: GraspScene, skin: FloatArray) -> DistanceField:
    """The object near the closed hand's skin (n, 3), its hollows filled where the hand does not reach into them."""
    own = scene.near(skin[scene.hand.own_skin])
    solid = scene.solid if own is scene.field else filled(own, FILLED * scene.hand.length)
    return solid if solid.distances(skin).min() > -OUTSIDE * scene.hand.length else own


def _settled(scene: GraspScene, draft: Draft, kept: DistanceField, closed: Pose) -> PoseSolution:
    """Solve, contacts to where they then face the object, solve again; the better of both."""
    settings = scene.settings(kept, closed)
    found = settle(draft.document, draft.copy(), scene.plugins, scene.revision, settings, rounds=1)
    draft.do(found.command)
    return found.after


def _unfit(scene: GraspScene, solution: PoseSolution) -> dict[str, str]:
    """Proposed pads that the solve could not bring to their places, with the reason: they do not belong there."""
    far = UNFIT * scene.hand.length
    return {
        name: "the solved hand does not lie on the object there"
        for name, patch in solution.patches.items()
        if patch.mean > far or patch.opposed_45 < FACES
    }


def _stands(scene: GraspScene, draft: Draft) -> tuple[FloatArray, TriangleMesh]:
    """(j, 4, 4) object_from_joint of the hand as a draft has it, and its posed skin in the object's space."""
    rig = scene.rig
    local = _local(rig, draft.document.poses[scene.hand_name])
    object_from_rig = scene.object_from_world @ world_from_surface(scene.document, scene.hand_name)
    own = forward_kinematics(rig.parents, local)
    return object_from_rig @ own, TriangleMesh(transform_points(object_from_rig, skin(rig, own)), rig.faces)


def _taking_part(scene: GraspScene, approach: Approaches, pads: tuple[str, ...]) -> tuple[str, ...]:
    """The pads that this kind of grasp touches with: those of digits that take part, the palm's in a power grasp,
    the side of the first finger in place of its others in a lateral one."""
    hand, used, kind = scene.hand, approach.used(scene.hand)[0], approach.kinds[0]
    roles = {d.role: k for k, d in enumerate(hand.digits)}
    own = {pad.name: pad.role for pad in hand.description.pads}
    beside = None if hand.side_pad is None else hand.side_pad.name

    def counts(name: str) -> bool:
        if name == beside or own.get(name) == "palm":
            return kind == ("lateral" if name == beside else "power")
        digit = roles.get(own.get(name, ""), -1)
        if digit < 0:
            return name not in own
        return bool(used[digit]) and not (kind == "lateral" and digit == hand.first_finger)

    return tuple(name for name in pads if counts(name))


def _place(scene: GraspScene, draft: Draft, names: tuple[str, ...]) -> dict[str, str]:
    """Pads to their closest facing points on the object, paired; those left out, with the reason."""
    world = {name: world_from_surface(draft.document, name) for name in (scene.hand_name, scene.object_name)}
    request = PlacementRequest(
        rig=scene.rig,
        pose=draft.document.poses[scene.hand_name],
        object_mesh=draft.geometry.mesh(scene.object_name),
        object_from_rig=np.asarray(np.linalg.inv(world[scene.object_name]) @ world[scene.hand_name]),
        patch_points={name: draft.geometry.points(name) for name in names},
        patch_axes={name: draft.geometry.axis_points(name) for name in names},
        reach=0.05 * hand_share(scene),
    )
    result = scene.plugins.get(PLACERS, scene.plugins.name_for(PLACERS, "settle")).place(request)
    left_out = dict(result.left_out)
    for name, place in result.placed.items():
        try:
            target = draft.patches.transfer(
                name,
                scene.object_name,
                place.root,
                direction=place.direction,
                name=f"{name} on {scene.object_name}",
            )
        except ContactError as error:  # where the object's surface is not sound a pad is left out, not the grasp
            left_out[name] = str(error)
            continue
        draft.patches.recolor(target, draft.document.patch(name).color)
        draft.pairs.add(name, target, name=name)
    return left_out


def hand_share(scene: GraspScene) -> float:
    """The hand's length as a share of the whole manipulator's, which placers measure by."""
    from contact_core.solve.body import manipulator_length

    return scene.hand.length / manipulator_length(scene.rig)


def judged(
    scene: GraspScene, draft: Draft, solution: PoseSolution, kind: Kind, used: BoolArray,
    left_out: dict[str, str], wanted: int, proposed: bool, score: GraspScore,
) -> Suggestion:  # fmt: skip
    """What a draft has made of a document, measured, judged and scored, as one step. As for `finished`; wanted: how
    many patches of the hand were to touch."""
    hand, rig = scene.hand, scene.rig
    pose = draft.document.poses[scene.hand_name]
    local = _local(rig, pose)
    object_from_rig = scene.object_from_world @ world_from_surface(scene.document, scene.hand_name)
    world, posed = _stands(scene, draft)
    contacts = {
        pair.pair.name: Contact(pair.manipulator_points, pair.object_points)
        for pair in draft.geometry.pairs()
        if (pair.manipulator_surface, pair.object_surface) == (scene.hand_name, scene.object_name)
    }
    metrics = measure(
        PosedScene(
            rest=rig.surface, skin=posed, bones=bone_segments(rig.parents, world), rest_local=rig.rest_local,
            local=local, moving=rig.parents >= 0, object_mesh=scene.mesh, solids=(scene.mesh,), contacts=contacts,
            length=hand.length,
        )
    )  # fmt: skip
    touching = digits_in_contact(hand, posed.points, Locator.of(scene.mesh))
    angles = hand.angles_of(pose)
    metrics |= {
        "pads_placed": (wanted - len(left_out)) / max(wanted, 1),
        "digits_in_contact": int((touching & used).sum()),
        "digits_wanted": int(used.sum()),
        "thumb_in_contact": bool(hand.thumb < 0 or not used[hand.thumb] or touching[hand.thumb]),
        "skin_through": float(skin_through(hand, posed.points, world, scene.mesh).max()) / hand.length,
        "uneven_curl_deg": float(np.degrees(uneven_curl(hand, angles, used & touching))),
        "opposition_deg": float(np.degrees(opposition(hand, posed.points, scene.mesh, used))),
        "crossing": crossing(hand, world),
        "digits_through": _digits_through(scene, world),
        "closure": closure(contact_wrenches(posed, scene.mesh, hand.length)),
    }
    verdict = judge(metrics, {} if proposed else left_out, {})
    if proposed:
        verdict = replace(verdict, failures=tuple(f for f in verdict.failures if not f.startswith("patch ")))
    held = judge_hold(metrics, kind)
    verdict = replace(verdict, failures=verdict.failures + held)
    placed = object_from_rig @ local[rig.parents < 0][0] @ np.linalg.inv(rig.rest_local[rig.parents < 0][0])
    way = placed[:3, :3] @ hand.frame[:, 0]
    facts = GraspFacts(
        kind, metrics, metrics["closure"], comfort(hand, angles),
        clearance(hand, scene.field, placed, way), verdict.failures,
    )  # fmt: skip
    command = Macro(f"{kind.capitalize()} grasp", draft.commands)
    proposal = Proposal(
        command, draft.document, scene.revision, solution, solution, left_out, solutions=(solution,)
    )
    seen = seen_from(hand, scene.field, placed[None])[0]
    return Suggestion(proposal, kind, facts, verdict, float(score.score(facts)), left_out, posed, placed, way, seen)


def _digits_through(scene: GraspScene, world: FloatArray) -> int:
    """How many digits go through a loop at the place that was to be held; none where no place was named."""
    if scene.at is None:
        return 0
    frames = world[scene.hand.joints][None]
    return int(through_loops(scene.hand, frames, scene.field, scene.solid, scene.at).sum())


def _local(rig: Rig, pose: Pose) -> FloatArray:
    return np.asarray(pose.local[[pose.joints.index(name) for name in rig.joints]])
