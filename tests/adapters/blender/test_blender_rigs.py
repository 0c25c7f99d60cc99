"""Rigs as Blender evaluates them, what linear skinning cannot do named, and freedoms out of locks and limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contact_core.document.asset import Asset
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.chart import Chart
from contact_core.rig.rig import JointFreedom, Pose, forward_kinematics, skin
from contact_core.scene.host import SceneSpace
from contact_core.solve.solver import SolveOptions
from contact_core.testing.host_checks import volume
from contact_core.testing.host_scenes import HostScene, SceneRig, affine, arm_rig, bent
from contact_core.testing.rigs import any_freedom, hand_like

MODES = ("QUATERNION", "XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX", "AXIS_ANGLE")


@pytest.fixture
def arm(scenes: Any) -> Any:
    """A host with the contract's arm, turned and shifted."""
    world = affine((0.3, -0.2, 0.9), (1.0, 1.0, 1.0), (1.0, 2.0, 3.0))
    return scenes.build(HostScene(SceneSpace(1.0, "Z"), rigs=(SceneRig("arm", arm_rig(), world),)))


def worst_difference(host: Any, key: str, poses: int = 5) -> float:
    """Largest distance between our skin and Blender's over random poses, by the size of the skin."""
    rig = host.read_rig(key).rig
    found = 0.0
    for seed in range(poses):
        pose = bent(rig, seed)
        fixed = [k for k, freedom in enumerate(rig.freedoms) if freedom.kind == "fixed"]
        local = np.array(pose.local)
        local[fixed] = rig.rest_local[fixed]
        pose = Pose(rig.joints, local)
        ours = skin(rig, forward_kinematics(rig.parents, pose.local))
        found = max(found, float(np.linalg.norm(ours - host.skin_points(key, pose), axis=1).max()))
    return found / rig.surface.bounding_box_diagonal


def test_awkward_rigs_skin_as_in_blender(bpy: Any, arm: Any) -> None:
    """Scaled armature, mirrored mesh not parented to it, mixed rotation modes, a bone that does not deform, a group
    without a bone, weights far from one, vertices without any: to 1e-5 of the size, and the notes say so."""
    from mathutils import Matrix

    made = bpy.data.objects["arm"]
    armature = made.parent
    outward = volume_about_centre(arm.read_rig("arm").mesh)
    armature.scale = (2.0, 2.0, 2.0)
    made.parent = None
    made.matrix_world = Matrix(affine((0.1, 0.2, 0.3), (-1.5, 0.7, 1.2), (0.5, 0.0, 0.0)).tolist())
    for k, bone in enumerate(armature.pose.bones):
        bone.rotation_mode = MODES[(3 * k) % len(MODES)]
    armature.data.bones["thumb"].use_deform = False
    made.vertex_groups.new(name="no bone of this name").add([0, 1, 2], 0.7, "REPLACE")
    made.vertex_groups["elbow"].add(list(range(10)), 1.4, "REPLACE")
    for group in made.vertex_groups:
        group.remove([33, 34])
    asset = arm.read_rig("arm")
    assert "stay at rest" in " ".join(asset.notes) and "normalised" in " ".join(asset.notes)
    assert asset.details["linear skinning is exact"], asset.details
    assert worst_difference(arm, "arm") < 1e-5
    assert outward > 0.0 and volume_about_centre(asset.mesh) > 0.0  # the mirrored mesh is not inside out


def volume_about_centre(mesh: TriangleMesh) -> float:
    """Signed volume of the cones from the centre: positive for an open tube seen from outside, too."""
    return volume(mesh.with_points(mesh.points - mesh.points.mean(axis=0)))


def test_in_edit_mode_the_rig_has_the_edits_so_far(bpy: Any, arm: Any) -> None:
    """The surface and the weights are those being edited; after leaving Edit Mode they are the same."""
    import bmesh

    made = bpy.data.objects["arm"]
    bpy.context.view_layer.objects.active = made
    bpy.ops.object.mode_set(mode="EDIT")
    edited = bmesh.from_edit_mesh(made.data)
    edited.verts.ensure_lookup_table()
    edited.verts[7].co.x += 0.5
    edited.verts[7][edited.verts.layers.deform.active][made.vertex_groups["thumb"].index] = 0.6
    bmesh.update_edit_mesh(made.data)
    during = arm.read_rig("arm").rig
    bpy.ops.object.mode_set(mode="OBJECT")
    after = arm.read_rig("arm").rig
    assert during.surface.digest == after.surface.digest != arm_rig().surface.digest
    np.testing.assert_array_equal(during.skin_weights, after.skin_weights)
    assert after.skin_weights[7].max() < 0.7


@pytest.mark.parametrize("editing", [False, True], ids=["object mode", "edit mode"])
def test_weights_are_those_that_blender_gives_one_by_one(bpy: Any, scenes: Any, empty: Any, editing: bool) -> None:
    """For more groups than are read at a time, with names of every kind and an attribute called like a group."""
    from contact_blender.mesh import cage
    from contact_blender.weights import group_weights, influences

    random = np.random.default_rng(4)
    count, groups = 200, 37
    made = scenes.mesh_object("blob", random.normal(size=(count, 3)), [3], [0, 1, 2])
    for number in range(groups):
        group = made.vertex_groups.new(name=f'größe "{number}".L' if number % 2 else f"bone {number}")
        for vertex in random.choice(count, int(random.integers(0, 60)), replace=False).tolist():
            group.add([vertex], float(random.uniform() * (random.uniform() < 0.9)), "REPLACE")
    made.data.attributes.new(".contact_weights 3", "FLOAT", "POINT")
    made.shape_key_add(name="Basis")
    made.shape_key_add(name="Other").driver_add("value").driver.expression = "0.5"
    there = [{e.group: e.weight for e in vertex.groups} for vertex in made.data.vertices]
    if editing:
        bpy.context.view_layer.objects.active = made
        bpy.ops.object.mode_set(mode="EDIT")
    blocks = ("objects", "meshes", "scenes", "node_groups", "shape_keys", "actions")
    before = [getattr(bpy.data, name).keys() for name in blocks]
    joint_of_group = {
        int(g): int(j) for g, j in zip(random.permutation(groups)[:30], range(29, -1, -1), strict=True)
    }
    with cage(made) as mesh:
        weights = np.array(list(group_weights(mesh, range(groups))))
        joints, values = influences(mesh, joint_of_group)
    assert [getattr(bpy.data, name).keys() for name in blocks] == before
    wanted = np.array([[row.get(group, 0.0) for row in there] for group in range(groups)])
    np.testing.assert_array_equal(weights, wanted)
    for vertex, row in enumerate(there):
        pairs = sorted((joint_of_group[g], w) for g, w in row.items() if g in joint_of_group and w > 0.0)
        used = values[vertex] > 0.0
        assert [*map(tuple, np.c_[joints[vertex, used], values[vertex, used]].tolist())] == pairs
        assert not joints[vertex, ~used].any()
    if editing:
        bpy.ops.object.mode_set(mode="OBJECT")


def test_a_connected_bone_stays_where_its_parent_ends(bpy: Any, arm: Any) -> None:
    """Blender ignores the location of a connected bone, and so does the pose that is read."""
    armature = bpy.data.objects["arm"].parent
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    armature.data.edit_bones["elbow"].tail = armature.data.edit_bones["wrist"].head
    armature.data.edit_bones["wrist"].use_connect = True
    bpy.ops.object.mode_set(mode="OBJECT")
    armature.pose.bones["wrist"].location = (0.3, 0.2, 0.1)
    rig, pose = arm.read_rig("arm").rig, arm.read_pose("arm")
    np.testing.assert_allclose(pose.local, rig.rest_local, atol=1e-6)
    ours = skin(rig, forward_kinematics(rig.parents, pose.local))
    np.testing.assert_allclose(arm.skin_points("arm", pose), ours, atol=1e-5)


@pytest.mark.parametrize("mode", MODES)
def test_every_rotation_mode_takes_every_pose(bpy: Any, arm: Any, mode: str) -> None:
    """Poses near and far, half turns and gimbal lock among them, come back, and Blender's own bones are there."""
    armature = bpy.data.objects["arm"].parent
    for bone in armature.pose.bones:
        bone.rotation_mode = mode
    rig = arm.read_rig("arm").rig
    skeleton_world = np.array(armature.matrix_world)
    quarter = Pose(rig.joints, rig.rest_local @ affine((np.pi, np.pi / 2, 0.0), (1, 1, 1), (0, 0, 0)))
    for pose in (bent(rig, 0), quarter, bent(rig, 1), Pose.rest(rig)):
        arm.write_pose("arm", pose)
        assert np.abs(arm.read_pose("arm").local - pose.local).max() < 1e-6
        bpy.context.view_layer.update()
        world = forward_kinematics(rig.parents, pose.local)
        for joint, matrix in zip(rig.joints, world, strict=True):
            theirs = skeleton_world @ np.array(armature.pose.bones[joint].matrix)
            ours = arm.placement("arm") @ matrix
            assert np.abs(theirs - ours).max() < 2e-6 * 3.0, (joint, mode)


def preserve_volume(bpy: Any, made: Any) -> None:
    made.modifiers["Armature"].use_deform_preserve_volume = True


def bendy_bone(bpy: Any, made: Any) -> None:
    made.parent.data.bones["elbow"].bbone_segments = 8
    made.parent.pose.bones["elbow"].bbone_curveinx = 0.3


def subdivided(bpy: Any, made: Any) -> None:
    made.modifiers.new("Smooth skin", "SUBSURF")


def mirrored_first(bpy: Any, made: Any) -> None:
    made.modifiers.new("Twin", "MIRROR")
    made.modifiers.move(1, 0)


def envelopes(bpy: Any, made: Any) -> None:
    made.modifiers["Armature"].use_bone_envelopes = True
    made.modifiers["Armature"].use_vertex_groups = False


def masked(bpy: Any, made: Any) -> None:
    made.modifiers["Armature"].vertex_group = "elbow"


def copied_rotation(bpy: Any, made: Any) -> None:
    constraint = made.parent.pose.bones["wrist"].constraints.new("COPY_ROTATION")
    constraint.target, constraint.subtarget = made.parent, "thumb"


def half_a_limit(bpy: Any, made: Any) -> None:
    constraint = made.parent.pose.bones["elbow"].constraints.new("LIMIT_ROTATION")
    constraint.use_limit_x, constraint.influence, constraint.owner_space = True, 0.5, "LOCAL"


def driven_bone(bpy: Any, made: Any) -> None:
    driver = made.parent.pose.bones["thumb"].driver_add("location", 0).driver
    driver.expression = "0.3"


def uninherited_rotation(bpy: Any, made: Any) -> None:
    made.parent.data.bones["wrist"].use_inherit_rotation = False


def driven_shape(bpy: Any, made: Any) -> None:
    made.shape_key_add(name="Basis")
    bulge = made.shape_key_add(name="Bulge")
    bulge.data[3].co.x += 0.5
    bulge.driver_add("value").driver.expression = "1.0"
    bpy.context.view_layer.update()


BEYOND: dict[Callable[[Any, Any], None], tuple[str, bool]] = {  # the word for it, and whether it shows in the skin
    preserve_volume: ("preserve volume", True),
    bendy_bone: ("B-bone", True),
    subdivided: ("after the armature", True),
    mirrored_first: ("before the armature", False),
    envelopes: ("bone envelopes", True),
    masked: ("influence of vertex group 'elbow'", True),
    copied_rotation: ("copy_rotation", True),
    half_a_limit: ("limit_rotation", True),
    driven_bone: ("driver", False),
    uninherited_rotation: ("does not inherit rotation", True),
    driven_shape: ("Shape keys are animated or driven", False),
}


@pytest.mark.parametrize("change", BEYOND, ids=lambda change: change.__name__)
def test_what_linear_skinning_cannot_do_is_named(bpy: Any, arm: Any, change: Callable[[Any, Any], None]) -> None:
    """It is in the notes, the rig is not called exact, and where it bends the skin the measure shows it."""
    assert arm.read_rig("arm").details["linear skinning is exact"]
    change(bpy, bpy.data.objects["arm"])
    bpy.context.view_layer.update()
    asset = arm.read_rig("arm")
    word, shows = BEYOND[change]
    assert word in " ".join(asset.notes), asset.notes
    assert not asset.details["linear skinning is exact"]
    assert not shows or asset.details["largest difference from Blender"] > 1e-4


def test_reading_a_rig_leaves_the_scene_as_it_was(bpy: Any, arm: Any) -> None:
    """Bit for bit, in a pose, with the comparison that a reading makes."""
    import blender_scenes

    arm.write_pose("arm", bent(arm.read_rig("arm").rig, 3))
    bpy.data.objects["arm"].parent.pose.bones["wrist"].rotation_quaternion = (0.3, 0.4, 0.5, 0.6)  # not unit
    bpy.context.view_layer.update()
    before = blender_scenes.whole_state()
    arm.read_rig("arm")
    assert blender_scenes.whole_state() == before


def test_shape_keys_as_they_stand_are_in_the_surface(bpy: Any, arm: Any) -> None:
    """Relative keys, of a key that is relative to another, and limited by a vertex group."""
    made = bpy.data.objects["arm"]
    made.shape_key_add(name="Basis")
    for name, value in (("Wide", 0.7), ("Tall", -0.4)):
        key = made.shape_key_add(name=name)
        for k, point in enumerate(key.data):
            point.co[0 if name == "Wide" else 1] *= 1.0 + 0.02 * k
        key.slider_min, key.value = -1.0, value
    made.data.shape_keys.key_blocks["Tall"].relative_key = made.data.shape_keys.key_blocks["Wide"]
    made.data.shape_keys.key_blocks["Wide"].vertex_group = "elbow"
    bpy.context.view_layer.update()
    assert arm.read_rig("arm").details["linear skinning is exact"]
    assert worst_difference(arm, "arm") < 1e-5


def test_limits_and_locks_become_freedoms(bpy: Any, arm: Any) -> None:
    """Limit Rotation, IK limits where it is silent, transform locks and IK locks; Blender's Euler order."""
    bones = bpy.data.objects["arm"].parent.pose.bones
    bones["elbow"].rotation_mode = "YZX"
    limit = bones["elbow"].constraints.new("LIMIT_ROTATION")
    limit.owner_space, limit.use_limit_x, limit.min_x, limit.max_x = "LOCAL", True, radians(-10), radians(70)
    bones["elbow"].use_ik_limit_z, bones["elbow"].ik_min_z, bones["elbow"].ik_max_z = True, radians(-20), radians(5)
    bones["wrist"].lock_rotation = (True, False, False)
    bones["thumb"].lock_ik_x = bones["thumb"].lock_ik_y = bones["thumb"].lock_ik_z = True
    rig = arm.read_rig("arm").rig
    shoulder, elbow, wrist, thumb = (
        rig.freedoms[rig.joint_index(n)] for n in ("shoulder", "elbow", "wrist", "thumb")
    )
    assert (shoulder.kind, shoulder.translates) == ("ball", True)
    assert (elbow.kind, elbow.order) == ("euler", "XZY")
    np.testing.assert_allclose(np.degrees(elbow.lower), [-10, -20, -np.inf], atol=1e-4)
    np.testing.assert_allclose(np.degrees(elbow.upper), [70, 5, np.inf], atol=1e-4)
    assert (wrist.kind, wrist.order, wrist.locked.tolist()) == ("euler", "ZYX", [False, False, True])
    assert (thumb.kind, thumb.locked.tolist()) == ("ball", [True] * 3)


@pytest.mark.parametrize("mode", MODES[:-1])
def test_within_the_limits_blender_changes_nothing(bpy: Any, arm: Any, mode: str) -> None:
    """Random poses inside the freedoms that we read pass Blender's limits untouched; outside they do not."""
    armature = bpy.data.objects["arm"].parent
    for bone in armature.pose.bones:
        bone.rotation_mode = mode
        limit = bone.constraints.new("LIMIT_ROTATION")
        limit.owner_space = "LOCAL"
        for axis, low, high in (("x", -0.3, 1.2), ("y", -0.6, 0.1), ("z", -0.2, 0.9)):
            setattr(limit, f"use_limit_{axis}", True)
            setattr(limit, f"min_{axis}", low)
            setattr(limit, f"max_{axis}", high)
    rig = arm.read_rig("arm").rig
    chart, random = Chart(rig), np.random.default_rng(8)
    for seed in range(4):
        inside = random.uniform(np.maximum(chart.lower, -1.0), np.minimum(chart.upper, 1.5))
        for theta, clamped in ((inside, False), (np.where(chart.is_translation, inside, inside + 2.0), True)):
            pose = Pose(rig.joints, chart.local(theta))
            ours = skin(rig, forward_kinematics(rig.parents, pose.local))
            off = np.abs(ours - arm.skin_points("arm", pose)).max()
            assert (off > 1e-2) if clamped else (off < 1e-5), (seed, off)


def test_freedoms_survive_the_way_through_blender(bpy: Any, empty: Any) -> None:
    """Every kind that a rig can have comes back exactly; once the artist sets a lock, the artist's word counts."""
    rig = hand_like(any_freedom)
    key = empty.add(Asset("hand", rig.surface, rig))
    again = empty.read_rig(key).rig
    for joint, freedom in zip(rig.joints, rig.freedoms, strict=True):
        back = again.freedoms[again.joint_index(joint)]
        assert (back.kind, back.order, back.translates) == (freedom.kind, freedom.order, freedom.translates), joint
        for name in ("frame", "lower", "upper", "prior_weight", "locked"):
            np.testing.assert_array_equal(getattr(back, name), getattr(freedom, name), err_msg=f"{joint} {name}")
    armature = bpy.data.objects[key].parent
    armature.pose.bones["finger1_0"].lock_rotation = (True, False, True)
    changed = empty.read_rig(key).rig
    freedom = changed.freedoms[changed.joint_index("finger1_0")]
    assert dict(zip(freedom.order, freedom.locked.tolist(), strict=True)) == {"X": True, "Y": False, "Z": True}


def test_a_rest_pose_apart_from_the_bind_pose_survives(empty: Any) -> None:
    """The surface is the rest pose's skin, although Blender binds at its own rest; poses count from there."""
    made = arm_rig()
    rig = replace(made, rest_local=bent(made, 1).local, freedoms=(JointFreedom(),) * 4)
    key = empty.add(Asset("arm", rig.surface, rig, meters_per_unit=1.0, up_axis="Z"))
    again = empty.read_rig(key).rig
    np.testing.assert_allclose(again.surface.points, rig.surface.points, atol=2e-6)
    np.testing.assert_allclose(again.rest_local, rig.rest_local, atol=2e-6)
    np.testing.assert_allclose(empty.read_pose(key).local, rig.rest_local, atol=2e-6)
    assert worst_difference(empty, key) < 1e-5


def test_what_cannot_be_a_rig_is_refused_in_words(bpy: Any, arm: Any) -> None:
    armature = bpy.data.objects["arm"].parent
    armature.scale = (1.0, 1.0, 2.0)
    with pytest.raises(InvalidInput, match="unevenly"):
        arm.read_rig("arm")
    armature.scale = (1.0, 1.0, 1.0)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(InvalidInput, match="Edit Mode"):
        arm.read_rig("arm")
    bpy.ops.object.mode_set(mode="OBJECT")
    bare = bpy.data.objects.new("bare", bpy.data.armatures.new("bare"))
    bpy.context.scene.collection.objects.link(bare)
    bpy.data.objects["arm"].modifiers["Armature"].object = bare
    for call in (arm.read_rig, arm.read_pose):
        with pytest.raises(InvalidInput, match="bare has no bones"):
            call("arm")
    bpy.data.objects["arm"].modifiers["Armature"].object = armature
    stretched = replace(arm_rig(), bind_world=arm_rig().bind_world @ np.diag([2.0, 2.0, 2.0, 1.0]))
    with pytest.raises(InvalidInput, match="scaled where its skin is bound"):
        arm.add(Asset("bad", stretched.surface, stretched))
    assert [each.name for each in bpy.data.objects if each.name.startswith("bad")] == []


def test_a_linked_rig_is_read_and_its_override_posed(bpy: Any, scenes: Any, arm: Any, tmp_path: Path) -> None:
    """Objects of a library have ids beside local ones of the same name; poses wait for an override, in words."""
    rig = arm.read_rig("arm").rig
    arm.save(tmp_path / "library.blend")
    local = scenes.build(HostScene(SceneSpace(1.0, "Z"), rigs=(SceneRig("arm", arm_rig()),)))
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (there, here):
        here.objects = there.objects
    for linked in here.objects:
        bpy.context.scene.collection.objects.link(linked)
    ids = [item.id for item in local.objects() if item.kind == "rig"]
    assert len(ids) == 2 and "arm" in ids
    linked_id = next(key for key in ids if key != "arm")
    asset = local.read_rig(linked_id)
    assert asset.rig.surface.digest == rig.surface.digest
    with pytest.raises(InvalidInput, match="library override"):
        local.write_pose(linked_id, bent(rig, 1))
    linked_rig = next(each for each in here.objects if each.type == "ARMATURE")
    override = linked_rig.override_hierarchy_create(bpy.context.scene, bpy.context.view_layer)
    assert override is not None
    posed = next(item.id for item in local.objects() if item.kind == "rig" and item.id not in ids)
    local.write_pose(posed, bent(rig, 1))
    assert np.abs(local.read_pose(posed).local - bent(rig, 1).local).max() < 1e-6


def test_a_real_hand_with_weights_far_from_one(bpy: Any, scenes: Any, assets: Path) -> None:
    """Six meshes on one armature, weights summing to 0.88 .. 2.15, up to seven influences: each as in Blender."""
    host = scenes.BlenderHost(assets / "rigs" / "godot_xr_hand_right.blend")
    rigs = [item.id for item in host.objects() if item.kind == "rig"]
    assert len(rigs) == 6
    sums, most = "", 0
    for key in rigs:
        asset = host.read_rig(key)
        sums, most = sums + " ".join(asset.notes), max(most, asset.rig.skin_joints.shape[1])
        assert asset.details["linear skinning is exact"], (key, asset.notes, asset.details)
        assert worst_difference(host, key, 2) < 1e-5
    assert most == 7 and "2.15" in sums and "0.88" in sums


def test_what_skinning_cannot_do_is_solved_through_blender(bpy: Any, arm: Any) -> None:
    """With preserved volume: contacts of a planted pose are met as Blender evaluates them, and better than by our
    skinning; the scene is as it was."""
    import blender_scenes

    from contact_blender.black_box import EvaluatedRig
    from contact_core.solve.body import Body, PairedPoints
    from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
    from contact_core.solve.problem import PoseProblem

    preserve_volume(bpy, bpy.data.objects["arm"])
    black_box = EvaluatedRig(arm, "arm")
    rig, place = black_box.chart.rig, arm.placement("arm")
    planted = Pose(rig.joints, np.concatenate([rig.rest_local[:1], bent(rig, 2).local[1:]]))
    moved = rig.surface.with_points(arm.skin_points("arm", planted) @ place[:3, :3].T + place[:3, 3])
    points = SurfacePoints(np.arange(20, 60), np.full((40, 3), 1 / 3))
    target = TriangleMesh(moved.points, moved.faces[:, ::-1])  # it faces the skin
    contacts = PairedPoints("skin", "arm", points, "target", points, np.full(40, 1 / 40))
    before = blender_scenes.whole_state()
    gaps = []
    for body in (Body.evaluated("arm", black_box), Body.skinned(rig, name="arm", world_from_rig=place)):
        problem = PoseProblem(bodies=(body, Body.rigid("target", target)), contacts=(contacts,), prior="current")
        solved = LevenbergMarquardt().solve(problem, SolveOptions(candidates=("current",))).poses["arm"]
        pose = black_box.pose(solved) if body.black_box is not None else solved
        skinned = rig.surface.with_points(arm.skin_points("arm", pose) @ place[:3, :3].T + place[:3, 3])
        gaps.append(np.linalg.norm(points.positions(skinned) - points.positions(moved), axis=1).mean())
    assert blender_scenes.whole_state() == before
    assert gaps[0] < 0.01 * rig.surface.bounding_box_diagonal and gaps[0] < 0.5 * gaps[1], gaps
