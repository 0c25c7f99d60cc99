"""What a file is in truth, where its name says something else: a page saved for a mesh, one format as another."""

from __future__ import annotations

import re
from pathlib import Path

_HEAD = 2000  # bytes that are looked at
# what a file begins with: what it is, and the endings under which it is read; none where it is not
_BEGINNINGS: tuple[tuple[bytes, str, tuple[str, ...]], ...] = (
    (b"glTF", "a binary glTF file", (".glb", ".gltf")),
    (b"ply\n", "a PLY file", (".ply",)),
    (b"ply\r", "a PLY file", (".ply",)),
    (b"#usda", "a USD layer in text form", (".usda", ".usd")),
    (b"PXR-USDC", "a binary USD layer", (".usdc", ".usd")),
    (b"solid ", "an STL file in text form", (".stl",)),
    (b"OFF", "an OFF file", (".off",)),
    (b"Kaydara FBX Binary", "an FBX file, which is not read: export a .glb", ()),
    (b"BLENDER", "a file of Blender's: open it there, or export a .glb", ()),
    (b"\x1f\x8b", "compressed (gzip): unpack it first", ()),
    (b"(\xb5/\xfd", "compressed (zstd): unpack it first", ()),
    (b"7z\xbc\xaf", "an archive (7z): unpack it first", ()),
    (b"PK\x03\x04", "a zip archive: unpack it first", (".3mf", ".usdz")),
    (b"\x89PNG", "a picture", ()),
    (b"\xff\xd8\xff", "a picture", ()),
)
_TAGS = {
    "collada": ("a COLLADA file", (".dae",)),
    "robot": ("a URDF file", (".urdf", ".xacro")),
    "model": ("a part of a 3MF package", (".3mf",)),
    "mujoco": ("a model of MuJoCo (MJCF), which is not read: convert it to URDF", ()),
    "sdf": ("a model in SDF, which is not read: convert it to URDF", ()),
    "html": ("a web page, and not the file itself: fetch it anew", ()),
}
_TAG = re.compile(rb"<(?:\w+:)?([A-Za-z]\w*)")


def mistaken(path: Path) -> str | None:
    """A sentence on what a file is that cannot be read as what its name says; None where its name may be right."""
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except (OSError, ValueError):
        return None
    kind, suffixes = _kind(head)
    if not kind or path.suffix.lower() in suffixes:
        return None
    cure = f": give it a name in {suffixes[0]}" if ":" not in kind and suffixes else ""
    return f"By what it begins with, {path} is {kind}{cure}."


def _kind(head: bytes) -> tuple[str, tuple[str, ...]]:
    for beginning, kind, suffixes in _BEGINNINGS:
        if head.startswith(beginning):
            return kind, suffixes
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    found = _TAG.search(re.sub(rb"<!--.*?-->", b"", text)) if text.startswith(b"<") else None
    return _TAGS.get(found[1].decode().lower(), ("", ())) if found else ("", ())
