"""PLY (Turk 1994), ASCII and binary, with polygons of any size."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from contact_builtins.formats.polygons import Polygons
from contact_builtins.formats.refusal import NoSurface, bounded
from contact_builtins.formats.words import as_whole, numbers, plain, whole
from contact_core.arrays import IntArray
from contact_core.errors import InvalidInput

TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
BYTE_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}

Column = npt.NDArray[Any]
# A column of a scalar property is (rows,) values; of a list property, sizes (rows,) and all values in a row.
Table = dict[str, tuple[Column, Column]]


@dataclass(frozen=True)
class Property:
    """One property of an element. size_type: numpy type of a list's length, "" for a scalar."""

    name: str
    value_type: str
    size_type: str = ""


@dataclass(frozen=True)
class Element:
    """A table: `count` rows of properties."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)

    def of_doubles(self) -> Element:
        """The same table with every number stored as a double."""
        return Element(
            self.name, self.count, [Property(p.name, "f8", p.size_type and "f8") for p in self.properties]
        )


def parse_ply(data: bytes) -> Polygons:
    """The polygons of a PLY file's bytes. Raises InvalidInput, ValueError or LookupError on damage."""
    encoding, elements, body = _header(plain(data))
    text = encoding == "ascii"
    if text:  # the same rows, every number a double
        body, order = numbers(body.split(), lambda k: f"number {k + 1} after the header").tobytes(), "="
        elements = [element.of_doubles() for element in elements]
    elif encoding in BYTE_ORDERS:
        order = BYTE_ORDERS[encoding]
    else:
        raise InvalidInput(f"its format is {encoding!r}; ascii and the two binary ones are read")
    tables, at = dict[str, Table](), 0
    for element in elements:
        tables[element.name], at = _table(body, element, at, order)
    if text and at < len(body):
        raise InvalidInput(f"{(len(body) - at) // 8} numbers are left over; its header states fewer")
    vertex = tables.get("vertex", {})
    missing = [axis for axis in "xyz" if axis not in vertex]
    if missing:
        raise InvalidInput(f"its vertices have no {missing[0]}")
    points = np.stack([vertex[axis][1].astype(np.float64) for axis in "xyz"], axis=1)  # (n, 3)
    sizes, indices = _faces(tables)
    return Polygons(points, sizes, indices)


def _faces(tables: dict[str, Table]) -> tuple[IntArray, IntArray]:
    """Sizes and corners of the faces, or of the triangle strips (each ended by -1) that stand for them."""
    face, strips = tables.get("face", {}), tables.get("tristrips", {})
    for name in ("vertex_indices", "vertex_index"):
        if name in face:
            return as_whole(face[name][0], "the sizes of faces"), as_whole(face[name][1], "corners of faces")
        if name in strips:
            return _of_strips(as_whole(strips[name][1], "corners of strips"))
    raise NoSurface(
        "holds points and no faces (a scan or splats): make a surface of them first, in MeshLab or CloudCompare."
    )


def _of_strips(corners: IntArray) -> tuple[IntArray, IntArray]:
    windows = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1) if len(corners) > 2 else corners[:0]
    triangles = windows.reshape(-1, 3)
    place = np.arange(len(corners))
    starts = np.maximum.accumulate(np.where(corners < 0, place + 1, 0))[: len(triangles)]  # where its strip began
    odd = (place[: len(triangles)] - starts) % 2 == 1
    triangles[odd] = triangles[odd][:, [1, 0, 2]]
    triangles = triangles[(triangles >= 0).all(axis=1)]
    return np.full(len(triangles), 3), triangles.ravel()


def _header(data: bytes) -> tuple[str, list[Element], bytes]:
    """Format, elements and body. Lines end as the first one does: LF, CR LF, or CR alone."""
    if data[:3].lower() != b"ply":
        raise InvalidInput('it does not start with "ply"')
    first = re.search(rb"\r\n?|\n", data)
    newline = b"\r" if first is not None and first[0] == b"\r" else b"\n"
    encoding, elements, at, number = "", list[Element](), 0, 0
    while True:
        end = data.find(newline, at)
        if end < 0:
            raise InvalidInput("its header has no end_header line")
        words, at, number = data[at:end].decode("ascii", "replace").split(), end + 1, number + 1
        if words == ["end_header"]:
            return encoding, elements, data[at:]
        try:
            encoding = words[1] if words[:1] == ["format"] else encoding
            _declare(words, elements)
        except LookupError:
            raise InvalidInput(f"line {number} of its header is no declaration of PLY") from None


def _declare(words: list[str], elements: list[Element]) -> None:
    """Take a line of the header in; names count in either case.

    Raises InvalidInput; LookupError where words are missing or unknown.
    """
    if words[:1] == ["element"]:
        count = whole(words[2].encode(), f"the count of {words[1]}")
        elements.append(Element(words[1].lower(), bounded(count, f"rows of {words[1]}")))
    elif words[:2] == ["property", "list"]:
        elements[-1].properties.append(Property(words[4].lower(), TYPES[words[3]], TYPES[words[2]]))
    elif words[:1] == ["property"]:
        elements[-1].properties.append(Property(words[2].lower(), TYPES[words[1]]))


def _table(body: bytes, element: Element, at: int, order: str) -> tuple[Table, int]:
    """The table of an element whose rows start at byte `at`, and where the next element starts."""
    if not element.count or not element.properties:
        none = np.zeros(0)
        return {p.name: (none, none) for p in element.properties}, at
    first, _ = _row(body, element, at, order)
    sizes = [len(values) for values in first]
    layout = np.dtype(
        [
            entry
            for k, (p, size) in enumerate(zip(element.properties, sizes, strict=True))
            for entry in ((f"size{k}", order + (p.size_type or "V0")), (f"value{k}", order + p.value_type, (size,)))
        ]
    )
    if at + layout.itemsize * element.count <= len(body):  # are all lists as long as in the first row?
        rows = np.frombuffer(body, layout, element.count, at)
        listed = [k for k, p in enumerate(element.properties) if p.size_type]
        if all((rows[f"size{k}"] == sizes[k]).all() for k in listed):
            columns = {
                p.name: (np.full(element.count, sizes[k]), rows[f"value{k}"].ravel())
                for k, p in enumerate(element.properties)
            }
            return columns, at + layout.itemsize * element.count
    return _table_row_by_row(body, element, at, order)


def _table_row_by_row(body: bytes, element: Element, at: int, order: str) -> tuple[Table, int]:
    rows = []
    for _ in range(element.count):
        row, at = _row(body, element, at, order)
        rows.append(row)
    columns = zip(*rows, strict=True)
    return {
        p.name: (np.array([len(values) for values in column]), np.concatenate(column))
        for p, column in zip(element.properties, columns, strict=True)
    }, at


def _row(body: bytes, element: Element, at: int, order: str) -> tuple[list[Column], int]:
    """The values of each property of the row at byte `at`, and where the next row starts. Raises InvalidInput."""
    values = []
    for p in element.properties:
        size = 1
        if p.size_type:
            stated, at = _values(body, order + p.size_type, 1, at, element)
            size = bounded(int(as_whole(stated.astype(np.float64), "the sizes of lists")[0]), "corners of one face")
        found, at = _values(body, order + p.value_type, size, at, element)
        values.append(found)
    return values, at


def _values(body: bytes, kind: str, count: int, at: int, element: Element) -> tuple[Column, int]:
    end = at + np.dtype(kind).itemsize * count
    if end > len(body):
        raise InvalidInput(f"it ends within its {element.count} rows of {element.name}")
    return np.frombuffer(body, kind, count, at) if count else np.zeros(0, kind), end
