"""Proxies: closed manifolds for broken meshes, the map to them, and contacts that run on them."""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import contact_core as contact
from contact_builtins.proxies.level_set import LevelSetProxy
from contact_core.contact.brush import BrushGesture
from contact_core.contact.stroke_field import StrokeField
from contact_core.document.asset import Asset
from contact_core.document.schema import dump_document, parse_document
from contact_core.errors import InvalidInput, NotManifold
from contact_core.geometry.exact_geodesics import log_map
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.report import report
from contact_core.geometry.surface_map import SurfaceMap
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.topology import Topology
from contact_core.job.run import prepare
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.proxies import made_proxy
from contact_core.plugins.registry import PROXY_MAKERS
from contact_core.progress import NO_PROGRESS
from contact_core.recipe.reader import load_recipe
from contact_core.rig.carried import carried
from contact_core.rig.rig import Pose, forward_kinematics, skin
from contact_core.session import Session
from contact_core.testing.broken_meshes import BROKEN, shells
from contact_core.testing.meshes import icosphere, torus
from contact_core.testing.rigs import hand_like

COARSE = LevelSetProxy(offset=0.03)


@cache
def broken(name: str) -> TriangleMesh:
    return BROKEN[name]()


@cache
def proxy_of(name: str, *, fill: bool = False) -> TriangleMesh:
    return replace(COARSE, fill=fill).make(broken(name))


def scattered(mesh: TriangleMesh, count: int, seed: int = 0) -> SurfacePoints:
    """Points spread over a mesh by area."""
    rng = np.random.default_rng(seed)
    faces = rng.choice(len(mesh.faces), count, p=mesh.face_areas / mesh.face_areas.sum())
    return SurfacePoints(faces, rng.dirichlet(np.ones(3), count))


@pytest.mark.parametrize("fill", [False, True])
@pytest.mark.parametrize("name", BROKEN)
def test_a_proxy_is_closed_manifold_and_near_its_mesh(name: str, fill: bool) -> None:
    mesh, proxy = broken(name), proxy_of(name, fill=fill)
    found = report(proxy)
    assert found.is_watertight and not found.degenerate_faces and found.volume is not None and found.volume > 0.0
    offset = COARSE.offset * mesh.bounding_box_diagonal
    away = Locator.of(mesh).closest(proxy.points).distance
    if not fill:
        assert away.max() <= 0.6 * offset  # the lift, and what a coarse cell adds
    assert float(np.median(away)) <= 0.3 * offset


@pytest.mark.parametrize("name", BROKEN)
def test_there_and_back_is_within_the_offset(name: str) -> None:
    mesh, proxy = broken(name), proxy_of(name)
    offset = COARSE.offset * mesh.bounding_box_diagonal
    between = SurfaceMap.of(mesh, proxy)
    start = scattered(proxy, 300)
    seen = between.to_source(start)
    again = between.to_source(between.to_proxy(seen))
    moved = np.linalg.norm(again.positions(mesh) - seen.positions(mesh), axis=1)
    assert np.quantile(moved, 0.95) <= 0.5 * offset and moved.max() <= 2.0 * offset


def test_either_side_of_a_sheet_has_its_own_side_of_the_proxy() -> None:
    mesh = broken("shirt")
    back = TriangleMesh(mesh.points, mesh.faces[:, ::-1])
    proxy = proxy_of("shirt")
    points = scattered(mesh, 200)
    inside_out = SurfacePoints(points.faces, points.barycentric[:, ::-1])
    for source, taken in ((mesh, points), (back, inside_out)):
        there = SurfaceMap(source, proxy).to_proxy(taken)
        facing = np.einsum("ki,ki->k", source.face_normals[taken.faces], proxy.face_normals[there.faces])
        assert np.mean(facing > 0.0) > 0.95


def test_lengths_on_the_proxy_are_those_on_a_sound_mesh() -> None:
    for mesh in (icosphere(4), torus(60, 30)):
        proxy = LevelSetProxy(offset=0.02).make(mesh)
        between = SurfaceMap.of(mesh, proxy)
        sources, targets = scattered(mesh, 1, seed=1), scattered(mesh, 200, seed=2)
        direct = log_map(mesh, sources, targets).distance
        there = log_map(proxy, between.to_proxy(sources), between.to_proxy(targets)).distance
        far = direct > 0.2
        error = np.abs(there[far] / direct[far] - 1.0)
        assert error.mean() < 0.02 and error.max() < 0.06


def test_a_mesh_and_its_copy_in_single_precision_have_one_proxy() -> None:
    mesh, plugins = broken("cards"), PluginManager()
    turn = np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]])
    exact = mesh.with_points(mesh.points @ turn / 3.0)
    single = exact.with_points(exact.points.astype(np.float32))
    first, made = made_proxy(exact, plugins, settings={"offset": 0.04})
    second, again = made_proxy(single, plugins, settings={"offset": 0.04})
    assert first.digest == second.digest == made.digest == again.digest


def test_wide_holes_are_closed_where_filling_is_asked() -> None:
    ball = icosphere(3)
    open_ = TriangleMesh(ball.points, ball.faces[ball.points[ball.faces, 1].mean(axis=1) < 0.8])
    kept, filled = (report(replace(COARSE, fill=fill).make(open_)).volume for fill in (False, True))
    assert kept is not None and filled is not None
    assert kept < 0.4 * 4.19 and 0.8 * 4.19 < filled < 1.05 * 4.19  # cubic units of a ball


# --- contacts ---------------------------------------------------------------------------------------------------


def session_on(mesh: TriangleMesh, **sources: TriangleMesh) -> Session:
    return contact.new(thing=mesh, **sources)


def at_the_fin(mesh: TriangleMesh) -> np.ndarray:
    return mesh.points[mesh.faces[-1]].mean(axis=0)


def test_what_a_broken_mesh_refuses_is_painted_on_a_proxy_in_one_step_with_a_note() -> None:
    with session_on(broken("fin")) as session:
        mesh = session.geometry.mesh("thing")
        centre = Locator.of(mesh).closest(0.75 * at_the_fin(mesh)[None]).points
        session.patches.brush("disk", "spot", surface="thing", at=centre, radius=0.4)
        record = session.document.surface("thing")
        assert record.proxy is not None and record.digest == mesh.digest
        assert any("proxy" in note and "thing" in note for note in session.notes)
        points = session.geometry.points("spot")
        assert points.faces.max() < len(mesh.faces)
        near = np.linalg.norm(points.positions(mesh) - centre.positions(mesh), axis=1)
        assert 0.25 < near.max() < 0.45 and not session.geometry.reconstruction("spot").ran_off.any()
        session.undo()
        assert session.document.surface("thing").proxy is None and not session.document.patches
        session.redo()
        assert len(session.geometry.points("spot")) == len(points)


def test_it_is_refused_where_that_is_wanted() -> None:
    with session_on(broken("fin")) as session:
        session.makers.mends = False
        mesh = session.geometry.mesh("thing")
        with pytest.raises(NotManifold):
            session.patches.brush("disk", "spot", surface="thing", at=0.75 * at_the_fin(mesh)[None], radius=0.4)
        assert not session.document.patches and session.document.surface("thing").proxy is None


def test_without_the_library_it_is_refused_with_what_to_install(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("CONTACT_CACHE", str(tmp_path))
    monkeypatch.setitem(sys.modules, "manifold3d", None)
    mesh = BROKEN["fin"]()
    with session_on(mesh) as session:
        with pytest.raises(NotManifold, match=r"more than two faces.*contact-core\[proxies\]"):
            session.patches.brush("disk", "spot", surface="thing", at=0.75 * at_the_fin(mesh)[None], radius=0.4)
        assert session.document.surface("thing").proxy is None and not session.document.patches


def test_one_patch_runs_over_parts_that_overlap() -> None:
    mesh = shells()
    with session_on(mesh) as session:
        row = np.column_stack([np.linspace(0.3, 1.5, 25), np.full(25, 0.3), np.zeros(25)])
        points = Locator.of(mesh).closest(row).points
        session.patches.paint("bar", points, surface="thing", axis=points[[0, 24]])
        assert session.document.surface("thing").proxy is not None
        there = session.geometry.points("bar").positions(mesh)
        assert np.linalg.norm(there - points.positions(mesh), axis=1).max() < 0.02 * mesh.bounding_box_diagonal


def test_where_a_proxy_is_no_cure_the_surface_stays_as_it_was() -> None:
    far = icosphere(2)
    mesh = TriangleMesh(
        np.concatenate([far.points, far.points + np.array([5.0, 0.0, 0.0])]),
        np.concatenate([far.faces, far.faces + len(far.points)]),
    )
    with session_on(mesh) as session:
        ends = SurfacePoints.at_vertices(mesh, [0, len(far.points)])
        with pytest.raises(InvalidInput, match="does not reach"):
            session.patches.paint("both", ends, surface="thing", axis=ends[:1], heading=1.0)
        assert session.document.surface("thing").proxy is None and not session.document.patches


def test_contacts_are_transferred_onto_a_broken_mesh_and_edited_there() -> None:
    with session_on(broken("fin"), ball=icosphere(4)) as session:
        mesh = session.geometry.mesh("thing")
        session.patches.brush("disk", "spot", surface="ball", at=[[0.0, 1.0, 0.0]], radius=0.3)
        target = Locator.of(mesh).closest(0.75 * at_the_fin(mesh)[None]).points
        copy = session.patches.transfer(
            "spot", "thing", target, direction=np.cross(target.normals(mesh)[0], [1.0, 0.2, 0.0])
        )
        assert session.document.surface("thing").proxy is not None
        root = session.geometry.axis_points(copy)[0].positions(mesh)[0]
        assert np.linalg.norm(root - target.positions(mesh)[0]) < 0.05
        session.patches.rotate(copy, 0.7)
        elsewhere = Locator.of(mesh).closest(-target.positions(mesh)).points
        session.patches.translate(copy, elsewhere)
        root = session.geometry.axis_points(copy)[0].positions(mesh)[0]
        assert np.linalg.norm(root - elsewhere.positions(mesh)[0]) < 0.05
        assert session.geometry.area(copy).area == pytest.approx(session.geometry.area("spot").area, rel=0.15)
        assert session.geometry.axis_points(copy).faces.max() < len(mesh.faces)


def test_patches_stay_where_they_are_when_a_proxy_comes_and_goes() -> None:
    mesh = torus(60, 30)
    with session_on(mesh) as session:
        session.patches.brush("disk", "spot", surface="thing", at=[[1.4, 0.0, 0.0]], radius=0.3)
        before = session.geometry.points("spot").positions(mesh)
        offset = 0.02 * mesh.bounding_box_diagonal
        assert session.surfaces.add_proxy("thing", offset=0.02).largest_move < offset
        assert np.linalg.norm(session.geometry.points("spot").positions(mesh) - before, axis=1).max() < offset
        assert session.geometry.carrier("thing") is not mesh and session.geometry.mesh("thing") is mesh
        session.surfaces.remove_proxy("thing")
        assert np.linalg.norm(session.geometry.points("spot").positions(mesh) - before, axis=1).max() < offset
        with pytest.raises(InvalidInput, match="no proxy"):
            session.surfaces.remove_proxy("thing")


def test_another_shape_gets_another_proxy() -> None:
    mesh = torus(60, 30)
    longer = mesh.with_points(mesh.points * np.array([1.3, 1.0, 1.0]))
    with session_on(mesh) as session:
        session.surfaces.add_proxy("thing", offset=0.03)
        session.patches.brush("disk", "spot", surface="thing", at=[[1.4, 0.0, 0.0]], radius=0.3)
        before, document = session.geometry.points("spot").positions(mesh), session.document
        session.surfaces.add("thing", longer)
        proxies = [d.surface("thing").proxy for d in (document, session.document)]
        assert proxies[0] is not None and proxies[1] is not None and proxies[0].digest != proxies[1].digest
        moved = session.geometry.points("spot").positions(longer) - before
        assert 0.2 < np.linalg.norm(moved, axis=1).mean() < 0.6
    with Session(document) as elsewhere:
        with pytest.raises(InvalidInput, match="old_mesh"):
            elsewhere.surfaces.add("thing", longer)
        elsewhere.surfaces.rebind("thing", longer, old_mesh=mesh)
        assert len(elsewhere.geometry.points("spot")) == len(before)


def test_a_document_opened_elsewhere_has_the_same_contacts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = broken("fin")
    with session_on(mesh) as session:
        session.surfaces.add_proxy("thing", offset=0.03)
        session.patches.brush("disk", "spot", surface="thing", at=0.75 * at_the_fin(mesh)[None], radius=0.4)
        expected = session.geometry.points("spot").positions(mesh)
        document = parse_document(dump_document(session.document))
    monkeypatch.setenv("CONTACT_CACHE", str(tmp_path))  # another machine, which has made nothing yet
    with Session(document) as elsewhere:
        elsewhere.surfaces.add("thing", mesh.with_points(mesh.points.astype(np.float32)))
        assert np.allclose(elsewhere.geometry.points("spot").positions(mesh), expected, atol=1e-6)
    proxy = document.surface("thing").proxy
    assert proxy is not None
    other = replace(document.surface("thing"), proxy=replace(proxy, digest="0" * 32))
    forged = replace(document, surfaces=document.surfaces.with_item("thing", other))
    with Session(forged) as elsewhere:
        elsewhere.surfaces.add("thing", mesh)
        with pytest.raises(InvalidInput, match="comes out otherwise"):
            elsewhere.geometry.points("spot")


def test_a_proxy_of_ones_own_is_taken_if_it_is_closed_and_has_to_be_brought_again() -> None:
    mesh, own = broken("fin"), icosphere(4, radius=1.02)
    with session_on(mesh) as session:
        with pytest.raises(InvalidInput, match="closed manifold"):
            session.surfaces.add_proxy("thing", mesh=mesh)
        session.surfaces.add_proxy("thing", mesh=own)
        session.patches.brush("disk", "spot", surface="thing", at=[[0.0, 1.0, 0.0]], radius=0.3)
        document, expected = session.document, session.geometry.points("spot")
    with Session(document) as elsewhere:
        elsewhere.surfaces.add("thing", mesh)
        with pytest.raises(InvalidInput, match="know_proxy"):
            elsewhere.geometry.points("spot")
        elsewhere.surfaces.know_proxy("thing", own)
        assert elsewhere.geometry.points("spot").same_as(expected)
        with pytest.raises(InvalidInput, match="do not run on that mesh"):
            elsewhere.surfaces.know_proxy("thing", mesh)


def test_what_was_kept_damaged_is_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CONTACT_CACHE", str(tmp_path))
    plugins, mesh = PluginManager(), broken("fin")
    record, _ = made_proxy(mesh, plugins, settings={"offset": 0.05})
    (kept,) = (tmp_path / "proxies").iterdir()
    wrong = icosphere(1)
    np.savez_compressed(kept, points=wrong.points, faces=wrong.faces)
    _, made = made_proxy(mesh, plugins, settings={"offset": 0.05}, wanted=record.digest)
    assert made.digest == record.digest


def test_a_maker_that_leaves_no_closed_manifold_is_refused() -> None:
    class Nothing:
        name = "nothing"
        summary = "the mesh itself"

        def make(self, mesh: TriangleMesh, progress: object) -> TriangleMesh:
            return mesh

    class Plugin:
        @contact.plugins.hookimpl
        def contact_proxy_makers(self) -> list[object]:
            return [Nothing]

    plugins = PluginManager([Plugin()])
    assert set(plugins.offers(PROXY_MAKERS)) == {"level_set", "nothing"}
    with pytest.raises(InvalidInput, match="closed manifold"):
        made_proxy(broken("fin"), plugins, "nothing")


@pytest.mark.parametrize(
    ("settings", "words"),
    [({"offset": 0.0}, "at least"), ({"cell": 0.0005}, "at least"), ({"of": 1}, "no setting")],
)
def test_settings_are_refused_in_a_sentence(settings: dict[str, float], words: str) -> None:
    with session_on(icosphere(2)) as session, pytest.raises(InvalidInput, match=words):
        session.surfaces.add_proxy("thing", **settings)


def test_a_mesh_without_extent_has_no_proxy() -> None:
    point = TriangleMesh(np.zeros((3, 3)), [[0, 1, 2]])
    with pytest.raises(InvalidInput, match="extent"):
        LevelSetProxy().make(point, NO_PROGRESS)


def test_a_stroke_over_a_broken_mesh_is_one_step_and_previewed_by_straight_distances() -> None:
    mesh = broken("fin")
    with session_on(mesh) as session:
        beside = Locator.of(mesh).closest(0.75 * at_the_fin(mesh)[None]).points
        field = StrokeField.begun(mesh, 0.3).extended(beside)
        away = np.linalg.norm(mesh.points - beside.positions(mesh), axis=1)
        assert len(field.covered()) and np.allclose(field.distances[field.covered()], away[field.covered()])
        steps = len(session.history.steps)
        with session.stroke() as stroke:
            for radius in (0.2, 0.3):
                stroke.patches.brush("disk", "spot", surface="thing", at=beside, radius=radius)
        assert len(session.history.steps) == steps + 1
        assert session.document.surface("thing").proxy is not None and len(session.geometry.points("spot"))


def test_what_is_solved_for_is_the_mesh_that_is_seen_and_slides_on_the_proxy() -> None:
    rig = hand_like()
    hand = Asset("hand", rig.surface, rig, meters_per_unit=1.0)
    with contact.new(hand=hand, thing=broken("fin")) as session:
        session.surfaces.add_proxy("thing", offset=0.03)
        tip = rig.rest_world[-1, :3, 3]
        session.patches.brush("disk", "tip", surface="hand", at=tip[None], radius=0.1)
        mesh = session.geometry.mesh("thing")
        session.patches.transfer(
            "tip", "thing", SurfacePoints.at_vertices(mesh, [0]), direction=[0.3, 1.0, 0.2], name="goal"
        )
        session.pairs.add("tip", "goal")
        problem = session.problem()
        (body,) = [body for body in problem.bodies if body.name == "thing"]
        assert len(body.rig.faces) == len(mesh.faces)  # what is solved for is the mesh that is seen
        goal = problem.contacts[0].object_points
        assert goal.same_as(session.geometry.points("goal")) and goal.faces.max() < len(mesh.faces)
        session.accept(slid := session.slide())
        assert not slid.left_out and session.document.surface("thing").proxy is not None
        assert session.problem().contacts[0].object_points.same_as(session.geometry.points("goal"))


def test_a_recipe_places_a_contact_on_a_broken_object(tmp_path: Path) -> None:
    mesh = broken("fin")
    lines = [f"v {x} {y} {z}" for x, y, z in 0.05 * mesh.points]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces]
    (tmp_path / "fin.obj").write_text("\n".join(lines))
    beside = (0.05 * 0.75 * at_the_fin(mesh)).tolist()
    (tmp_path / "fin.toml").write_text(f"""
schema = 1
name = "fin"
title = "A tip beside a fin"
[manipulator]
sample = "human_hand"
[object]
file = "fin.obj"
center = [0.0, 0.07, 0.08]
[[patch]]
name = "tip"
disk = {{ joint = "index_distal", along = 0.55, radius = 0.0065, points = 30 }}
place = {{ root = {{ position = {beside} }}, direction = [0.3, 1.0, 0.2] }}
""")
    job = prepare(load_recipe(tmp_path / "fin.toml"), PluginManager())
    assert job.session.document.surface("object").proxy is not None
    assert any("proxy" in note for note in job.notes)
    assert len(job.session.geometry.pairs()[0].object_points) == 30


# --- skins ------------------------------------------------------------------------------------------------------


def curled(angle: float) -> tuple[np.ndarray, Pose]:
    rig = hand_like()
    local = rig.rest_local.copy()
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    local[rig.parents >= 0, :3, :3] = local[rig.parents >= 0, :3, :3] @ turn
    return forward_kinematics(rig.parents, local), Pose(rig.joints, local)


def test_the_proxy_follows_the_skin() -> None:
    rig = hand_like()
    mesh = rig.surface
    proxy = LevelSetProxy(offset=0.02).make(mesh)
    between = SurfaceMap.of(mesh, proxy)
    assert np.allclose(between.followed(mesh).points, proxy.points, atol=1e-9)
    skeleton = carried(rig, proxy)
    assert np.allclose(skeleton.surface.points, proxy.points, atol=1e-9)
    world, _ = curled(0.5)
    posed = mesh.with_points(skin(rig, world))
    offset = 0.02 * mesh.bounding_box_diagonal
    points = scattered(proxy, 400)
    seen = between.to_source(points).positions(posed)
    for moved in (between.followed(posed), proxy.with_points(skin(skeleton, world))):
        apart = np.linalg.norm(points.positions(moved) - seen, axis=1)
        assert np.quantile(apart, 0.95) <= 1.5 * offset  # the map commutes with posing


def test_a_skin_is_painted_as_it_is_seen_in_a_pose() -> None:
    rig = hand_like()
    hand = Asset("hand", rig.surface, rig, meters_per_unit=1.0)
    _, pose = curled(0.4)
    with contact.new(hand=hand) as session:
        session.surfaces.set_pose("hand", pose)
        session.surfaces.add_proxy("hand", offset=0.03)
        posed = session.geometry.posed_mesh("hand")
        mesh = session.geometry.mesh("hand")
        centre = scattered(mesh, 1, seed=4)
        size = mesh.bounding_box_diagonal
        session.patches.brush(
            "disk", "spot", BrushGesture(mesh, centre, radius=0.05 * size, seen=posed), surface="hand"
        )
        points = session.geometry.points("spot")
        assert np.linalg.norm(points.positions(mesh) - centre.positions(mesh), axis=1).max() < 0.09 * size
        assert Topology.of(session.geometry.carrier("hand")).is_manifold
