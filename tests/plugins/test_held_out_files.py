"""Odd files of real tools, held out while the readers were written: right, or refused in a sentence.

Each is the cube of side 2 in another dress.
"""

from __future__ import annotations

import json
import struct
import zipfile
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contact_core.errors import FileRefused
from contact_core.geometry.mesh import TriangleMesh
from contact_core.plugins.reading import read_asset

CORNERS = 2.0 * np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
TRIANGLES = np.array([t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))])
V = "".join(f"v {x:g} {y:g} {z:g}\n" for x, y, z in CORNERS)
F = "".join(f"f {a + 1} {b + 1} {c + 1} {d + 1}\n" for a, b, c, d in QUADS)
POINTS = "".join(f"{x:g} {y:g} {z:g}\n" for x, y, z in CORNERS)
FACES = "".join(f"4 {a} {b} {c} {d}\n" for a, b, c, d in QUADS)
FACETS = b"".join(struct.pack("<12fH", 0, 0, 0, *CORNERS[list(t)].ravel(), 31) for t in TRIANGLES.tolist())
ASCII = "".join(
    "facet normal nan -nan(ind) inf\n outer loop\n"
    + "".join(f"  vertex {x:+.6E} {y:+.6E} {z:+.6E}\n" for x, y, z in CORNERS[list(t)])
    + " endloop\nendfacet\n"
    for t in TRIANGLES.tolist()
)


def header(form: str, faces: str, vertices: str = "float") -> bytes:
    lines = ["ply", f"format {form} 1.0", "obj_info odd", "element vertex 8"]
    lines += [f"property {vertices} {axis}" for axis in "xyz"]
    return "\n".join([*lines, *faces.splitlines(), "end_header", ""]).encode()


USHORT_FACES = "element face 6\nproperty list uchar ushort vertex_indices"
USHORTS = b"".join(struct.pack("<B4H", 4, *quad) for quad in QUADS)
RIGHT: dict[str, bytes | str] = {
    "negative.obj": V + "".join("f " + " ".join(str(i - 8) for i in quad) + "\n" for quad in QUADS),
    "continued.obj": V + F.replace(" ", " \\\n  ", 3),
    "coloured.obj": "".join(f"v {x:g} {y:g} {z:g} 0.5 0.5 0.5\n" for x, y, z in CORNERS) + F,
    "mixed.obj": V + "vt 0 0\nvn 0 0 1\n"
    + "".join(f"f {a + 1}/1/1 {b + 1}//1 {c + 1}/1 {d + 1}\n" for a, b, c, d in QUADS),
    "faces_first.obj": F + V,
    "end_of_dos.obj": (V + F).replace("\n", "\r\n") + "\x1a",
    "shouted.obj": (V + F).upper(),
    "ushort_double.ply": header("binary_little_endian", USHORT_FACES, "double")
    + CORNERS.astype("<f8").tobytes() + USHORTS,
    "shorts.ply": header("binary_little_endian", USHORT_FACES, "short")
    + CORNERS.astype("<i2").tobytes() + USHORTS,
    "big_with_uv.ply": header("binary_big_endian",
        "element face 6\nproperty uint8 f\nproperty list uint8 uint32 vertex_index\nproperty list uint8 float32 uv")
    + CORNERS.astype(">f4").tobytes() + b"".join(struct.pack(">BB4IB8f", 0, 4, *q, 8, *range(8)) for q in QUADS),
    "capitals.ply": header("ascii", USHORT_FACES).replace(b" x", b" X").replace(b" y", b" Y").replace(b" z", b" Z")
    .replace(b"vertex_indices", b"Vertex_Indices") + (POINTS + FACES).encode(),
    "one_odd_facet.stl": b"x".ljust(80) + struct.pack("<I", 13) + struct.pack("<12fH", *[np.nan] * 12, 0) + FACETS,
    "one_odd_face.obj": V + "v nan 0 0\n" + F + "f 1 2 9\n",
    "no_end.stl": "solid\n" + ASCII,
    "named_facet.stl": "solid facet outer loop vertex 1 2 3\n" + ASCII + "endsolid\n",
    "one_line.stl": " ".join(("solid x\n" + ASCII).split()) + " endsolid x",
    "binary_solid.stl": b"solid exported facet normal".ljust(80) + struct.pack("<I", 12) + FACETS,
    "binary_trail.stl": b"x".ljust(80) + struct.pack("<I", 12) + FACETS + b"more bytes",
    "coloured.off": "COFF\n8 6 0\n" + "".join(f"{x:g} {y:g} {z:g} 1 0 0 1\n" for x, y, z in CORNERS) + FACES,
    "normals.off": "NOFF\n8 6 0\n" + "".join(f"{x:g} {y:g} {z:g} 0 0 1\n" for x, y, z in CORNERS) + FACES,
    "no_edge_count.off": "OFF\n# by hand\n8 6\n" + POINTS + FACES,
}  # fmt: skip
REFUSED: dict[str, tuple[bytes | str, str]] = {
    "comma.obj": (V.replace("2", "2,0") + F, "a point, not a comma"),
    "from_zero.obj": (V + F.replace("f 1 ", "f 0 "), "counted from 1"),
    "nothing.obj": ("# empty\no a\n", "nothing to touch"),
    "cloud.ply": (header("ascii", "") + POINTS.encode(), "make a surface of them first"),
    "count_zero.stl": (b"x".ljust(80) + struct.pack("<I", 0) + FACETS, "has room for 12"),
    "headless.off": ("8 6 0\n" + POINTS + FACES, "first word is not OFF"),
    "gazebo.urdf": ('<gazebo/>', "where a URDF has <robot>"),
    "sdf.urdf": ('<sdf version="1.6"/>', "convert it to URDF"),
    "bare.urdf": ('<robot name="r"><link name="a"/></robot>', "<visual>"),
}  # fmt: skip


def volume(mesh: TriangleMesh) -> float:
    return float(np.linalg.det(mesh.points[mesh.faces]).sum() / 6.0)


def written(folder: Path, name: str, data: bytes | str) -> Path:
    path = folder / name
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path


@pytest.mark.parametrize("name", RIGHT)
def test_it_is_the_cube(tmp_path: Path, name: str) -> None:
    mesh = read_asset(written(tmp_path, name, RIGHT[name])).mesh
    assert len(mesh.points) == 8 and len(mesh.faces) == 12
    assert volume(mesh) == pytest.approx(8.0)


MISTAKEN: dict[str, tuple[bytes | str, str]] = {
    "page.glb": ("<!DOCTYPE html>\n<html><body>Not found</body></html>", "web page"),
    "page.stl": ("\n<html>", "web page"),
    "page.urdf": ("<!doctype html><html/>", "web page"),
    "robot.dae": ('<?xml version="1.0"?><!-- made by hand --><robot name="r"/>', "name in .urdf"),
    "scene.urdf": ('<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema"/>', "name in .dae"),
    "model.urdf": ("<mujoco><worldbody/></mujoco>", "MuJoCo"),
    "cloud.obj": (header("ascii", USHORT_FACES) + (POINTS + FACES).encode(), "name in .ply"),
    "layer.obj": ("#usda 1.0\n", "name in .usda"),
    "scene.obj": (b"glTF\2\0\0\0", "name in .glb"),
    "fbx.glb": (b"Kaydara FBX Binary  \0", "FBX"),
    "small.obj": (b"\x1f\x8b\x08", "gzip"),
    "picture.obj": (b"\x89PNG\r\n", "picture"),
}


@pytest.mark.parametrize("name", MISTAKEN)
def test_what_a_file_is_in_truth_is_said(tmp_path: Path, name: str) -> None:
    data, words = MISTAKEN[name]
    with pytest.raises(FileRefused, match=name) as refusal:
        read_asset(written(tmp_path, name, data))
    assert words in str(refusal.value) and "damaged" not in str(refusal.value)


def test_faces_at_no_place_are_left_out_and_counted(tmp_path: Path) -> None:
    asset = read_asset(written(tmp_path, "m.obj", V + "v nan 0 0\nf 1 2 9\n" + F + "f 9 9 9\n"))
    assert any(note.startswith("2 faces with corners that are not finite") for note in asset.notes)
    assert asset.source_faces is not None and sorted(set(asset.source_faces.tolist())) == list(range(1, 7))


# Packages of printers


CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"
SHAPE = (
    "<mesh><vertices>"
    + "".join(f'<vertex x="{x:g}" y="{y:g}" z="{z:g}"/>' for x, y, z in CORNERS)
    + "</vertices><triangles>"
    + "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in TRIANGLES.tolist())
    + "</triangles></mesh>"
)
CUBE = f'<object id="1">{SHAPE}</object>'


def package(folder: Path, objects: str, items: str, **others: str) -> Path:
    """A 3MF package; others: further parts of its folder 3D by name."""

    def model(inside: str, build: str) -> str:
        spaces = f'xmlns="{CORE}" xmlns:p="{PRODUCTION}"'
        return f'<model unit="meter" {spaces}><resources>{inside}</resources><build>{build}</build></model>'

    with zipfile.ZipFile(folder / "m.3mf", "w") as made:
        for name, inside in others.items():
            made.writestr(f"3D/Objects/{name}.model", model(inside, ""))
        made.writestr("3D/3dmodel.model", model(objects, items))
    return folder / "m.3mf"


OTHER = 'p:path="/3D/Objects/other.model" objectid="1"'


@pytest.mark.parametrize(
    ("objects", "items", "noted"),
    [
        (f'<object id="2"><components><component {OTHER}/></components></object>', '<item objectid="2"/>', ""),
        ("", f"<item {OTHER}/>", ""),
        (CUBE, "", "to be built"),
        (CUBE.replace('id="1"', 'id="1" type="surface"'), '<item objectid="1"/>', ""),
        (
            CUBE + CUBE.replace('id="1"', 'id="2" type="support"'),
            '<item objectid="1"/><item objectid="2"/>',
            ": 2.",
        ),
        (CUBE, '<item objectid="1"/><item objectid="7"/>', ": 7."),
        (CUBE + CUBE.replace('id="1"', 'id="2" name="UCX_a"'), '<item objectid="1"/><item objectid="2"/>', "UCX_a"),
    ],
)
def test_packages_as_printers_write_them(tmp_path: Path, objects: str, items: str, noted: str) -> None:
    asset = read_asset(package(tmp_path, objects, items, other=CUBE))
    assert volume(asset.mesh) == pytest.approx(8.0) and len(asset.mesh.faces) == 12
    assert bool(asset.notes) == bool(noted) and noted in " ".join(asset.notes)


def test_components_in_a_ring_of_parts_are_refused(tmp_path: Path) -> None:
    ring = f'<object id="1"><components><component {OTHER}/></components></object>'
    with pytest.raises(FileRefused, match="ring"):
        read_asset(package(tmp_path, ring, '<item objectid="1"/>', other=ring))


@pytest.mark.parametrize("lines", ["o UCX_cube", "o Hull\ng cube_collider", "g Cube_LOD1"])
def test_hulls_and_copies_of_an_obj_are_named_and_no_surface(tmp_path: Path, lines: str) -> None:
    copy = "".join(f"f {a + 9} {b + 9} {c + 9} {d + 9}\n" for a, b, c, d in QUADS)
    moved = "".join(f"v {x + 9:g} {y:g} {z:g}\n" for x, y, z in CORNERS)
    asset = read_asset(written(tmp_path, "cube.obj", f"{lines}\n{moved}{F}o Cube\ng Cube\n{V}{copy}"))
    assert volume(asset.mesh) == pytest.approx(8.0) and asset.mesh.points.max() == 2.0
    assert any(lines.split()[-1] in note for note in asset.notes)
    assert asset.source_faces is not None and sorted(set(asset.source_faces.tolist())) == list(range(6, 12))


@pytest.mark.parametrize("name", REFUSED)
def test_it_is_refused_in_words(tmp_path: Path, name: str) -> None:
    data, words = REFUSED[name]
    with pytest.raises(FileRefused, match=name) as refusal:
        read_asset(written(tmp_path, name, data))
    assert words in str(refusal.value)


def gltf(folder: Path, change: Any) -> Path:
    """A cube as text glTF with its buffer beside it, after a change of its document."""
    moves, turns = np.array([[0, 0, 0], [10, 0, 0], [0, 20, 0]], "<f4"), np.tile([0, 0, 0, 1], (3, 1)).astype("<f4")
    blocks = [CORNERS.astype("<f4"), TRIANGLES.astype("<u2").ravel(), moves, turns, 0.5 * np.ones((3, 3), "<f4")]
    starts = np.cumsum([0, *(block.nbytes for block in blocks)]).tolist()
    document: dict[str, Any] = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"uri": "my%20cube.bin", "byteLength": starts[-1]}],
        "bufferViews": [{"buffer": 0, "byteOffset": a, "byteLength": b - a} for a, b in pairwise(starts)],
        "accessors": [
            {"bufferView": k, "componentType": 5123 if k == 1 else 5126, "count": len(block),
             "type": "SCALAR" if k == 1 else f"VEC{block.shape[1]}"}
            for k, block in enumerate(blocks)
        ],
    }  # fmt: skip
    change(document)
    (folder / "my cube.bin").write_bytes(b"".join(block.tobytes() for block in blocks))
    return written(folder, "cube.gltf", json.dumps(document))


@pytest.mark.parametrize("required", [False, True])
@pytest.mark.parametrize(
    ("keys", "size"), [({"TRANSLATION": 2}, 24.0), ({"TRANSLATION": 2, "ROTATION": 3, "SCALE": 4}, 3.0)]
)
def test_copies_of_a_mesh_are_all_there(tmp_path: Path, keys: dict[str, int], size: float, required: bool) -> None:
    """EXT_mesh_gpu_instancing, which viewers draw whether a file requires it or not."""
    name = "EXT_mesh_gpu_instancing"

    def change(document: dict[str, Any]) -> None:
        document["nodes"][0]["extensions"] = {name: {"attributes": keys}}
        document["extensionsUsed"] = [name]
        if required:
            document["extensionsRequired"] = [name]

    asset = read_asset(gltf(tmp_path, change))
    assert volume(asset.mesh) == pytest.approx(size) and len(asset.mesh.faces) == 36
    assert asset.mesh.points.max(axis=0)[:2] == pytest.approx((10.0, 20.0), abs=2.1)
    assert any(name in note for note in asset.notes)


def test_what_is_null_is_left_out(tmp_path: Path) -> None:
    def change(document: dict[str, Any]) -> None:
        document["nodes"][0] |= {"name": None, "translation": None, "matrix": None, "extensions": None}
        document["skins"] = None

    assert volume(read_asset(gltf(tmp_path, change)).mesh) == pytest.approx(8.0)


def test_folders_may_be_parted_as_on_windows(tmp_path: Path) -> None:
    path = gltf(tmp_path, lambda document: document["buffers"][0].update(uri="data\\my%20cube.bin"))
    (tmp_path / "data").mkdir()
    (tmp_path / "my cube.bin").rename(tmp_path / "data" / "my cube.bin")
    assert volume(read_asset(path).mesh) == pytest.approx(8.0)


def test_coarser_levels_of_msft_lod_are_no_surface(tmp_path: Path) -> None:
    def change(document: dict[str, Any]) -> None:
        document["nodes"] = [
            {"mesh": 0, "extensions": {"MSFT_lod": {"ids": [1]}}},
            {"children": [2]},
            {"mesh": 0, "name": "coarse", "scale": [3, 3, 3]},
        ]
        document["scenes"] = [{"nodes": [0, 1]}]

    asset = read_asset(gltf(tmp_path, change))
    assert volume(asset.mesh) == pytest.approx(8.0) and any("coarse" in note for note in asset.notes)


@pytest.mark.parametrize("attributes", [{}, {"TRANSLATION": 2, "SCALE": 0}, {"_ID": 2}, {"TRANSLATION": 99}])
def test_copies_that_contradict_themselves_are_refused(tmp_path: Path, attributes: dict[str, int]) -> None:
    def change(document: dict[str, Any]) -> None:
        document["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}

    with pytest.raises(FileRefused):
        read_asset(gltf(tmp_path, change))


def test_a_scene_without_triangles_is_not_called_damaged(tmp_path: Path) -> None:
    with pytest.raises(FileRefused, match="holds no triangles") as refusal:
        read_asset(gltf(tmp_path, lambda document: document["nodes"][0].clear()))
    assert "damaged" not in str(refusal.value)


def test_an_empty_usd_mesh_refuses_no_other(tmp_path: Path) -> None:
    pytest.importorskip("pxr", reason="usd-core is not installed")
    counts, indices = [4] * 6, [i for quad in QUADS for i in quad]
    points = ", ".join(f"({x:g}, {y:g}, {z:g})" for x, y, z in CORNERS)
    text = f"""#usda 1.0
def Mesh "empty"
{{
}}
def Mesh "cube"
{{
    int[] faceVertexCounts = {counts}
    int[] faceVertexIndices = {indices}
    point3f[] points = [{points}]
}}
"""
    asset = read_asset(written(tmp_path, "cube.usda", text))
    assert volume(asset.mesh) == pytest.approx(8.0)
    assert any("without points or faces, left out: /empty" in note for note in asset.notes)
