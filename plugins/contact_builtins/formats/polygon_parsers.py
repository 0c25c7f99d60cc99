"""OBJ, STL and OFF as their writers meant them: polygons stay polygons.

Mesh libraries fan n-gons and merge vertices while reading (ADR 0046), which loses the connection to the file's own
faces, so these small formats are parsed here, and PLY in `ply`. Each parser takes bytes and returns Polygons, or
raises InvalidInput with the line or face that is wrong; `refusal.refusing` makes a sentence of it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

import numpy as np

from contact_builtins.formats.polygons import Polygons
from contact_builtins.formats.refusal import bounded
from contact_builtins.formats.words import numbers, plain, whole, wholes, without_comment
from contact_core.arrays import BoolArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.scene.mesh_names import MeshNames, shown

_OFF_HEAD = re.compile(rb"\s*(ST)?(C)?(N)?(4)?(n)?OFF(?![A-Za-z_])[ \t]*(BINARY)?", re.IGNORECASE)
_OBJ_LOOSE = {b"l", b"p", b"curv", b"curv2", b"surf"}
_STL_NAME = re.compile(rb"^[ \t]*(?:end[ \t]*)?solid\b.*?(?=\bfacet[ \t]+normal\b|$)", re.MULTILINE)
_STL_MARK = re.compile(rb"\b(?:vertex\s+(\S+)\s+(\S+)\s+(\S+)|(outer)\s+loop\b|(endloop)\b)")
_STL_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def parse_obj(data: bytes) -> Polygons:
    """Wavefront OBJ: `v` and `f` lines (negative indices count from the end); everything else is skipped."""
    coordinates: list[bytes] = []
    vertex_lines: list[int] = []
    corners: list[bytes] = []
    face_lines: list[int] = []
    sizes: list[int] = []
    before: list[int] = []  # how many vertices stand before each face
    named: dict[tuple[bytes, bytes], int] = {(b"", b""): 0}  # object and group, numbered
    within, group_of = {b"o": b"", b"g": b""}, list[int]()
    current = 0
    loose = 0
    for number, line in _obj_lines(plain(data)):
        words = without_comment(line).split()
        kind = words[0].lower() if words else b""
        if kind == b"v":
            if len(words) < 4:
                raise InvalidInput(f"line {number} is a vertex with {len(words) - 1} coordinates instead of 3")
            coordinates += words[1:4]
            vertex_lines.append(number)
        elif kind in (b"f", b"fo"):
            corners += words[1:]
            face_lines.append(number)
            sizes.append(len(words) - 1)
            before.append(len(vertex_lines))
            group_of.append(current)
        elif kind in (b"o", b"g"):
            within[kind] = b" ".join(words[1:])
            current = named.setdefault((within[b"o"], within[b"g"]), len(named))
        loose += kind in _OBJ_LOOSE
    if loose and not sizes:
        raise InvalidInput("it holds points, lines or curves, but no faces")
    points = numbers(coordinates, lambda k: f"line {vertex_lines[k // 3]}").reshape(-1, 3)
    size_of = np.array(sizes, np.int64)
    indices = _obj_indices(corners, np.repeat(face_lines, size_of), np.repeat(before, size_of), len(points))
    notes = (f"{loose} points, lines and curves were left out; only faces make a surface.",) if loose else ()
    kept, told = _without_stand_ins(named, np.array(group_of, np.int64))
    return Polygons(points, size_of, indices, (*notes, *told), kept)


def _without_stand_ins(
    named: Iterable[tuple[bytes, bytes]], group_of: IntArray
) -> tuple[BoolArray | None, list[str]]:
    """Faces that are a surface by the names of their objects and groups, and notes. group_of: (f,)."""
    there = np.unique(group_of)
    names = [tuple(name.decode("utf-8", "replace") for name in both if name) or ("",) for both in named]
    kept, notes = shown([MeshNames(names[k]) for k in there.tolist()])
    return (np.isin(group_of, there[kept]) if len(kept) < len(there) else None), notes


def _obj_indices(corners: list[bytes], lines: IntArray, before: IntArray, count: int) -> IntArray:
    """Point of each corner, from words such as 1, 1/2/3, -1//2. lines, before: the line of each corner, and the
    number of vertices before it."""
    told = wholes([word.partition(b"/")[0] for word in corners], lambda k: f"line {lines[k]}")
    wrong = (told == 0) | (told < -before) | (told > count)
    if wrong.any():
        k = int(np.argmax(wrong))
        there = f"only {before[k]} come before it" if told[k] < 0 else f"there are {count}, counted from 1"
        raise InvalidInput(f"line {lines[k]} names vertex {told[k]}, but {there}")
    return np.asarray(np.where(told > 0, told - 1, before + told), np.int64)


def _obj_lines(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Number and text of each line. A backslash at the end continues vertices and faces, not comments or names."""
    held, start = b"", 0
    for number, line in enumerate(data.splitlines(), 1):
        if held:
            line = held + b" " + line
        if b"\\" in line and _continues(line):
            held, start = without_comment(line).rstrip()[:-1], start or number
            continue
        yield start or number, line
        held, start = b"", 0
    if held:
        yield start, held


def _continues(line: bytes) -> bool:
    text = without_comment(line)
    return text.rstrip().endswith(b"\\") and text.split(None, 1)[0].lower() in (b"v", b"f", b"fo", b"l", b"p")


def parse_off(data: bytes) -> Polygons:
    """Geomview OFF, also COFF, NOFF and STOFF (what follows the position of a vertex is skipped)."""
    text = b"\n".join(map(without_comment, plain(data).splitlines()))
    head = _OFF_HEAD.match(text)
    if head is None:
        raise InvalidInput("the first word is not OFF")
    if head[4] or head[5] or head[6]:
        raise InvalidInput("it is OFF in binary form or of four dimensions, which is not read; save it as text OFF")
    lines = [words for words in map(bytes.split, text[head.end() :].splitlines()) if words]
    if not lines or len(lines[0]) < 2:
        raise InvalidInput("after the word OFF the numbers of vertices and faces are expected in one line")
    vertices, faces = (
        bounded(whole(word, "the counts"), what)
        for word, what in zip(lines[0], ("vertices", "faces"), strict=False)
    )
    if len(lines) < 1 + vertices + faces:
        raise InvalidInput(f"it states {vertices} vertices and {faces} faces, but ends after {len(lines)} lines")
    rows = lines[1 : 1 + vertices]
    short = next((k for k, row in enumerate(rows) if len(row) < 3), None)
    if short is not None:
        raise InvalidInput(f"vertex {short} has {len(rows[short])} coordinates instead of 3")
    points = numbers([word for row in rows for word in row[:3]], lambda k: f"vertex {k // 3}").reshape(-1, 3)
    rows = lines[1 + vertices : 1 + vertices + faces]
    sizes = wholes([row[0] for row in rows], lambda k: f"face {k}")
    room = np.array([len(row) - 1 for row in rows], np.int64)
    if ((sizes < 0) | (sizes > room)).any():
        k = int(np.argmax((sizes < 0) | (sizes > room)))
        raise InvalidInput(f"face {k} states {sizes[k]} corners, but {room[k]} numbers follow")
    corners = [word for row, size in zip(rows, sizes.tolist(), strict=True) for word in row[1 : size + 1]]
    owner = np.repeat(np.arange(faces), sizes)
    return Polygons(points, sizes, wholes(corners, lambda k: f"face {owner[k]}"))


def parse_stl(data: bytes) -> Polygons:
    """STL, binary (recognised by its length, else by bytes that no text has) or ASCII."""
    stated = int.from_bytes(data[80:84], "little") if len(data) >= 84 else 0
    exact = len(data) == 84 + 50 * stated
    text = b"" if exact else plain(data)
    if text.lstrip()[:5].lower() == b"solid" and not (len(data) >= 84 and b"\0" in text[80:1000]):
        return _text_stl(text.lower())
    if len(data) < 84:
        raise InvalidInput("it does not begin with the word solid, and is too short to be binary STL")
    room = (len(data) - 84) // 50
    if stated > room or (room and not stated):
        raise InvalidInput(f"it states {stated} facets, but has room for {room}")
    points = np.frombuffer(data, _STL_RECORD, bounded(stated, "facets"), 84)["corners"].reshape(-1, 3)
    return Polygons.of_triangles(points.astype(np.float64), np.arange(len(points)).reshape(-1, 3))


def _text_stl(text: bytes) -> Polygons:
    """Each loop is one polygon: three corners by the standard, more from some writers."""
    marks = _STL_MARK.findall(_STL_NAME.sub(b"", b"\n".join(text.splitlines())))  # (x, y, z, "outer", "endloop")
    closes = np.array([bool(mark[4]) for mark in marks], np.bool_)
    opens = np.array([bool(mark[3]) for mark in marks], np.bool_)
    if opens.sum() != closes.sum() or not (len(marks) and closes[-1]):
        raise InvalidInput("its last facet is not complete, or it has none")
    at = np.flatnonzero(~opens & ~closes)
    sizes = np.diff(np.searchsorted(at, np.flatnonzero(closes)), prepend=0)
    if (sizes < 3).any():
        raise InvalidInput(f"facet {int(np.argmax(sizes < 3))} has {int(sizes.min())} corners instead of 3")
    ends = np.cumsum(sizes)
    words = [word for k in at.tolist() for word in marks[k][:3]]
    points = numbers(words, lambda k: f"facet {int(np.searchsorted(ends, k // 3, 'right'))}")
    return Polygons(points.reshape(-1, 3), sizes, np.arange(len(at)))
