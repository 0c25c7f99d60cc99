"""The add-on: what registers, what each operator does and takes back, what it refuses in words."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest


@pytest.fixture
def shared(bpy: Any, empty: Any) -> Iterator[Any]:
    """The module that holds sessions, with the add-on registered, two grids and a cube in the scene."""
    from contact_blender import extension

    for name, x in (("left", 0.0), ("right", 5.0)):
        bpy.ops.mesh.primitive_grid_add(x_subdivisions=12, y_subdivisions=12, size=2.0, location=(x, 0.0, 0.0))
        bpy.context.object.name = name
    extension.register()
    yield extension.shared
    extension.unregister()


def choose(bpy: Any, name: str, low: float = -0.45, high: float = 0.45) -> Any:
    """Make an object active, with the vertices of a square selected."""
    for each in bpy.context.view_layer.objects:
        each.select_set(each.name == name)
    thing = bpy.context.view_layer.objects.active = bpy.data.objects[name]
    for part in (thing.data.vertices, thing.data.edges, thing.data.polygons):
        part.foreach_set("select", np.zeros(len(part), bool))
    places = np.array([vertex.co for vertex in thing.data.vertices])
    thing.data.vertices.foreach_set("select", (np.abs(places[:, :2] - (low + high) / 2) < (high - low) / 2).all(1))
    return thing


def painted(bpy: Any, shared: Any, patch: str = "grip", surface: str = "left") -> Any:
    choose(bpy, surface)
    assert bpy.ops.contact.paint(patch=patch) == {"FINISHED"}
    return shared.session()


def two(bpy: Any, shared: Any) -> Any:
    painted(bpy, shared, "small")
    choose(bpy, "left", 0.5, 0.95)
    bpy.ops.contact.paint(patch="child")
    return shared.session()


def one_step(bpy: Any, session: Any, run: Callable[[], set[str]]) -> tuple[Any, Any]:
    """Documents before and after an operator, of which one Ctrl+Z goes back, and a redo forth again."""
    before, revision = session.document, session.revision
    assert run() == {"FINISHED"}
    after, reached = session.document, session.revision
    assert reached > revision and after is not before
    bpy.ops.ed.undo()
    assert session.revision == revision and session.document is before
    bpy.ops.ed.redo()
    assert session.revision == reached and session.document is after
    return before, after


def test_registering_loads_nothing_heavy() -> None:
    heavy = ("numba", "scipy", "contact_core.session", "contact_core.edit", "contact_core.geometry")
    script = (
        "import os, sys, bpy\nfrom contact_blender import extension\nextension.register()\n"
        f"loaded = [name for name in {heavy!r} if name in sys.modules]\n"
        "print('loaded', loaded, flush=True)\nos._exit(0)"
    )
    said = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120)
    assert "loaded []" in said.stdout, said.stdout + said.stderr


def test_cycles_leave_handlers_and_classes_as_they_were(bpy: Any, shared: Any) -> None:
    from contact_blender import extension

    def state() -> Any:
        handlers = {n: len(h) for n in dir(bpy.app.handlers) if isinstance(h := getattr(bpy.app.handlers, n), list)}
        kinds = sorted(n for n in dir(bpy.types) if "contact" in n.lower())
        return handlers, kinds, hasattr(bpy.types.WindowManager, "contact"), sorted(dir(bpy.ops.contact))

    extension.unregister()
    before = state()
    for _ in range(100):
        extension.register()
        extension.register()
        shared.session()
        assert bpy.ops.contact.begin.poll()
        extension.unregister()
    assert state() == before
    assert not before[1] and not before[2] and not before[3]


def test_panel_and_scripts_share_a_session(bpy: Any, shared: Any) -> None:
    session = painted(bpy, shared)
    session.patches.rename("grip", "palm")
    assert [row.name for row in bpy.context.window_manager.contact.rows] == ["palm"]
    bpy.ops.ed.undo()
    assert [row.name for row in bpy.context.window_manager.contact.rows] == ["grip"]
    bpy.ops.contact.rotate(patch="grip", angle=0.1)
    assert shared.session() is session


def test_a_session_ends_with_its_scene(bpy: Any, shared: Any, tmp_path: Any) -> None:
    session = painted(bpy, shared)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "grip.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert shared.held() is None and session.host is None
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "grip.blend"))
    assert shared.is_stored() and bpy.ops.contact.rotate.poll()
    assert bpy.ops.contact.begin() == {"FINISHED"}
    again = shared.session()
    assert again is not session and list(again.document.patches) == ["grip"]
    assert again.binding.surfaces["left"].object_id == "left"  # two objects have its triangles: it is remembered


def test_painting_from_selection_and_group_and_adding(bpy: Any, shared: Any) -> None:
    thing = choose(bpy, "left")
    chosen = [vertex.index for vertex in thing.data.vertices if vertex.select]
    bpy.ops.contact.begin()
    session = shared.session()
    _, after = one_step(bpy, session, lambda: bpy.ops.contact.paint(patch="grip", color=(0.1, 0.2, 0.3)))
    assert after.patch("grip").color == pytest.approx((0.1, 0.2, 0.3))
    assert len(session.geometry.points("grip")) == len(chosen) > 8
    bpy.data.objects["left"].vertex_groups.new(name="edge").add([0, 1, 2, 13, 14, 15], 1.0, "REPLACE")
    one_step(bpy, session, lambda: bpy.ops.contact.paint(patch="grip", group="edge"))
    assert len(session.geometry.points("grip")) == len(chosen) + 6
    one_step(bpy, session, lambda: bpy.ops.contact.paint(group="edge"))
    assert list(session.document.patches) == ["grip", "edge"]


def test_erasing(bpy: Any, shared: Any) -> None:
    session = painted(bpy, shared)
    whole = len(session.geometry.points("grip"))
    choose(bpy, "left", 0.0, 0.45)
    one_step(bpy, session, lambda: bpy.ops.contact.erase(patch="grip"))
    assert 0 < len(session.geometry.points("grip")) < whole


def test_adding_surfaces(bpy: Any, shared: Any) -> None:
    for name in ("left", "right"):
        bpy.data.objects[name].select_set(True)
    session = shared.session()
    _, after = one_step(bpy, session, lambda: bpy.ops.contact.add_surfaces())
    assert set(after.surfaces) == {"left", "right"}


@pytest.mark.parametrize("at", ["CURSOR", "SELECTION"])
def test_transferring_pairs_the_copy(bpy: Any, shared: Any, at: str) -> None:
    session = painted(bpy, shared)
    choose(bpy, "right", 0.1, 0.55)
    bpy.context.scene.cursor.location = (5.3, 0.2, 0.7)
    _, after = one_step(bpy, session, lambda: bpy.ops.contact.transfer(patch="grip", at=at, name="copy"))
    assert after.patch("copy").surface == "right" and after.patch("copy").mirrored
    assert [(pair.manipulator, pair.object) for pair in after.pairs.values()] == [("grip", "copy")]
    root = session.geometry.root("copy").point().positions(session.geometry.mesh("right"))[0]
    if at == "CURSOR":
        assert root == pytest.approx((0.3, 0.2, 0.0), abs=1e-6)
    else:
        assert np.abs(root[:2] - 0.325).max() < 0.2


def test_pairing_and_unpairing(bpy: Any, shared: Any) -> None:
    session = painted(bpy, shared)
    choose(bpy, "right")
    bpy.ops.contact.transfer(patch="grip", name="copy", pair=False)
    _, after = one_step(bpy, session, lambda: bpy.ops.contact.pair(patch="grip", other="copy", weight=0.5))
    assert [pair.weight for pair in after.pairs.values()] == [0.5]
    assert {row.pair for row in bpy.context.window_manager.contact.rows} == set(after.pairs)
    bpy.context.window_manager.contact.patch = "copy"
    _, after = one_step(bpy, session, lambda: bpy.ops.contact.unpair())
    assert not after.pairs and len(after.patches) == 2


def test_moving_turning_bending_scaling(bpy: Any, shared: Any) -> None:
    session = painted(bpy, shared)
    before = session.geometry.points("grip").positions(session.geometry.mesh("left"))

    def moved() -> Any:
        now = session.geometry.points("grip").positions(session.geometry.mesh("left"))
        return float(np.abs(now - before).max())

    one_step(bpy, session, lambda: bpy.ops.contact.rotate(patch="grip", angle=0.3))
    assert moved() > 0.05
    bpy.ops.ed.undo()
    assert moved() < 1e-9
    bpy.context.scene.cursor.location = (0.2, 0.1, 3.0)
    one_step(bpy, session, lambda: bpy.ops.contact.translate(patch="grip"))
    root = session.geometry.root("grip").point().positions(session.geometry.mesh("left"))[0]
    assert root == pytest.approx((0.2, 0.1, 0.0), abs=1e-6)

    def size() -> float:
        now = session.geometry.points("grip").positions(session.geometry.mesh("left"))
        return float(np.sqrt(np.linalg.det(np.cov(now[:, :2].T))))

    whole = size()
    one_step(bpy, session, lambda: bpy.ops.contact.scale(patch="grip", along=0.8, spread=0.7))
    assert size() == pytest.approx(0.8 * 0.7 * whole, rel=1e-6)
    one_step(bpy, session, lambda: bpy.ops.contact.bend(patch="grip", point=1, angle=0.2))


def test_linking_and_unlinking(bpy: Any, shared: Any) -> None:
    from contact_core.contact.placement import Link

    session = two(bpy, shared)
    _, after = one_step(bpy, session, lambda: bpy.ops.contact.link(patch="child", parent="small"))
    assert isinstance(after.patch("child").placement, Link) and after.patch("child").placement.parent == "small"
    _, after = one_step(bpy, session, lambda: bpy.ops.contact.unlink(patch="child"))
    assert not isinstance(after.patch("child").placement, Link)


def test_renaming_and_removing(bpy: Any, shared: Any) -> None:
    session = painted(bpy, shared)
    _, after = one_step(bpy, session, lambda: bpy.ops.contact.rename(patch="grip", name="palm"))
    assert list(after.patches) == ["palm"] and bpy.context.window_manager.contact.patch == "palm"
    _, after = one_step(bpy, session, lambda: bpy.ops.contact.remove(patch="palm"))
    assert not after.patches and bpy.context.window_manager.contact.patch == ""
    bpy.ops.ed.undo()
    assert bpy.context.window_manager.contact.patch == "palm"


def test_selecting_the_vertices_of_a_patch(bpy: Any, shared: Any) -> None:
    painted(bpy, shared)
    thing = bpy.data.objects["left"]
    wanted = [vertex.index for vertex in thing.data.vertices if vertex.select]
    choose(bpy, "left", 0.8, 0.81)
    assert bpy.ops.contact.select(patch="grip") == {"FINISHED"}
    assert [vertex.index for vertex in bpy.data.objects["left"].data.vertices if vertex.select] == wanted
    assert sum(face.select for face in bpy.data.objects["left"].data.polygons) > 0
    bpy.ops.contact.select(patch="grip", group="kept")
    group = bpy.data.objects["left"].vertex_groups["kept"].index
    held = [v.index for v in bpy.data.objects["left"].data.vertices if any(g.group == group for g in v.groups)]
    assert held == wanted
    bpy.ops.ed.undo()
    assert "kept" not in bpy.data.objects["left"].vertex_groups
    assert list(shared.session().document.patches) == ["grip"]


class Layout:
    """What a panel draws into, for Blender has none without a window (tests/adapters/blender_window has the real
    one): texts are kept, and operators, lists and properties have to be registered ones."""

    def __init__(self, bpy: Any, texts: list[str]) -> None:
        self.bpy, self.texts, self.enabled = bpy, texts, True

    def row(self, align: bool = False) -> Layout:
        return Layout(self.bpy, self.texts)

    box = column = row

    def split(self, factor: float) -> Layout:
        return self.row()

    def separator(self, factor: float = 1.0) -> None:
        pass

    def label(self, text: str, icon: str = "NONE") -> None:
        self.known(icon)
        self.texts.append(text)

    def known(self, icon: str) -> None:
        assert icon in self.bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items

    def prop(self, data: Any, name: str, text: str | None = None, emboss: bool = True) -> None:
        assert name in data.bl_rna.properties
        if name == "label":
            self.texts.append(data.label)

    def operator_menu_enum(self, name: str, choices: str) -> None:
        known = getattr(self.bpy.ops.contact, name.removeprefix("contact.")).get_rna_type().properties
        assert choices in known

    def menu(self, name: str, text: str = "", icon: str = "NONE") -> None:
        self.known(icon)
        assert hasattr(self.bpy.types, name)
        self.texts.append(text)

    def prop_search(
        self, data: Any, name: str, searched: Any, rows: str, text: str = "", icon: str = "NONE"
    ) -> None:
        self.known(icon)
        assert name in data.bl_rna.properties and rows in searched.bl_rna.properties

    def template_list(self, kind: str, _: str, data: Any, shown: str, active: Any, row: str, rows: int) -> None:
        listed = getattr(self.bpy.types, kind)
        assert row in active.bl_rna.properties
        for item in getattr(data, shown):
            listed.draw_item(None, self.bpy.context, self, data, item, 0, active, row)

    def operator(self, name: str, text: str = "", icon: str = "NONE") -> Any:
        self.known(icon)
        known = getattr(self.bpy.ops.contact, name.removeprefix("contact.")).get_rna_type().properties

        class Given:
            def __setattr__(self, key: str, value: Any) -> None:
                assert key in known

        return Given()


def drawn(bpy: Any) -> list[str]:
    """The texts of the panels as they are now."""
    from types import SimpleNamespace

    from contact_blender.extension import panel

    texts: list[str] = []
    for kind in panel.PANELS:
        if issubclass(kind, bpy.types.Panel) and getattr(kind, "poll", lambda _: True)(bpy.context):
            kind.draw(SimpleNamespace(layout=Layout(bpy, texts)), bpy.context)
    return texts


def test_the_panel_shows_what_there_is(bpy: Any, hand: Any) -> None:
    from contact_blender.extension import panel, shared

    names, scene = list(hand.document.pairs), bpy.context.scene
    assert drawn(bpy).count("not solved") == len(names) == 2
    bpy.ops.contact.solve()
    near = {panel.nearness(name, scene) for name in names}
    assert all(told.endswith("mm") for told in near) and near < set(drawn(bpy))
    assert set(hand.document.patches) < set(drawn(bpy))
    scene.unit_settings.system = "NONE"
    kept = shared.held()
    assert kept is not None
    assert panel.nearness(names[0], scene) == f"{kept.residuals[names[0]]:.3g}"
    bpy.ops.contact.rotate(patch=next(iter(hand.document.patches)), angle=0.1)
    assert panel.nearness(names[0], scene).endswith(" ?")  # edited since the solve
    shared.close_all()
    assert drawn(bpy) == []  # nothing was begun: a button that shows what the scene holds


def test_rows_of_the_lists_are_patches_and_pairs(bpy: Any, hand: Any) -> None:
    settings, patches, pairs = bpy.context.window_manager.contact, hand.document.patches, hand.document.pairs
    assert [row.label for row in settings.rows] == list(patches) and len(settings.pairs) == len(pairs) == 2
    settings.row, settings.pair_row = 1, 0
    assert settings.patch == list(patches)[1] and settings.pair == next(iter(pairs))
    bpy.ops.contact.rename(name="other")  # the active one
    assert settings.row == 1 and settings.rows[1].label == "other"
    one_step(bpy, hand, lambda: bpy.ops.contact.recolor(patch="other", color=(0.0, 0.5, 1.0)))
    assert tuple(settings.rows[1].color) == pytest.approx((0.0, 0.5, 1.0))


@pytest.fixture
def hand(bpy: Any, empty: Any) -> Iterator[Any]:
    """A hand and a ball with two pairs, in a session of the add-on."""
    import contact_core as contact
    from contact_blender import extension

    extension.register()
    session = extension.shared.session()
    for name in ("human_hand", "baseball"):
        session.host.add(contact.read_asset(f"sample:{name}"))
    for each in bpy.context.scene.objects:
        each.select_set(each.type == "MESH")
        if each.type == "MESH":
            bpy.context.view_layer.objects.active = each
    assert bpy.ops.contact.add_surfaces() == {"FINISHED"}
    rigged, thing = sorted(session.document.surfaces, key=lambda name: name not in session.rigs)
    rig, ball = session.rigs[rigged], session.geometry.mesh(thing)
    size = np.ptp(ball.points, axis=0).max()
    for side, name in ((-1.0, "thumb_distal"), (1.0, "index_distal")):
        tip = rig.rest_world[rig.joint_index(name), :3, 3]
        session.patches.brush("disk", name, surface=rigged, at=tip, radius=0.05 * size)
        root = contact.SurfacePoints.at_vertices(ball, [int(np.argmax(side * ball.points[:, 0]))])
        session.pairs.add(name, session.patches.transfer(name, thing, root, direction=[0.0, 0.0, 1.0]))
    yield session
    extension.unregister()


@pytest.mark.parametrize(
    ("name", "given"),
    [("solve", {}), ("solve", {"penetration": True}), ("settle", {"rounds": 1}), ("slide", {})],
)
def test_solving_accepts_and_keeps_residuals(bpy: Any, hand: Any, name: str, given: dict[str, Any]) -> None:
    from contact_blender.extension import shared

    before, after = one_step(bpy, hand, lambda: getattr(bpy.ops.contact, name)(**given))
    assert after.poses and not before.poses
    kept = shared.held()
    assert kept is not None and set(kept.residuals) == set(after.pairs)
    assert max(kept.residuals.values()) < 0.1 and kept.solved == hand.revision


def test_solving_frames_keys_them_and_a_pose_is_cleared(bpy: Any, hand: Any) -> None:
    assert bpy.ops.contact.solve(keyed=True, first=3, last=4) == {"FINISHED"}
    rigged = next(iter(hand.rigs))
    assert {3.0, 4.0} <= set(hand.host.pose_keys(hand.binding.surfaces[rigged].object_id))
    bpy.ops.ed.undo()
    assert bpy.ops.contact.solve() == {"FINISHED"} and rigged in hand.document.poses
    _, after = one_step(bpy, hand, lambda: bpy.ops.contact.clear_pose(patch="thumb_distal"))
    assert rigged not in after.poses


def test_the_cursor_means_the_skin_as_it_is_posed(bpy: Any, hand: Any) -> None:
    bpy.ops.contact.solve()
    rigged = next(iter(hand.rigs))
    posed, world = hand.geometry.posed_mesh(rigged), hand.document.surface(rigged).world_from_surface
    rest = hand.geometry.mesh(rigged)
    vertex = int(np.argmax(np.linalg.norm(posed.points - rest.points, axis=1)))
    bpy.context.scene.cursor.location = (world @ np.append(posed.points[vertex], 1.0))[:3]
    assert bpy.ops.contact.translate(patch="thumb_distal") == {"FINISHED"}
    root = hand.geometry.root("thumb_distal").point().positions(hand.geometry.carrier(rigged))[0]
    assert root == pytest.approx(rest.points[vertex], abs=1e-4 * np.ptp(rest.points))
    assert np.linalg.norm(posed.points[vertex] - rest.points[vertex]) > 0.01 * np.ptp(rest.points)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_undo_and_edits_in_any_order_keep_scene_and_document_together(
    bpy: Any, shared: Any, tmp_path: Any, seed: int
) -> None:
    """Our operators, Blender's own edits, undo, redo, reloading: what the scene stores is what the session has."""
    painted(bpy, shared)
    random = np.random.default_rng(seed)
    path = str(tmp_path / "shot.blend")

    def foreign() -> None:
        bpy.data.objects["right"].location.z += 0.1
        bpy.ops.ed.undo_push(message="Move")

    def reload() -> None:
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)

    def tried(run: Any, **given: Any) -> None:
        if run.poll():
            run(**given)

    steps: list[Callable[[], object]] = [
        lambda: tried(bpy.ops.contact.rotate, angle=float(random.uniform(-1.0, 1.0))),
        lambda: tried(bpy.ops.contact.scale, along=float(random.uniform(0.6, 1.2))),
        lambda: tried(bpy.ops.contact.transfer, object="right", pair=bool(random.integers(2))),
        lambda: tried(bpy.ops.contact.remove),
        lambda: choose(bpy, "left") and tried(bpy.ops.contact.paint),
        foreign,
        lambda: tried(bpy.ops.ed.undo),
        lambda: tried(bpy.ops.ed.redo),
        lambda: tried(bpy.ops.ed.undo),
        reload,
    ]
    done = 0
    for kind in random.choice(len(steps), 60, p=[0.12] * 8 + [0.02] * 2):
        steps[kind]()
        session = shared.session()
        stored = session.host.stored_document()
        known = stored.read("the scene").document if stored is not None else None
        assert [*session.document.patches] == ([*known.patches] if known is not None else [])
        assert session.document.pairs == known.pairs if known is not None else not session.document.pairs
        assert stored is None or stored.stamp.revision == session.revision
        assert [row.name for row in bpy.context.window_manager.contact.rows] == [*session.document.patches]
        done = max(done, len(session.document.patches))
    assert done > 1


def test_a_group_that_deforms_is_not_overwritten(bpy: Any, hand: Any) -> None:
    with pytest.raises(RuntimeError, match="deforms the mesh"):
        bpy.ops.contact.select(patch="thumb_distal", group="thumb_distal")


def test_polls_say_why_not(bpy: Any, shared: Any) -> None:
    for name, words in (("rotate", "no patch yet"), ("solve", "no pair yet"), ("pair", "no patch yet")):
        with pytest.raises(RuntimeError, match=words):
            getattr(bpy.ops.contact, name)()
    painted(bpy, shared)
    with pytest.raises(RuntimeError, match="one patch only"):
        bpy.ops.contact.link()
    bpy.context.view_layer.objects.active = None
    with pytest.raises(RuntimeError, match="active object"):
        bpy.ops.contact.paint()
    choose(bpy, "left")
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="Tab leaves Edit Mode"):
        bpy.ops.contact.paint()
    bpy.ops.object.mode_set(mode="OBJECT")


@pytest.mark.parametrize(
    ("name", "given", "words"),
    [
        ("rotate", {"patch": "grop"}, "There is no patch 'grop'; there are: grip"),
        ("paint", {"group": "nothing"}, "has no selection 'nothing'"),
        ("paint", {"object": "nowhere"}, "Contacts lie on meshes"),
        ("bend", {"patch": "grip", "point": 999}, "999"),
        ("rename", {"patch": "grip", "name": ""}, "name"),
    ],
)
def test_refusals_are_reports(bpy: Any, shared: Any, name: str, given: dict[str, Any], words: str) -> None:
    session = painted(bpy, shared)
    before = session.document
    with pytest.raises(RuntimeError) as refused:  # Blender hands a script the reports of an operator as this
        getattr(bpy.ops.contact, name)(**given)
    assert words in str(refused.value) and "fault of the add-on" not in str(refused.value)
    assert "Traceback" not in str(refused.value) and session.document is before


def test_a_missing_library_is_a_sentence(bpy: Any, shared: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    from contact_blender.extension import preferences

    assert "All libraries are here" in preferences.words()
    monkeypatch.setattr(shared, "LIBRARIES", ("numpy", "no_such_library"))
    assert "no no_such_library" in preferences.words()
    choose(bpy, "left")
    with pytest.raises(RuntimeError, match="no_such_library"):
        bpy.ops.contact.paint()
    monkeypatch.undo()
    monkeypatch.setattr(shared, "OLDEST_NUMPY", (99, 1))
    assert "numpy 99.1 is needed" in preferences.words()


def test_a_broken_library_is_a_sentence(bpy: Any, shared: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    from contact_blender.extension import preferences

    monkeypatch.setattr(shared, "_broken", [])
    monkeypatch.setitem(sys.modules, "scipy.sparse", None)  # as Python refuses one that cannot be loaded
    choose(bpy, "left")
    with pytest.raises(RuntimeError, match="scipy is here and cannot be loaded"):
        bpy.ops.contact.paint()
    assert preferences.words() == shared.missing() and "scipy" in shared.missing()
    assert drawn(bpy) == ["A library is missing or broken:", "see the add-on's preferences"]


def test_the_operators_say_what_they_do_and_can_be_run_again_by_f9(bpy: Any, shared: Any) -> None:
    from contact_blender.extension import operators

    assert len(operators.classes()) >= 20
    for kind in operators.classes():
        assert kind.bl_options == {"REGISTER", "UNDO"} and len(kind.bl_description) > 15
        assert getattr(bpy.ops.contact, kind.bl_idname.partition(".")[2]).get_rna_type().name == kind.bl_label


def test_modes_are_those_of_the_undo(bpy: Any) -> None:
    from contact_blender import storage, undo
    from contact_blender.extension import declaring, shared

    assert declaring.MODES == undo.WHOLE_SCENE and shared.KEY == storage.KEY
