"""Mesh files: polygons as written, against an independent reader; the ways back; refusals in words."""

import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_builtins.formats.inspection import inspect
from contact_builtins.formats.mesh_files import MeshFiles
from contact_core.document.asset import Asset
from contact_core.errors import FileRefused
from contact_core.geometry.report import report
from contact_core.testing import meshes

CONCAVE = np.array([[0, 0, 0], [4, 0, 0], [4, 4, 0], [2, 1, 0], [0, 4, 0]], float)  # area 10; a fan covers 14


def read(folder: Path, name: str, content: str | bytes) -> Asset:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return MeshFiles().read(path)


def concave_prism() -> tuple[np.ndarray, list[list[int]]]:
    """A prism over the concave pentagon: 2 pentagons and 5 quads, volume 20."""
    points = np.concatenate([CONCAVE, CONCAVE + np.array([0, 0, 2])])
    sides = [[i, (i + 1) % 5, 5 + (i + 1) % 5, 5 + i] for i in range(5)]
    return points, [*sides, [4, 3, 2, 1, 0], [5, 6, 7, 8, 9]]


def as_obj(points: np.ndarray, faces: list[list[int]]) -> bytes:
    lines = [f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in points]
    return "\n".join(lines + ["f " + " ".join(f"{i + 1}/{i + 1}/1" for i in face) for face in faces]).encode()


def as_obj_counting_back(points: np.ndarray, faces: list[list[int]]) -> bytes:
    lines = [f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in points]
    return "\n".join(lines + ["f " + " ".join(str(i - len(points)) for i in face) for face in faces]).encode()


def as_off(points: np.ndarray, faces: list[list[int]]) -> bytes:
    rows = [" ".join(f"{v:.17g}" for v in p) for p in points] + [" ".join(map(str, [len(f), *f])) for f in faces]
    return "\n".join(["OFF # a comment", f"{len(points)} {len(faces)} 0", *rows]).encode()


def _ply_head(kind: str, points: np.ndarray, faces: list[list[int]]) -> bytes:
    return (
        f"ply\nformat {kind} 1.0\nelement vertex {len(points)}\n"
        "property double x\nproperty double y\n"
        f"property double z\nproperty uchar red\nelement face {len(faces)}\n"
        "property list uchar int vertex_indices\nproperty float quality\nend_header\n"
    ).encode()


def as_ply_text(points: np.ndarray, faces: list[list[int]]) -> bytes:
    rows = [" ".join(f"{v:.17g}" for v in p) + " 7" for p in points]
    rows += [" ".join(map(str, [len(f), *f])) + " 0.5" for f in faces]
    return _ply_head("ascii", points, faces) + "\n".join(rows).encode()


def as_ply_binary(points: np.ndarray, faces: list[list[int]], order: str = "<") -> bytes:
    kind = "binary_little_endian" if order == "<" else "binary_big_endian"
    body = b"".join(struct.pack(order + "dddB", *p, 7) for p in points)
    body += b"".join(struct.pack(f"{order}B{len(f)}if", len(f), *f, 0.5) for f in faces)
    return _ply_head(kind, points, faces) + body


WRITERS = {
    "a.obj": as_obj,
    "b.obj": as_obj_counting_back,
    "c.off": as_off,
    "d.ply": as_ply_text,
    "e.ply": as_ply_binary,
    "f.ply": lambda points, faces: as_ply_binary(points, faces, ">"),
}


@pytest.mark.parametrize("name", WRITERS)
def test_n_gons_are_clipped_and_remembered(tmp_path: Path, name: str) -> None:
    points, faces = concave_prism()
    asset = read(tmp_path, name, WRITERS[name](points, faces))
    facts = report(asset.mesh)
    assert facts.is_watertight and facts.genus == 0
    assert np.isclose(facts.volume, 20.0)
    assert asset.source_faces is not None and asset.source_vertices is not None
    assert np.bincount(asset.source_faces).tolist() == [len(face) - 2 for face in faces]
    assert np.array_equal(asset.mesh.points[asset.source_vertices], points)
    for triangle, source in zip(asset.mesh.faces, asset.source_faces, strict=True):
        assert set(np.flatnonzero(np.isin(asset.source_vertices, triangle))) <= set(faces[source])


@settings(max_examples=25)
@given(data=st.data())
def test_agrees_with_trimesh(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    """The same surface as an independent reader makes of an independent writer's file."""
    family = data.draw(st.sampled_from([meshes.icosphere(1), meshes.torus(9, 7), meshes.cylinder(8, 3)]))
    kind = data.draw(st.sampled_from(["obj", "ply", "ply_ascii", "stl", "stl_ascii", "off"]))
    scale = data.draw(st.floats(1e-3, 1e3))
    solid = trimesh.Trimesh(family.points * scale, family.faces, process=False)
    options = {"encoding": "ascii"} if kind == "ply_ascii" else {}
    content = solid.export(file_type=kind.removesuffix("_ascii") if kind == "ply_ascii" else kind, **options)
    suffix = kind.split("_")[0]
    asset = read(tmp_path_factory.mktemp("x"), f"m.{suffix}", content)
    assert len(asset.mesh.points) == len(family.points) and len(asset.mesh.faces) == len(family.faces)
    assert trimesh.proximity.closest_point(solid, asset.mesh.points)[1].max() <= 1e-5 * scale
    ours = trimesh.Trimesh(asset.mesh.points, asset.mesh.faces)
    assert np.isclose(ours.area, solid.area, rtol=1e-5) and np.isclose(
        ours.volume, solid.volume, rtol=1e-4, atol=1e-12
    )


def test_split_vertices_weld_and_loose_ones_go(tmp_path: Path) -> None:
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [9, 9, 9], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    asset = read(tmp_path, "m.obj", as_obj(np.array(points, float), [[0, 1, 2], [4, 5, 6]]))
    assert len(asset.mesh.points) == 4
    assert asset.source_vertices is not None
    assert asset.source_vertices.tolist()[3] == -1
    assert (
        asset.source_vertices[1] == asset.source_vertices[4]
        and asset.source_vertices[2] == asset.source_vertices[6]
    )
    assert any("welded" in note for note in asset.notes) and any("left out" in note for note in asset.notes)


PLY_POINT = b"ply\nformat %s 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"

REFUSED = {
    "missing corner": ("m.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "line 4 names vertex 9, but there are 3"),
    "zero index": (
        "m.obj",
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n",
        "names vertex 0, but there are 3, counted from 1",
    ),
    "not a number": ("m.obj", b"v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "not finite"),
    "infinite": ("m.obj", b"v 0 0 0\nv inf 0 0\nv 0 1 0\nf 1 2 3\n", "not finite"),
    "words": ("m.obj", b"v zero 0 0\n", "line 1: 'zero' is not a number"),
    "no faces": ("m.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no faces"),
    "empty": ("m.obj", b"", "it is empty"),
    "huge off": ("m.off", b"OFF\n99999999999 1 0\n", "99999999999 vertices"),
    "short off": ("m.off", b"OFF\n3 1 0\n0 0 0\n", "ends after"),
    "huge ply": (
        "m.ply",
        b"ply\nelement vertex 99999999999\nend_header\n",
        "99999999999 rows",
    ),
    "points only": (
        "m.ply",
        PLY_POINT % b"ascii" + b"end_header\n1 2 3",
        "points and no faces",
    ),
    "huge list": (
        "m.ply",
        PLY_POINT % b"binary_little_endian"
        + b"element face 1\nproperty list uint int vertex_indices\nend_header\n"
        + b"\0" * 12
        + b"\xff" * 8,
        "4294967295 corners",
    ),
    "huge stl": ("m.stl", b"\0" * 80 + b"\xff\xff\xff\xff" + b"\0" * 50, "4294967295 facets"),
    "wrong ending": ("m.fbx", b"", "mesh files end in"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_bad_files_are_refused_in_a_sentence(tmp_path: Path, case: str) -> None:
    name, content, words = REFUSED[case]
    with pytest.raises(FileRefused, match=words) as refusal:
        read(tmp_path, name, content)
    assert name in str(refusal.value) and str(refusal.value).endswith(".")


def test_a_missing_file_and_a_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FileRefused, match="No such file"):
        MeshFiles().read(tmp_path / "none.obj")
    (tmp_path / "folder.obj").mkdir()
    with pytest.raises(FileRefused, match="not a file"):
        MeshFiles().read(tmp_path / "folder.obj")


@pytest.mark.assets
def test_real_objects_count_as_their_manifest_says(assets: Path) -> None:
    """Vertices after welding, faces, components, boundary loops and genus, against an independent count."""
    import json

    for entry in json.loads((assets / "manifest.json").read_text())["assets"]:
        stats = entry.get("stats", {})
        if entry["kind"] != "object" or entry["format"] != "obj" or "genus_total" not in stats:
            continue
        facts = inspect(assets / entry["file"])
        assert facts["mesh"]["components"] == stats["components"], entry["file"]
        assert facts["mesh"]["boundary_loops"] == stats["boundary_loops"], entry["file"]
        assert facts["source_vertices"] == stats["raw_vertices"], entry["file"]
        if not stats["degenerate_faces"]:
            assert facts["mesh"]["faces"] == stats["triangles"], entry["file"]
        if facts["mesh"]["genus"] is not None and not stats["degenerate_faces"]:
            assert facts["mesh"]["genus"] == stats["genus_total"], entry["file"]
