"""What real tools write into text meshes: every way of writing one tetrahedron reads as that tetrahedron, or is
refused in words that name the place. Kinds after tinyobjloader#394, assimp#3532, assimp#5890, numpy-stl#154."""

from __future__ import annotations

import re
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from contact_builtins.formats.mesh_files import MeshFiles
from contact_core.document.asset import Asset
from contact_core.errors import FileRefused
from contact_core.geometry.report import report

POINTS = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
OBJ = b"".join(b"v %g %g %g\n" % tuple(p) for p in POINTS) + b"".join(
    b"f %d %d %d\n" % tuple(i + 1 for i in f) for f in FACES
)
OFF_ROWS = b"".join(b"%g %g %g\n" % tuple(p) for p in POINTS) + b"".join(b"3 %d %d %d\n" % tuple(f) for f in FACES)
OFF = b"OFF\n4 4 6\n" + OFF_ROWS
PLY_HEAD = (
    b"ply\nformat ascii 1.0\ncomment made here\nelement vertex 4\nproperty float x\nproperty float y\n"
    b"property float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
)
PLY = PLY_HEAD + OFF_ROWS
BODY = b"".join(struct.pack("<3f", *p) for p in POINTS) + b"".join(struct.pack("<B3i", 3, *f) for f in FACES)
BINARY_HEAD = PLY_HEAD.replace(b"ascii", b"binary_little_endian")
STL = (
    b"solid tetra\n"
    + b"".join(
        b"facet normal 0 0 0\n outer loop\n"
        + b"".join(b"  vertex %g %g %g\n" % tuple(POINTS[i]) for i in f)
        + b" endloop\nendfacet\n"
        for f in FACES
    )
    + b"endsolid tetra\n"
)


def binary_stl(header: bytes, tail: bytes = b"") -> bytes:
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *(c for i in f for c in POINTS[i]), 0) for f in FACES)
    return header.ljust(80, b" ") + struct.pack("<I", len(FACES)) + rows + tail


def read(folder: Path, name: str, content: bytes) -> Asset:
    path = folder / name
    path.write_bytes(content)
    return MeshFiles().read(path)


def is_the_tetrahedron(asset: Asset) -> bool:
    facts = report(asset.mesh)
    same = np.array_equal(np.unique(asset.mesh.points, axis=0), np.unique(np.array(POINTS), axis=0))
    return same and facts.is_watertight and facts.faces == 4 and bool(np.isclose(facts.volume, 1 / 6))


def wide(text: bytes, encoding: str, mark: bytes = b"") -> bytes:
    return mark + text.decode().encode(encoding)


def with_attribute(more: bytes) -> bytes:
    """Every corner of every face of the OBJ file with more behind its vertex."""
    return re.sub(rb"f (\d) (\d) (\d)", rb"f \1%s \2%s \3%s" % (more, more, more), OBJ)


def counting_back() -> bytes:
    return re.sub(rb"f (\d) (\d) (\d)", lambda m: b"f %d %d %d" % tuple(int(g) - 5 for g in m.groups()), OBJ)


TEXTS = {"m.obj": OBJ, "m.off": OFF, "m.ply": PLY, "m.stl": STL}
CR = OBJ.replace(b"\n", b"\r")
WRITTEN = {
    **{f"byte order mark {name}": (name, b"\xef\xbb\xbf" + text) for name, text in TEXTS.items()},
    **{
        f"{coding} {name}": (name, wide(text, coding, mark))
        for name, text in TEXTS.items()
        for coding, mark in {
            "utf-16-le": b"\xff\xfe",
            "utf-16-be": b"\xfe\xff",
            "utf-32-le": b"\xff\xfe\0\0",
        }.items()
    },
    "UTF-16 without a mark": ("m.obj", wide(OBJ, "utf-16-le")),
    "CR LF": ("m.obj", OBJ.replace(b"\n", b"\r\n")),
    "CR": ("m.obj", CR),
    "mixed ends of lines": ("m.obj", CR[:20] + OBJ[20:60].replace(b"\n", b"\r\n") + OBJ[60:]),
    "comment after everything": ("m.obj", OBJ.replace(b"\n", b" # thumb\n")),
    "comment glued": ("m.obj", OBJ.replace(b"\n", b"#thumb\n")),
    "backslash in a comment": ("m.obj", b"# C:\\meshes\\\n" + OBJ),
    "backslash in a comment after a vertex": ("m.obj", OBJ.replace(b"v 0 0 0\n", b"v 0 0 0 # C:\\\n")),
    "backslash after a name": ("m.obj", b"mtllib C:\\lib\\\nusemtl a\\\n" + OBJ),
    "continued lines": ("m.obj", OBJ.replace(b"f 1 3", b"f \\\n1 \\ \n3").replace(b"v 1 0", b"v 1 \\\r\n0")),
    "code page 1252": ("m.obj", b"usemtl caf\xe9 \x85 \x93q\x94\n# \xfc\n" + OBJ.replace(b"\n", b" # \x85\n")),
    "tabs and blanks": ("m.obj", OBJ.replace(b" ", b"\t ").replace(b"\n", b" \t \n")),
    "blank lines": ("m.obj", b"\n \n\t\n" + OBJ.replace(b"\n", b"\n\n")),
    "counting back": ("m.obj", counting_back()),
    "normals": ("m.obj", b"vn 0 0 1\nvt 0 0\n" + with_attribute(b"//1")),
    "textures": ("m.obj", b"vt 0 0\n" + with_attribute(b"/1")),
    "textures and no normals": ("m.obj", b"vt 0 0\n" + with_attribute(b"/1/")),
    "colours": ("m.obj", re.sub(rb"(v .*)", rb"\1 0.5 0.25 1", OBJ)),
    "weights": ("m.obj", re.sub(rb"(v .*)", rb"\1 1.0", OBJ)),
    "lines and points": ("m.obj", OBJ + b"l 1 2 3\np 1\n"),
    "groups": ("m.obj", b"o a\ng b c\ns off\n" + OBJ),
    "faces first": ("m.obj", OBJ[OBJ.index(b"f") :] + OBJ[: OBJ.index(b"f")]),
    "plus signs and exponents": ("m.obj", OBJ.replace(b"v 1 ", b"v +1.0E+00 ")),
    "no number in a vertex that is not used": ("m.obj", OBJ + b"v nan inf 0\nv -1.#IND 1.#QNAN 1.#INF\n"),
    "a long line": ("m.obj", b"# " + b"x" * 300_000 + b"\n" + OBJ),
    "no newline at the end": ("m.obj", OBJ.rstrip()),
    "OFF glued": ("m.off", b"OFF4 4 6\n" + OFF_ROWS),
    "OFF counts beside": ("m.off", b"off 4 4 6\n" + OFF_ROWS),
    "OFF comment first": ("m.off", b"# by a tool\n" + OFF.replace(b"\n", b" # c\n")),
    "OFF without edges": ("m.off", b"OFF\n4 4\n" + OFF_ROWS),
    "OFF colours": ("m.off", b"COFF\n4 4 0\n" + OFF_ROWS.replace(b"\n", b" 255 0 0 255\n")),
    "OFF CR": ("m.off", OFF.replace(b"\n", b"\r")),
    "OFF comment first, CR": ("m.off", (b"# by a tool\n" + OFF).replace(b"\n", b"\r")),
    "PLY CR": ("m.ply", PLY.replace(b"\n", b"\r")),
    "PLY CR LF": ("m.ply", PLY.replace(b"\n", b"\r\n")),
    "PLY binary": ("m.ply", BINARY_HEAD + BODY),
    "PLY binary CR": ("m.ply", BINARY_HEAD.replace(b"\n", b"\r") + BODY),
    "PLY binary CR LF": ("m.ply", BINARY_HEAD.replace(b"\n", b"\r\n") + BODY),
    "PLY comment end_header": ("m.ply", PLY.replace(b"made here", b"end_header")),
    "PLY comment ends with end_header": (
        "m.ply",
        PLY.replace(b"made here", b"before\ncomment the end_header\nobj_info end_header"),
    ),
    "PLY binary comment end_header": ("m.ply", (BINARY_HEAD + BODY).replace(b"made here", b"end_header")),
    "PLY blanks in the header": (
        "m.ply",
        PLY.replace(b"\nelement", b" \n  element\t").replace(b"end_header", b"end_header "),
    ),
    "PLY code page 1252": ("m.ply", PLY.replace(b"made here", b"\xe9\x85")),
    "PLY strips": (
        "m.ply",
        PLY_HEAD.replace(b"face 4", b"tristrips 1").replace(b"uchar", b"int")
        + OFF_ROWS[: OFF_ROWS.index(b"3 0 2 1")]
        + b"12 0 2 1 3 -1 0 3 2 -1 0 1 3\n",
    ),
    "STL capitals": ("m.stl", STL.upper()),
    "STL mixed capitals": ("m.stl", STL.title()),
    "STL CR": ("m.stl", STL.replace(b"\n", b"\r")),
    "STL in one line": ("m.stl", STL.replace(b"\n", b" ")),
    "STL two solids": (
        "m.stl",
        STL.replace(b"endloop\nendfacet\nfacet", b"endloop\nendfacet\nendsolid a\nsolid b\nfacet", 1),
    ),
    "STL name of a vertex": ("m.stl", STL.replace(b"tetra", b"vertex loop 1 facet \xe9")),
    "STL no name": ("m.stl", STL.replace(b" tetra", b"")),
    "STL binary": ("m.stl", binary_stl(b"made here")),
    "STL binary solid": ("m.stl", binary_stl(b"solid tetra")),
    "STL binary solid facet": ("m.stl", binary_stl(b"solid facet normal vertex endsolid")),
    "STL binary solid and a tail": ("m.stl", binary_stl(b"solid facet", b"\0\0")),
    "STL binary mark": ("m.stl", binary_stl(b"\xef\xbb\xbfsolid")),
    "STL binary wide header": ("m.stl", binary_stl("solid".encode("utf-16"))),
}


@pytest.mark.parametrize("way", WRITTEN)
def test_read_as_it_was_meant(tmp_path: Path, way: str) -> None:
    name, content = WRITTEN[way]
    assert is_the_tetrahedron(read(tmp_path, name, content)), read(tmp_path, name, content).mesh


def test_what_is_left_out_is_noted(tmp_path: Path) -> None:
    asset = read(tmp_path, "m.obj", OBJ + b"l 1 2\np 3\nv nan 0 0\n")
    assert any("2 points, lines and curves" in note for note in asset.notes)
    assert any("1 vertices that no face uses" in note for note in asset.notes)
    assert asset.source_vertices is not None and asset.source_vertices[4] == -1


def test_polygons_of_text_stl_stay_polygons(tmp_path: Path) -> None:
    quad = b"solid\nfacet normal 0 0 1\nouter loop\n" + b"".join(
        b"vertex %d %d 0\n" % corner for corner in [(0, 0), (1, 0), (1, 1), (0, 1)]
    )
    asset = read(tmp_path, "m.stl", quad + b"endloop\nendfacet\nendsolid")
    assert len(asset.mesh.faces) == 2 and np.isclose(report(asset.mesh).area, 1.0)


DEEP = b"9" * 5000
REFUSED = {
    "comma OBJ": (
        "m.obj",
        OBJ.replace(b"v 1 0 0", b"v 1,5 0 0"),
        r"line 2: '1,5' is not a number; decimals need a point",
    ),
    "comma OFF": ("m.off", OFF.replace(b"1 0 0", b"1,5 0 0"), r"vertex 1: '1,5' is not a number"),
    "comma PLY": ("m.ply", PLY.replace(b"1 0 0", b"1,5 0 0"), r"number 4 after the header: '1,5' is not a number"),
    "comma STL": ("m.stl", STL.replace(b"vertex 1 0 0", b"vertex 1,5 0 0", 1), r"facet 0: '1,5' is not a number"),
    "underscore": ("m.obj", OBJ.replace(b"v 1 0 0", b"v 1_0 0 0"), "line 2: '1_0' is not a number"),
    "underscore in a face": ("m.obj", OBJ.replace(b"f 1 3 2", b"f 1 0_3 2"), "line 5: '0_3' is not a whole number"),
    "face of words": ("m.obj", OBJ.replace(b"f 1 3 2", b"f a b c"), "line 5: 'a' is not a whole number"),
    "face of fractions": ("m.obj", OBJ.replace(b"f 1 3 2", b"f 1.5 3 2"), "line 5: '1.5' is not a whole number"),
    "face without a vertex": ("m.obj", OBJ.replace(b"f 1 3 2", b"f /1 3 2"), "line 5: '' is not a whole number"),
    "counting back too far": (
        "m.obj",
        OBJ.replace(b"f 1 3 2", b"f -1 -9 -2"),
        "line 5 names vertex -9, but only 4",
    ),
    "many digits OBJ": ("m.obj", OBJ.replace(b"f 1 ", b"f %s " % DEEP, 1), "line 5: '9+...' is too large"),
    "many digits OFF": ("m.off", OFF.replace(b"4 4 6", b"%s 4 6" % DEEP), "too large"),
    "many digits PLY": ("m.ply", PLY.replace(b"face 4", b"face %s" % DEEP), "too large"),
    "many digits in a face": ("m.off", OFF.replace(b"3 0 2 1", b"3 %s 2 1" % DEEP), "face 0: '9+...' is too large"),
    "zero byte": ("m.obj", OBJ.replace(b"v 1 0 0", b"v 1\0 0 0"), r"line 2: '1\?' is not a number"),
    "only lines": ("m.obj", OBJ[: OBJ.index(b"f")] + b"l 1 2\n", "points, lines or curves, but no faces"),
    "vertex of two": ("m.obj", OBJ.replace(b"v 1 0 0", b"v 1 0"), "line 2 is a vertex with 2 coordinates"),
    "no number in use": ("m.obj", OBJ.replace(b"v ", b"v 1.#QNAN "), "not finite"),
    "broken UTF-16": ("m.obj", b"\xff\xfe" + OBJ.decode().encode("utf-16-le")[:-1], "begins as UTF-16 text"),
    "empty OBJ": ("m.obj", b"", "it is empty"),
    "blank OFF": ("m.off", b" \n\n", "it is empty"),
    "empty PLY": ("m.ply", b"", "it is empty"),
    "empty STL": ("m.stl", b"", "it is empty"),
    "OFF vertex of two": ("m.off", OFF.replace(b"1 0 0", b"1 0", 1), "vertex 1 has 2 coordinates"),
    "OFF face too short": ("m.off", OFF.replace(b"3 0 2 1", b"5 0 2 1"), "face 0 states 5 corners, but 3"),
    "OFF binary": ("m.off", b"OFF BINARY\n" + OFF_ROWS, "binary form"),
    "OFF one count": ("m.off", b"OFF\n4\n" + OFF_ROWS, "are expected in one line"),
    "OFF words": ("m.off", b"OFFICE\n", "not OFF"),
    "PLY rows longer": (
        "m.ply",
        PLY.replace(b"0 0 1\n", b"0 0 1 7\n", 1),
        "must be whole numbers|left over|ends within",
    ),
    "PLY left over": ("m.ply", PLY + b"7 8", "2 numbers are left over"),
    "PLY cut": ("m.ply", PLY[:-9], "ends within its 4 rows of face"),
    "PLY binary cut": ("m.ply", BINARY_HEAD + BODY[:-1], "ends within its 4 rows of face"),
    "PLY words missing": ("m.ply", PLY.replace(b"property float x", b"property float"), "line 5 of its header"),
    "PLY unknown type": ("m.ply", PLY.replace(b"float x", b"half x"), "line 5 of its header"),
    "PLY property first": ("m.ply", PLY.replace(b"element vertex 4\n", b""), "line 4 of its header"),
    "PLY no x": ("m.ply", PLY.replace(b"float x", b"float u"), "have no x"),
    "PLY no end": ("m.ply", PLY_HEAD.replace(b"end_header", b"end"), "no end_header"),
    "PLY no number of corners": ("m.ply", PLY.replace(b"3 0 2 1", b"nan 0 2 1"), "must be whole numbers, but nan"),
    "PLY fraction of a corner": ("m.ply", PLY.replace(b"3 0 2 1", b"3 0 2.5 1"), "must be whole numbers, but 2.5"),
    "STL cut": ("m.stl", STL[: STL.rindex(b"vertex")], "last facet is not complete"),
    "STL corner missing": ("m.stl", STL.replace(b"  vertex 1 0 0\n", b"", 1), "facet 0 has 2 corners"),
    "STL binary cut": ("m.stl", binary_stl(b"x")[:-1], "states 4 facets, but has room for 3"),
    "STL short": ("m.stl", b"abc", "too short"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused_with_the_place_in_words(tmp_path: Path, case: str) -> None:
    name, content, words = REFUSED[case]
    with pytest.raises(FileRefused, match=words) as refusal:
        read(tmp_path, name, content)
    speaks_plainly(str(refusal.value))


PYTHON_WORDS = (
    "invalid literal", "could not convert", "Exceeds the limit", "embedded null", "recursion depth", "codec",
    "buffer",
    "out of range", "out of bounds", "not iterable", "NoneType", "object", "subscriptable", "unpack", "Traceback",
    "struct", "dtype", "reshape", "broadcast", "argument", "cannot convert", "array",
)  # fmt: skip


def speaks_plainly(text: str) -> None:
    assert text.endswith(".") and "\n" not in text and len(text) < 700
    assert not [word for word in PYTHON_WORDS if word in text], text


def test_a_name_that_no_file_can_have_is_refused_in_words() -> None:
    for name in ("a\0b.obj", "\0.stl"):
        with pytest.raises(FileRefused, match="cannot be the name of a file") as refusal:
            MeshFiles().read(Path(name))
        speaks_plainly(str(refusal.value))


@settings(max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_changed_file_is_read_or_refused_in_words(tmp_path: Path, data: st.DataObject) -> None:
    """Mutants of every way of writing above: bytes changed, cut, moved, repeated, and hostile words put in."""
    name, content = data.draw(st.sampled_from(list(WRITTEN.values())))
    changed = bytearray(content[:4000])
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(changed)))
        until = min(len(changed), at + data.draw(st.integers(0, 12)))
        changed[at:until] = data.draw(HOSTILE)
    survives(tmp_path, name, bytes(changed))


HOSTILE = st.one_of(
    st.binary(max_size=3),
    st.sampled_from([
        b"", b"\n", b"\r", b"\\\n", b"#", b" -1 ", b" 0 ", b" 99999999999999999999 ", b" 1e999 ", b" nan ", b"1_0",
        b" 1,5 ", b"\xef\xbb\xbf", b"\0", b"\xff\xfe", DEEP, b"f ", b"v ", b"end_header\n",
        b"property list float int a\n",
        b"element vertex 20000000\n", b" vertex ", b" endloop ", b"OFF", b"solid ", b"\xff\xff\xff\x7f",
        b"/", b"//", b"+",
    ]),
)  # fmt: skip


def survives(folder: Path, name: str, content: bytes) -> None:
    try:
        asset = read(folder, name, content)
    except FileRefused as refusal:
        speaks_plainly(str(refusal))
    else:
        assert np.isfinite(asset.mesh.points).all() and len(asset.mesh.faces)
