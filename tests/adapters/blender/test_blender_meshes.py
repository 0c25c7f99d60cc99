"""Meshes come out of Blender as Blender has them, in any mode, under any parents; reading leaves no trace."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from contact_core.errors import InvalidInput
from contact_core.scene.host import SceneSpace
from contact_core.testing.host_scenes import HostScene, affine, contract_scene, octahedron, step_prism

STILL = {  # modifiers that add or remove vertices and leave the others where they are
    "MIRROR": {"use_axis": (False, False, True)},
    "ARRAY": {"count": 3},
    "SOLIDIFY": {"offset": -1.0},
    "TRIANGULATE": {},
    "DECIMATE": {"decimate_type": "DISSOLVE"},
    "BEVEL": {"width": 0.05},
    "SUBSURF": {"subdivision_type": "SIMPLE"},
}


@pytest.fixture
def step(scenes: Any) -> Any:
    """A host with a step of n-gons, on its own."""
    return scenes.build(HostScene(SceneSpace(1.0, "Z"), (contract_scene(SceneSpace(1.0, "Z")).meshes[1],)))


def test_surface_and_placement_make_blenders_own_world(bpy: Any, scenes: Any, empty: Any) -> None:
    """Under parents that turn, scale, shear and mirror, our points in the world are Blender's."""
    from mathutils import Matrix

    random = np.random.default_rng(5)
    above = None
    for depth in range(6):
        made = scenes.mesh_object(f"part{depth}", *octahedron())
        scale = random.uniform(0.5, 2.0, 3) * random.choice([-1.0, 1.0], 3)
        made.parent = above
        made.matrix_basis = Matrix(affine(random.uniform(-3, 3, 3), scale, random.normal(size=3)).tolist())
        above = made
    bpy.context.view_layer.update()
    for item in empty.objects():
        asset, place = empty.read_surface(item.id), empty.placement(item.id)
        theirs = np.array([tuple(above.matrix_world @ v.co)
                           for above in (bpy.data.objects[item.id],) for v in above.data.vertices])  # fmt: skip
        ours = asset.mesh.points[asset.source_vertices] @ place[:3, :3].T + place[:3, 3]
        assert np.abs(ours - theirs).max() < 1e-5 * np.ptp(theirs)


@pytest.mark.parametrize("editing", [False, True], ids=["object mode", "edit mode"])
@pytest.mark.parametrize("kind", STILL)
def test_original_vertices_are_found_behind_modifiers(bpy: Any, step: Any, kind: str, editing: bool) -> None:
    """Each of the mesh's own vertices that is still there is found at its place, and the mesh is left as it was."""
    modifier = bpy.data.objects["step"].modifiers.new(kind, kind)
    for name, value in STILL[kind].items():
        setattr(modifier, name, value)
    if editing:
        bpy.context.view_layer.objects.active = bpy.data.objects["step"]
        bpy.ops.object.mode_set(mode="EDIT")
    import blender_scenes

    before = blender_scenes.whole_state()
    asset = step.read_surface("step")
    assert blender_scenes.whole_state() == before
    originals = step_prism()[0]
    found = asset.source_vertices >= 0
    assert len(asset.source_vertices) == len(originals)
    np.testing.assert_allclose(asset.mesh.points[asset.source_vertices[found]], originals[found], atol=1e-6)
    if kind == "BEVEL":
        assert not found.any()  # a bevel replaces every corner
    elif kind == "DECIMATE":
        assert found.all()
    else:
        assert found.all() and (kind == "TRIANGULATE" or len(asset.mesh.points) > len(originals))


def test_edit_mode_shows_the_edits_so_far(bpy: Any, step: Any) -> None:
    """In Edit Mode the surface is what is being edited, not the mesh as it was at the start of the edit."""
    import bmesh

    made = bpy.data.objects["step"]
    bpy.context.view_layer.objects.active = made
    bpy.ops.object.mode_set(mode="EDIT")
    edited = bmesh.from_edit_mesh(made.data)
    edited.verts.ensure_lookup_table()
    edited.verts[7].co.x = 9.0
    for vertex in edited.verts:
        vertex.select = vertex.index in (7, 2)
    bmesh.update_edit_mesh(made.data)
    during = step.read_surface("step").mesh
    assert during.points[:, 0].max() == 9.0
    chosen = step.selected_points("step", "selection").positions(during)
    np.testing.assert_allclose(sorted(chosen.tolist()), sorted(during.points[[2, 7]].tolist()), atol=1e-6)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert step.read_surface("step").mesh.digest == during.digest


def test_selections_by_group_attribute_and_hand(bpy: Any, step: Any) -> None:
    """Groups, boolean attributes of points and faces, and the live selection are listed and give their vertices."""
    mesh = bpy.data.objects["step"].data
    mesh.attributes.new("rim", "BOOLEAN", "POINT").data.foreach_set("value", [k in (3, 5) for k in range(12)])
    mesh.attributes.new("top", "BOOLEAN", "FACE").data.foreach_set("value", [k == 1 for k in range(8)])
    mesh.vertices.foreach_set("select", [k == 4 for k in range(12)])
    assert step.selections("step") == ("selection", "grip", "rim", "top")
    asset = step.read_surface("step")
    for name, vertices in (("selection", [4]), ("grip", [1, 4, 7]), ("rim", [3, 5]), ("top", [*range(6, 12)])):
        points = step.selected_points("step", name).positions(asset.mesh)
        wanted = asset.mesh.points[vertices]
        np.testing.assert_allclose(points[np.lexsort(points.T)], wanted[np.lexsort(wanted.T)], atol=1e-9)


def test_a_selection_behind_modifiers_lies_on_the_evaluated_surface(bpy: Any, step: Any) -> None:
    bpy.data.objects["step"].modifiers.new("Mirror", "MIRROR").use_axis = (False, True, False)
    bpy.data.objects["step"].modifiers["Mirror"].use_mirror_merge = False
    asset = step.read_surface("step")
    points = step.selected_points("step", "grip").positions(asset.mesh)
    wanted = step_prism()[0][[1, 4, 7]]
    np.testing.assert_allclose(points[np.lexsort(points.T)], wanted[np.lexsort(wanted.T)], atol=1e-6)


def test_moving_keeps_the_digest_and_scaling_changes_it(bpy: Any, step: Any) -> None:
    """For twenty places and turns of an object that is scaled unevenly under a turned parent."""
    made, above = bpy.data.objects["step"], bpy.data.objects.new("above", None)
    bpy.context.scene.collection.objects.link(above)
    made.parent, made.scale = above, (2.0, 0.5, 1.25)
    random = np.random.default_rng(2)
    digests = set()
    for _ in range(20):
        above.location, above.rotation_euler = random.normal(size=3), random.uniform(-3, 3, 3)
        digests.add(step.read_surface("step").mesh.digest)
    assert len(digests) == 1
    above.scale = (1.5, 1.5, 1.5)
    assert step.read_surface("step").mesh.digest not in digests


def test_what_is_no_mesh_is_refused_in_words(bpy: Any, step: Any) -> None:
    lamp = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "POINT"))
    bpy.context.scene.collection.objects.link(lamp)
    with pytest.raises(InvalidInput, match="contacts lie on meshes"):
        step.read_surface("lamp")
    bpy.data.objects["step"].scale.z = 0.0
    with pytest.raises(InvalidInput, match="flat"):
        step.read_surface("step")


def test_what_blender_does_not_evaluate_is_refused_in_words(bpy: Any, step: Any) -> None:
    """Disabled in viewports, or in an excluded collection: its modifiers and its place would be those of before."""
    made = bpy.data.objects["step"]
    made.modifiers.new("Row", "ARRAY")
    made.hide_viewport = True
    for call in (step.read_surface, step.placement):
        with pytest.raises(InvalidInput, match="disabled in viewports"):
            call("step")
    made.hide_viewport = False
    assert len(step.read_surface("step").mesh.points) > 12
    made.hide_set(True)  # the eye alone hides it from view, not from evaluation
    assert len(step.read_surface("step").mesh.points) > 12
