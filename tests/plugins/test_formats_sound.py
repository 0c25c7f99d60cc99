"""Every reader brings the same faults of a mesh in order: STL, OBJ, PLY, OFF and glTF share one function."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from contact_builtins.formats.gltf import GltfFiles
from contact_builtins.formats.gltf_writer import glb_bytes
from contact_builtins.formats.mesh_files import MeshFiles
from contact_core.arrays import FloatArray, IntArray
from contact_core.document.asset import Asset
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.report import report
from contact_core.testing import meshes

MUG = meshes.torus(16, 12, 0.04, 0.02)
FAULTS = ("inwards", "mixed", "twice", "loose", "far ground", "noise")


def faulty(fault: str) -> tuple[FloatArray, IntArray]:
    points, faces = MUG.points, MUG.faces.copy()
    if fault == "inwards":
        faces = faces[:, ::-1]
    elif fault == "mixed":
        faces[::3] = faces[::3, ::-1]
    elif fault == "twice":
        faces = np.concatenate([faces, faces])
    elif fault in ("loose", "noise"):
        points, faces = points[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3)
        if fault == "noise":
            points = points + np.random.default_rng(0).uniform(-2e-6, 2e-6, points.shape)
    else:
        ground = np.array([[-1e3, -1, -1e3], [-1e3, -1, 1e3], [1e3, -1, 1e3], [1e3, -1, -1e3]])
        faces = np.concatenate([faces, len(points) + np.array([[0, 1, 2], [0, 2, 3]])])
        points = np.concatenate([points, ground])
    return points, faces


@pytest.mark.parametrize("kind", ["obj", "ply", "off", "stl", "glb"])
@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_mended_in_every_format(tmp_path: Path, kind: str, fault: str) -> None:
    points, faces = faulty(fault)
    path = tmp_path / f"mug.{kind}"
    if kind == "glb":
        path.write_bytes(glb_bytes([Asset("mug", TriangleMesh(points, faces))], {}))
        asset = GltfFiles().read(path)
    else:
        content = trimesh.Trimesh(points, faces, process=False).export(file_type=kind)
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        asset = MeshFiles().read(path)
    found = report(asset.mesh)
    more = 1 if fault == "far ground" else 0
    assert found.is_manifold and found.components == 1 + more
    assert found.faces == len(MUG.faces) + 2 * more and found.boundary_edges == 4 * more
    if not more:
        assert np.isclose(found.volume or 0.0, report(MUG).volume or 1.0, rtol=1e-3)
    turned = "turned round"
    noted = {"inwards": turned, "mixed": turned, "twice": "lay on another", "noise": "open edges met"}
    if fault in noted:
        assert any(noted[fault] in note for note in asset.notes)
    assert asset.source_faces is not None and len(asset.source_faces) == found.faces
