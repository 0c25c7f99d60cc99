"""`suggest`: many different grasps of an object by a hand, each solved, measured and judged, the best first.

Many approaches are closed quickly and looked at once (`screening`); those that seem best and are not alike become
documents one after the other: pads are placed where the closed hand has them, the pose is solved with penetration
and self-collision, contacts settle, and the result is measured as any job's is."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.geometry.raycast import Locator
from contact_core.grasping.closing import Closed
from contact_core.grasping.finishing import Suggestion, finished
from contact_core.grasping.pads import painted_pads, remark_on_size
from contact_core.grasping.scene import GraspScene
from contact_core.grasping.searching import GraspSettings, chosen, kinds_of, place_of, screened
from contact_core.grasping.slots import GRASP_SCORES, Approaches, GraspScore, lacks
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.proposals.draft import Draft

MOST_TRIED = 3  # times as many as are wanted are solved at most,
LEAST_TRIED = 8  # or so many: who wants one good grasp does not care how many others failed
WITH_TIPS = ("precision", "pinch")  # kinds that one pad of each digit makes
LIES = 0.02  # hand lengths: a pad of the closed hand that is nearer lies on the object
REACHED = 0.5  # hand lengths: a place to hold that is farther from the object is none of its


def suggest(scene: GraspScene, settings: GraspSettings, progress: Progress = NO_PROGRESS) -> Iterator[Suggestion]:
    """Grasps as they come, good ones first as far as a first look tells; those that fail the verdict only where
    there are not enough others. Raises InvalidInput where the hand can come near the object nowhere, Cancelled."""
    progress.tell(0.0, "Looking at the hand and the object")
    at, kinds = place_of(scene, settings), kinds_of(scene, settings)
    _check(scene, settings, at)
    scene = replace(scene, at=at)
    base, pads, proposed = painted_pads(scene, at, "lateral" in kinds)
    approaches, closed, value, seen = screened(scene, settings, progress.part(0.02, 0.3))
    order = chosen(scene.hand, approaches, value, seen, max(MOST_TRIED * settings.count, LEAST_TRIED))
    if not len(order):
        raise _no_place(scene, settings)
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
    if not given and not poor:
        raise _no_place(scene, settings)
    yield from poor[: max(settings.count - len(given), 0)]
    progress.tell(1.0, "Done")


def _no_place(scene: GraspScene, settings: GraspSettings) -> InvalidInput:
    what = f"for a {' or '.join(settings.kinds)} grasp " if settings.kinds else ""
    return InvalidInput(f"the hand found no place {what}at which it touches the object. {remark_on_size(scene)}")


def ranked(found: Iterable[Suggestion]) -> list[Suggestion]:
    """Those that pass first, however well others score, and the best of each first."""
    return sorted(found, key=lambda one: (not one.is_grasp, -one.score))


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
    in_rig = np.linalg.inv(scene.object_from_rig) @ closed.placed[0]
    start = hand.pose(in_rig, closed.angles[0], closed.turns[0])
    draft.surfaces.set_pose(scene.hand_name, start)
    wanted = _taking_part(scene, approach, pads)
    if approach.kinds[0] in WITH_TIPS or (scene.loops and approach.bars[0, 6] > 0.0):
        wanted = _nearest_of_digits(scene, closed, wanted)
    return finished(scene, draft, wanted, proposed, approach.kinds[0], approach.used(hand)[0], score)


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


def _nearest_of_digits(scene: GraspScene, closed: Closed, pads: tuple[str, ...]) -> tuple[str, ...]:
    """Of those pads the nearest of each digit, and what lies on the object as well: a handle is no longer across
    than one bone, and a finger that goes round it cannot touch it with all; and tips that hold a thick thing do so
    alone."""
    hand = scene.hand
    owner = {pad.name: int(b) for pad in hand.description.pads for b in np.flatnonzero(hand.joints == pad.joint)}
    away = np.abs(closed.fits[0, :, 0]) / hand.length
    own = {name: owner[name] for name in pads if name in owner and hand.has_pad[owner[name]]}
    digits = {name: int(np.searchsorted(hand.bones, b, side="right")) for name, b in own.items()}
    least = {d: min(away[own[name]] for name in own if digits[name] == d) for d in digits.values()}
    return tuple(name for name in pads if name not in own or away[own[name]] <= max(least[digits[name]], LIES))
