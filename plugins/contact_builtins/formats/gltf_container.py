"""glTF 2.0 as bytes: the GLB container, buffers, accessors (strided, normalised, sparse).

Nothing outside the file's own folder is ever opened, and no count is believed before it is checked.
"""

from __future__ import annotations

import base64
import binascii
import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import numpy.typing as npt

from contact_builtins.formats import gltf_meshopt
from contact_builtins.formats.refusal import bounded, file_bytes, file_of
from contact_core.errors import FileRefused, InvalidInput

MAGIC, JSON_CHUNK, BINARY_CHUNK = 0x46546C67, 0x4E4F534A, 0x004E4942
COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
COMPRESSED = {
    "KHR_draco_mesh_compression": "Draco",
    "EXT_meshopt_compression": "meshopt",
    "KHR_meshopt_compression": "meshopt",
}
# Required extensions that change looks, behaviour or meaning, but not shapes.
HARMLESS = (
    "KHR_materials_", "EXT_materials_", "ADOBE_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_",
    "KHR_lights_", "EXT_lights_", "KHR_animation_", "KHR_node_", "KHR_xmp", "KHR_audio", "KHR_interactivity",
    "KHR_physics_", "KHR_environment", "KHR_techniques_", "KHR_blend", "KHR_character", "KHR_mesh_variants",
    "EXT_structural_metadata", "EXT_mesh_features", "EXT_instance_features", "EXT_feature_", "EXT_mesh_manifold",
    "EXT_property_", "EXT_bmesh_encoding", "MSFT_physics", "MSFT_audio", "MSFT_lod", "MSFT_packing_",
    "CESIUM_primitive_outline", "AGI_", "ASOBO_", "BLENDER_", "FB_ngon_encoding", "GODOT_", "MOZ_", "NEEDLE_",
    "MX_", "OMI_", "VRM",
)  # fmt: skip
INSTANCING = "EXT_mesh_gpu_instancing"
UNDERSTOOD = (INSTANCING, "KHR_mesh_quantization", "KHR_draco_mesh_compression", *gltf_meshopt.NAMES)
_OLD = (
    "{path} is glTF version {version}, an old format that is laid out otherwise; version 2 is read. Convert it"
    " (gltf-pipeline does) or export it anew as glTF 2.0."
)


@dataclass(frozen=True, eq=False)
class Gltf:
    """A parsed file. document: its JSON. binary: the GLB's own chunk. path: where external buffers are sought."""

    document: dict[str, Any]
    binary: bytes
    path: Path

    def entries(self, kind: str) -> list[dict[str, Any]]:
        """A top-level list of the document ("nodes", "meshes"), empty where absent."""
        if kind not in self._checked:  # once: a look at every entry for each entry is a square
            found = self.document.get(kind, [])
            if not isinstance(found, list) or not all(isinstance(entry, dict) for entry in found):
                raise InvalidInput(f"{kind} is not a list of objects")
            self._checked[kind] = found
        return self._checked[kind]

    def entry(self, kind: str, index: Any) -> dict[str, Any]:
        """One entry of a top-level list. Raises InvalidInput when there is none."""
        entries = self.entries(kind)
        if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(entries):
            raise InvalidInput(f"it names {kind}[{index!r}], but has {len(entries)} {kind}")
        return entries[index]

    @cached_property
    def _checked(self) -> dict[str, list[dict[str, Any]]]:
        return {}

    @cached_property
    def _buffers(self) -> list[bytes]:
        return [self._buffer(index, entry) for index, entry in enumerate(self.entries("buffers"))]

    def view_bytes(self, index: Any) -> bytes:
        """The bytes of a buffer view."""
        data, start, end, _ = self.view(index)
        return data[start:end]

    def _buffer(self, index: int, entry: dict[str, Any]) -> bytes:
        uri = entry.get("uri")
        if uri is None and any(name in COMPRESSED for name in entry.get("extensions", {})):
            return b""  # stands for what its views hold compressed
        if uri is None:
            if index:
                raise InvalidInput(f"buffer {index} has no bytes")
            data = self.binary
        elif uri[:5].lower() == "data:":  # schemes and media types are written in either case
            head, _, text = uri.partition(",")
            encoded = head.lower().endswith(";base64")
            data = _decode_base64(unquote(text)) if encoded else unquote(text, "latin-1").encode("latin-1")
        else:
            data = file_bytes(_beside(self.path, uri))
        if len(data) < entry["byteLength"]:
            raise InvalidInput(f"buffer {index} states {entry['byteLength']} bytes, but {len(data)} are there")
        return data

    def view(self, index: Any) -> tuple[bytes, int, int, int]:
        """A buffer view: the buffer's bytes, where the view starts and ends in them, and its stride (0: packed)."""
        entry = self.entry("bufferViews", index)
        buffer = self.entry("buffers", entry["buffer"])
        # a compressed view may come with its uncompressed twin; where it does not, its buffer has no bytes
        squeezed = any(name in COMPRESSED for name in entry.get("extensions", {}))
        empty = any(name in COMPRESSED for name in buffer.get("extensions", {})) or not self.binary
        if squeezed and empty and "uri" not in buffer:
            return self._unsqueezed(index, entry)
        data = self._buffers[entry["buffer"]]
        start = bounded_offset(entry.get("byteOffset", 0))
        end = start + bounded_offset(entry["byteLength"])
        if end > len(data):
            raise InvalidInput(f"bufferViews[{index}] ends at byte {end} of {len(data)}")
        return data, start, end, bounded_offset(entry.get("byteStride", 0))

    def _unsqueezed(self, index: int, entry: dict[str, Any]) -> tuple[bytes, int, int, int]:
        """A compressed view without a twin. Raises FileRefused where nothing here reads it."""
        told = next((entry["extensions"][name] for name in gltf_meshopt.NAMES if name in entry["extensions"]), None)
        if told is None:
            raise FileRefused(_compressed(self.path, entry["extensions"]))
        if index not in self._decoded:
            data = self._buffers[told["buffer"]]
            start = bounded_offset(told.get("byteOffset", 0))
            end = start + bounded_offset(told["byteLength"])
            if end > len(data):
                raise InvalidInput(f"bufferViews[{index}] ends at byte {end} of {len(data)}")
            self._decoded[index] = gltf_meshopt.decoded(told, data[start:end], self.path)
        found = self._decoded[index]
        return found, 0, len(found), bounded_offset(entry.get("byteStride", 0))

    @cached_property
    def _decoded(self) -> dict[int, bytes]:
        return {}

    def accessor(self, index: Any) -> npt.NDArray[Any]:
        """(count, width) values of an accessor, as stored; normalised integers as floats."""
        entry = self.entry("accessors", index)
        kind, width = np.dtype(COMPONENTS[entry["componentType"]]), WIDTHS[entry["type"]]
        count = bounded(entry["count"], f"elements of accessors[{index}]")
        if "bufferView" in entry:
            values = self._elements(entry["bufferView"], entry.get("byteOffset", 0), kind, count, width)
        else:  # all zero, and free of charge in the file: hence a bound of its own
            bounded(count * width * 8, "zeros")
            values = np.zeros((count, width), kind)
        if "sparse" in entry:
            values = self._with_sparse(values, entry["sparse"], kind, width)
        return _denormalised(values) if entry.get("normalized") and kind.kind in "iu" else values

    def _with_sparse(
        self, values: npt.NDArray[Any], sparse: dict[str, Any], kind: np.dtype[Any], width: int
    ) -> npt.NDArray[Any]:
        count = bounded(sparse["count"], "sparse elements")
        where, what = sparse["indices"], sparse["values"]
        index_kind = np.dtype(COMPONENTS[where["componentType"]])
        rows = self._elements(where["bufferView"], where.get("byteOffset", 0), index_kind, count, 1)[:, 0]
        if len(rows) and int(rows.max()) >= len(values):
            raise InvalidInput(f"a sparse accessor changes element {int(rows.max())} of {len(values)}")
        changed = np.array(values)
        changed[rows] = self._elements(what["bufferView"], what.get("byteOffset", 0), kind, count, width)
        return changed

    def _elements(self, view: Any, offset: Any, kind: np.dtype[Any], count: int, width: int) -> npt.NDArray[Any]:
        data, start, end, stride = self.view(view)
        start += bounded_offset(offset)
        size = kind.itemsize * width
        stride = stride or size
        if stride < size or (count and start + stride * (count - 1) + size > end):
            raise InvalidInput(
                f"an accessor wants {count} elements of {size} bytes, {stride} apart, of {end - start} bytes"
            )
        return np.ndarray((count, width), kind, data, start, (stride, kind.itemsize))


def open_gltf(path: Path) -> Gltf:
    """Parse a .glb or .gltf file. Raises FileRefused, InvalidInput, or what a damaged file makes Python raise."""
    data = file_bytes(path)
    if data[:4] == b"glTF":
        text, binary = _chunks(path, data)
    else:
        text, binary = data, b""
    try:
        document = _without_nulls(json.loads(text.decode("utf-8-sig")))
    except ValueError as error:
        raise InvalidInput("it is neither a GLB container nor JSON text") from error
    if isinstance(document, dict) and any(isinstance(document.get(key), dict) for key in ("meshes", "nodes")):
        raise FileRefused(_OLD.format(path=path, version="1.0"))  # 1.0 has tables where 2.0 has lists
    if not isinstance(document, dict) or not isinstance(document.get("asset"), dict):
        raise InvalidInput('it has no "asset" entry, which every glTF file has')
    version = str(document["asset"].get("version", ""))
    if not version.startswith("2."):
        if version.startswith(("0.", "1")):
            raise FileRefused(_OLD.format(path=path, version=version))
        raise FileRefused(f"{path} is glTF version {version or 'unknown'}; version 2 is read. Export it anew.")
    required = document.get("extensionsRequired", [])
    for name in required:
        if name not in UNDERSTOOD and not str(name).startswith(HARMLESS):
            raise FileRefused(
                f"{path} requires the glTF extension {name}, which is not read here. Export without it."
            )
    return Gltf(document, binary, path)


def _without_nulls(value: Any) -> Any:
    """The document without members that are null: some exporters write so what the format leaves out."""
    if isinstance(value, dict):
        return {key: _without_nulls(inner) for key, inner in value.items() if inner is not None}
    if isinstance(value, list) and value and isinstance(value[0], (dict, list)):
        return [_without_nulls(inner) for inner in value]
    return value


def bounded_offset(value: Any) -> int:
    """A byte offset or length that a file states. Raises InvalidInput."""
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 1 << 40:
        raise InvalidInput(f"a byte offset or length is {value!r}")
    return value


def _chunks(path: Path, data: bytes) -> tuple[bytes, bytes]:
    """The JSON and the binary chunk of a GLB."""
    _, version, length = np.frombuffer(data, "<u4", 3)
    if version == 1:
        raise FileRefused(_OLD.format(path=path, version="1.0"))
    if version != 2:
        raise InvalidInput(f"its container has version {version}; version 2 is read")
    if length > len(data):
        raise InvalidInput(f"it states {length} bytes, but ends after {len(data)}")
    found: dict[int, bytes] = {}
    at = 12
    while at + 8 <= length:
        size, kind = (int(v) for v in np.frombuffer(data, "<u4", 2, at))
        if at + 8 + size > len(data):
            raise InvalidInput(f"a chunk states {size} bytes, but {len(data) - at - 8} are left")
        found.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size + (-size) % 4
    if JSON_CHUNK not in found:
        raise InvalidInput("it has no JSON chunk")
    return found[JSON_CHUNK], found.get(BINARY_CHUNK, b"")


def _beside(path: Path, uri: str) -> Path:
    """The path of an external buffer, which must lie in the file's own folder or below it."""
    folder = path.resolve().parent
    wanted = (folder / unquote(uri)).resolve()
    if not wanted.is_file() and "\\" in uri:  # written on Windows, where that parts folders
        wanted = (folder / unquote(uri).replace("\\", "/")).resolve()
    wanted = file_of(wanted, folder)
    if "://" in uri or not wanted.is_relative_to(folder):
        raise FileRefused(
            f"{path} wants its buffer from {uri[:200]!r}, outside its folder; only files below it are read."
        )
    if not wanted.is_file():
        raise FileRefused(f"{path} needs its buffer {uri[:200]!r}, but there is no such file. Copy it there.")
    return wanted


def _decode_base64(text: str) -> bytes:
    text = "".join(text.split()).replace("-", "+").replace("_", "/").rstrip("=")
    try:
        return base64.b64decode(text + "=" * (-len(text) % 4), validate=True)
    except binascii.Error as error:
        raise InvalidInput(f"a data URI is not base64: {error}") from error


def _denormalised(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Integers as fractions of their largest value (glTF 2.0, 3.6.2.2)."""
    largest = np.iinfo(values.dtype).max
    return np.asarray(np.maximum(values.astype(np.float64) / largest, -1.0))


def _compressed(path: Path, names: Any) -> str:
    kind = next(COMPRESSED[name] for name in names if name in COMPRESSED)
    return (
        f"{path} is compressed with {kind}, which is not read here. Export it without mesh compression, or take it"
        " out (gltf-transform copy does)."
    )
