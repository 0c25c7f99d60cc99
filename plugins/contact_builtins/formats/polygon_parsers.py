"""OBJ, STL and OFF as their writers meant them: polygons stay polygons.

Mesh libraries fan n-gons and merge vertices while reading (ADR 0040), which loses the way back to the file,
so these small formats are parsed here, and PLY in `ply`. Each parser takes bytes and returns Polygons, or raises
InvalidInput, ValueError or LookupError; `refusal.refusing` makes a sentence of it.
"""

from __future__ import annotations

import numpy as np

from contact_builtins.formats.polygons import Polygons
from contact_builtins.formats.refusal import bounded
from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput


def parse_obj(data: bytes) -> Polygons:
    """Wavefront OBJ: `v` and `f` lines (negative indices count from the end); everything else is skipped."""
    points: list[list[float]] = []
    sizes: list[int] = []
    indices: list[int] = []
    for number, line in enumerate(data.replace(b"\\\n", b" ").replace(b"\\\r\n", b" ").splitlines(), 1):
        words = line.split()
        if not words:
            continue
        if words[0] == b"v":
            if len(words) < 4:
                raise InvalidInput(f"line {number} is a vertex with {len(words) - 1} coordinates instead of 3")
            points.append([float(word) for word in words[1:4]])
        elif words[0] == b"f":
            corners = [int(word.split(b"/", 1)[0]) for word in words[1:]]
            if 0 in corners:
                raise InvalidInput(f"line {number} names vertex 0, but OBJ counts from 1")
            sizes.append(len(corners))
            indices.extend(corner - 1 if corner > 0 else len(points) + corner for corner in corners)
    return Polygons(_points(points), np.array(sizes, np.int64), np.array(indices, np.int64))


def parse_off(data: bytes) -> Polygons:
    """Geomview OFF, also COFF and NOFF (extra numbers after a vertex are skipped); comments start with #."""
    lines = [line.split(b"#", 1)[0].split() for line in data.splitlines()]
    lines = [words for words in lines if words]
    if not lines or not lines[0][0].upper().endswith(b"OFF"):
        raise InvalidInput("the first word is not OFF")
    counts, at = (lines[0][1:], 1) if len(lines[0]) > 1 else (lines[1], 2)
    vertices, faces = bounded(int(counts[0]), "vertices"), bounded(int(counts[1]), "faces")
    if len(lines) < at + vertices + faces:
        raise InvalidInput(f"it states {vertices} vertices and {faces} faces, but ends after {len(lines)} lines")
    points = [[float(word) for word in lines[at + k][:3]] for k in range(vertices)]
    sizes: list[int] = []
    indices: list[int] = []
    for words in lines[at + vertices : at + vertices + faces]:
        size = int(words[0])
        if not 0 <= size < len(words):
            raise InvalidInput(f"a face states {size} corners, but {len(words) - 1} numbers follow")
        sizes.append(size)
        indices.extend(int(word) for word in words[1 : size + 1])
    return Polygons(_points(points), np.array(sizes, np.int64), np.array(indices, np.int64))


def parse_stl(data: bytes) -> Polygons:
    """STL, binary (recognised by its exact length) or ASCII."""
    stated = int.from_bytes(data[80:84], "little") if len(data) >= 84 else 0
    if len(data) >= 84 and len(data) >= 84 + 50 * stated and not _is_ascii_stl(data):
        record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
        corners = np.frombuffer(data, record, bounded(stated, "facets"), 84)["corners"]
        points = corners.reshape(-1, 3).astype(np.float64)
    elif _is_ascii_stl(data):
        words = data.split()
        at = [k for k, word in enumerate(words) if word == b"vertex"]
        points = _points([[float(word) for word in words[k + 1 : k + 4]] for k in at])
    else:
        raise InvalidInput(f"it states {stated} facets, but has room for {max(len(data) - 84, 0) // 50}")
    if len(points) % 3:
        raise InvalidInput(f"{len(points)} corners do not make whole triangles")
    return Polygons.of_triangles(points, np.arange(len(points)).reshape(-1, 3))


def _is_ascii_stl(data: bytes) -> bool:
    return data.lstrip()[:5].lower() == b"solid" and b"facet" in data[:2000].lower()


def _points(rows: list[list[float]]) -> FloatArray:
    if any(len(row) != 3 for row in rows):
        raise InvalidInput("a vertex has fewer than 3 coordinates")
    return np.array(rows, np.float64).reshape(-1, 3)
