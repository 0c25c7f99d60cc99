"""COLLADA (.dae) and 3MF as plain surfaces, in the units and with the up axis that the file states."""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal
from xml.etree import ElementTree

import numpy as np

from contact_builtins.formats.polygons import Polygons, surface_of
from contact_builtins.formats.refusal import MAX_FILE_BYTES, NO_FACES, NoSurface, bounded, file_bytes, refusing
from contact_core.arrays import FloatArray, IntArray
from contact_core.document.asset import Asset
from contact_core.errors import FileRefused, InvalidInput, MissingExtra
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.transform import transform_points
from contact_core.rig.rig import Pose
from contact_core.scene.mesh_names import MeshNames, shown

Placed = tuple[FloatArray, IntArray, IntArray]  # points (n, 3), corners per face (f,), point of each corner
Parsed = tuple[list[Placed], float, Literal["X", "Y", "Z"], list[str]]
_UNITS_3MF = {
    "micron": 1e-6, "millimeter": 1e-3, "centimeter": 1e-2, "inch": 0.0254, "foot": 0.3048, "meter": 1.0,
}  # fmt: skip
_CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
# What zipfile raises while it reads a damaged archive: an odd version or method, a lock, a cut, a number too large.
_DAMAGED_ZIP = (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError, OSError, ValueError)
_DEEPEST = 32  # components within components


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


def parse_dae(data: bytes) -> Parsed:
    """The geometry of a COLLADA scene by pycollada. Raises InvalidInput, MissingExtra."""
    try:
        import collada
    except ImportError as error:
        raise MissingExtra("Reading COLLADA (.dae)", "io") from error
    _check_xml(data)
    try:
        scene = collada.Collada(
            io.BytesIO(data), ignore=[collada.common.DaeError], aux_file_loader=lambda name: None
        )
        objects = (
            [] if scene.scene is None else [*scene.scene.objects("geometry"), *scene.scene.objects("controller")]
        )
        kept, notes = shown([_dae_names(item) for item in objects])
        parts = list(_dae_parts([objects[k] for k in kept]))
    except collada.common.DaeError as error:
        raise InvalidInput(f"pycollada says: {' '.join(str(error).split())[:120]}") from error
    if any(hasattr(item, "skin") for item in objects):
        notes.append("The file's skin was read as it stands; for a rig, export glTF or USD.")
    up = {"X_UP": "X", "Z_UP": "Z"}.get(str(scene.assetInfo.upaxis), "Y")
    unit = float(scene.assetInfo.unitmeter or 1.0)
    if not 0 < unit < float("inf"):
        raise InvalidInput(f"its unit is {unit:g} metres")
    return parts, unit, up, notes  # type: ignore[return-value]


def _dae_names(item: Any) -> MeshNames:
    """The name of a geometry and its id, by which exporters tell what it is; pycollada keeps no names of nodes."""
    geometry = getattr(item, "original", item)
    geometry = getattr(geometry, "geometry", geometry)
    told = [getattr(geometry, key, None) for key in ("name", "id")]
    return MeshNames(tuple(str(name) for name in told if name) or ("",))


def _dae_parts(objects: list[Any]) -> Iterator[Placed]:
    total = 0
    for item in objects:
        for outer in item.primitives():
            primitive = getattr(outer, "primitive", outer)  # a skin wraps its primitives
            corners = getattr(primitive, "vertex_index", None)
            if corners is None or primitive.vertex is None or not len(corners):
                continue
            corners = np.asarray(corners, np.int64)
            if corners.ndim == 2 and corners.shape[1] == 3:
                sizes = np.full(len(corners), 3)
            elif hasattr(primitive, "polyindex"):
                ranges = np.asarray(primitive.polyindex, np.int64)  # (f, 2) start and end of each polygon
                sizes = ranges[:, 1] - ranges[:, 0]
            else:
                continue  # lines
            total = bounded(total + len(primitive.vertex) + len(sizes), "vertices and faces in all")
            yield np.asarray(primitive.vertex, np.float64), sizes, corners.ravel()


def parse_3mf(data: bytes) -> Parsed:
    """The build items of a 3MF package (3MF core specification 1.3). Raises InvalidInput."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as package:
            names = [name for name in package.namelist() if name.lower().endswith(".model")]
            main = next((name for name in names if name.lower() == "3d/3dmodel.model"), names[0] if names else None)
            if main is None:
                raise InvalidInput("its package holds no .model part")
            if package.getinfo(main).file_size > MAX_FILE_BYTES:
                raise InvalidInput("its model is too large to be unpacked")
            text = package.read(main)
    except _DAMAGED_ZIP as error:
        raise InvalidInput("it is no 3MF package, which is a zip archive") from error
    root = _check_xml(text)
    unit = root.get("unit", "millimeter")
    if unit not in _UNITS_3MF:
        raise InvalidInput(f"its unit is {unit[:40]!r}; 3MF has {', '.join(_UNITS_3MF)}")
    objects = {entry.get("id"): entry for entry in root.iter(f"{_CORE}object")}
    parts, budget = list[Placed](), [0]
    for item in root.iterfind(f"{_CORE}build/{_CORE}item"):
        parts += _placed_3mf(objects, item, np.eye(4), budget, 0)
    return parts, _UNITS_3MF[unit], "Z", []


def _placed_3mf(
    objects: dict[str | None, ElementTree.Element], item: ElementTree.Element, above: FloatArray, budget: list[int],
    depth: int,
) -> Iterator[Placed]:  # fmt: skip
    """The meshes of an item or component under the transform above it. budget: elements so far."""
    if depth > _DEEPEST:
        raise InvalidInput("its components are nested in a ring, or too deeply")
    key = item.get("objectid")
    if key not in objects:
        raise InvalidInput(f"it names the object {key!r}, which is not there")
    entry, world = objects[key], above @ _matrix_3mf(item.get("transform"))
    budget[0] = bounded(budget[0] + 1, "components")
    mesh = entry.find(f"{_CORE}mesh")
    if mesh is not None and entry.get("type", "model") == "model":
        points = _table(mesh, "vertices/vertex", ("x", "y", "z"), np.float64)
        faces = _table(mesh, "triangles/triangle", ("v1", "v2", "v3"), np.int64)
        budget[0] = bounded(budget[0] + len(points) + len(faces), "vertices and faces in all")
        if np.linalg.det(world[:3, :3]) < 0:
            faces = faces[:, ::-1]
        if len(faces):
            yield transform_points(world, points), np.full(len(faces), 3), faces.ravel()
    for component in entry.iterfind(f"{_CORE}components/{_CORE}component"):
        yield from _placed_3mf(objects, component, world, budget, depth + 1)


def _table(mesh: ElementTree.Element, where: str, keys: tuple[str, ...], kind: type) -> Any:
    path = "/".join(_CORE + tag for tag in where.split("/"))
    return (
        np.array([[row.attrib[key] for key in keys] for row in mesh.iterfind(path)], "U32")
        .reshape(-1, 3)
        .astype(kind)
    )


def _matrix_3mf(text: str | None) -> FloatArray:
    """(4, 4) for column vectors out of twelve numbers of a row-vector matrix."""
    matrix = np.eye(4)
    if text is not None:
        matrix[:3] = np.array(text.split(), np.float64).reshape(4, 3).T
    if not np.isfinite(matrix).all():
        raise InvalidInput("a transform in it is not finite")
    return matrix


def _check_xml(text: bytes) -> ElementTree.Element:
    """The root. Raises InvalidInput on what is no XML, or declares entities, which may grow without bound."""
    if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
        raise InvalidInput("it declares a document type, which is not read")
    try:
        return ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise InvalidInput(f"its XML cannot be parsed: {error}") from error


PARSERS: dict[str, Callable[[bytes], Parsed]] = {".dae": parse_dae, ".3mf": parse_3mf}
