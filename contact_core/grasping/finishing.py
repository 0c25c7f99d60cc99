"""A posed hand finished: its pads placed and paired, the pose solved and settled, the result measured, judged
and scored."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from contact_core.arrays import BoolArray, FloatArray
from contact_core.edit.command import Macro
from contact_core.errors import ContactError, InvalidInput
from contact_core.geometry.distance_field import DistanceField
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.transform import transform_points
from contact_core.grasping.facts import (
    clearance,
    closure,
    comfort,
    contact_wrenches,
    crossing,
    digits_in_contact,
    opposition,
    skin_through,
    thumb_along,
    thumb_away,
    uneven_curl,
)
from contact_core.grasping.hand import Hand
from contact_core.grasping.loops import digits_through
from contact_core.grasping.metrics import measure
from contact_core.grasping.posed_scene import posed_scene_in
from contact_core.grasping.scene import GraspScene, hand_share
from contact_core.grasping.screening import seen_from
from contact_core.grasping.slots import GraspFacts, GraspScore, Kind
from contact_core.grasping.verdict import Verdict, judge, judge_hold, margin
from contact_core.plugins.registry import PLACERS
from contact_core.plugins.slots import PlacementRequest
from contact_core.proposals.draft import Draft
from contact_core.proposals.proposal import Proposal, settle
from contact_core.rig.chart import pose_on
from contact_core.rig.poses import posed_points, posed_world
from contact_core.rig.rig import Pose
from contact_core.scene.problem import world_from_surface
from contact_core.solve.solver import PoseSolution

OUTSIDE = 0.015  # hand lengths: a closed hand that is no deeper in the filled object keeps out of all of it
UNFIT = 0.03  # hand lengths from its place, after solving, at which a proposed pad is given up
FACES = 0.35  # share of a pad that has to face the object within 45 degrees


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
    kept = _kept_out_of(scene, _posed(scene, draft))
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
    solid = scene.solid if own is scene.field else scene.filled(own)
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


def _posed(scene: GraspScene, draft: Draft) -> FloatArray:
    """(n, 3) the hand's skin as a draft has it, in the object's space."""
    return transform_points(scene.object_from_rig, posed_points(scene.rig, draft.document.poses[scene.hand_name]))


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


def judged(
    scene: GraspScene, draft: Draft, solution: PoseSolution, kind: Kind, used: BoolArray,
    left_out: dict[str, str], wanted: int, proposed: bool, score: GraspScore,
) -> Suggestion:  # fmt: skip
    """What a draft has made of a document, measured, judged and scored, as one step. As for `finished`; wanted: how
    many patches of the hand were to touch."""
    hand, rig = scene.hand, scene.rig
    pose = draft.document.poses[scene.hand_name]
    local = pose_on(rig, pose)
    object_from_rig = scene.object_from_rig
    world = object_from_rig @ posed_world(rig, pose)
    looked_at = posed_scene_in(
        draft.geometry, rig, scene.hand_name, scene.object_name, object_from_rig, scene.mesh, hand.length
    )
    posed, metrics = looked_at.skin, measure(looked_at)
    touching = digits_in_contact(hand, posed.points, Locator.of(scene.mesh))
    angles, (through,) = hand.angles_of(pose), digits_through(hand, world[hand.joints][None], scene.loops)
    metrics |= _through(hand, through)
    metrics |= {
        "pads_placed": (wanted - len(left_out)) / max(wanted, 1),
        "digits_in_contact": int((touching & used).sum()),
        "digits_wanted": int(used.sum()),
        "thumb_in_contact": bool(hand.thumb < 0 or not used[hand.thumb] or touching[hand.thumb]),
        "skin_through": float(skin_through(hand, posed.points, world, scene.mesh).max()) / hand.length,
        "uneven_curl_deg": float(np.degrees(uneven_curl(hand, angles, used & touching, through.any(axis=0)))),
        "opposition_deg": float(np.degrees(opposition(hand, posed.points, scene.mesh, used))),
        "thumb_away": thumb_away(hand, posed.points, scene.mesh, used),
        "thumb_along": thumb_along(hand, posed.points, world, scene.mesh),
        "crossing": crossing(hand, world),
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
        clearance(hand, scene.field, placed, way), verdict.failures, margin(metrics, kind),
    )  # fmt: skip
    command = Macro(f"{kind.capitalize()} grasp", draft.commands)
    proposal = Proposal(
        command, draft.document, scene.revision, solution, solution, left_out, solutions=(solution,)
    )
    seen = seen_from(hand, scene.field, placed[None])[0]
    return Suggestion(proposal, kind, facts, verdict, float(score.score(facts)), left_out, posed, placed, way, seen)


def _through(hand: Hand, through: BoolArray) -> dict[str, Any]:
    """Metrics of what goes through loops at the place that was to be held. through: (L, D) which digits do."""
    roles = [hand.digits[d].role for d in np.flatnonzero(through.any(axis=0))]
    return {
        "digits_through": len(roles),
        "through_loop": roles,
        "loops_held": int(through.any(axis=1).sum()),
    }
