"""One table of what can be read as a plain mesh: a format that is read as an object is read as a link too."""

from __future__ import annotations

from pathlib import Path

from contact_builtins.formats.gltf import GltfFiles
from contact_builtins.formats.mesh_files import MeshFiles
from contact_builtins.formats.scene_meshes import SceneMeshFiles
from contact_core.errors import FileRefused
from contact_core.geometry.mesh import TriangleMesh

READERS = (MeshFiles(), GltfFiles(), SceneMeshFiles())


def read_any_mesh(path: Path) -> tuple[TriangleMesh, tuple[str, ...]]:
    """The surface of a mesh file in its own frame, in metres where the format knows units, and notes.

    Raises FileRefused, MissingExtra.
    """
    suffix = path.suffix.lower()
    for reader in READERS:
        if suffix in reader.suffixes:
            asset = reader.read(path)
            unit = asset.meters_per_unit or 1.0
            mesh = asset.mesh if unit == 1.0 else TriangleMesh(asset.mesh.points * unit, asset.mesh.faces)
            return mesh, asset.notes
    known = ", ".join(suffix for reader in READERS for suffix in reader.suffixes)
    raise FileRefused(f"{path} ends in {path.suffix!r}; mesh files end in {known}.")
