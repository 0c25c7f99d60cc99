"""URDF as tools write it: packages, shared readers, values that nothing uses, macros left in, long chains."""

import zipfile
from pathlib import Path

import numpy as np
import pytest

from contact_builtins.formats.any_mesh import read_any_mesh
from contact_builtins.formats.gltf import GltfFiles
from contact_builtins.formats.scene_meshes import SceneMeshFiles
from contact_builtins.formats.urdf import UrdfFiles
from contact_core.document.asset import Asset
from contact_core.errors import FileRefused
from contact_core.geometry import solids
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.report import report
from contact_core.plugins.reading import read_asset
from contact_core.plugins.slots import Format
from contact_core.testing import meshes
from contact_core.testing.format_contract import FormatContract

BOX = '<visual><geometry><box size="0.2 0.2 0.2"/></geometry></visual>'
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
DAE = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="15">0 0 0  4 0 0  4 4 0  2 1 0  0 4 0</float_array>
<technique_common><accessor source="#pa" count="5" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<polylist count="1"><input semantic="VERTEX" source="#v" offset="0"/><vcount>5</vcount><p>0 1 2 3 4</p></polylist>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><translate>0 0 7</translate><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""
MODEL = """<?xml version="1.0"?>
<model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>
<object id="1" type="model"><mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/>
<vertex x="0" y="1" z="0"/><vertex x="0" y="0" z="1"/></vertices><triangles><triangle v1="0" v2="2" v3="1"/>
<triangle v1="0" v2="1" v3="3"/><triangle v1="1" v2="2" v3="3"/><triangle v1="2" v2="0" v3="3"/></triangles></mesh>
</object><object id="2" type="model"><components>
<component objectid="1"/><component objectid="1" transform="-1 0 0 0 1 0 0 0 1 -5 0 0"/></components></object>
</resources><build><item objectid="2"/></build></model>"""


def mesh_visual(name: str) -> str:
    return f'<link name="a"><visual><geometry><mesh filename="{name}"/></geometry></visual></link>'


def read(path: Path, inside: str, reader: UrdfFiles | None = None) -> Asset:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f'<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">{inside}</robot>')
    return (reader or UrdfFiles()).read(path)


def two(joint: str) -> str:
    """Two links and a joint, of which the opening tag and what else it holds are given."""
    head, _, rest = joint.partition(">")
    ends = '<parent link="p"/><child link="c"/>'
    return f'<link name="p">{BOX}</link><link name="c">{BOX}</link>{head}>{ends}{rest}</joint>'


@pytest.mark.parametrize("kind", ["fixed", "floating", "prismatic"])
@pytest.mark.parametrize("axis", ["0 0 0", "1 0 0"])
def test_the_axis_of_a_joint_that_does_not_turn_is_not_looked_at(tmp_path: Path, kind: str, axis: str) -> None:
    asset = read(tmp_path / "r.urdf", two(f'<joint name="j" type="{kind}"><axis xyz="{axis}"/>'))
    assert asset.rig is not None and asset.rig.freedoms[1].kind == "fixed"


@pytest.mark.parametrize(
    ("limit", "lower", "upper", "noted"),
    [
        ('<limit effort="1" velocity="1"/>', 0.0, 0.0, True),
        ('<limit upper="1.5"/>', 0.0, 1.5, True),
        ('<limit lower="-1.5"/>', -1.5, 0.0, True),
        ('<limit lower="-1" upper="2"/>', -1.0, 2.0, False),
        ("", -np.inf, np.inf, True),
    ],
)
def test_a_limit_that_is_left_out_is_what_the_specification_says(
    tmp_path: Path, limit: str, lower: float, upper: float, noted: bool
) -> None:
    asset = read(tmp_path / "r.urdf", two(f'<joint name="j" type="revolute"><axis xyz="0 0 1"/>{limit}'))
    assert asset.rig is not None
    hinge = asset.rig.freedoms[1]
    assert hinge.kind == "hinge" and (hinge.lower[0], hinge.upper[0]) == (lower, upper)
    assert any("j" in note and "limit" in note for note in asset.notes) == noted


def test_a_continuous_joint_has_no_limits(tmp_path: Path) -> None:
    asset = read(tmp_path / "r.urdf", two('<joint name="j" type="continuous"><limit effort="1" velocity="1"/>'))
    assert asset.rig is not None and np.isinf(asset.rig.freedoms[1].lower[0])
    assert not any("limit" in note for note in asset.notes)


def test_a_mesh_of_the_ros_package_is_found_by_package_xml(tmp_path: Path) -> None:
    package = tmp_path / "folder_of_any_name"
    (package / "meshes").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>my_hand</name></package>")
    (package / "meshes" / "link 1.obj").write_text(OBJ)
    for name in ("package://my_hand/meshes/link 1.obj", "../meshes/link%201.obj", "..\\meshes\\link 1.obj"):
        assert len(read(package / "urdf" / "r.urdf", mesh_visual(name)).mesh.faces) == 4
    for name in ("package://other/meshes/link 1.obj", "package://my_hand/../x.obj", "../../x.obj", "/etc/hostname"):
        (tmp_path / "x.obj").write_text(OBJ)
        with pytest.raises(FileRefused, match="ROS_PACKAGE_PATH"):
            read(package / "urdf" / "r.urdf", mesh_visual(name))


def test_further_packages_are_found_below_a_given_root_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "ws" / "src" / "parts").mkdir(parents=True)
    (tmp_path / "ws" / "src" / "parts" / "package.xml").write_text("<package><name>parts</name></package>")
    (tmp_path / "ws" / "src" / "parts" / "link.obj").write_text(OBJ)
    (tmp_path / "secret.obj").write_text(OBJ)
    path, visual = tmp_path / "elsewhere" / "r.urdf", mesh_visual("package://parts/link.obj")
    with pytest.raises(FileRefused, match="ROS_PACKAGE_PATH"):
        read(path, visual)
    assert len(read(path, visual, UrdfFiles([tmp_path / "ws"])).mesh.faces) == 4
    with pytest.raises(FileRefused, match="outside"):
        read(path, mesh_visual("package://parts/../../../secret.obj"), UrdfFiles([tmp_path / "ws"]))
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "ws" / "src"))
    assert len(read(path, visual).mesh.faces) == 4


def test_a_link_to_outside_is_no_loophole(tmp_path: Path) -> None:
    (tmp_path / "secret.obj").write_text(OBJ)
    (tmp_path / "robot").mkdir()
    try:
        (tmp_path / "robot" / "m.obj").symlink_to(tmp_path / "secret.obj")
    except OSError:
        pytest.skip("no symbolic links here")
    with pytest.raises(FileRefused, match="outside"):
        read(tmp_path / "robot" / "r.urdf", mesh_visual("m.obj"))


@pytest.mark.parametrize("suffix", [".glb", ".dae", ".3mf", ".OBJ", ".stl"])
def test_every_mesh_format_serves_as_a_link(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"m{suffix}"
    if suffix == ".glb":
        GltfFiles().write(path, [Asset("m", meshes.icosphere(1))], {})
    elif suffix == ".stl":
        import trimesh

        trimesh.creation.box().export(path)
    elif suffix == ".3mf":
        with zipfile.ZipFile(path, "w") as package:
            package.writestr("3D/3dmodel.model", MODEL)
    else:
        path.write_text(DAE if suffix == ".dae" else OBJ)
    asset = read(tmp_path / "r.urdf", mesh_visual(path.name))
    alone, _ = read_any_mesh(path)
    assert asset.rig is not None and np.allclose(np.sort(asset.mesh.points, 0), np.sort(alone.points, 0))


def test_collada_keeps_polygons_units_and_axes(tmp_path: Path) -> None:
    pytest.importorskip("collada")
    (tmp_path / "m.dae").write_text(DAE)
    asset = SceneMeshFiles().read(tmp_path / "m.dae")
    assert (asset.meters_per_unit, asset.up_axis) == (0.01, "Z")
    assert np.isclose(asset.mesh.face_areas.sum(), 10.0)  # a fan over the concave face covers 14
    assert np.isclose(asset.mesh.points[:, 2], 7.0).all() and set(asset.source_faces) == {0}
    assert np.allclose(read_any_mesh(tmp_path / "m.dae")[0].points.max(0), [0.04, 0.04, 0.07])


def test_3mf_places_its_components_and_turns_mirrored_ones(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "m.3mf", "w") as package:
        package.writestr("3D/3dmodel.model", MODEL)
    asset = SceneMeshFiles().read(tmp_path / "m.3mf")
    found = report(asset.mesh)
    assert asset.meters_per_unit == 1e-3 and found.components == 2
    assert np.isclose(volume(asset.mesh), 2 / 6) and np.allclose(asset.mesh.points.min(0), [-6, 0, 0])


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("m.dae", b""), ("m.dae", b"<COLLADA"), ("m.dae", b"<a/>"), ("m.dae", b"PK\3\4"), ("m.3mf", b"PK"),
        ("m.dae", b'<!DOCTYPE a [<!ENTITY x "y">]><a>&x;</a>'),
        ("m.dae", DAE.replace("2 3 4</p>", "2 3 9</p>").encode()),
    ],
)  # fmt: skip
def test_damaged_scenes_are_refused_in_a_sentence(tmp_path: Path, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(FileRefused, match=r"is damaged|nothing to touch|is a zip archive"):
        SceneMeshFiles().read(tmp_path / name)


def test_a_3mf_ring_of_components_ends(tmp_path: Path) -> None:
    ring = MODEL.replace('<component objectid="1"/>', '<component objectid="2"/><component objectid="2"/>')
    with zipfile.ZipFile(tmp_path / "m.3mf", "w") as package:
        package.writestr("3D/3dmodel.model", ring)
    with pytest.raises(FileRefused, match="ring"):
        SceneMeshFiles().read(tmp_path / "m.3mf")


@pytest.mark.parametrize(
    ("shape", "volume_of", "height"),
    [
        ('<capsule radius="0.1" length="0.3"/>', np.pi * 0.01 * 0.3 + 4 / 3 * np.pi * 0.001, 0.5),
        ('<cylinder radius="0.1" length="0.3"/>', np.pi * 0.01 * 0.3, 0.3),
        ('<sphere radius="0.1"/>', 4 / 3 * np.pi * 0.001, 0.2),
        ('<box size="0.1 0.2 0.3"/>', 0.006, 0.3),
    ],
)
def test_solids_have_their_size(tmp_path: Path, shape: str, volume_of: float, height: float) -> None:
    asset = read(tmp_path / "r.urdf", f'<link name="a"><visual><geometry>{shape}</geometry></visual></link>')
    assert 0.985 * volume_of < volume(asset.mesh) <= volume_of * (1 + 1e-9)
    assert np.isclose(np.ptp(asset.mesh.points[:, 2]), height) and report(asset.mesh).volume is not None


def volume(mesh: TriangleMesh) -> float:
    """Signed: positive where the surface is turned outwards."""
    return float(np.linalg.det(mesh.points[mesh.faces]).sum() / 6)


@pytest.mark.parametrize(
    "solid",
    [solids.cone(1.0, 2.0), solids.cone(1.0, 2.0, 0.5), solids.capsule(0.5, 0.0), solids.capsule(0.5, 1.0, 0.2)],
)
def test_solids_are_closed_and_turned_outwards(solid: solids.Solid) -> None:
    mesh = TriangleMesh(*solid)
    assert volume(mesh) > 0 and report(mesh).volume is not None and report(mesh).components == 1


@pytest.mark.parametrize(
    ("inside", "words"),
    [
        (f'<link name="a">{BOX}</link><xacro:macro name="m"/>', "expand it with xacro first"),
        (f'<link name="a">{BOX.replace("0.2 0.2", "${w} 0.2")}</link>', "expand it with xacro first"),
        (f'<link name="$(arg prefix)a">{BOX}</link>', "expand it with xacro first"),
        (f'<link name="a">{BOX.replace("0.2 0.2", "wide 0.2")}</link>', "3 numbers must stand"),
        (two('<joint name="j" type="revolute"><limit lower="-1,5" upper="1,5"/>'), "-1,5"),
        (two('<joint name="j" type="fixed"><origin xyz="0 0"/>'), "3 numbers must stand"),
        (f'<link name="a">{BOX}</link>' * 2, "two links named 'a'"),
        (two('<joint name="j" type="fixed">').replace('child link="c"', 'child link="d"'), "'d', which is not"),
        (mesh_visual("https://host/m.obj"), "no addresses"),
    ],
)
def test_what_cannot_be_read_is_said_in_words(tmp_path: Path, inside: str, words: str) -> None:
    with pytest.raises(FileRefused, match=words):
        read(tmp_path / "r.urdf", inside)


HULL = BOX.replace("visual", "collision").replace("0.2 0.2 0.2", "0.4 0.4 0.4")


def test_links_with_collision_shapes_only_are_read_and_that_is_said(tmp_path: Path) -> None:
    joint = '<joint name="j" type="fixed"><parent link="p"/><child link="c"/><origin xyz="2 0 0"/></joint>'
    asset = read(tmp_path / "r.urdf", f'<link name="p">{HULL}</link><link name="c">{HULL}</link>{joint}')
    assert len(asset.mesh.faces) == 24 and any("<collision>" in note for note in asset.notes)
    asset = read(tmp_path / "s.urdf", f'<link name="p">{BOX}</link><link name="c">{HULL}</link>{joint}')
    assert len(asset.mesh.faces) == 12 and any("left out: c." in note for note in asset.notes)


def test_a_damaged_collision_shape_costs_nothing(tmp_path: Path) -> None:
    asset = read(tmp_path / "r.urdf", f'<link name="p">{BOX}{HULL.replace("0.4 0.4", "x")}</link>')
    assert len(asset.mesh.faces) == 12 and not asset.notes


@pytest.mark.parametrize(("name", "data"), [("gone.obj", ""), ("../out.obj", OBJ), ("bad.obj", "f 1 2 3\n")])
def test_one_missing_mesh_is_named_and_the_rest_is_read(tmp_path: Path, name: str, data: str) -> None:
    (tmp_path / "r").mkdir()
    if data:
        (tmp_path / "r" / name).write_text(data)
    joint = '<joint name="j" type="fixed"><parent link="p"/><child link="a"/></joint>'
    lost = mesh_visual(name)
    asset = read(tmp_path / "r" / "r.urdf", f'<link name="p">{BOX}</link>{lost}{joint}')
    assert len(asset.mesh.faces) == 12 and asset.rig is not None and "j" in asset.rig.joints
    assert sum(f"{name} of a" in note for note in asset.notes) == 1
    asset = read(
        tmp_path / "r" / "r.urdf", f'<link name="p">{BOX}</link>{joint}{lost}'.replace("</link>", f"{HULL}</link>")
    )
    assert len(asset.mesh.faces) == 24 and any("<collision> shapes of a" in note for note in asset.notes)
    with pytest.raises(FileRefused, match=name):
        read(tmp_path / "r" / "r.urdf", lost)


@pytest.mark.parametrize("space", ["http://www.ros.org", "https://drake.mit.edu"])
def test_a_default_namespace_is_read_over(tmp_path: Path, space: str) -> None:
    text = two('<joint name="j" type="revolute"><axis xyz="0 0 1"/><limit lower="-1" upper="1"/>')
    (tmp_path / "r.urdf").write_text(f'<robot name="r" xmlns="{space}">{text}</robot>')
    rig = UrdfFiles().read(tmp_path / "r.urdf").rig
    assert rig is not None and rig.freedoms[1].kind == "hinge" and len(rig.surface.faces) == 24


@pytest.mark.parametrize(("limit", "noted"), [(90.0, True), (6.2832, False), (1.57, False), (180.0, True)])
def test_limits_that_look_like_degrees_are_noted(tmp_path: Path, limit: float, noted: bool) -> None:
    joint = f'<joint name="j" type="revolute"><limit lower="-{limit}" upper="{limit}"/>'
    assert any("degrees" in note for note in read(tmp_path / "r.urdf", two(joint)).notes) is noted


@pytest.mark.parametrize(
    ("joint", "kind", "noted"),
    [
        ('type="revolute"><axis xyz="0 0 0"/><limit lower="-1" upper="1"/>', "fixed", "no length"),
        ('type="Revolute"><axis xyz="0 0 1"/><limit lower="-1" upper="1"/>', "hinge", ""),
        ('type="ball">', "fixed", "held still"),
        ('type="revolute"><limit lower="1" upper="-1"/>', "hinge", "exchanged"),
        ('type="revolute"><limit lower="nan" upper="1"/>', "hinge", "no number"),
        ('type="revolute"><limit lower="-inf" upper="inf"/>', "hinge", ""),
        ('type="revolute"><axis xyz="0, 0, 1"/><limit lower="-1" upper="1"/>', "hinge", ""),
        ('type="revolute"><axis xyz=""/><origin xyz="" rpy=" "/><limit lower="-1" upper="1"/>', "hinge", ""),
        ('type="revolute"><limit lower="-1" upper="1"/><mimic joint="ghost"/>', "hinge", "mimic"),
    ],
)
def test_one_odd_value_of_a_joint_spoils_no_robot(tmp_path: Path, joint: str, kind: str, noted: str) -> None:
    asset = read(tmp_path / "r.urdf", two(f'<joint name="j" {joint}'))
    assert asset.rig is not None and asset.rig.freedoms[1].kind == kind and len(asset.mesh.faces) == 24
    assert bool(asset.notes) == bool(noted) and noted in " ".join(asset.notes)


@pytest.mark.parametrize(
    "geometry",
    ['<sphere radius="-1"/>', "<mesh/>", '<mesh filename="a.obj" scale="0 0 0"/>', '<box size="1 a 1"/>'],
)
def test_one_odd_shape_is_named_and_spoils_no_robot(tmp_path: Path, geometry: str) -> None:
    odd = f"<visual><geometry>{geometry}</geometry></visual>"
    asset = read(tmp_path / "r.urdf", f'<link name="a">{odd}{BOX}</link>')
    assert len(asset.mesh.faces) == 12 and any("link 'a'" in note for note in asset.notes)
    with pytest.raises(FileRefused, match="link 'a'"):
        read(tmp_path / "s.urdf", f'<link name="a">{odd}</link>')


def test_the_largest_of_several_trees_is_the_robot(tmp_path: Path) -> None:
    arm = two('<joint name="j" type="fixed">')
    asset = read(tmp_path / "r.urdf", f'<link name="alone">{BOX}</link>{arm}<link name="also"/>')
    assert asset.rig is not None and asset.rig.joints == ("p", "j") and len(asset.mesh.faces) == 24
    assert any("alone, also" in note for note in asset.notes)
    ring = arm.replace('name="p"', 'name="q"').replace('"c"', '"d"').replace('"j"', '"k"').replace('"p"', '"d"')
    with pytest.raises(FileRefused, match="ring"):
        read(tmp_path / "s.urdf", arm + ring)


def test_what_stands_before_the_declaration_is_passed_over(tmp_path: Path) -> None:
    (tmp_path / "r.urdf").write_text(f'\n  <?xml version="1.0"?><robot><link name="a">{BOX}</link></robot>')
    assert len(UrdfFiles().read(tmp_path / "r.urdf").mesh.faces) == 12


@pytest.mark.parametrize(
    "name", ["meshes/a.obj", "Meshes/A.obj", "package://ARM/meshes/A.OBJ", "package://arm/meshes/a.obj"]
)
def test_names_of_meshes_count_in_either_case_where_one_file_is_meant(tmp_path: Path, name: str) -> None:
    meshes_ = tmp_path / "arm" / "meshes"
    meshes_.mkdir(parents=True)
    (meshes_ / "A.OBJ").write_text(OBJ)
    where = tmp_path / "arm" / ("urdf" if name.startswith("package://arm") else "")
    assert len(read(where / "r.urdf", mesh_visual(name)).mesh.faces) == 4
    (meshes_ / "a.Obj").write_text(OBJ)  # another: now either may be meant
    if name.endswith("a.obj"):
        with pytest.raises(FileRefused, match="no such file"):
            read(where / "r.urdf", mesh_visual(name))


def test_a_link_out_of_the_folder_is_not_followed_in_another_case(tmp_path: Path) -> None:
    (tmp_path / "r").mkdir()
    (tmp_path / "secret.obj").write_text(OBJ)
    (tmp_path / "r" / "A.obj").symlink_to(tmp_path / "secret.obj")
    with pytest.raises(FileRefused, match=r"a\.obj"):
        read(tmp_path / "r" / "r.urdf", mesh_visual("a.obj"))


@pytest.mark.parametrize("name", ["m.obj", "m.stl", "m.glb", "r.urdf", "m.3mf", "m.ply", "m.dae"])
def test_a_pointer_of_git_lfs_is_called_that(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n")
    with pytest.raises(FileRefused, match="git lfs pull"):
        read_asset(tmp_path / name)


def chain(count: int) -> str:
    links = "".join(f'<link name="l{k}">{BOX}</link>' for k in range(count + 1))
    joints = "".join(
        f'<joint name="j{k}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/><axis xyz="0 0 1"/>'
        '<origin xyz="0 0 0.3"/><limit lower="-1" upper="1"/></joint>'
        for k in reversed(range(count))  # the tip first: the order that costs a search per joint its square
    )
    return links + joints


def test_a_long_chain_is_read_and_a_longer_one_refused(tmp_path: Path) -> None:
    rig = read(tmp_path / "r.urdf", chain(1500)).rig
    assert rig is not None and rig.joints[:3] == ("l0", "j0", "j1") and len(rig.joints) == 1501
    assert np.isclose(rig.rest_world[-1, 2, 3], 450.0)
    with pytest.raises(FileRefused, match="5000 joints; 0 to 4096 are read"):
        read(tmp_path / "r.urdf", chain(5000))


def test_hulls_of_a_collada_scene_are_named_and_no_surface(tmp_path: Path) -> None:
    pytest.importorskip("collada")
    body, hull = (
        DAE[DAE.index("<geometry") : DAE.index("</library_geometries>")].replace(
            'id="g"', f'id="{name}" name="{name}"'
        )
        for name in ("g", "UCX_g")
    )
    text = DAE.replace(body.replace(' name="g"', ""), body + hull.replace('"p', '"q').replace('"#p', '"#q'))
    node = '<node><instance_geometry url="#UCX_g"/></node></visual_scene>'
    (tmp_path / "m.dae").write_text(text.replace('"v"', '"v"').replace("</visual_scene>", node))
    asset = SceneMeshFiles().read(tmp_path / "m.dae")
    assert len(asset.mesh.points) == 5 and any("UCX_g" in note for note in asset.notes)


NODE = '<node><translate>0 0 7</translate><instance_geometry url="#g"/></node>'
PAINTED = (
    '<instance_geometry url="#g"><bind_material><technique_common><instance_material symbol="a" target="#gone"/>'
    "</technique_common></bind_material></instance_geometry>"
)


@pytest.mark.parametrize(
    ("old", "new", "height", "unit", "noted"),
    [
        ('<instance_geometry url="#g"/>', PAINTED, 7.0, 0.01, ""),
        (NODE, "", 0.0, 0.01, "shows none of its shapes"),
        (NODE, NODE + '<node><instance_geometry url="#gone"/></node>', 7.0, 0.01, "gone"),
        (NODE, NODE + NODE.replace("<node>", '<node name="UCX_a">').replace("7", "9"), 7.0, 0.01, "UCX_a"),
        ('meter="0.01"', 'meter="0,01"', 7.0, 0.01, ""),
        ('meter="0.01"', 'meter="a"', 7.0, 1.0, "is no length"),
    ],
)
def test_collada_as_tools_write_it(
    tmp_path: Path, old: str, new: str, height: float, unit: float, noted: str
) -> None:
    pytest.importorskip("collada")
    (tmp_path / "m.dae").write_text(DAE.replace(old, new))
    asset = SceneMeshFiles().read(tmp_path / "m.dae")
    assert len(asset.mesh.points) == 5 and np.allclose(asset.mesh.points[:, 2], height)
    assert asset.meters_per_unit == unit
    assert bool(asset.notes) == bool(noted) and noted in " ".join(asset.notes)


class TestSceneMeshes(FormatContract):
    cannot = {"writing": "a .glb is what is written", "rigs": "rigs come by glTF or USD"}

    @pytest.fixture
    def file_format(self) -> Format:
        return SceneMeshFiles()

    @pytest.fixture
    def example(self, tmp_path: Path) -> Path:
        with zipfile.ZipFile(tmp_path / "m.3mf", "w") as package:
            package.writestr("3D/3dmodel.model", MODEL)
        return tmp_path / "m.3mf"
