"""Settle and slide: nothing is committed until it is accepted, as one undo step, and contacts fit better."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import contact_builtins
from contact_core.contact.placement import Link
from contact_core.document.schema import document_to_json
from contact_core.errors import Cancelled, CommandRejected, InvalidInput
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.job.run import prepare
from contact_core.plugins.manager import PluginManager
from contact_core.proposals.proposal import Proposal, SolveSettings
from contact_core.recipe.reader import load_recipe
from contact_core.rig.rig import Rig
from contact_core.scene.memory_host import MemoryHost
from contact_core.session import DocumentChanged, Session
from contact_core.solve.solver import PoseSolution
from contact_core.testing import meshes, rigs

BALL = meshes.icosphere(3, radius=3.0)
PATCHES = ("wrist", "finger1_2", "finger3_2")


def pad(rig: Rig, joint: str, axis: int = 2) -> SurfacePoints:
    """Faces of a joint's skin, those first whose normals look along an axis (+z), from the lowest y (or x) on."""
    owner = rig.skin_joints[rig.faces[:, 0], 0]
    surface = rig.surface
    faces = np.flatnonzero(owner == rig.joint_index(joint))
    faces = faces[np.argsort(-surface.face_normals[faces, axis], kind="stable")[:12]]
    faces = faces[np.argsort(surface.points[surface.faces[faces]].mean(axis=1)[:, axis - 1], kind="stable")]
    return SurfacePoints(faces, np.full((len(faces), 3), 1.0 / 3.0))


@pytest.fixture
def session() -> Session:
    """A hand and a ball in other units, three pairs, the targets near one another but placed badly."""
    rig = rigs.hand_like(rigs.limited_freedom)
    session = Session(plugins=[contact_builtins], discover=False)
    session.surfaces.add("hand", rig.surface, rig=rig, meters_per_unit=0.01)
    where = np.eye(4)
    where[:3, 3] = [0.05, 0.02, 0.06]
    ball = BALL.with_points(0.01 * BALL.points)
    session.surfaces.add("ball", ball, world_from_surface=where)
    for name, place in zip(PATCHES, ([0, -1, 0], [-0.8, 0.6, 0.2], [0.9, 0.5, 0.1]), strict=True):
        points = pad(rig, name)
        session.patches.paint(name, points, surface="hand", axis=points[[0, 11]])
        at = Locator.of(ball).closest(np.array([place], float)).points
        session.patches.transfer(name, "ball", at, direction=[0.3, 0.2, 1.0], name=f"{name} there")
        session.pairs.add(name, f"{name} there", name=name)
    return session


def gap(solution: PoseSolution) -> float:
    """Mean distance over pairs, in manipulator lengths."""
    return float(np.mean([p.mean for p in solution.patches.values()])) / solution.problem.manipulator_length


def propose(session: Session, kind: str) -> Proposal:
    return session.settle() if kind == "settle" else session.slide()


@pytest.mark.parametrize("kind", ["settle", "slide"])
def test_nothing_is_committed_until_it_is_accepted(session: Session, kind: str) -> None:
    seen: list[DocumentChanged] = []
    session.listen(seen.append)
    before, revision = session.document, session.revision
    proposal = propose(session, kind)
    assert session.document is before and session.revision == revision
    assert [change.kind for change in seen] == ["preview"] and seen[0].after is proposal.ghost
    session.dismiss(proposal)
    assert seen[-1].kind == "preview" and seen[-1].after is before

    session.accept(proposal)
    assert document_to_json(session.document) == document_to_json(proposal.ghost)
    assert "hand" in proposal.command.poses
    session.undo()
    assert session.document is before
    session.redo()
    assert document_to_json(session.document) == document_to_json(proposal.ghost)


@pytest.fixture
def spread_out() -> Session:
    """A hand on a table in other units; three fingertips are to touch it up to 2 cm from where they can."""
    rig = rigs.hand_like(rigs.narrow_freedom)
    session = Session(plugins=[contact_builtins], discover=False)
    session.surfaces.add("hand", rig.surface, rig=rig, meters_per_unit=0.01)
    floor = meshes.plane(12, 0.3)
    where = np.eye(4)
    where[:3, :3] = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]  # the table's normal is -y
    where[:3, 3] = [0.0, 0.02, -0.15]
    session.surfaces.add("table", floor, world_from_surface=where)
    for name, wrong in (("finger1_2", 0.01), ("finger2_2", -0.01), ("finger3_2", 0.008)):
        points = pad(rig, name, axis=1)
        session.patches.paint(name, points, surface="hand", axis=points[[0, 11]])
        x, _, z = 0.01 * points[[0]].positions(rig.surface)[0]
        at = Locator.of(floor).closest(np.array([[x + wrong, z + 0.15, 0.0]])).points
        way = points[[11]].positions(rig.surface)[0] - points[[0]].positions(rig.surface)[0]
        session.patches.transfer(name, "table", at, direction=[way[0], way[2], 0.0], name=f"{name} there")
        session.pairs.add(name, f"{name} there", name=name)
    return session


def test_a_slide_gives_fingers_their_spacing_back_and_is_what_the_document_then_holds(spread_out: Session) -> None:
    proposal = spread_out.slide()
    assert gap(proposal.after) < 0.4 * gap(proposal.before), (gap(proposal.before), gap(proposal.after))
    spread_out.accept(proposal)
    again = spread_out.slide(slack=1e-6).before
    assert gap(again) <= 1.02 * gap(proposal.after)


def test_settling_is_never_worse(session: Session) -> None:
    proposal = session.settle()
    assert proposal.after.value <= proposal.before.value


def test_the_hand_on_the_mug_fits_better_by_a_third(repository: Path) -> None:
    """A rough placement on the mug: both lower the distances by at least 30 %, and the whole objective too."""
    recipe = load_recipe(repository / "examples" / "07_mug_slide.toml")
    job = prepare(recipe, PluginManager([contact_builtins], discover=False))
    session = Session(job.session.document, plugins=[contact_builtins], discover=False)
    for name, surface in job.session.document.surfaces.items():
        session.surfaces.add(
            name,
            job.session.geometry.mesh(name),
            rig=job.session.rigs.get(name),
            meters_per_unit=surface.meters_per_unit,
        )
    for kind in ("settle", "slide"):
        proposal = propose(session, kind)
        assert gap(proposal.after) <= 0.7 * gap(proposal.before), kind
        assert proposal.after.value < proposal.before.value


def test_slack_holds_in_the_units_of_the_object(session: Session) -> None:
    proposal = session.slide(slack=0.02)
    length = proposal.before.problem.manipulator_length  # units of the hand, cm
    ball, moved = session.geometry.mesh("ball"), []
    for name, placement in proposal.command.placements:
        assert not isinstance(placement, Link)
        at = placement.point().positions(ball) - session.geometry.root(name).point().positions(ball)
        moved.append(100.0 * float(np.linalg.norm(at)) / length)
    assert 0.01 < max(moved) <= 0.02 * np.sqrt(2.0) + 1e-6


def test_a_linked_contact_stays_linked(session: Session) -> None:
    session.patches.link("finger1_2 there", "wrist there")
    proposal = session.slide()
    assert isinstance(proposal.ghost.patch("finger1_2 there").placement, Link)
    session.accept(proposal)
    points = session.geometry.points("finger1_2 there").positions(session.geometry.mesh("ball"))
    after = proposal.after.problem
    found = after.state(proposal.after.theta).vectors(after.pairs.object_points)[after.pairs.rows["finger1_2"]]
    centimetres = 100.0 * (points + np.array([0.05, 0.02, 0.06]))  # the world is in units of the hand
    assert found == pytest.approx(centimetres, abs=1e-6)


def test_a_proposal_for_an_older_document_is_refused(session: Session) -> None:
    proposal = session.settle(rounds=1)
    session.patches.rotate("wrist there", 0.1)
    with pytest.raises(CommandRejected, match="changed since"):
        session.accept(proposal)


def test_refusals(session: Session) -> None:
    with pytest.raises(InvalidInput, match="pair"):
        Session(discover=False).slide()
    host = MemoryHost()
    host.cancel()
    with pytest.raises(Cancelled):
        session.slide(settings=SolveSettings(progress=host))
    before = session.document
    with pytest.raises(InvalidInput):
        session.settle(settings=SolveSettings(solver="none such"))
    assert session.document is before


def test_what_cannot_move_says_why(session: Session) -> None:
    """A pair between two fingers stays: a contact does not slide on what bends."""
    session.patches.transfer(
        "finger1_2", "hand", session.geometry.root("finger3_2").point(), direction=[0, 1, 0], name="on finger"
    )
    session.pairs.add("finger1_2", "on finger", name="fingers")
    for kind in ("settle", "slide"):
        proposal = propose(session, kind)
        assert "bends" in proposal.left_out["fingers"]
        assert "on finger" not in dict(proposal.command.placements)
