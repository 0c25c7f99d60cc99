"""The artist's verbs through a session: what moves, what stays, what is told."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from contact_core.arrays import FloatArray
from contact_core.contact.mirror import reflected
from contact_core.contact.placement import Link, Root
from contact_core.document.document import Patch
from contact_core.document.schema import dump_document, inconsistencies
from contact_core.edit import derived
from contact_core.errors import CommandRejected, InvalidInput
from contact_core.geometry.exact_geodesics import log_map
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.plugins import hookimpl
from contact_core.session import DocumentChanged, Session
from contact_core.testing import meshes
from contact_core.testing.strategies import cached_family


def where(session: Session, patch: str) -> FloatArray:
    return session.geometry.points(patch).positions(session.geometry.mesh_of(patch))


def disk_at(mesh: TriangleMesh, centre: FloatArray, count: int, radius: float, seed: int) -> SurfacePoints:
    """Random points in the faces whose centres lie within `radius` of a place."""
    near = np.flatnonzero(np.linalg.norm(mesh.points[mesh.faces].mean(axis=1) - centre, axis=1) <= radius)
    random = np.random.default_rng(seed)
    return SurfacePoints(random.choice(near, count), random.dirichlet(np.ones(3), count))


def point_on(session: Session, surface: str, face: int) -> SurfacePoints:
    return SurfacePoints([face % len(session.geometry.mesh(surface).faces)], [[0.2, 0.3, 0.5]])


def relative(session: Session, parent: str, child: str) -> tuple[complex, float]:
    """The child's root as seen from its parent's: log map relative to the parent's heading, and its own turn."""
    mesh = session.geometry.mesh_of(parent)
    here, there = session.geometry.root(parent), session.geometry.root(child)
    log = log_map(mesh, here.point(), there.point())
    turn = float(np.angle(there.heading / complex(log.headings[0]) / np.exp(1j * log.turning_angles.sum())))
    return complex(log.coordinates[0]) / here.heading, turn


def test_every_verb_is_one_undo_step_and_undo_takes_it_back(session: Session) -> None:
    """Each verb commits exactly one step; undone, the very same document is there again."""
    torus = session.geometry.mesh("torus")
    goal = point_on(session, "sphere", 20)
    verbs: list[Any] = [
        lambda: session.patches.paint("palm", session.geometry.points("thumb")[:5]),
        lambda: session.patches.erase("palm", [0, 2]),
        lambda: session.patches.erase("palm", near=session.geometry.points("palm")[4], radius=0.01),
        lambda: session.patches.merge("palm", ["tip"]),
        lambda: session.patches.split("palm", [0, 1, 2], "part"),
        lambda: session.patches.set_axis("palm", session.geometry.points("palm")[[1, 7, 9]]),
        lambda: session.patches.bind("palm", [0, 1], 0),
        lambda: session.patches.weigh("palm", np.full(len(session.geometry.points("palm")), 2.0)),
        lambda: session.patches.translate("palm", point_on(session, "torus", 300)),
        lambda: session.patches.place("palm", point_on(session, "torus", 300), direction=[0.0, 0.0, 1.0]),
        lambda: session.patches.rotate("palm", 0.3),
        lambda: session.patches.rotate("palm", 0.3, about=1),
        lambda: session.patches.bend("palm", 1, 0.2),
        lambda: session.patches.scale("palm", along=0.8, spread=1.1),
        lambda: session.patches.mirror("palm"),
        lambda: session.patches.link("thumb", "palm", parent_point=1),
        lambda: session.patches.transfer_tree("palm", "sphere", goal, heading=1j),
        lambda: session.patches.unlink("thumb"),
        lambda: session.patches.transfer("palm", "sphere", goal, heading=1j, name="copy"),
        lambda: session.pairs.add("palm", "copy", name="pair"),
        lambda: session.pairs.remove("pair"),
        lambda: session.patches.rename("palm", "hand"),
        lambda: session.patches.recolor("hand", (0.1, 0.2, 0.3)),
        lambda: session.patches.group("all", ["hand", "thumb"]),
        lambda: session.patches.ungroup("all"),
        lambda: session.patches.symmetric_copy("hand"),
        lambda: session.patches.detach("copy"),
        lambda: session.set_extra("host.test", [1, 2]),
        lambda: session.surfaces.place("torus", np.eye(4)),
        lambda: session.patches.remove("hand", "part"),
    ]
    for number, verb in enumerate(verbs):
        before, steps = session.document, len(session.history.done)
        verb()
        assert len(session.history.done) == steps + 1, f"verb {number}"
        assert list(inconsistencies(session.document)) == []
        after = session.document
        for patch in after.patches:
            session.geometry.points(patch)
        session.undo()
        assert session.document is before, f"verb {number}"
        session.redo()
        assert session.document is after
    assert torus is session.geometry.mesh("torus")


def test_editing_a_parent_carries_all_its_descendants(session: Session) -> None:
    """Rotation, translation and bending before the link: each child keeps its place relative to its parent."""
    session.patches.link("thumb", "palm")
    session.patches.link("tip", "thumb")
    before = [relative(session, "palm", "thumb"), relative(session, "thumb", "tip")]
    placements = {name: session.document.patch(name).placement for name in ("thumb", "tip")}
    positions = where(session, "tip")
    for edit in (
        lambda: session.patches.rotate("palm", 0.4),
        lambda: session.patches.translate("palm", session.geometry.points("palm")[3]),
    ):
        edit()
        assert {name: session.document.patch(name).placement for name in placements} == placements
        assert not np.allclose(where(session, "tip"), positions)
        positions = where(session, "tip")
    session.undo()
    session.undo()
    after = [relative(session, "palm", "thumb"), relative(session, "thumb", "tip")]
    assert np.allclose(np.array(before), np.array(after), atol=1e-12)


@settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(angle=st.floats(-2.0, 2.0), face=st.integers(0, 287))
def test_a_tree_moves_rigidly_on_a_plane(angle: float, face: int) -> None:
    """Where the surface is flat, a whole tree turns and moves as one rigid body, branches and depth included."""
    session, mesh = Session(discover=False), meshes.plane(12)
    session.surfaces.add("plane", mesh)
    centre = np.array([0.5, 0.5, 0.0])
    for number, offset in enumerate([(0.0, 0.0), (0.06, 0.02), (0.1, -0.03), (-0.05, 0.06)]):
        points = disk_at(mesh, centre + np.array([*offset, 0.0]), 8, 0.09, number)
        session.patches.paint(f"p{number}", points, surface="plane", axis=points[[0, 5]])
    session.patches.link("p1", "p0", parent_point=len(session.geometry.axis("p0")) - 1)
    session.patches.link("p2", "p1", own_point=len(session.geometry.axis("p2")) - 1)
    session.patches.link("p3", "p0")
    names = [f"p{k}" for k in range(4)]
    before = np.concatenate([where(session, name) for name in names])[:, :2] @ np.array([1.0, 1j])
    pivot = session.geometry.root("p0").point().positions(mesh)[0, :2] @ np.array([1.0, 1j])
    session.patches.rotate("p0", angle)
    after = np.concatenate([where(session, name) for name in names])[:, :2] @ np.array([1.0, 1j])
    on = ~np.concatenate([session.geometry.reconstruction(name).ran_off for name in names])
    assert np.abs(after - (pivot + (before - pivot) * np.exp(1j * angle)))[on].max() <= 1e-9
    to = point_on(session, "plane", face)
    session.patches.translate("p0", to)
    moved = np.concatenate([where(session, name) for name in names])[:, :2] @ np.array([1.0, 1j])
    on &= ~np.concatenate([session.geometry.reconstruction(name).ran_off for name in names])
    shift = to.positions(mesh)[0, :2] @ np.array([1.0, 1j]) - pivot
    assert np.abs(moved - after - shift)[on].max(initial=0.0) <= 1e-9


def test_moving_a_child_changes_its_link_alone(session: Session) -> None:
    session.patches.link("thumb", "palm", own_point=2)
    goal = session.geometry.points("thumb")[4]
    palm = where(session, "palm")
    session.patches.translate("thumb", goal)
    link = session.document.patch("thumb").placement
    assert isinstance(link, Link) and link.parent == "palm" and link.own_point == 2
    assert np.allclose(
        session.geometry.root("thumb").point().positions(session.geometry.mesh("torus")),
        goal.positions(session.geometry.mesh("torus")),
    )
    assert np.array_equal(where(session, "palm"), palm)
    pivot = session.geometry.axis("thumb").points[2].positions(session.geometry.mesh("torus"))
    session.patches.rotate("thumb", 0.7, about=2)
    assert np.allclose(
        session.geometry.axis("thumb").points[2].positions(session.geometry.mesh("torus")), pivot, atol=1e-12
    )


def test_rotation_about_an_axis_point_keeps_that_point(session: Session) -> None:
    mesh = session.geometry.mesh("torus")
    for about in range(len(session.geometry.axis("palm"))):
        pivot = session.geometry.axis("palm").points[about].positions(mesh)
        session.patches.rotate("palm", 0.5, about=about)
        assert np.allclose(session.geometry.axis("palm").points[about].positions(mesh), pivot, atol=1e-12)
        session.undo()


def test_linking_and_unlinking_move_nothing(session: Session) -> None:
    before = {name: where(session, name) for name in ("palm", "thumb", "tip")}
    session.patches.link("thumb", "palm", parent_point=2, own_point=1)
    session.patches.link("tip", "thumb")
    for name, positions in before.items():
        assert np.allclose(where(session, name), positions, atol=1e-12)
    with pytest.raises(CommandRejected, match="which descends from it"):
        session.patches.link("palm", "tip")
    session.patches.remove("thumb")  # its child stays where it is
    assert np.allclose(where(session, "tip"), before["tip"], atol=1e-12)
    assert isinstance(session.document.patch("tip").placement, Root)


def test_a_copy_follows_the_shape_of_its_source_and_keeps_its_place(session: Session) -> None:
    """Repainting and bending the source reaches the partner; bending the partner stays with the partner."""
    session.patches.transfer("palm", "sphere", point_on(session, "sphere", 50), heading=1.0, name="copy")
    root = session.document.patch("copy").placement
    there = where(session, "copy")
    session.patches.bend("palm", 1, 0.3)
    assert not np.allclose(where(session, "copy"), there)
    session.patches.erase("palm", [0, 1, 2])
    assert len(session.geometry.points("copy")) == len(session.geometry.points("palm"))
    session.patches.paint("palm", session.geometry.points("thumb")[:4])
    assert len(session.geometry.points("copy")) == len(session.geometry.points("palm"))
    assert session.document.patch("copy").placement == root
    here = where(session, "palm")
    session.patches.bend("copy", 1, 0.4)
    session.patches.scale("copy", along=1.2)
    assert np.array_equal(where(session, "palm"), here)
    twist = session.document.patch("copy").turns
    session.patches.bend("palm", 2, 0.1)
    assert session.document.patch("copy").turns == twist  # its own deviation lives on
    session.patches.detach("copy")
    alone = where(session, "copy")
    session.patches.bend("palm", 2, 0.2)
    assert np.allclose(where(session, "copy"), alone)


def test_painting_on_a_copy_paints_its_source_too(session: Session) -> None:
    session.patches.transfer("palm", "sphere", point_on(session, "sphere", 50), heading=1.0, name="copy")
    new = session.geometry.points("copy")[:3]
    session.patches.erase("palm", [0, 1, 2])
    here = where(session, "palm")
    session.patches.paint("copy", new)
    assert np.allclose(where(session, "copy")[-3:], new.positions(session.geometry.mesh("sphere")), atol=1e-12)
    assert np.allclose(where(session, "palm")[:-3], here)


@pytest.mark.parametrize("scaled", [False, True])
def test_a_new_axis_moves_neither_points_nor_children_nor_partners_root(session: Session, scaled: bool) -> None:
    if scaled:
        session.patches.scale("palm", along=0.9, spread=1.2)
    session.patches.link("thumb", "palm", parent_point=1)
    session.patches.transfer(
        "palm", "torus", point_on(session, "torus", 500), heading=1.0, name="copy", mirrored=False
    )
    before = {name: where(session, name) for name in ("palm", "thumb")}
    count = len(session.geometry.points("copy"))
    session.patches.set_axis("palm", session.geometry.points("palm")[[2, 12]])
    for name, positions in before.items():
        assert np.allclose(where(session, name), positions, atol=1e-11), name
    assert len(session.geometry.points("copy")) == count
    spread = np.linalg.norm(where(session, "copy") - where(session, "copy").mean(axis=0), axis=1).max()
    wanted = np.linalg.norm(before["palm"] - before["palm"].mean(axis=0), axis=1).max()
    assert 0.5 * wanted < spread < 2.0 * wanted
    assert session.document.patch("palm").mirrored is False


def test_a_new_axis_keeps_a_partner_in_place_where_surfaces_are_flat() -> None:
    """On a plane the partner of a patch whose axis is redrawn does not move at all."""
    session, mesh = Session(discover=False), meshes.plane(12)
    session.surfaces.add("plane", mesh)
    points = disk_at(mesh, np.array([0.4, 0.5, 0.0]), 20, 0.1, 1)
    session.patches.paint("p", points, surface="plane", axis=points[[0, 5, 9]])
    session.patches.transfer("p", "plane", point_on(session, "plane", 130), heading=1j, name="q")
    before = where(session, "q")
    assert not session.geometry.reconstruction("q").ran_off.any()
    session.patches.set_axis("p", points[[3, 11]])
    assert np.allclose(where(session, "q"), before, atol=1e-11)
    assert np.allclose(where(session, "p"), points.positions(mesh), atol=1e-11)


def test_units_are_converted_in_transfer(session: Session) -> None:
    """From centimetres to metres and back onto the first surface: every length comes out as it was."""
    session.patches.transfer("palm", "sphere", point_on(session, "sphere", 10), heading=1.0, name="there")
    source, copy = session.geometry.axis("palm"), session.geometry.axis("there")
    assert session.document.unit("there") == pytest.approx(0.01)
    steps = np.linalg.norm(np.diff(source.points.positions(session.geometry.mesh("torus")), axis=0), axis=1).sum()
    shape = session.document.shape_of("palm").axis
    assert steps == pytest.approx(shape.length, rel=1e-6)
    assert not copy.remaining.any()
    root = session.geometry.root("palm")
    session.patches.transfer("there", "torus", root.point(), heading=root.heading, name="back")
    assert np.allclose(where(session, "back"), where(session, "palm"), atol=1e-12)


def test_a_tree_is_transferred_in_one_step_with_its_links(session: Session) -> None:
    session.patches.link("thumb", "palm", parent_point=1)
    session.patches.link("tip", "thumb")
    steps = len(session.history.done)
    names = session.patches.transfer_tree("palm", "sphere", point_on(session, "sphere", 40), heading=1.0)
    assert len(session.history.done) == steps + 1 and list(names) == ["palm", "thumb", "tip"]
    for name, copy in names.items():
        assert session.document.patch(copy).mirrored
        assert len(session.geometry.points(copy)) == len(session.geometry.points(name))
    link = session.document.patch(names["tip"]).placement
    assert isinstance(link, Link) and link.parent == names["thumb"]
    root = session.geometry.root("palm")
    back = session.patches.transfer_tree(names["palm"], "torus", root.point(), heading=root.heading)
    for name, copy in names.items():
        assert np.allclose(where(session, back[copy]), where(session, name), atol=1e-11)


def test_a_stroke_previews_from_its_start_and_commits_once(session: Session) -> None:
    told: list[DocumentChanged] = []
    session.listen(told.append)
    before, steps = session.document, len(session.history.done)
    with session.stroke() as stroke:
        for angle in (0.1, 0.2, 0.3):
            stroke.patches.rotate("palm", angle)
        with pytest.raises(CommandRejected, match="stroke is under way"):
            session.undo()
        assert session.document is before
    assert [change.kind for change in told] == ["preview", "preview", "preview", "do"]
    assert len(session.history.done) == steps + 1
    dragged = where(session, "palm")
    session.undo()
    session.patches.rotate("palm", 0.3)  # the drag ended where its last position says, and not at the sum of all
    assert np.array_equal(where(session, "palm"), dragged)
    with pytest.raises(CommandRejected, match="stroke is over"):
        stroke.patches.rotate("palm", 0.1)


def test_a_stroke_that_fails_vanishes(session: Session) -> None:
    told: list[DocumentChanged] = []
    session.listen(told.append)
    before, steps = session.document, len(session.history.done)
    with pytest.raises(ZeroDivisionError), session.stroke() as stroke:
        stroke.patches.rotate("palm", 0.1)
        raise ZeroDivisionError
    assert session.document is before and len(session.history.done) == steps
    assert told[-1].kind == "preview" and told[-1].after is before
    with session.stroke() as stroke:
        stroke.patches.rotate("palm", 0.1)
        stroke.cancel()
    assert len(session.history.done) == steps
    session.patches.rotate("palm", 0.1)  # the session is free again


def test_a_macro_is_one_step_or_none(session: Session) -> None:
    before, steps = session.document, len(session.history.done)
    with session.macro("Arrange"):
        session.patches.rotate("palm", 0.2)
        turned = where(session, "palm")
        session.patches.link("thumb", "palm")
        with pytest.raises(CommandRejected, match="macro is under way"):
            session.undo()
        with session.stroke() as stroke:
            stroke.patches.rotate("thumb", 0.1)
        with session.macro("inner"):
            session.patches.recolor("palm", (0.0, 0.0, 0.0))
    assert len(session.history.done) == steps + 1
    assert session.history.done[-1].command.label() == "Arrange"
    assert np.array_equal(where(session, "palm"), turned)
    session.undo()
    assert session.document is before
    with pytest.raises(CommandRejected), session.macro("Fails"):
        session.patches.rotate("palm", 0.2)
        session.patches.rename("palm", "thumb")
    assert session.document is before and session.history.can_redo


def test_a_listener_that_fails_takes_nothing_back(session: Session, caplog: pytest.LogCaptureFixture) -> None:
    def broken(change: DocumentChanged) -> None:
        raise RuntimeError("the panel is gone")

    heard: list[str] = []
    dispose = session.listen(broken)
    session.listen(lambda change: heard.append(change.kind))
    revision = session.revision
    session.patches.rotate("palm", 0.1)
    assert session.revision > revision
    assert heard == ["do"] and "the panel is gone" in caplog.text
    dispose()
    dispose()


def test_undo_and_redo_compute_nothing(session: Session) -> None:
    """What was reconstructed once comes from the cache: the cost of an undo does not depend on the patch."""
    session.geometry.points("palm")
    for angle in (0.1, 0.2, 0.3):
        session.patches.rotate("palm", angle)
        session.geometry.points("palm")
    computed = session.derived.computed
    for _ in range(3):
        session.undo()
        session.geometry.points("palm")
    for _ in range(3):
        session.redo()
        session.geometry.points("palm")
    assert session.derived.computed == computed


def test_the_cache_is_bounded(monkeypatch: pytest.MonkeyPatch, session: Session) -> None:
    monkeypatch.setattr(derived, "MOST_POINTS", 200)
    for _ in range(30):
        session.patches.rotate("palm", 0.01)
        session.geometry.points("palm")
    kept = session.derived._kept
    assert sum(size for _, size in kept.values()) <= 200
    assert np.isfinite(where(session, "palm")).all()


def test_merge_and_split_move_no_point(session: Session) -> None:
    both = np.concatenate([where(session, "palm"), where(session, "thumb")])
    session.patches.merge("palm", ["thumb"])
    assert np.allclose(where(session, "palm"), both, atol=1e-12) and "thumb" not in session.document.patches
    session.patches.split("palm", range(25, 50), "thumb")
    assert np.allclose(where(session, "palm"), both[:25], atol=1e-12)
    assert np.allclose(where(session, "thumb"), both[25:], atol=1e-12)


def test_points_painted_twice_are_kept_once(session: Session) -> None:
    count = len(session.geometry.points("palm"))
    with pytest.raises(CommandRejected, match="already"):
        session.patches.paint("palm", session.geometry.points("palm"))
    session.patches.paint(
        "palm",
        SurfacePoints.concatenate([session.geometry.points("palm"), session.geometry.points("thumb")[[0, 0]]]),
    )
    assert len(session.geometry.points("palm")) == count + 1
    mesh = session.geometry.mesh("torus")
    vertex = int(mesh.faces[50, 0])
    faces, corners = np.nonzero(mesh.faces == vertex)
    session.patches.paint(
        "palm", SurfacePoints(faces, np.eye(3)[corners])
    )  # one vertex, named by every face round it
    assert len(session.geometry.points("palm")) == count + 2


def test_symmetric_copies_are_mirror_images_on_a_symmetric_mesh() -> None:
    """On a mesh that is symmetric about x = 0 the copy is the reflection, to the last digits."""
    half = meshes.icosphere(2)
    session = Session(discover=False)
    session.surfaces.add("body", half)  # the icosahedron's own symmetry: x -> -x maps the mesh onto itself
    mirrored = reflected(half.points, [1.0, 0.0, 0.0])
    distance = np.linalg.norm(half.points[:, None] - mirrored[None], axis=-1).min(axis=0)
    assert distance.max() < 1e-12
    points = disk_at(half, np.array([0.6, 0.5, 0.6]), 20, 0.5, 4)
    session.patches.paint("left", points, surface="body", axis=points[[0, 7]])
    session.patches.symmetric_copy("left", name="right")
    wanted = reflected(where(session, "left"), [1.0, 0.0, 0.0])
    assert np.allclose(where(session, "right"), wanted, atol=1e-9)


def test_a_region_over_disjoint_surfaces_becomes_a_group() -> None:
    """A figurine in two shells: painted at once, split, transferred part by part, kept as one group."""
    inner = meshes.plane(10)
    shells = TriangleMesh(
        np.concatenate([inner.points, inner.points + np.array([1.2, 0.0, 0.0])]),
        np.concatenate([inner.faces, inner.faces + len(inner.points)]),
    )
    session = Session(discover=False, plugins=[AxisPlugin()])
    session.surfaces.add("cloth", shells)
    session.surfaces.add("target", meshes.plane(12, 3.0))
    left = disk_at(shells, np.array([0.8, 0.5, 0.0]), 15, 0.15, 1)
    right = disk_at(shells, np.array([1.4, 0.5, 0.0]), 15, 0.15, 2)
    region = SurfacePoints.concatenate([left, right])
    names = session.patches.paint_region("sleeve", {"cloth": region})
    assert names == ("sleeve.1", "sleeve.2") and session.document.groups["sleeve"] == names
    painted = np.concatenate([where(session, name) for name in names])
    assert {tuple(np.round(p, 9)) for p in painted} == {tuple(np.round(p, 9)) for p in region.positions(shells)}
    goal = SurfacePoints([120], [[0.3, 0.3, 0.4]])
    copies = session.patches.transfer_group("sleeve", ["target"], goal, direction=[1.0, 0.0, 0.0], mirrored=False)
    assert session.document.groups["sleeve.target"] == tuple(copies.values())
    moved = np.concatenate([where(session, copy) for copy in copies.values()])
    z, w = painted[:, :2] @ np.array([1.0, 1j]), moved[:, :2] @ np.array([1.0, 1j])
    gaps, gaps_there = np.abs(z[:, None] - z[None]), np.abs(w[:, None] - w[None])
    assert np.allclose(gaps, gaps_there, atol=1e-9)  # from plane to plane the whole group is moved rigidly


class Ends:
    """An axis generator: the two points farthest apart in x."""

    name = "ends"
    summary = "joins the outermost points"

    def generate(self, request: Any) -> SurfacePoints:
        order = np.argsort(request.points.positions(request.mesh)[:, 0])
        return request.points[order[[0, -1]]]  # type: ignore[no-any-return]


class AxisPlugin:
    """Offers that generator."""

    @hookimpl
    def contact_axis_generators(self) -> list[Ends]:
        return [Ends()]


def test_contacts_from_proximity_take_what_is_near_and_faces() -> None:
    """A ball just above a plane: the cap within the distance is painted, and nothing of the far side."""
    session = Session(discover=False, plugins=[AxisPlugin()])
    ball = meshes.icosphere(3, 0.2)
    session.surfaces.add("ball", ball)
    session.surfaces.add("floor", meshes.plane(6, 2.0))
    place = np.eye(4)
    place[:3, 3] = [1.0, 1.0, 0.21]
    session.surfaces.place("ball", place)
    names = session.patches.paint_touching("cap", "ball", "floor", 0.05)
    assert len(names) == 1
    heights = where(session, names[0])[:, 2] + 0.21
    wanted = np.sort(ball.points[ball.points[:, 2] + 0.21 <= 0.05][:, 2]) + 0.21
    assert np.allclose(np.sort(heights), wanted, atol=1e-12)
    with pytest.raises(InvalidInput, match="nothing of 'ball'"):
        session.patches.paint_touching("cap", "ball", "floor", 0.001)


def test_contact_sets_load_onto_the_same_and_onto_another_manipulator(session: Session, tmp_path: Path) -> None:
    session.patches.link("thumb", "palm", parent_point=1)
    session.patches.transfer("palm", "sphere", point_on(session, "sphere", 9), heading=1.0, name="copy")
    session.pairs.add("palm", "copy", name="grip")
    session.patches.group("all", ["palm", "thumb"])
    session.sets.write(tmp_path / "grip.json", "grip", ["palm", "thumb", "copy"])
    fresh = Session(discover=False)
    for name in ("torus", "sphere"):
        fresh.surfaces.add(
            name, session.geometry.mesh(name), meters_per_unit=session.document.surface(name).meters_per_unit
        )
    names = fresh.sets.read(tmp_path / "grip.json")
    assert names == {"palm": "palm", "thumb": "thumb", "copy": "copy"}
    for name in names:
        assert np.array_equal(where(fresh, name), where(session, name))
    assert list(fresh.document.pairs) == ["grip"] and fresh.document.groups["all"] == ("palm", "thumb")
    again = fresh.sets.read(tmp_path / "grip.json")
    assert again == {"palm": "palm.2", "thumb": "thumb.2", "copy": "copy.2"}
    fresh.surfaces.add("other hand", cached_family("cylinder"), meters_per_unit=0.1)
    with pytest.raises(InvalidInput, match=r"painted on another mesh: give roots for palm\."):
        fresh.sets.read(tmp_path / "grip.json", onto={"torus": "other hand"})
    root = Root(200, (0.3, 0.3, 0.4), 1.0 + 0j)
    third = fresh.sets.read(tmp_path / "grip.json", onto={"torus": "other hand"}, roots={"palm": root})
    assert fresh.document.patch(third["thumb"]).surface == "other hand"
    assert len(where(fresh, third["thumb"])) == len(where(session, "thumb"))
    for _ in range(3):  # the third set, the third surface, the second set
        fresh.undo()
    assert set(fresh.document.patches) == {"palm", "thumb", "copy"}


def test_new_positions_bind_silently_and_new_topology_is_refused_and_rebound(session: Session) -> None:
    torus = session.geometry.mesh("torus")
    stretched = torus.with_points(torus.points * np.array([1.0, 1.0, 1.1]))
    session.surfaces.add("torus", stretched, meters_per_unit=0.01)
    assert session.document.surface("torus").digest == stretched.digest
    session.undo()
    assert np.allclose(session.geometry.mesh("torus").points, torus.points)
    session.patches.link("thumb", "palm", parent_point=1)
    session.patches.transfer("palm", "torus", point_on(session, "torus", 500), heading=1.0, name="copy")
    finer = meshes.subdivided(torus)
    with pytest.raises(InvalidInput, match=r"another mesh now .* use rebind"):
        session.surfaces.add("torus", finer, meters_per_unit=0.01)
    before = {name: where(session, name) for name in session.document.patches}
    report = session.surfaces.rebind("torus", finer)
    assert set(report.moves) == set(before)
    for name, positions in before.items():
        moved = np.linalg.norm(where(session, name) - positions, axis=1).max()
        assert moved == pytest.approx(report.moves[name], abs=1e-12)
    assert report.largest_move <= 1e-9 * torus.bounding_box_diagonal  # the same surface, cut finer
    assert isinstance(session.document.patch("thumb").placement, Link)
    session.undo()
    for name, positions in before.items():
        assert np.allclose(where(session, name), positions)


def test_pairs_answer_point_by_point_and_leave_out_what_ran_off(session: Session) -> None:
    session.patches.transfer("palm", "sphere", point_on(session, "sphere", 9), heading=1.0, name="copy")
    session.pairs.add("palm", "copy", weight=2.0)
    (pair,) = session.geometry.pairs()
    assert (pair.manipulator_surface, pair.object_surface) == ("torus", "sphere")
    assert pair.manipulator_points.same_as(session.geometry.points("palm"))
    assert pair.object_points.same_as(session.geometry.points("copy"))
    shape = session.document.shape_of("palm")
    assert pair.weights == pytest.approx(2.0 * shape.weights * 1e-4)
    assert pair.weights.sum() == pytest.approx(2e-4 * session.geometry.area("palm").area, rel=0.35)


def test_independent_patches_pair_through_their_axes_or_are_refused() -> None:
    """Two strips painted apart: along answers along, left answers right; what does not match is told why."""
    session, mesh = Session(discover=False), meshes.plane(20, 2.0)
    session.surfaces.add("a", mesh)
    session.surfaces.add("b", mesh)
    random = np.random.default_rng(0)

    def strip(x: float, y: float, length: float, width: float) -> SurfacePoints:
        u, v = random.uniform(0, 1, (2, 200))
        where = np.column_stack([x + length * u, y + width * (v - 0.5), np.zeros(200)])
        where[0], where[1] = [x, y, 0.0], [x + length, y, 0.0]
        return Locator.of(mesh).closest(where).points

    for name, surface, box in (("p", "a", (0.3, 0.5, 0.8, 0.3)), ("q", "b", (0.5, 1.2, 1.0, 0.4))):
        points = strip(*box)
        session.patches.paint(name, points, surface=surface, axis=points[[0, 1]])
    session.pairs.add("p", "q")
    (pair,) = session.geometry.pairs()
    here = pair.manipulator_points.positions(mesh)
    there = pair.object_points.positions(mesh)
    along, along_there = (here[:, 0] - 0.3) / 0.8, (there[:, 0] - 0.5) / 1.0
    across, across_there = (here[:, 1] - 0.5) / 0.15, (there[:, 1] - 1.2) / 0.2
    assert np.abs(along - along_there).mean() < 0.06
    assert np.abs(across + across_there).mean() < 0.15  # they face each other
    points = strip(0.2, 1.7, 0.1, 0.05)
    session.patches.paint("tiny", points, surface="a", axis=points[[0, 1]])
    with pytest.raises(InvalidInput, match="times as long"):
        session.pairs.add("tiny", "q")
    dot = strip(1.7, 1.7, 0.1, 0.1)
    session.patches.paint("dot", dot, surface="a", axis=dot[0], heading=1.0)
    with pytest.raises(InvalidInput, match="without an axis"):
        session.pairs.add("dot", "q")


def test_area_boundary_and_distortion_of_a_flat_patch() -> None:
    session, mesh = Session(discover=False), meshes.plane(20, 2.0)
    session.surfaces.add("a", mesh)
    vertices = np.flatnonzero((np.abs(mesh.points[:, 0] - 1.0) < 0.45) & (np.abs(mesh.points[:, 1] - 1.0) < 0.25))
    points = SurfacePoints.at_vertices(mesh, vertices)
    where = points.positions(mesh)
    box = np.ptp(where[:, :2], axis=0)
    ends = [int(np.argmin(np.linalg.norm(where[:, :2] - [x, 1.0], axis=1))) for x in (0.5, 1.5)]
    session.patches.paint("p", points, surface="a", axis=points[ends])
    area = session.geometry.area("p")
    assert area.area == pytest.approx(box.prod(), rel=1e-9)
    assert area.shares.sum() == pytest.approx(area.area)
    assert len(area.boundary) == 1
    rim = (np.abs(where[:, :2] - where[:, :2].mean(axis=0)) >= box / 2 - 1e-9).any(axis=1)
    assert sorted(area.boundary[0]) == np.flatnonzero(rim).tolist()
    session.patches.transfer("p", "a", SurfacePoints([203], [[0.3, 0.3, 0.4]]), heading=1.0, name="copy")
    even = session.geometry.distortion("p", "copy")
    assert (
        even.folds == 0
        and even.worst_length_ratio == pytest.approx(1.0)
        and even.worst_area_ratio == pytest.approx(1.0)
    )
    session.patches.scale("copy", along=1.5)
    stretched = session.geometry.distortion("p", "copy")
    assert np.nanmax(np.abs(stretched.area_ratio - 1.5)) < 1e-9 and stretched.folds == 0
    session.patches.mirror("copy")
    assert session.geometry.distortion("p", "copy").folds == 0


def test_patch_values_say_what_is_wrong() -> None:
    root = Root(0, (1.0, 0.0, 0.0), 1.0 + 0j)
    with pytest.raises(InvalidInput, match="colour"):
        Patch("p", "s", "k", root, color=(2.0, 0.0, 0.0))
    with pytest.raises(InvalidInput, match="along and spread"):
        Patch("p", "s", "k", root, along=0.0)
    with pytest.raises(InvalidInput, match="heading"):
        Root(0, (1.0, 0.0, 0.0), 0.0 + 0j)
    with pytest.raises(InvalidInput, match="one length more"):
        Link("p", 0.0, (1.0,), (0.1,), 0.0)


def test_sessions_on_equal_inputs_make_equal_bytes(session: Session) -> None:
    again = Session(session.document, discover=False)
    assert dump_document(again.document) == dump_document(session.document)
