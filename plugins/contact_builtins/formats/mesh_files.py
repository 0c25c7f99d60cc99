"""The formats of plain meshes: OBJ, PLY, STL, OFF."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from contact_builtins.formats.ply import parse_ply
from contact_builtins.formats.polygon_parsers import parse_obj, parse_off, parse_stl
from contact_builtins.formats.polygons import Polygons, surface_of
from contact_builtins.formats.refusal import file_bytes, refusing
from contact_core.document.asset import Asset
from contact_core.errors import FileRefused, InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.rig.rig import Pose

PARSERS: dict[str, Callable[[bytes], Polygons]] = {
    ".obj": parse_obj,
    ".ply": parse_ply,
    ".stl": parse_stl,
    ".off": parse_off,
}


class MeshFiles:
    """Reads polygon meshes; none of these formats knows units, up axis or rigs."""

    name = "mesh"
    summary = "meshes in the common files without a skeleton"
    suffixes = tuple(PARSERS)
    can_read = True
    can_write = False

    def read(self, path: Path, *, sidecar: Path | None = None) -> Asset:
        """The mesh in a file. Raises FileRefused."""
        path = Path(path)
        if sidecar is not None:
            raise FileRefused(f"{path} is a plain mesh, so the rig sidecar {sidecar} has no joints to describe.")
        suffix = path.suffix.lower()
        if suffix not in PARSERS:
            raise FileRefused(f"{path} ends in {suffix!r}; mesh files end in {', '.join(PARSERS)}.")
        with refusing(path, f"a mesh in {suffix[1:].upper()} form"):
            data = file_bytes(path)
            if not data.strip():
                raise InvalidInput("it is empty")
            polygons = PARSERS[suffix](data)
            surface = surface_of(polygons)
        return Asset(
            name=path.stem,
            mesh=TriangleMesh(surface.points, surface.faces),
            source_vertices=surface.source_vertices,
            source_faces=surface.source_faces,
            notes=(*polygons.notes, *surface.notes),
            details={"format": suffix[1:], "polygons": len(polygons.sizes)},
        )

    def write(self, path: Path, assets: Sequence[Asset], poses: Mapping[str, Pose]) -> None:
        """Refused: posed rigs and their objects go into a .glb file."""
        raise FileRefused(f"{path}: plain mesh files are only read here; write a .glb file instead.")
