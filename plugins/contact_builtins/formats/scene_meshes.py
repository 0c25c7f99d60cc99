"""COLLADA (.dae) and 3MF as plain surfaces, in the units and with the up axis that the file states."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from contact_builtins.formats.dae import parse_dae
from contact_builtins.formats.placed import Parsed
from contact_builtins.formats.polygons import Polygons, surface_of
from contact_builtins.formats.refusal import NO_FACES, NoSurface, file_bytes, refusing
from contact_builtins.formats.threemf import parse_3mf
from contact_core.document.asset import Asset
from contact_core.errors import FileRefused
from contact_core.geometry.mesh import TriangleMesh
from contact_core.rig.rig import Pose


class SceneMeshFiles:
    """Reads the surfaces of scenes; rigs come by glTF or USD."""

    name = "scene-mesh"
    summary = "meshes of COLLADA and 3MF scenes"
    suffixes = (".dae", ".3mf")
    can_read = True
    can_write = False

    def read(self, path: Path, *, sidecar: Path | None = None) -> Asset:
        """All surfaces of a file as one mesh. Raises FileRefused; MissingExtra for .dae without pycollada."""
        path = Path(path)
        if sidecar is not None:
            raise FileRefused(f"{path} is read as a mesh, so the rig sidecar {sidecar} has no joints to describe.")
        suffix = path.suffix.lower()
        if suffix not in PARSERS:
            raise FileRefused(f"{path} ends in {suffix!r}; these files end in {', '.join(PARSERS)}.")
        with refusing(path, "a COLLADA file" if suffix == ".dae" else "a 3MF file"):
            parts, unit, up, notes = PARSERS[suffix](file_bytes(path))
            if not parts:
                raise NoSurface(NO_FACES)
            starts = np.cumsum([0, *(len(points) for points, _, _ in parts)])
            polygons = Polygons(
                np.concatenate([points for points, _, _ in parts]),
                np.concatenate([sizes for _, sizes, _ in parts]),
                np.concatenate([corners + start for (_, _, corners), start in zip(parts, starts, strict=False)]),
            )
            surface = surface_of(polygons)
        return Asset(
            name=path.stem,
            mesh=TriangleMesh(surface.points, surface.faces),
            source_vertices=surface.source_vertices,
            source_faces=surface.source_faces,
            meters_per_unit=unit,
            up_axis=up,
            notes=(*notes, *surface.notes),
            details={"format": suffix[1:], "polygons": len(polygons.sizes)},
        )

    def write(self, path: Path, assets: Sequence[Asset], poses: Mapping[str, Pose]) -> None:
        """Refused: posed rigs and their objects go into a .glb file."""
        raise FileRefused(f"{path}: these files are only read here; write a .glb file instead.")


PARSERS: dict[str, Callable[[bytes], Parsed]] = {".dae": parse_dae, ".3mf": parse_3mf}
