"""glTF: every way to store numbers, scenes as others see them, refusals, and what we write."""

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_builtins.formats.gltf import GltfFiles
from contact_builtins.formats.gltf_container import open_gltf
from contact_core.document.asset import Asset
from contact_core.errors import ContactError, FileRefused
from contact_core.geometry.report import report
from contact_core.rig.rig import Pose, forward_kinematics, skin
from contact_core.testing import meshes
from contact_core.testing.format_contract import bar, bent

FLOAT, USHORT, UBYTE, BYTE = 5126, 5123, 5121, 5120


class Document:
    """A glTF document under construction, its buffer in a data URI."""

    def __init__(self) -> None:
        self.binary = b""
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "bufferViews": [],
            "accessors": [],
            "meshes": [],
            "nodes": [],
        }

    def view(self, data: bytes, **more: Any) -> int:
        self.json["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data), **more}
        )
        self.binary += data + b"\0" * (-len(data) % 4)
        return len(self.json["bufferViews"]) - 1

    def accessor(self, values: Any, kind: str = "VEC3", component: int = FLOAT, **more: Any) -> int:
        dtype = {FLOAT: "<f4", USHORT: "<u2", UBYTE: "u1", BYTE: "i1"}[component]
        values = np.asarray(values, dtype)
        entry = {
            "bufferView": self.view(values.tobytes()),
            "componentType": component,
            "count": len(values),
            "type": kind,
        }
        self.json["accessors"].append(entry | more)
        return len(self.json["accessors"]) - 1

    def mesh(self, *primitives: dict[str, Any]) -> int:
        self.json["meshes"].append({"primitives": list(primitives)})
        return len(self.json["meshes"]) - 1

    def node(self, **entry: Any) -> int:
        self.json["nodes"].append(entry)
        return len(self.json["nodes"]) - 1

    def save(self, folder: Path, name: str = "m.gltf") -> Path:
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.binary).decode()
        self.json["buffers"] = [{"byteLength": len(self.binary), "uri": uri}]
        (folder / name).write_text(json.dumps(self.json))
        return folder / name


def triangle(document: Document, **attributes: int) -> dict[str, Any]:
    points = document.accessor([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    return {
        "attributes": {"POSITION": points, **attributes},
        "indices": document.accessor([[0], [1], [2]], "SCALAR", USHORT),
    }


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 20), padding=st.integers(0, 3))
def test_accessors_strided_normalised_sparse(
    tmp_path_factory: pytest.TempPathFactory, seed: int, count: int, padding: int
) -> None:
    """What was packed with struct comes back, whatever the layout."""
    random, folder, document = np.random.default_rng(seed), tmp_path_factory.mktemp("g"), Document()
    values = random.integers(-128, 128, (count, 3))
    rows = b"\xee" * 4 + b"".join(struct.pack("<3b", *row) + b"\xee" * (1 + 4 * padding) for row in values)
    view = document.view(rows, byteStride=4 + 4 * padding)
    plain = {"bufferView": view, "byteOffset": 4, "componentType": BYTE, "count": count, "type": "VEC3"}
    changed = np.sort(random.choice(count, random.integers(1, count + 1), replace=False))
    replaced = random.integers(-128, 128, (len(changed), 3))
    sparse = {
        "count": len(changed),
        "indices": {"bufferView": document.view(changed.astype("u1").tobytes()), "componentType": UBYTE},
        "values": {"bufferView": document.view(replaced.astype("i1").tobytes())},
    }
    document.json["accessors"] += [plain, {**plain, "normalized": True}, {**plain, "sparse": sparse}]
    document.json["accessors"].append({k: v for k, v in {**plain, "sparse": sparse}.items() if k != "bufferView"})
    gltf = open_gltf(document.save(folder))
    assert np.array_equal(gltf.accessor(0), values)
    assert np.allclose(gltf.accessor(1), np.maximum(values / 127.0, -1.0))
    expected = values.copy()
    expected[changed] = replaced
    assert np.array_equal(gltf.accessor(2), expected)
    expected[np.setdiff1d(np.arange(count), changed)] = 0
    assert np.array_equal(gltf.accessor(3), expected)


def test_strips_fans_and_lists_make_the_same_square(tmp_path: Path) -> None:
    for mode, order in ((4, [0, 1, 2, 2, 1, 3]), (5, [0, 1, 2, 3]), (6, [0, 1, 3, 2])):
        document = Document()
        points = document.accessor([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
        indices = document.accessor(np.array(order)[:, None], "SCALAR", UBYTE)
        document.node(mesh=document.mesh({"attributes": {"POSITION": points}, "indices": indices, "mode": mode}))
        asset = GltfFiles().read(document.save(tmp_path))
        assert np.isclose(asset.mesh.face_areas.sum(), 1.0) and (asset.mesh.face_normals[:, 2] > 0.99).all()


def test_a_scene_is_what_an_independent_reader_sees(tmp_path: Path) -> None:
    """Nested transforms, a mirrored node, a mesh used twice, a node outside the scene: as trimesh places them."""
    document = Document()
    ball = meshes.icosphere(1)
    points, indices = document.accessor(ball.points), document.accessor(ball.faces.reshape(-1, 1), "SCALAR", USHORT)
    mesh = document.mesh({"attributes": {"POSITION": points}, "indices": indices})
    inner = document.node(mesh=mesh, translation=[3, 0, 0], rotation=[0, 0, 0.6, 0.8])
    mirrored = document.node(mesh=mesh, translation=[-3, 1, 0], scale=[-1, 2, 1])
    root = document.node(children=[inner, mirrored], scale=[2, 2, 2])
    document.node(mesh=mesh, translation=[99, 0, 0])
    document.json |= {"scenes": [{"nodes": [root]}], "scene": 0}
    path = document.save(tmp_path)
    asset = GltfFiles().read(path)
    theirs = trimesh.load(path, process=False).to_mesh()
    facts = report(asset.mesh)
    assert facts.components == 2 and facts.is_watertight
    assert np.isclose(facts.volume, abs(theirs.volume), rtol=1e-5)  # outward on the mirrored ball too
    assert np.allclose(np.sort(asset.mesh.points, axis=0), np.sort(theirs.vertices, axis=0), atol=1e-5)


def skinned(document: Document, joints: int = 2, sets: int = 2) -> None:
    """A triangle with `sets` sets of influences on joints in a row, and a second mesh riding on joint 1."""
    attributes = {}
    for k in range(sets):
        attributes[f"JOINTS_{k}"] = document.accessor([[(4 * k + c) % joints for c in range(4)]] * 3, "VEC4", UBYTE)
        attributes[f"WEIGHTS_{k}"] = document.accessor([[51, 51, 0, 51]] * 3, "VEC4", UBYTE, normalized=True)
    primitive, rider = triangle(document, **attributes), triangle(document)
    inverse = np.tile(np.eye(4), (joints, 1, 1))
    inverse[:, 3, 0] = -np.arange(joints)  # column by column: translation in the last row
    matrices = document.accessor(inverse.reshape(-1, 16), "MAT4")
    body, prop = document.mesh(primitive), document.mesh(rider)
    for k in range(joints):
        document.node(name=f"j{k}", translation=[min(k, 1), 0, 0], children=[k + 1] if k + 1 < joints else [])
    document.node(mesh=body, skin=0, translation=[5, 5, 5])  # ignored: the specification says so
    document.json["nodes"][1].setdefault("children", []).append(document.node(mesh=prop, translation=[0, 0, 2]))
    document.json["skins"] = [{"joints": list(range(joints)), "inverseBindMatrices": matrices}]


def test_more_than_four_influences_and_a_rigid_rider(tmp_path: Path) -> None:
    document = Document()
    skinned(document, joints=7)
    asset = GltfFiles().read(document.save(tmp_path))
    rig = asset.rig
    assert rig is not None and asset.details["influences"] == 5  # joint 0 twice
    assert not asset.details["weights_sum_to_1"] and any("normalised" in note for note in asset.notes)
    assert np.allclose(rig.skin_weights.sum(axis=1), 1.0)
    rider = asset.mesh.points[:, 2] > 1.9
    assert np.allclose(asset.mesh.points[~rider], [[0, 0, 0], [1, 0, 0], [0, 1, 0]], atol=1e-6)
    assert rider.sum() == 3
    assert np.allclose(rig.skin_weights[rider].max(axis=1), 1.0) and set(rig.skin_joints[rider, 0]) == {1}
    assert np.allclose(asset.mesh.points[rider].min(axis=0), [1, 0, 2], atol=1e-6)


def test_a_skeleton_that_moves_no_mesh_is_said(tmp_path: Path) -> None:
    """It is read as an object, and whoever expected a hand is told why it is none."""
    document = Document()
    skinned(document)
    with_skin = GltfFiles().read(document.save(tmp_path))
    for node in document.json["nodes"]:
        node.pop("skin", None)
    without = GltfFiles().read(document.save(tmp_path, "without.gltf"))
    assert with_skin.rig is not None and without.rig is None
    assert any("no hand" in note for note in without.notes)
    assert not any("no hand" in note for note in with_skin.notes)


def test_rest_may_differ_from_bind_and_scale_is_taken_out(tmp_path: Path) -> None:
    """A rig under a node scaled by 100, bound elsewhere: the skin stands where the file's own matrices put it."""
    document = Document()
    skinned(document, joints=3)
    document.json["nodes"][1]["rotation"] = [0, 0, np.sqrt(0.5), np.sqrt(0.5)]
    holder = document.node(scale=[100, 100, 100], children=[0, 3])
    document.json |= {"scenes": [{"nodes": [holder]}]}
    asset = GltfFiles().read(document.save(tmp_path))
    rig = asset.rig
    assert rig is not None
    linear = rig.rest_world[:, :3, :3]
    assert np.allclose(linear @ linear.transpose(0, 2, 1), np.eye(3), atol=1e-9)
    raw = [np.diag([100.0, 100, 100, 1])]  # world of the joints by hand
    turn = np.array([[0.0, -1, 0, 1], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    raw += [raw[0] @ turn, raw[0] @ turn @ np.array([[1.0, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])]
    moves = [
        world @ np.array([[1.0, 0, 0, -k], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) for k, world in enumerate(raw)
    ]
    weights = np.zeros(3)
    np.add.at(weights, [0, 1, 0, 1, 2, 1], 0.2)  # joints (4k + c) % 3 where the weight is not 0
    blend = sum(w / weights.sum() * m for w, m in zip(weights, moves, strict=True))
    expected = np.array([[0, 0, 0, 1], [1, 0, 0, 1], [0, 1, 0, 1]]) @ blend.T
    assert np.allclose(asset.mesh.points[asset.mesh.points[:, 2] < 100], expected[:, :3], atol=1e-3)
    rides = raw[1] @ np.array(
        [[0, 1, 0], [0, 0, 1], [2, 2, 2], [1, 1, 1]]
    )  # the rider stands where its node stands
    assert np.allclose(asset.mesh.points[asset.mesh.points[:, 2] > 100], rides.T[:, :3], atol=1e-3)


def test_joint_names_become_unique(tmp_path: Path) -> None:
    document = Document()
    skinned(document, joints=5)
    for k, name in enumerate(["root", "bone", "bone", "bone", "bone"]):
        document.json["nodes"][k]["name"] = name
    rig = GltfFiles().read(document.save(tmp_path)).rig
    assert rig is not None
    assert rig.joints == ("root", "root/bone", "bone/bone", "bone/bone_2", "bone/bone_3")
    document.json["nodes"][1].pop("name")
    rig = GltfFiles().read(document.save(tmp_path)).rig
    assert rig is not None and rig.joints[1] == "node_1"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"extensionsRequired": ["ACME_secret"]}, "ACME_secret"),
        ({"asset": {"version": "1.0"}}, "version 1.0"),
        ({"meshes": []}, "meshes"),
        ({"nodes": []}, "no triangles"),
    ],
)
def test_what_is_not_read_is_named(tmp_path: Path, change: dict[str, Any], words: str) -> None:
    document = Document()
    document.node(mesh=document.mesh(triangle(document)))
    document.json |= change
    with pytest.raises(FileRefused, match=words):
        GltfFiles().read(document.save(tmp_path))


def test_an_unknown_compression_without_a_fallback_is_named(tmp_path: Path) -> None:
    document = Document()
    primitive = triangle(document) | {"extensions": {"EXT_meshopt_compression": {"bufferView": 0}}}
    del document.json["accessors"][0]["bufferView"]
    document.node(mesh=document.mesh(primitive))
    with pytest.raises(FileRefused, match="compressed in a way"):
        GltfFiles().read(document.save(tmp_path))


@pytest.mark.parametrize(
    "uri", ["../secret.bin", "/etc/hostname", "file:///etc/hostname", "%2e%2e/secret.bin", "https://a/b.bin"]
)
def test_buffers_outside_the_folder_are_never_opened(tmp_path: Path, uri: str) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    (tmp_path / "secret.bin").write_bytes(b"\0" * 1000)
    document = Document()
    document.node(mesh=document.mesh(triangle(document)))
    path = document.save(inside)
    document.json["buffers"][0]["uri"] = uri
    path.write_text(json.dumps(document.json))
    with pytest.raises(FileRefused, match=r"outside its folder|no such file"):
        GltfFiles().read(path)


def test_a_buffer_beside_the_file_is_read_and_missed(tmp_path: Path) -> None:
    document = Document()
    document.node(mesh=document.mesh(triangle(document)))
    path = document.save(tmp_path)
    document.json["buffers"][0]["uri"] = "my%20data.bin"
    path.write_text(json.dumps(document.json))
    with pytest.raises(FileRefused, match="Copy it there"):
        GltfFiles().read(path)
    (tmp_path / "my data.bin").write_bytes(document.binary)
    assert len(GltfFiles().read(path).mesh.faces) == 1


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_written_pose_stands_as_it_was(tmp_path_factory: pytest.TempPathFactory, seed: int) -> None:
    """Random poses of a rig, and an object moved by its transform: read back, every vertex is in its place."""
    random, folder = np.random.default_rng(seed), tmp_path_factory.mktemp("w")
    asset, ball = bar(), Asset("ball", meshes.icosphere(1))
    rig = asset.rig
    assert rig is not None
    local = np.array(rig.rest_local)
    for k in range(len(local)):
        turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
        local[k, :3, :3] = turn * np.sign(np.linalg.det(turn))
    local[0, :3, 3] = random.normal(size=3)
    GltfFiles().write(folder / "a.glb", [asset], {"bar": Pose(rig.joints, local)})
    back = GltfFiles().read(folder / "a.glb")
    assert np.allclose(back.mesh.points, skin(rig, forward_kinematics(rig.parents, local)), atol=1e-5)
    stand = np.eye(4)
    stand[:3, 3] = random.normal(size=3)
    GltfFiles().write(folder / "b.glb", [ball], {"ball": Pose(("ball",), stand[None])})
    moved = trimesh.load(folder / "b.glb", process=False).to_mesh()
    assert np.allclose(moved.vertices, ball.mesh.points + stand[:3, 3], atol=1e-5)


def test_centimetres_and_z_up_leave_as_metres_and_y_up(tmp_path: Path) -> None:
    tall = Asset(
        "tall",
        meshes.icosphere(1).with_points(meshes.icosphere(1).points * [1, 1, 300]),
        meters_per_unit=0.01,
        up_axis="Z",
    )
    GltfFiles().write(tmp_path / "t.glb", [tall], {})
    extent = np.ptp(GltfFiles().read(tmp_path / "t.glb").mesh.points, axis=0)
    assert extent[1] == pytest.approx(0.01 * 300 * np.ptp(meshes.icosphere(1).points[:, 2]), rel=1e-5)


def test_a_pose_for_nothing_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ContactError, match="no such asset"):
        GltfFiles().write(tmp_path / "a.glb", [bar()], {"hand": bent()})
    assert not list(tmp_path.iterdir())


def two_skins(bridge: np.ndarray, *, contradict: bool) -> Document:
    """Two triangles on the same two joints; the second is bound in a space moved by `bridge`."""
    document = Document()
    joints = document.accessor([[0, 1, 0, 0]] * 3, "VEC4", UBYTE)
    weights = document.accessor([[0.5, 0.5, 0, 0]] * 3, "VEC4")
    inverse = np.tile(np.eye(4), (2, 1, 1))
    inverse[1, 0, 3] = -1.0
    other = inverse @ np.linalg.inv(bridge)
    other[1, 2, 3] += 0.5 * contradict
    shift = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]) @ bridge[:3, :3].T + bridge[:3, 3]
    document.node(name="a", children=[1])
    document.node(name="b", translation=[1, 0, 0])
    document.json["skins"] = []
    for k, (points, matrices) in enumerate(
        ((np.array([[0.0, 0, 3], [1, 0, 3], [0, 1, 3]]), inverse), (shift, other))
    ):
        attributes = {"POSITION": document.accessor(points), "JOINTS_0": joints, "WEIGHTS_0": weights}
        document.node(mesh=document.mesh({"attributes": attributes}), skin=k)
        columns = document.accessor(matrices.transpose(0, 2, 1).reshape(-1, 16), "MAT4")
        document.json["skins"].append({"joints": [0, 1], "inverseBindMatrices": columns})
    return document


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1))
def test_skins_bound_in_spaces_of_their_own_come_together(
    tmp_path_factory: pytest.TempPathFactory, seed: int
) -> None:
    random = np.random.default_rng(seed)
    bridge = np.eye(4)
    bridge[:3, :3], _ = np.linalg.qr(random.normal(size=(3, 3)))
    bridge[:3, 3] = random.normal(size=3)
    asset = GltfFiles().read(two_skins(bridge, contradict=False).save(tmp_path_factory.mktemp("s")))
    assert asset.rig is not None and asset.rig.joints == ("a", "b")
    low = asset.mesh.points[asset.mesh.points[:, 2] < 1.5]
    assert np.allclose(low, [[0, 0, 0], [1, 0, 0], [0, 1, 0]], atol=1e-5)


def test_skins_that_contradict_each_other_have_joints_of_their_own(tmp_path: Path) -> None:
    asset = GltfFiles().read(two_skins(np.eye(4), contradict=True).save(tmp_path))
    assert asset.rig is not None and any("bound elsewhere by a second skin" in note for note in asset.notes)
    assert any("#bound" in name for name in asset.rig.joints)
