"""glTF as tools write it: odd values, what a viewer shows, mirrors."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_builtins.formats.gltf import GltfFiles
from contact_builtins.formats.gltf_container import open_gltf
from contact_builtins.formats.gltf_nodes import read_nodes
from contact_builtins.formats.gltf_writer import node_transforms
from contact_core.document.asset import Asset
from contact_core.errors import FileRefused
from contact_core.geometry.mesh import TriangleMesh
from contact_core.rig.rig import Pose, Rig, forward_kinematics, skin
from contact_core.testing import meshes
from contact_core.testing.format_contract import bar, bent, corners

CASES = Path(__file__).parents[1] / "data" / "cases"


def read(path: Path) -> Asset:
    return GltfFiles().read(path)


def parts_of(path: Path) -> tuple[dict[str, Any], bytes]:
    """The JSON and the binary chunk of a GLB, independent of the reader."""
    data = path.read_bytes()
    size = struct.unpack("<I", data[12:16])[0]
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def save(path: Path, document: dict[str, Any], binary: bytes) -> Path:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    document["buffers"][0]["byteLength"] = len(binary)
    head = struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(binary), len(text), 0x4E4F534A)
    path.write_bytes(head + text + struct.pack("<II", len(binary), 0x004E4942) + binary)
    return path


def changed(tmp_path: Path, case: str, **change: Any) -> Path:
    document, binary = parts_of(CASES / case)
    return save(tmp_path / "changed.glb", document | change, binary)


def volume(mesh: TriangleMesh) -> float:
    """Signed: positive where the surface is turned outwards."""
    return float(np.linalg.det(mesh.points[mesh.faces]).sum() / 6)


def rig_of(path: Path) -> Rig:
    rig = read(path).rig
    assert rig is not None
    return rig


# What is shown


@pytest.mark.parametrize(
    ("case", "name"), [("e02_hidden_node.glb", "hidden_lod"), ("e03_ucx_collision.glb", "UCX_mug_collision")]
)
def test_hidden_meshes_and_hulls_are_named_and_no_surface(case: str, name: str) -> None:
    asset = read(CASES / case)
    assert len(asset.mesh.points) == 110 and len(asset.mesh.faces) == 216
    assert [name in note for note in asset.notes] == [True]


@pytest.mark.parametrize("name", ["UCX_mug_00", "ubx_mug", "USP_a", "UCP_a", "mug-colonly", "mug-convcolonly"])
def test_all_names_of_hulls_are_known(tmp_path: Path, name: str) -> None:
    nodes = [{"mesh": 0, "name": "mug"}, {"mesh": 0, "name": name, "translation": [3, 0, 0]}]
    asset = read(changed(tmp_path, "e03_ucx_collision.glb", nodes=nodes))
    assert len(asset.mesh.points) == 110 and any(name in note for note in asset.notes)


def test_a_file_of_hulls_alone_is_read(tmp_path: Path) -> None:
    nodes, scenes = [{"mesh": 0, "name": "UCX_mug"}], [{"nodes": [0]}]
    asset = read(changed(tmp_path, "e03_ucx_collision.glb", nodes=nodes, scenes=scenes))
    assert len(asset.mesh.points) == 110 and any("UCX_mug" in note for note in asset.notes)


@pytest.mark.parametrize("name", ["mug_LOD1", "mug_LOD2", "mugCollider", "mug_collision", "Navmesh"])
def test_coarser_copies_and_colliders_are_named_and_no_surface(tmp_path: Path, name: str) -> None:
    nodes = [{"mesh": 0, "name": "mug"}, {"mesh": 0, "name": name, "translation": [3, 0, 0]}]
    asset = read(changed(tmp_path, "e03_ucx_collision.glb", nodes=nodes, scenes=[{"nodes": [0, 1]}]))
    assert len(asset.mesh.points) == 110 and any(name in note for note in asset.notes)
    nodes[0]["name"] = "Vase_LOD0"  # of another mesh, so a LOD1 is the finest of its own
    asset = read(changed(tmp_path, "e03_ucx_collision.glb", nodes=nodes, scenes=[{"nodes": [0, 1]}]))
    assert len(asset.mesh.points) == (220 if "LOD" in name else 110)


def test_a_group_of_hulls_is_left_out(tmp_path: Path) -> None:
    nodes = [{"mesh": 0}, {"name": "Colliders", "children": [2]}, {"mesh": 0, "translation": [3, 0, 0]}]
    asset = read(changed(tmp_path, "e03_ucx_collision.glb", nodes=nodes, scenes=[{"nodes": [0, 1]}]))
    assert len(asset.mesh.points) == 110


def test_visibility_holds_for_what_is_below(tmp_path: Path) -> None:
    off = {"KHR_node_visibility": {"visible": False}}
    nodes = [
        {"mesh": 0},
        {"extensions": off, "children": [2]},
        {"mesh": 0, "name": "below", "translation": [5, 0, 0]},
    ]
    asset = read(changed(tmp_path, "e02_hidden_node.glb", nodes=nodes))
    assert len(asset.mesh.points) == 110 and "below" in asset.notes[0]
    nodes = [{"extensions": off, "children": [1]}, {"mesh": 0, "name": "below"}]
    with pytest.raises(FileRefused, match="shows no triangles: hidden are below"):
        read(changed(tmp_path, "e02_hidden_node.glb", nodes=nodes, scenes=[{"nodes": [0]}]))


def test_a_node_scaled_to_nothing_is_hidden(tmp_path: Path) -> None:
    nodes = [{"mesh": 0}, {"mesh": 0, "name": "off", "scale": [0, 0, 0]}]
    asset = read(changed(tmp_path, "e03_ucx_collision.glb", nodes=nodes))
    assert len(asset.mesh.points) == 110 and "off" in asset.notes[0]


@pytest.mark.parametrize("where", ["mesh", "node", "nowhere"])
def test_morph_targets_stand_at_their_default_weights(tmp_path: Path, where: str) -> None:
    document, binary = parts_of(CASES / "e04_morph_default_on.glb")
    document["meshes"][0].pop("weights")
    base = read(save(tmp_path / "base.glb", document, binary)).mesh.points
    moves = open_gltf(CASES / "e04_morph_default_on.glb").accessor(2)
    if where == "mesh":
        document["meshes"][0]["weights"] = [0.5]
    elif where == "node":
        document["meshes"][0]["weights"] = [1.0]
        document["nodes"][0]["weights"] = [0.5]  # the node's own come first
    asset = read(save(tmp_path / "m.glb", document, binary))
    assert np.allclose(asset.mesh.points, base + (0.0 if where == "nowhere" else 0.5) * moves)
    assert any("Morph targets" in note for note in asset.notes) and np.abs(moves).max() > 0.01


def test_morph_targets_move_skins_before_they_are_posed() -> None:
    asset, plain = read(CASES / "g36_morph_default_weight.glb"), read(CASES / "g18_req_VRM.glb")
    moves = open_gltf(CASES / "g36_morph_default_weight.glb").accessor(5)
    assert np.allclose(asset.mesh.points - plain.mesh.points, moves, atol=1e-6) and np.abs(moves).max() > 0.01


# One odd value


@pytest.mark.parametrize(
    ("case", "words"),
    [
        ("g07_one_zero_weight_vertex.glb", "1 vertices had no weight"),
        ("g08_tiny_negative_weight.glb", "weights below zero"),
        ("g12_joint_twice.glb", ""),
        ("g18_req_FB_ngon_encoding.glb", ""),
        ("g18_req_KHR_animation_pointer.glb", ""),
        ("g18_req_KHR_node_visibility.glb", ""),
        ("g18_req_VRM.glb", ""),
    ],
)
def test_one_odd_value_leaves_the_rig_whole(case: str, words: str) -> None:
    asset = read(CASES / case)
    assert asset.rig is not None and asset.rig.joints == ("root", "index_proximal", "index_distal")
    assert len(asset.mesh.points) == 110 and volume(asset.mesh) > 0
    assert any(words in note for note in asset.notes) if words else not asset.notes
    plain = read(CASES / "g18_req_VRM.glb").rig
    assert plain is not None
    moved = skin(asset.rig, forward_kinematics(asset.rig.parents, bent_finger(asset.rig)))
    wanted = skin(plain, forward_kinematics(plain.parents, bent_finger(plain)))
    assert np.count_nonzero(np.abs(moved - wanted).max(axis=1) > 1e-6) <= 1  # the odd vertex, if any


def bent_finger(rig: Rig) -> np.ndarray:
    local = np.array(rig.rest_local)
    c, s = np.cos(0.6), np.sin(0.6)
    local[1, :3, :3] = local[1, :3, :3] @ [[c, -s, 0], [s, c, 0], [0, 0, 1]]
    return local


@pytest.mark.parametrize("scale", [[1, 1, 1], [-1, 1, 1], [0.01, 0.01, 0.01]])
@pytest.mark.parametrize("value", [0.0, np.nan, np.inf])
def test_a_damaged_bind_matrix_of_a_joint_that_moves_nothing_costs_nothing(
    tmp_path: Path, value: float, scale: list[float]
) -> None:
    document, binary = parts_of(CASES / "g18_req_VRM.glb")
    joints = document["skins"][0]["joints"]
    document["nodes"].append({"name": "tip", "translation": [0, 0.2, 0]})
    document["nodes"][joints[-1]].setdefault("children", []).append(len(document["nodes"]) - 1)
    document["nodes"].append({"name": "above", "scale": scale, "children": document["scenes"][0]["nodes"]})
    document["scenes"][0]["nodes"] = [len(document["nodes"]) - 1]
    accessor = document["accessors"][document["skins"][0]["inverseBindMatrices"]]
    start = document["bufferViews"][accessor["bufferView"]].get("byteOffset", 0) + accessor.get("byteOffset", 0)
    known = binary[start : start + 64 * len(joints)]
    plain = rig_of(save(tmp_path / "plain.glb", document, binary))

    document["skins"][0]["joints"] = [*joints, len(document["nodes"]) - 2]
    binary += b"\0" * (-len(binary) % 4)
    view = {"buffer": 0, "byteOffset": len(binary), "byteLength": 64 * (len(joints) + 1)}
    document["bufferViews"].append(view)
    document["accessors"].append(
        accessor | {"bufferView": len(document["bufferViews"]) - 1, "count": len(joints) + 1, "byteOffset": 0}
    )
    document["skins"][0]["inverseBindMatrices"] = len(document["accessors"]) - 1
    damaged = np.full(16, value, "<f4").tobytes()
    asset = read(save(tmp_path / "damaged.glb", document, binary + known + damaged))
    assert asset.rig is not None and asset.rig.joints == (*plain.joints, "tip")
    assert sum("Damaged bind matrices" in note and "tip" in note for note in asset.notes) == 1
    assert np.allclose(asset.mesh.points, plain.surface.points) and volume(asset.mesh) > 0
    carried = np.linalg.solve(asset.rig.bind_world[-2], asset.rig.bind_world[-1])
    assert np.allclose(carried, np.linalg.solve(asset.rig.rest_world[-2], asset.rig.rest_world[-1]), atol=1e-6)


def test_a_damaged_bind_matrix_of_a_joint_that_moves_skin_is_refused(tmp_path: Path) -> None:
    document, binary = parts_of(CASES / "g18_req_VRM.glb")
    accessor = document["accessors"][document["skins"][0]["inverseBindMatrices"]]
    start = document["bufferViews"][accessor["bufferView"]].get("byteOffset", 0) + accessor.get("byteOffset", 0)
    for joint in range(len(document["skins"][0]["joints"])):
        spoilt = binary[: start + 64 * joint] + b"\0" * 64 + binary[start + 64 * (joint + 1) :]
        with pytest.raises(FileRefused, match="bind matrix is singular"):
            read(save(tmp_path / "spoilt.glb", document, spoilt))


@pytest.mark.parametrize("name", ["KHR_materials_unlit", "VRMC_vrm", "KHR_xmp_json_ld", "EXT_mesh_features"])
def test_required_extensions_that_change_no_shape_are_read(tmp_path: Path, name: str) -> None:
    assert read(changed(tmp_path, "g18_req_VRM.glb", extensionsRequired=[name])).rig is not None


def test_skins_bound_in_other_poses_are_both_shown_and_posed_as_viewers_do(tmp_path: Path) -> None:
    path = CASES / "g23_two_skins_bound_in_other_pose.glb"
    rig = rig_of(path)
    assert len(rig.joints) > 3 and [f.kind for f in rig.freedoms[3:]] == ["fixed"] * len(rig.joints[3:])
    gltf = open_gltf(path)
    for local in (None, bent_finger(rig)):
        world = read_nodes(gltf).world[[0, 1, 2]] if local is None else forward_kinematics(rig.parents, local)[:3]
        wanted = []
        for mesh, entry in zip(gltf.entries("meshes"), gltf.entries("skins"), strict=True):
            attributes = mesh["primitives"][0]["attributes"]
            inverse = gltf.accessor(entry["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
            points = np.c_[gltf.accessor(attributes["POSITION"]), np.ones(110)]
            moves = world @ inverse
            each = np.einsum("nkij,nj->nki", moves[gltf.accessor(attributes["JOINTS_0"])], points)
            wanted.append((gltf.accessor(attributes["WEIGHTS_0"])[..., None] * each).sum(1)[:, :3])
        got = skin(rig, rig.rest_world if local is None else forward_kinematics(rig.parents, local))
        assert np.allclose(np.sort(got, 0), np.sort(np.concatenate(wanted), 0), atol=1e-5)
    GltfFiles().write(tmp_path / "back.glb", [read(path)], {})
    assert np.allclose(
        np.sort(read(tmp_path / "back.glb").mesh.points, 0), np.sort(rig.surface.points, 0), atol=1e-5
    )


def test_a_primitive_without_positions_and_a_rotation_of_no_length_are_passed_over() -> None:
    for case, words in (
        ("e14_primitive_without_position.glb", "without positions"),
        ("e16_zero_quaternion.glb", "zero"),
    ):
        asset = read(CASES / case)
        assert len(asset.mesh.points) == 110 and any(words in note for note in asset.notes)


def test_schemes_and_media_types_in_capitals(tmp_path: Path) -> None:
    wanted = read(CASES / "e11_upper_mime.gltf").mesh
    assert len(wanted.points) == 110
    text = (CASES / "e11_upper_mime.gltf").read_text()
    (tmp_path / "m.gltf").write_text(text.replace("DATA:application/octet-stream;base64", "Data:;BASE64"))
    assert np.array_equal(read(tmp_path / "m.gltf").mesh.points, wanted.points)


# Mirrors


def baked(path: Path, target: Path) -> Path:
    """The mirrored hand with its mirror in the data: points, bind matrices and nodes mirrored, no node scaled."""
    document, binary = parts_of(path)
    gltf, data = open_gltf(path), bytearray(binary)
    mirror = np.diag([-1.0, 1.0, 1.0, 1.0])
    for node in document["nodes"]:
        if np.prod(node.get("scale", [1, 1, 1])) < 0:
            node.pop("scale")
    local = [np.array(read_nodes(open_gltf(save(target, document, binary))).world)]
    parents = read_nodes(gltf).parents
    for index, node in enumerate(document["nodes"]):
        above = local[0][parents[index]] if parents[index] >= 0 else np.eye(4)
        matrix = mirror @ np.linalg.solve(above, local[0][index]) @ mirror
        for key in ("translation", "rotation", "scale"):
            node.pop(key, None)
        node["matrix"] = [float(v) for v in matrix.T.ravel()]

    def put(accessor: int, values: np.ndarray) -> None:
        entry = document["accessors"][accessor]
        view = document["bufferViews"][entry["bufferView"]]
        start = view.get("byteOffset", 0) + entry.get("byteOffset", 0)
        raw = np.ascontiguousarray(values).tobytes()
        assert "byteStride" not in view
        data[start : start + len(raw)] = raw

    for mesh in document["meshes"]:
        for primitive in mesh["primitives"]:
            points = gltf.accessor(primitive["attributes"]["POSITION"]) * np.array([-1, 1, 1], "<f4")
            put(primitive["attributes"]["POSITION"], points.astype("<f4"))
            corners_ = gltf.accessor(primitive["indices"])
            put(primitive["indices"], corners_.reshape(-1, 3)[:, ::-1].reshape(-1, 1))
    for entry in document["skins"]:
        inverse = gltf.accessor(entry["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
        put(entry["inverseBindMatrices"], (mirror @ inverse @ mirror).transpose(0, 2, 1).astype("<f4"))
    return save(target, document, bytes(data))


def test_a_hand_below_a_mirrored_node_is_the_hand_mirrored_in_its_data(tmp_path: Path) -> None:
    asset, wanted = (
        read(CASES / "hand_right_mirrored.glb"),
        read(baked(CASES / "hand_right_mirrored.glb", tmp_path / "b.glb")),
    )
    assert asset.rig is not None and wanted.rig is not None
    assert volume(asset.mesh) > 0 and volume(wanted.mesh) > 0
    assert np.allclose(corners(asset), corners(wanted), atol=1e-6)
    assert np.allclose(asset.rig.rest_world, wanted.rig.rest_world, atol=1e-6)
    assert (np.linalg.det(asset.rig.rest_world[:, :3, :3]) > 0).all()
    assert any(freedom.kind == "euler" for freedom in asset.rig.freedoms)
    for name, one, other in zip(asset.rig.joints, asset.rig.freedoms, wanted.rig.freedoms, strict=True):
        assert one.kind == other.kind and np.allclose(one.frame, other.frame, atol=1e-5), name
        assert np.allclose(one.lower, other.lower) and np.allclose(one.upper, other.upper)


def test_fingers_of_a_mirrored_hand_bend_to_the_palm() -> None:
    """As those of the hand whose mirror image it is: tips come closer to where the thumb's tip is."""
    rig = rig_of(CASES / "hand_right_mirrored.glb")
    local = np.array(rig.rest_local)
    for k, (name, freedom) in enumerate(zip(rig.joints, rig.freedoms, strict=True)):
        if freedom.kind == "euler" and "thumb" not in name:
            c, s = np.cos(0.5), np.sin(0.5)
            local[k, :3, :3] @= freedom.frame @ [[c, -s, 0], [s, c, 0], [0, 0, 1]] @ freedom.frame.T
    after, before = forward_kinematics(rig.parents, local), rig.rest_world
    thumb = rig.joints.index("thumb-tip")
    for name in ("index-finger-tip", "middle-finger-tip", "ring-finger-tip"):
        k = rig.joints.index(name)
        near = np.linalg.norm(after[k, :3, 3] - before[thumb, :3, 3])
        assert near < np.linalg.norm(before[k, :3, 3] - before[thumb, :3, 3]), name


def two_bars(tmp_path: Path, scale: list[float]) -> Path:
    """Two bars with a skin each, the second under a node of its own that is scaled."""
    path = tmp_path / "m.glb"
    GltfFiles().write(path, [bar()], {})
    document, binary = parts_of(path)
    nodes = document["nodes"]
    roots, count = document["scenes"][0]["nodes"], len(nodes)
    for node in [dict(node) for node in nodes]:
        if "children" in node:
            node["children"] = [child + count for child in node["children"]]
        if "skin" in node:
            node["skin"] = 1
        nodes.append(node)
    (skin,) = document["skins"]
    document["skins"].append(skin | {"joints": [joint + count for joint in skin["joints"]]})
    nodes.append({"scale": scale, "translation": [50, 0, 0], "children": [root + count for root in roots]})
    document["scenes"][0]["nodes"] = [*roots, len(nodes) - 1]
    return save(path, document, binary)


@pytest.mark.parametrize("scale", [[-1, 1, 1], [1, -1, 1], [-1, -1, -1], [1, 1, 1], [-1, -1, 1]])
def test_of_two_skins_one_may_stand_mirrored(tmp_path: Path, scale: list[float]) -> None:
    """Two hands of one model, the left a mirrored copy: both are turned outwards, and each as it stands."""
    asset = read(two_bars(tmp_path, scale))
    assert asset.rig is not None
    for surface in (asset.mesh, asset.rig.surface):
        second = surface.points[surface.faces][:, :, 0].mean(axis=1) > 25
        halves = [TriangleMesh(surface.points, surface.faces[half]) for half in (~second, second)]
        assert np.allclose([volume(half) for half in halves], volume(bar().mesh), rtol=1e-4)
    mirrored = np.prod(scale) < 0
    assert any("1 of 2 skins" in note for note in asset.notes) == mirrored


def test_a_joint_scaled_to_nothing_is_read_in_its_full_size_and_named(tmp_path: Path) -> None:
    path = tmp_path / "m.glb"
    GltfFiles().write(path, [bar()], {})
    whole = read(path)
    document, binary = parts_of(path)
    joint = document["skins"][0]["joints"][-1]
    document["nodes"][joint]["scale"] = [0, 0, 0]
    asset = read(save(path, document, binary))
    assert asset.rig is not None and whole.rig is not None
    assert np.allclose(asset.rig.rest_world, whole.rig.rest_world) and np.allclose(
        asset.mesh.points, whole.mesh.points
    )
    assert any(whole.rig.joints[-1] in note and "full size" in note for note in asset.notes)


@pytest.mark.parametrize("many", [False, True])
def test_a_vertex_of_a_joint_that_is_not_there_follows_its_others(tmp_path: Path, many: bool) -> None:
    path = tmp_path / "m.glb"
    GltfFiles().write(path, [bar()], {})
    document, binary = parts_of(path)
    gltf = open_gltf(path)
    (mesh,) = document["meshes"]
    attributes = mesh["primitives"][0]["attributes"]
    joints, weights = (np.array(gltf.accessor(attributes[key])) for key in ("JOINTS_0", "WEIGHTS_0"))
    shared = np.flatnonzero((weights > 0.05).sum(axis=1) > 1)
    chosen = shared if many else shared[:1]
    joints[chosen, 0] = 200
    view = document["bufferViews"][document["accessors"][attributes["JOINTS_0"]]["bufferView"]]
    data = bytearray(binary)
    stored = joints.astype(
        {5121: "u1", 5123: "<u2"}[document["accessors"][attributes["JOINTS_0"]]["componentType"]]
    )
    data[view["byteOffset"] : view["byteOffset"] + stored.nbytes] = stored.tobytes()
    save(path, document, bytes(data))
    if many:
        with pytest.raises(FileRefused, match="names joint 200"):
            read(path)
    else:
        assert any("1 vertices name a joint" in note for note in read(path).notes)


@pytest.mark.parametrize("scale", [(-1, 1, 1), (1, -1, 1), (1, 1, -1), (-1, -1, -1), (-2, 2, 2)])
@pytest.mark.parametrize("chain", [1, 2, 3])
def test_reflections_anywhere_above_a_skin(tmp_path: Path, scale: tuple[int, ...], chain: int) -> None:
    """An odd number of reflections mirrors, an even one does not; the surface is turned outwards either way."""
    path = tmp_path / "m.glb"
    GltfFiles().write(path, [bar()], {})
    document, binary = parts_of(path)
    roots = document["scenes"][0]["nodes"]
    for _ in range(chain):
        document["nodes"].append({"scale": list(scale), "children": roots})
        roots = [len(document["nodes"]) - 1]
    document["scenes"][0]["nodes"] = roots
    asset = read(save(path, document, binary))
    size = np.array(scale, float) ** chain
    assert asset.rig is not None and volume(asset.mesh) > 0
    assert np.isclose(volume(asset.mesh), volume(bar().mesh) * abs(np.prod(size)), rtol=1e-4)
    assert np.allclose(np.sort(asset.mesh.points, 0), np.sort(bar().mesh.points * size, 0), atol=1e-5)
    assert (np.linalg.det(asset.rig.rest_world[:, :3, :3]) > 0).all()
    assert (np.linalg.det(asset.rig.bind_world[:, :3, :3]) > 0).all()


# What is written


@settings(max_examples=60)
@given(st.lists(st.floats(-2, 2, width=32), min_size=12, max_size=12), st.booleans())
def test_any_matrix_is_written_as_nodes_that_viewers_multiply_to_it(numbers: list[float], flat: bool) -> None:
    matrix = np.eye(4)
    matrix[:3] = np.reshape(numbers, (3, 4))
    if flat:
        matrix[2, :3] = 0
    outer, inner = node_transforms(matrix)
    assert np.allclose((np.eye(4) if outer is None else composed(outer)) @ composed(inner), matrix, atol=1e-5)


def composed(node: dict[str, Any]) -> np.ndarray:
    """As a viewer: translation, rotation, scale; nothing else is in a node that we write."""
    from scipy.spatial.transform import Rotation

    assert set(node) <= {"translation", "rotation", "scale"}
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_quat(node["rotation"]).as_matrix() * node.get("scale", [1, 1, 1])
    matrix[:3, 3] = node["translation"]
    return matrix


def test_a_pose_of_unevenly_scaled_joints_is_shown_as_here(tmp_path: Path) -> None:
    asset = read(CASES / "g04_nonuniform_joint.glb")
    assert asset.rig is not None
    local = bent_finger(asset.rig)
    pose = Pose(asset.rig.joints, local)
    GltfFiles().write(tmp_path / "posed.glb", [asset], {asset.name: pose})
    document, _ = parts_of(tmp_path / "posed.glb")
    for node in document["nodes"]:
        if "matrix" in node:  # only where no viewer has to split it
            linear = np.reshape(node["matrix"], (4, 4))[:3, :3]
            gram = linear @ linear.T
            assert np.allclose(gram, np.diag(np.diag(gram)), atol=1e-6)
    back = read(tmp_path / "posed.glb")
    wanted = skin(asset.rig, forward_kinematics(asset.rig.parents, local))
    assert np.allclose(corners(back), corners(Asset("w", TriangleMesh(wanted, asset.rig.faces))), atol=1e-4)
    assert back.rig is not None and back.rig.joints == asset.rig.joints


def test_the_bar_keeps_its_pose(tmp_path: Path) -> None:
    GltfFiles().write(tmp_path / "m.glb", [bar()], {"bar": bent()})
    document, _ = parts_of(tmp_path / "m.glb")
    assert len(document["nodes"]) == 4  # no node more than the joints, the skin and its holder


# Old, compressed, hostile


def test_gltf_1_is_called_old(tmp_path: Path) -> None:
    (tmp_path / "a.glb").write_bytes(struct.pack("<4sIIII", b"glTF", 1, 24, 4, 0) + b"{}  ")
    (tmp_path / "b.gltf").write_text('{"asset": {"version": "1.0"}, "meshes": {"m": {}}}')
    (tmp_path / "c.gltf").write_text('{"meshes": {"m": {}}, "nodes": {}}')
    (tmp_path / "d.gltf").write_text('{"asset": {"version": "1.1"}}')
    for name in ("a.glb", "b.gltf", "c.gltf", "d.gltf"):
        with pytest.raises(FileRefused, match=r"old format.*as glTF 2.0") as refused:
            read(tmp_path / name)
        assert "damaged" not in str(refused.value)


def test_draco_is_read(tmp_path: Path) -> None:
    draco = pytest.importorskip("DracoPy")
    ball = meshes.icosphere(2)
    packed = draco.encode(ball.points.astype("<f4"), ball.faces.astype("<u4"), quantization_bits=16)
    document: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "extensionsRequired": ["KHR_draco_mesh_compression"],
        "buffers": [{"byteLength": len(packed)}],
        "bufferViews": [{"buffer": 0, "byteLength": len(packed)}],
        "accessors": [
            {"componentType": 5126, "count": len(ball.points), "type": "VEC3"},
            {"componentType": 5125, "count": ball.faces.size, "type": "SCALAR"},
        ],
        "meshes": [{"primitives": [{
            "attributes": {"POSITION": 0}, "indices": 1,
            "extensions": {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}},
        }]}],
        "nodes": [{"mesh": 0}],
    }  # fmt: skip
    asset = read(save(tmp_path / "m.glb", document, packed))
    assert len(asset.mesh.points) == len(ball.points) and np.isclose(volume(asset.mesh), volume(ball), rtol=1e-3)
    with pytest.raises(FileRefused, match="Draco data cannot be decoded"):
        read(save(tmp_path / "m.glb", document, packed[:40] + b"\0" * (len(packed) - 40)))


def test_very_many_copies_are_refused_in_words(tmp_path: Path) -> None:
    many = [{"mesh": 0}] * 60_000
    scenes = [{"nodes": list(range(len(many)))}]
    with pytest.raises(FileRefused, match="60000 nodes with meshes"):
        read(changed(tmp_path, "e03_ucx_collision.glb", nodes=many, scenes=scenes))
    fewer = many[:15_000]
    with pytest.raises(FileRefused, match="in copies of its meshes"):
        read(changed(tmp_path, "e03_ucx_collision.glb", nodes=fewer, scenes=[{"nodes": list(range(len(fewer)))}]))


def test_python_does_not_speak(tmp_path: Path) -> None:
    deep = '{"asset":{"version":"2.0"},"extras":' + "[" * 100_000 + "]" * 100_000 + "}"
    zero = json.dumps({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 1, "uri": "a\0b"}],
                       "bufferViews": [{"buffer": 0, "byteLength": 1}], "accessors":
                       [{"bufferView": 0, "componentType": 5126, "count": 1, "type": "VEC3"}],
                       "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "nodes": [{"mesh": 0}],
                       })  # fmt: skip
    for text in (deep, zero):
        (tmp_path / "m.gltf").write_text(text)
        with pytest.raises(FileRefused) as refused:
            read(tmp_path / "m.gltf")
        assert not any(word in str(refused.value) for word in ("recursion", "embedded", "null byte", "Error"))


def squeezed(packed: dict[str, bytes], count: dict[str, int]) -> dict[str, Any]:
    """A document as gltfpack writes it: views of a buffer without bytes, compressed in that of the file."""
    views, start = [], 0
    for mode, stride in (("ATTRIBUTES", 12), ("TRIANGLES", 2)):
        told = {"buffer": 0, "byteOffset": start, "byteLength": len(packed[mode]), "byteStride": stride,
                "mode": mode, "count": count[mode]}  # fmt: skip
        views.append({"buffer": 1, "byteLength": 12, "extensions": {"EXT_meshopt_compression": told}})
        start += len(packed[mode])
    return {
        "asset": {"version": "2.0"},
        "extensionsRequired": ["EXT_meshopt_compression"],
        "buffers": [
            {"byteLength": start},
            {"byteLength": 1 << 20, "extensions": {"EXT_meshopt_compression": {"fallback": True}}},
        ],
        "bufferViews": views,
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": count["ATTRIBUTES"], "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": count["TRIANGLES"], "type": "SCALAR"},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0}],
    }


def test_meshopt_is_read(tmp_path: Path) -> None:
    meshopt = pytest.importorskip("meshopt")
    ball, path = meshes.icosphere(2), tmp_path / "m.glb"
    points, faces = ball.points.astype("<f4"), ball.faces.astype("<u2")
    packed = {
        "ATTRIBUTES": meshopt.encode_gltf_buffer(points, "ATTRIBUTES"),
        "TRIANGLES": meshopt.encode_gltf_buffer(faces.ravel(), "TRIANGLES"),
    }
    count = {"ATTRIBUTES": len(points), "TRIANGLES": faces.size}
    binary = b"".join(packed.values())
    mesh = read(save(path, squeezed(packed, count), binary)).mesh
    assert len(mesh.points) == len(points) and np.isclose(volume(mesh), volume(ball), rtol=1e-6)
    assert np.abs(np.linalg.norm(mesh.points, axis=1) - 1.0).max() < 1e-6
    with pytest.raises(FileRefused, match="meshopt data cannot be decoded"):
        read(save(path, squeezed(packed, count), b"\0" * len(binary)))
    many = squeezed(packed, count)
    many["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["count"] = 1 << 40
    with pytest.raises(FileRefused, match="compressed elements"):
        read(save(path, many, binary))
    beyond = {**packed, "TRIANGLES": packed["TRIANGLES"] + b"more"}
    with pytest.raises(FileRefused, match="ends at byte"):
        read(save(path, squeezed(beyond, count) | {"buffers": squeezed(packed, count)["buffers"]}, binary))
