"""A grasp carried: to its own hand and object it is the same pose; to a mirrored hand its mirror image; to others
it holds, and says what they lack."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from contact_core.document.library import ContactSet
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.transform import transform_points
from contact_core.grasp_files.grasp import HAND, OBJECT, prepare
from contact_core.grasping.hand import hand_of
from contact_core.hands.describe import describe_hand
from contact_core.library.applying import apply, carried_places
from contact_core.library.carrying import carried, palm_in_rig
from contact_core.library.record import Grasp, dump_grasp, parse_grasp
from contact_core.library.shelf import Library
from contact_core.library.verbs import apply_grasp, library_scene, save_grasp
from contact_core.plugins.manager import PluginManager
from contact_core.rig.rig import JointFreedom, Rig, forward_kinematics
from contact_core.session import Session

Saved = tuple[Grasp, ContactSet]
TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


def placed(turn: np.ndarray, at: tuple[float, float, float]) -> np.ndarray:
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = turn, at
    return result


def posed(session: Session) -> np.ndarray:
    pose = session.document.poses[HAND]
    return pose.local[[pose.joints.index(name) for name in session.rigs[HAND].joints]]


def fresh(plugins: PluginManager, hand: str = "human_hand", thing: str = "baseball") -> Session:
    return prepare(f"sample:{hand}", f"sample:{thing}", 1.0, plugins).session


def test_on_its_own_hand_and_object_it_is_the_same(held: Session, saved: Saved, plugins: PluginManager) -> None:
    session = fresh(plugins)
    (found,) = apply(library_scene(session, HAND, OBJECT), *saved)
    assert found.suggestion.proposal.solutions[0].evaluations == 0  # nothing was solved
    session.accept(found.suggestion.proposal)
    assert np.abs(posed(session) - posed(held)).max() < 1e-9
    touching = {name for pair in held.document.pairs.values() for name in (pair.manipulator, pair.object)}
    assert dict(session.document.patches) == {n: p for n, p in held.document.patches.items() if n in touching}
    assert dict(session.document.pairs) == dict(held.document.pairs)
    session.undo()
    assert not session.document.pairs and not session.document.patches and not session.document.poses


def test_the_way_to_any_hand_and_object_leads_back_to_its_own(held: Session, saved: Saved) -> None:
    """Without looking at digests: bones, palm and like places alone give the pose back."""
    scene, grasp = library_scene(held, HAND, OBJECT), parse_grasp(dump_grasp(saved[0]).encode(), "x")
    unlike, local = next(iter(carried_places(scene, grasp, carried(grasp, scene.hand))))
    assert unlike < 1e-9
    assert np.abs(local - posed(held)).max() < 1e-6


def test_it_goes_with_its_object(held: Session, saved: Saved, plugins: PluginManager) -> None:
    session = fresh(plugins)
    moved = placed(TURN, (0.3, -0.2, 1.0))
    session.surfaces.place(OBJECT, moved)
    (found,) = apply(library_scene(session, HAND, OBJECT), *saved)
    session.accept(found.suggestion.proposal)
    wanted = posed(held)
    wanted[0] = moved @ wanted[0]
    assert np.abs(posed(session) - wanted).max() < 1e-6


def test_an_object_turned_in_its_own_space_is_the_same_object(saved: Saved, plugins: PluginManager) -> None:
    session = fresh(plugins, thing="mug")
    (found,) = apply(library_scene(session, HAND, OBJECT), *saved)
    session.accept(found.suggestion.proposal)
    again, _ = save_of(session)
    scene = library_scene(session, HAND, OBJECT)
    turned = placed(TURN, (0.01, 0.02, -0.03))
    mesh = TriangleMesh(transform_points(turned, scene.mesh.points), scene.mesh.faces)
    other = fresh(plugins)
    other.surfaces.remove(OBJECT)
    other.surfaces.add(OBJECT, mesh)
    there = library_scene(other, HAND, OBJECT)
    unlike, local = next(iter(carried_places(there, again, carried(again, there.hand))))
    wanted = posed(session)
    wanted[0] = turned @ wanted[0]
    assert unlike < 0.01  # the field is sampled along other axes
    assert np.abs(local - wanted).max() < 1e-6


def save_of(session: Session) -> Saved:
    from contact_core.library.capture import captured

    return captured(library_scene(session, HAND, OBJECT))


def mirror_of(rig: Rig) -> Rig:
    """The other hand: reflected at x = 0."""
    flip = np.diag([-1.0, 1.0, 1.0, 1.0])
    free = tuple(JointFreedom("ball", translates=freedom.translates) for freedom in rig.freedoms)
    return replace(
        rig, rest_local=flip @ rig.rest_local @ flip, bind_world=flip @ rig.bind_world @ flip,
        bind_points=rig.bind_points * [-1.0, 1.0, 1.0], faces=rig.faces[:, ::-1], freedoms=free,
        joints=tuple(f"other_{name}" for name in rig.joints),
    )  # fmt: skip


def test_the_other_hand_does_the_mirror_image(held: Session, saved: Saved) -> None:
    scene = library_scene(held, HAND, OBJECT)
    rig = mirror_of(scene.rig)
    hand = hand_of(rig, describe_hand(rig))
    assert hand.description.side == "left"
    pose = carried(saved[0], hand)
    flip = np.diag([-1.0, 1.0, 1.0, 1.0])
    own, wanted = forward_kinematics(rig.parents, pose.local), forward_kinematics(rig.parents, posed(held))
    here, there = palm_in_rig(hand, own), palm_in_rig(scene.hand, wanted)
    digits = hand.joints
    mine = (np.linalg.inv(here) @ own[digits])[:, :3, 3] * [1.0, 1.0, -1.0]
    theirs = (np.linalg.inv(there) @ wanted[digits])[:, :3, 3]
    assert np.abs(mine - theirs).max() < 1e-5 * hand.length
    assert np.allclose(flip @ rig.rest_local @ flip, scene.rig.rest_local)


# Not the human hand on the mug: it closes round it by 98 to 101 degrees where 100 are wanted, which falls to either
# side by the last bits of one processor or another.
@pytest.mark.parametrize(
    ("hand", "thing"), [("human_hand", "pole"), ("witch_hand", "baseball"), ("witch_hand", "mug")]
)
def test_it_holds_elsewhere(saved: Saved, plugins: PluginManager, hand: str, thing: str) -> None:
    session = fresh(plugins, hand, thing)
    (found,) = apply(library_scene(session, HAND, OBJECT), *saved)
    assert found.suggestion.is_grasp, found.suggestion.verdict.failures
    revision = session.revision
    session.accept(found.suggestion.proposal)
    assert session.revision == revision + 1 and len(session.document.pairs) >= 4


def test_missing_digits_are_said(saved: Saved, plugins: PluginManager) -> None:
    session = fresh(plugins, "alien_hand")
    (found,) = apply(library_scene(session, HAND, OBJECT), *saved)
    assert found.suggestion.is_grasp, found.suggestion.verdict.failures
    assert any("alien_hand has no ring and no little" in note for note in found.notes), found.notes


def test_applied_again_it_is_not_there_twice(saved: Saved, plugins: PluginManager) -> None:
    session = fresh(plugins, thing="mug")
    for _ in range(2):
        (found,) = apply(library_scene(session, HAND, OBJECT), *saved)
        session.accept(found.suggestion.proposal)
    on_hand = [patch for patch in session.document.patches.values() if patch.surface == HAND]
    assert len(on_hand) == len(saved[0].pads)


def test_without_pairs_there_is_nothing_to_save(plugins: PluginManager) -> None:
    with pytest.raises(InvalidInput, match="no grasp to save"):
        save_of(fresh(plugins))


def test_verbs_of_a_session(held: Session, plugins: PluginManager, tmp_path: object) -> None:
    library = Library(str(tmp_path))
    assert save_grasp(held, library, "ball", HAND, OBJECT, kind="power", tags=("a",)) == 1
    assert (library.picture("ball") or b"").startswith(b"\x89PNG")
    session = fresh(plugins)
    (found,) = apply_grasp(session, library, "ball", HAND, OBJECT)
    assert found.unlike == 0.0 and not session.document.pairs
    with pytest.raises(InvalidInput, match="64 ways"):
        apply_grasp(session, library, "ball", HAND, OBJECT, count=0)
