"""The glTF format: reads objects and skinned manipulators, writes posed scenes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from contact_builtins.formats.gltf_container import open_gltf
from contact_builtins.formats.gltf_nodes import opened, read_nodes
from contact_builtins.formats.gltf_rig import followed_by, rig_asset
from contact_builtins.formats.gltf_scene import Part, read_parts
from contact_builtins.formats.gltf_skeleton import read_skeleton
from contact_builtins.formats.polygons import Polygons, surface_of
from contact_builtins.formats.refusal import NoSurface, refusing
from contact_builtins.formats.sidecar import read_sidecar, sidecar_beside
from contact_core.document.asset import Asset
from contact_core.errors import FileRefused, InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.rig.clip import Clip
from contact_core.rig.rig import Pose


class GltfFiles:
    """glTF 2.0, binary or JSON, on the standard library and numpy alone."""

    name = "gltf"
    summary = "glTF 2.0 scenes, with skeletons and their skins"
    suffixes = (".glb", ".gltf")
    can_read = True
    can_write = True

    def read(self, path: Path, *, sidecar: Path | None = None) -> Asset:
        """The scene in a file: one rig when any mesh is skinned, else one mesh. Raises FileRefused."""
        path = Path(path)
        with refusing(path, "a glTF 2.0 file"):
            told = sidecar or sidecar_beside(path)
            gltf = open_gltf(path)
            nodes = read_nodes(gltf)
            parts, notes = read_parts(gltf, nodes)
            if not parts:
                raise NoSurface("holds no triangles in the scene that it shows; name a file with a mesh.")
            if any(part.skin is not None for part in parts):
                return rig_asset(gltf, nodes, parts, read_sidecar(told) if told else None, notes)
            if sidecar is not None:
                raise FileRefused(f"{path} holds no skin, so the rig sidecar {sidecar} has no joints to describe.")
            if gltf.document.get("skins"):
                notes.append(
                    "Its skeleton moves none of its meshes, so it is an object, and no hand that is posed."
                )
            return _object_asset(path, parts, notes)

    def read_clips(self, path: Path, *, sidecar: Path | None = None, rate: float | None = None) -> tuple[Clip, ...]:
        """The animations of the rig in a file, and of its objects. Raises FileRefused."""
        from contact_builtins.formats.gltf_clips import read_clips

        path = Path(path)
        if rate is not None and not 0.0 < rate < math.inf:
            raise InvalidInput(f"the rate is a positive number of frames per second, but got {rate}.")
        with refusing(path, "a glTF 2.0 file"):
            told = sidecar or sidecar_beside(path)
            gltf = open_gltf(path)
            nodes = read_nodes(gltf)
            parts, notes = read_parts(gltf, nodes)
            skins = sorted({part.skin for part in parts if part.skin is not None})
            objects = list(dict.fromkeys(part.node for part in parts if part.skin is None))
            if not skins:
                return read_clips(gltf, nodes, None, objects, rate)
            words = read_sidecar(told) if told else None
            nodes = replace(nodes, world=opened(gltf, nodes, ())[0])
            rig = rig_asset(gltf, nodes, parts, words, notes).rig
            assert rig is not None
            return read_clips(
                gltf, nodes, (read_skeleton(gltf, nodes, followed_by(parts), words), rig), objects, rate
            )

    def write(self, path: Path, assets: Sequence[Asset], poses: Mapping[str, Pose]) -> None:
        """One GLB with every asset; rigs as skins in their pose. Raises FileRefused, InvalidInput."""
        self.write_clip(path, assets, poses, None)

    def write_clip(self, path: Path, assets: Sequence[Asset], poses: Mapping[str, Pose], clip: Clip | None) -> None:
        """One GLB with every asset and, where a clip is given, its animation. Raises FileRefused, InvalidInput."""
        from contact_builtins.formats.gltf_writer import glb_bytes
        from contact_core.atomic_file import write_atomic

        if Path(path).suffix.lower() != ".glb":
            raise FileRefused(f"{path}: glTF is written as one binary file; let its name end in .glb.")
        if not Path(path).absolute().parent.is_dir():
            raise FileRefused(f"{path} cannot be written: there is no folder {Path(path).parent}. Make it first.")
        write_atomic(path, glb_bytes(assets, poses, clip))


def _object_asset(path: Path, parts: list[Part], notes: list[str]) -> Asset:
    starts = np.cumsum([0, *(len(part.points) for part in parts)])
    faces = np.concatenate([part.faces + start for part, start in zip(parts, starts[:-1], strict=True)])
    surface = surface_of(Polygons.of_triangles(np.concatenate([part.points for part in parts]), faces))
    return Asset(
        name=path.stem,
        mesh=TriangleMesh(surface.points, surface.faces),
        source_vertices=surface.source_vertices,
        source_faces=surface.source_faces,
        meters_per_unit=1.0,
        up_axis="Y",
        notes=(*notes, *surface.notes),
        details={"format": "gltf", "polygons": len(faces)},
    )
