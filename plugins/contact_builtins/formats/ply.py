"""PLY (Turk 1994), ASCII and binary, with polygons of any size."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from contact_builtins.formats.polygons import Polygons
from contact_builtins.formats.refusal import bounded
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
    encoding, elements, body = _header(data)
    if encoding == "ascii":  # the same rows, every number a double
        body, order = np.array(body.split(), np.float64).tobytes(), "="
        elements = [element.of_doubles() for element in elements]
    elif encoding in BYTE_ORDERS:
        order = BYTE_ORDERS[encoding]
    else:
        raise InvalidInput(f"its format is {encoding!r}; ascii and the two binary ones are read")
    tables, at = dict[str, Table](), 0
    for element in elements:
        tables[element.name], at = _table(body, element, at, order)
    vertex, face = tables.get("vertex", {}), tables.get("face", {})
    points = np.stack([vertex[axis][1].astype(np.float64) for axis in "xyz"], axis=1)  # (n, 3)
    polygons = face.get("vertex_indices", face.get("vertex_index"))
    if polygons is None:
        raise InvalidInput("it has no faces, only points")
    return Polygons(points, polygons[0].astype(np.int64), polygons[1].astype(np.int64))


def _header(data: bytes) -> tuple[str, list[Element], bytes]:
    head, mark, rest = data.partition(b"end_header")
    if not data.startswith(b"ply") or not mark or b"\n" not in rest:
        raise InvalidInput('it does not start with "ply" and a header')
    encoding, elements = "", list[Element]()
    for line in head.decode("ascii", "replace").splitlines():
        words = line.split()
        if words[:1] == ["format"]:
            encoding = words[1]
        elif words[:1] == ["element"]:
            elements.append(Element(words[1], bounded(int(words[2]), f"rows of {words[1]}")))
        elif words[:2] == ["property", "list"]:
            elements[-1].properties.append(Property(words[4], TYPES[words[3]], TYPES[words[2]]))
        elif words[:1] == ["property"]:
            elements[-1].properties.append(Property(words[2], TYPES[words[1]]))
    return encoding, elements, rest[rest.index(b"\n") + 1 :]


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
    """The values of each property of the row at byte `at`, and where the next row starts."""
    values = []
    for p in element.properties:
        size = 1
        if p.size_type:
            kind = np.dtype(order + p.size_type)
            size = bounded(int(np.frombuffer(body, kind, 1, at)[0]), "corners of one face")
            at += kind.itemsize
        kind = np.dtype(order + p.value_type)
        values.append(np.frombuffer(body, kind, size, at) if size else np.zeros(0, kind))
        at += kind.itemsize * size
    return values, at
