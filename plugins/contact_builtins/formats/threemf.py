"""3MF packages: the core specification (1.3), and objects in several parts as the production extension has."""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any
from xml.etree import ElementTree

import numpy as np

from contact_builtins.formats.placed import Parsed, Placed, parsed_xml
from contact_builtins.formats.refusal import MAX_FILE_BYTES, bounded, named
from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.geometry.transform import transform_points
from contact_core.scene.mesh_names import MeshNames, shown

_UNITS = {
    "micron": 1e-6, "millimeter": 1e-3, "centimeter": 1e-2, "inch": 0.0254, "foot": 0.3048, "meter": 1.0,
}  # fmt: skip
_CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
_PATH = "{http://schemas.microsoft.com/3dmanufacturing/production/2015/06}path"
# What zipfile raises while it reads a damaged archive: an odd version or method, a lock, a cut, a number too large.
_DAMAGED = (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError, OSError, ValueError)
_DEEPEST = 32  # components within components
_SHAPES = ("model", "surface")  # the other kinds are supports, which a printer adds and nobody sees


def parse_3mf(data: bytes) -> Parsed:
    """The build items of a package. Raises InvalidInput."""
    package = _Package(_texts(data))
    root = package.part(package.main)
    unit = root.get("unit", "millimeter")
    if unit not in _UNITS:
        raise InvalidInput(f"its unit is {unit[:40]!r}; 3MF has {', '.join(_UNITS)}")
    items = root.findall(f"{_CORE}build/{_CORE}item")
    notes = []
    if not items:
        items = [ElementTree.Element("item", objectid=key) for key, _ in package.objects(package.main)]
        notes.append("It says nothing of what is to be built, so all of its objects were read.")
    kept, told = shown([MeshNames((package.title(item),)) for item in items])
    parts = [part for k in kept for part in package.placed(items[k], package.main, np.eye(4), 0)]
    return parts, _UNITS[unit], "Z", [*notes, *told, *package.notes()]


def _texts(data: bytes) -> dict[str, bytes]:
    """The .model parts by name, the main one first."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as package:
            names = [name for name in package.namelist() if name.lower().endswith(".model")]
            names.sort(key=lambda name: _plain(name) != "3d/3dmodel.model")
            if not names:
                raise InvalidInput("its package holds no .model part")
            if sum(package.getinfo(name).file_size for name in names) > MAX_FILE_BYTES:
                raise InvalidInput("its model is too large to be unpacked")
            return {_plain(name): package.read(name) for name in names}
    except _DAMAGED as error:
        raise InvalidInput("it is no 3MF package, which is a zip archive") from error


def _plain(name: str) -> str:
    return name.replace("\\", "/").lstrip("/").lower()


@dataclass
class _Package:
    """The parts of a package, parsed when they are asked for. elements: read so far.

    lost: objects that are named and not there; supports: those of kinds that are no shape.
    """

    texts: dict[str, bytes]
    roots: dict[str, ElementTree.Element] = field(default_factory=dict)
    known: dict[str, dict[str | None, ElementTree.Element]] = field(default_factory=dict)
    elements: int = 0
    lost: dict[str, None] = field(default_factory=dict)
    supports: dict[str, None] = field(default_factory=dict)

    @property
    def main(self) -> str:
        return next(iter(self.texts))

    def part(self, name: str) -> ElementTree.Element:
        if name not in self.roots:
            self.roots[name] = parsed_xml(self.texts[name])
        return self.roots[name]

    def objects(self, name: str) -> list[tuple[str, ElementTree.Element]]:
        """The objects of a part by id."""
        return [(str(key), entry) for key, entry in self._table(name).items() if key is not None]

    def title(self, item: ElementTree.Element) -> str:
        """What the object of an item is called."""
        entry = self._named(item, self.main)[1]
        return "" if entry is None else entry.get("name") or ""

    def notes(self) -> list[str]:
        told = {
            "Objects that it names and does not hold were left out": self.lost,
            "Supports, and other objects that are no part of the model, were left out": self.supports,
        }
        return [f"{what}: {named(list(ids))}." for what, ids in told.items() if ids]

    def placed(self, item: ElementTree.Element, part: str, above: FloatArray, depth: int) -> Iterator[Placed]:
        """The meshes of an item or component of a part, under the transform above it. Raises InvalidInput."""
        if depth > _DEEPEST:
            raise InvalidInput("its components are nested in a ring, or too deeply")
        part, entry = self._named(item, part)
        if entry is None:
            self.lost[str(item.get("objectid"))[:40]] = None
            return
        if entry.get("type", "model") not in _SHAPES:
            self.supports[str(entry.get("name") or entry.get("id"))[:40]] = None
            return
        world = above @ _matrix(item.get("transform"))
        self.elements = bounded(self.elements + 1, "components")
        mesh = entry.find(f"{_CORE}mesh")
        if mesh is not None:
            points = _table(mesh, "vertices/vertex", ("x", "y", "z"), np.float64)
            faces = _table(mesh, "triangles/triangle", ("v1", "v2", "v3"), np.int64)
            self.elements = bounded(self.elements + len(points) + len(faces), "vertices and faces in all")
            if np.linalg.det(world[:3, :3]) < 0:
                faces = faces[:, ::-1]
            if len(faces):
                yield transform_points(world, points), np.full(len(faces), 3), faces.ravel()
        for component in entry.iterfind(f"{_CORE}components/{_CORE}component"):
            yield from self.placed(component, part, world, depth + 1)

    def _named(self, item: ElementTree.Element, part: str) -> tuple[str, ElementTree.Element | None]:
        """The part and the object that an item means: of its own part, where it does not say another."""
        part = _plain(item.get(_PATH) or part)
        return part, self._table(part).get(item.get("objectid")) if part in self.texts else None

    def _table(self, name: str) -> dict[str | None, ElementTree.Element]:
        if name not in self.known:
            self.known[name] = {entry.get("id"): entry for entry in self.part(name).iter(f"{_CORE}object")}
        return self.known[name]


def _table(mesh: ElementTree.Element, where: str, keys: tuple[str, ...], kind: type) -> Any:
    path = "/".join(_CORE + tag for tag in where.split("/"))
    return (
        np.array([[row.attrib[key] for key in keys] for row in mesh.iterfind(path)], "U32")
        .reshape(-1, 3)
        .astype(kind)
    )


def _matrix(text: str | None) -> FloatArray:
    """(4, 4) for column vectors out of twelve numbers of a row-vector matrix."""
    matrix = np.eye(4)
    if text is not None:
        matrix[:3] = np.array(text.split(), np.float64).reshape(4, 3).T
    if not np.isfinite(matrix).all():
        raise InvalidInput("a transform in it is not finite")
    return matrix
