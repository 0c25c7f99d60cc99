"""Every built-in format keeps the contract."""

from __future__ import annotations

from pathlib import Path

import pytest

from contact_builtins.formats.gltf import GltfFiles
from contact_builtins.formats.mesh_files import MeshFiles
from contact_core.plugins.slots import Format
from contact_core.testing.format_contract import FormatContract

TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


class TestGltf(FormatContract):
    @pytest.fixture
    def file_format(self) -> Format:
        return GltfFiles()


class TestMeshFiles(FormatContract):
    cannot = {"writing": "plain meshes are only read; a .glb is what is written", "rigs": "a plain mesh has none"}

    @pytest.fixture
    def file_format(self) -> Format:
        return MeshFiles()

    @pytest.fixture
    def example(self, tmp_path: Path) -> Path:
        path = tmp_path / "tetrahedron.obj"
        path.write_text(TETRAHEDRON, encoding="utf-8")
        return path
