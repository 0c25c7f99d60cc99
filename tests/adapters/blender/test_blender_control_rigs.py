"""Rigs as artists have them: controls that constraints and drivers follow, solved as Blender evaluates them."""

from __future__ import annotations

from math import radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contact_core.errors import InvalidInput
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.testing import meshes

# bone: (head, tail, parent, whether it deforms)
BONES = {
    "root": ((0, 0, 0), (0, 0, 0.5), None, False),
    "DEF upper": ((0, 0, 0), (0, 1, 0.15), "root", True),
    "DEF lower": ((0, 1, 0.15), (0, 2, 0), "DEF upper", True),
    "DEF tip": ((0, 2, 0), (0, 2.5, 0), None, True),
    "DEF end": ((0, 2.5, 0), (0, 3, 0), "DEF tip", True),
    "hand ik": ((0, 2, 0), (0, 2, 0.4), None, False),
    "tip": ((0, 2, 0), (0, 2.5, 0), "hand ik", False),
    "elsewhere": ((3, 0, 0), (3, 0, 0.4), None, False),
    "MCH hidden": ((0, 2, 0), (0, 2, 0.2), "hand ik", False),
}
CONTROLS = {"hand ik", "tip"}


def armature_of_bones(bpy: Any) -> Any:
    armature = bpy.data.objects.new("character", bpy.data.armatures.new("character"))
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for name, (head, tail, parent, deforms) in BONES.items():
        bone = armature.data.edit_bones.new(name)
        bone.head, bone.tail, bone.use_deform = head, tail, deforms
        bone.parent = armature.data.edit_bones[parent] if parent else None
    armature.data.edit_bones["DEF lower"].use_connect = True
    bpy.ops.object.mode_set(mode="OBJECT")
    return armature


def constrained(armature: Any) -> None:
    """IK with limits and a lock, copied transforms, a driver from a custom property, a limit and a lock."""
    bones = armature.pose.bones
    ik = bones["DEF lower"].constraints.new("IK")
    ik.target, ik.subtarget, ik.chain_count = armature, "hand ik", 2
    bones["DEF lower"].use_ik_limit_x = True
    bones["DEF lower"].ik_min_x, bones["DEF lower"].ik_max_x = radians(-150.0), radians(10.0)
    bones["DEF lower"].lock_ik_y = bones["DEF lower"].lock_ik_z = True
    copy = bones["DEF tip"].constraints.new("COPY_TRANSFORMS")
    copy.target, copy.subtarget = armature, "tip"
    bones["hand ik"]["curl"] = 0.2
    bones["DEF end"].rotation_mode = bones["tip"].rotation_mode = "XYZ"
    driver = bones["DEF end"].driver_add("rotation_euler", 0).driver
    driver.type = "SUM"
    variable = driver.variables.new()
    variable.targets[0].id, variable.targets[0].data_path = armature, 'pose.bones["hand ik"]["curl"]'
    limit = bones["tip"].constraints.new("LIMIT_ROTATION")
    limit.owner_space, limit.use_limit_x = "LOCAL", True
    limit.min_x, limit.max_x = -0.4, 0.4
    bones["tip"].lock_rotation = (False, True, False)
    bones["tip"].lock_location = (True, True, True)
    bones["root"].lock_location = bones["root"].lock_rotation = (True, True, True)


def skin_on(bpy: Any, scenes: Any, armature: Any) -> Any:
    """A closed tube along the bones, each ring following the bone that it lies on."""
    rings, around = np.linspace(0.0, 3.0, 25), np.arange(8) * np.pi / 4.0
    points = [(0.2 * np.cos(a), y, 0.2 * np.sin(a)) for y in rings for a in around]
    sides = [
        [8 * r + k, 8 * r + (k + 1) % 8, 8 * (r + 1) + (k + 1) % 8, 8 * (r + 1) + k]
        for r in range(len(rings) - 1)
        for k in range(8)
    ]
    ends = [list(range(8)), list(range(8 * len(rings) - 1, 8 * len(rings) - 9, -1))]
    flipped = [face[::-1] for face in (*sides, *ends)]
    made = scenes.mesh_object("skin", points, [len(f) for f in flipped], [i for f in flipped for i in f])
    spans = {"DEF upper": (0, 1), "DEF lower": (1, 2), "DEF tip": (2, 2.5), "DEF end": (2.5, 3.1)}
    for name, (low, high) in spans.items():
        inside = [8 * r + k for r, y in enumerate(rings) if low <= y < high for k in range(8)]
        made.vertex_groups.new(name=name).add(inside, 1.0, "REPLACE")
    made.parent = armature
    made.modifiers.new("Armature", "ARMATURE").object = armature
    return made


@pytest.fixture
def character(bpy: Any, empty: Any, scenes: Any) -> Any:
    """An armature whose deforming bones are all another's."""
    armature = armature_of_bones(bpy)
    constrained(armature)
    hidden = armature.data.collections.new("Mechanism")
    hidden.assign(armature.data.bones["MCH hidden"])
    hidden.is_visible = False
    shown = armature.data.collections.new("Hand")
    shown.assign(armature.data.bones["tip"])
    skin_on(bpy, scenes, armature)
    bpy.context.view_layer.update()
    return armature


def posed(rig: Any) -> set[str]:
    return {joint for joint, freedom in zip(rig.joints, rig.freedoms, strict=True) if freedom.kind != "fixed"}


def test_which_bones_are_posed_is_a_choice(bpy: Any, empty: Any, character: Any) -> None:
    """Where the skin's bones are taken over, the controls that it follows are posed; else what the artist says."""
    rig = empty.read_rig("skin").rig
    assert posed(rig) == CONTROLS | {"root", "DEF end"}
    free = dict(zip(rig.joints, rig.freedoms, strict=True))
    assert free["hand ik"].translates and not free["tip"].translates
    assert free["tip"].locked[free["tip"].order.index("Y")]
    assert free["DEF end"].locked.tolist() == [axis == "X" for axis in free["DEF end"].order]  # the driver's
    before = empty.read_pose("skin").local
    for choice, bones in (("deform", {"DEF end"}), ("collection:Hand", {"tip"}), ("controls", posed(rig))):
        empty.choose_bones("skin", choice)
        assert empty.bones_of("skin") == choice and posed(empty.read_rig("skin").rig) == bones
    assert np.array_equal(empty.read_pose("skin").local, before)
    with pytest.raises(InvalidInput, match=r"there are \w+, \w+"):
        empty.choose_bones("skin", "collection:Foot")
    assert empty.bones_of("skin") == "controls"
    empty.undo()
    assert empty.bones_of("skin") == "collection:Hand"


def session_with_ball(bpy: Any, scenes: Any, host: Any, at: Any, **arguments: Any) -> Any:
    """A session with the underside of the skin's end on the top of a ball."""
    from contact_core.session import Session

    ball = meshes.icosphere(2)
    scenes.mesh_object("ball", 0.3 * ball.points + at, np.full(len(ball.faces), 3), ball.faces.ravel())
    bpy.context.view_layer.update()
    session = Session(host=host, objects=None, discover=False, **arguments)
    skin, round_ = session.geometry.mesh("skin"), session.geometry.mesh("ball")
    near = np.argsort(np.linalg.norm(skin.points - (0.0, 2.75, -0.2), axis=1))[:5]
    points = SurfacePoints.at_vertices(skin, near)
    session.patches.paint("pad", points, surface="skin", axis=points[[0]], heading=1.0)
    top = SurfacePoints.at_vertices(round_, [int(np.argmax(round_.points[:, 2]))])
    session.pairs.add("pad", session.patches.transfer("pad", "ball", top, heading=1.0, mirrored=True))
    return session


def gap_in_blender(bpy: Any, session: Any) -> Any:
    """(k,) distances of the pair's points, skin and ball as Blender itself evaluates them."""
    (pair,) = session.geometry.pairs()
    bpy.context.view_layer.update()
    seen = bpy.data.objects["skin"].evaluated_get(bpy.context.evaluated_depsgraph_get())
    world = np.array(seen.matrix_world)
    corners = np.array([world @ (*vertex.co, 1.0) for vertex in seen.data.vertices])[:, :3]
    asset = session.binding.surfaces["skin"].asset
    kept = np.unique(asset.source_vertices, return_index=True)[1]
    skin = asset.mesh.with_points(corners[kept])
    ball = session.geometry.mesh("ball")
    return np.linalg.norm(pair.manipulator_points.positions(skin) - pair.object_points.positions(ball), axis=1)


def channels(armature: Any, names: Any) -> dict[str, Any]:
    bones = armature.pose.bones
    what = ("location", "rotation_quaternion", "rotation_euler", "scale")
    return {name: [tuple(getattr(bones[name], channel)) for channel in what] for name in names}


def still(now: dict[str, Any], before: dict[str, Any]) -> bool:
    return all(np.allclose(now[n][c], before[n][c], rtol=0.0, atol=1e-7) for n in before for c in range(4))


def test_the_skin_is_where_the_solver_said(bpy: Any, empty: Any, scenes: Any, character: Any) -> None:
    """The result lands on the controls alone, within locks and limits; Blender's own skin is at the contacts; keys
    are on what was posed, and one undo takes all of it back."""
    character.data.collections["Hand"].assign(character.data.bones["hand ik"])
    session = session_with_ball(bpy, scenes, empty, (0.3, 2.4, -0.8))
    session.surfaces.choose_bones("skin", "collection:Hand")
    others = set(BONES) - CONTROLS
    before, all_before = channels(character, others), channels(character, BONES)
    apart = gap_in_blender(bpy, session).mean()
    proposal = session.solve(frames=[1])
    session.accept(proposal)
    bpy.context.scene.frame_set(1)
    gap = gap_in_blender(bpy, session)
    assert apart > 0.2 and gap.mean() < 0.06, (apart, gap)
    assert still(channels(character, others), before)
    tip = character.pose.bones["tip"]
    assert abs(tip.rotation_euler.x) <= 0.4 + 1e-5 and tip.rotation_euler.y == 0.0 and not any(tip.location)
    assert not np.allclose(character.pose.bones["hand ik"].location, 0.0, atol=0.05)
    keyed = {path.split('"')[1] for path in paths(character)}
    assert keyed == CONTROLS
    session.undo()
    bpy.context.view_layer.update()
    after = channels(bpy.data.objects["character"], BONES)
    assert still(after, all_before)
    session.close()


def paths(armature: Any) -> set[str]:
    from contact_blender.compat import fcurves

    return {f"{curve.data_path}[{curve.array_index}]" for curve in fcurves(armature)}


def test_a_proposal_says_what_blender_then_shows(bpy: Any, empty: Any, scenes: Any, character: Any) -> None:
    """Within 1e-4 of the skin's size, also where only a collection is posed and the contacts cannot be met."""
    session = session_with_ball(bpy, scenes, empty, (0.1, 2.6, -0.65))
    session.surfaces.choose_bones("skin", "collection:Hand")
    before = channels(character, set(BONES) - {"tip"})
    proposal = session.solve()
    session.accept(proposal)
    (told,) = proposal.after.patches.values()
    gap = gap_in_blender(bpy, session)
    assert gap.mean() == pytest.approx(told.mean, abs=3e-4) and told.mean > 0.01
    assert still(channels(character, set(BONES) - {"tip"}), before)
    session.close()


def test_locks_and_limits_set_later_are_honoured(bpy: Any, empty: Any, scenes: Any, character: Any) -> None:
    """A session that is open reads them before it solves: a lock of a location, a limit, how stiff a bone is."""
    session = session_with_ball(bpy, scenes, empty, (0.1, 2.6, -0.65))
    hand, end = character.pose.bones["hand ik"], character.pose.bones["DEF end"]
    hand.lock_location, end.ik_stiffness_z = (True, False, True), 0.75
    session.surfaces.follow_freedoms()
    rig = session.rigs["skin"]
    free = dict(zip(rig.joints, rig.freedoms, strict=True))
    assert free["hand ik"].locked_translation.tolist() == [True, False, True]
    assert sorted(free["DEF end"].prior_weight) == [1.0, 1.0, pytest.approx(4.0)]
    assert session.surfaces.follow_freedoms() is None and session.rigs["skin"] is rig
    character.pose.bones["root"].lock_rotation = (False, False, False)
    names = {dof.name for dof in session.problem().bodies[0].black_box.dofs}
    assert "hand ik.ty" in names and "hand ik.tx" not in names and "root.x" in names
    session.close()


def test_the_panel_and_its_operator_choose(bpy: Any, empty: Any, scenes: Any, character: Any) -> None:
    """One step of undo, kept through saving, and heeded by the session that scripts share."""
    from contact_blender import extension
    from contact_blender.extension import panel

    extension.register()
    try:
        session = extension.shared.session()
        skin = bpy.data.objects["skin"]
        skin.vertex_groups.new(name="pad").add([176, 177, 184, 185], 1.0, "REPLACE")
        bpy.context.view_layer.objects.active = skin
        assert bpy.ops.contact.paint(patch="pad", group="pad") == {"FINISHED"}
        chosen, choices = panel._rig_under("pad")
        assert chosen == "automatic" and [c for c, _ in choices[3:]] == ["collection:Mechanism", "collection:Hand"]
        assert bpy.ops.contact.choose_bones(bones="collection:Hand") == {"FINISHED"}
        assert posed(session.rigs["skin"]) == {"tip"} and panel._rig_under("pad")[0] == "collection:Hand"
        bpy.ops.ed.undo()
        session.surfaces.follow_freedoms()
        assert panel._rig_under("pad")[0] == "automatic" and "hand ik" in posed(session.rigs["skin"])
        with pytest.raises(RuntimeError, match="but got 'feet'"):
            bpy.ops.contact.choose_bones(bones="feet")
    finally:
        extension.unregister()


def test_a_file_is_opened_with_its_choice(bpy: Any, empty: Any, character: Any, tmp_path: Path) -> None:
    """Kept by pointer, so that the armature may be called otherwise; `contact.open` sets another."""
    import contact_core as contact

    empty.choose_bones("skin", "collection:Hand")
    character.name = "somebody else"
    empty.save(tmp_path / "shot.blend")
    with contact.open(tmp_path / "shot.blend") as session:
        assert posed(session.rigs["skin"]) == {"tip"}
    with contact.open(tmp_path / "shot.blend", bones={"skin": "deform"}) as session:
        assert posed(session.rigs["skin"]) == {"DEF end"}
    with pytest.raises(InvalidInput, match="0 rigs of the scene are called 'hand'"):
        contact.open(tmp_path / "shot.blend", bones={"hand": "deform"})
