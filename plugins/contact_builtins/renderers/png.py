"""PNG files from the standard library alone, written whole or not at all."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import numpy.typing as npt

from contact_core.atomic_file import write_atomic

_SIGNATURE = b"\x89PNG\r\n\x1a\n"


def encode_png(image: npt.NDArray[np.uint8]) -> bytes:
    """The bytes of an 8-bit RGB PNG; image: (height, width, 3) uint8, top row first."""
    height, width, _ = image.shape
    rows = np.zeros((height, 1 + width * 3), np.uint8)  # (height, 1 + 3 width), filter byte 0 first
    rows[:, 1:] = image.reshape(height, width * 3)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes(), 6)), (b"IEND", b""))
    return _SIGNATURE + b"".join(_chunk(kind, data) for kind, data in chunks)


def write_png(image: npt.NDArray[np.uint8], path: Path) -> None:
    """Write (height, width, 3) uint8 as a PNG. Raises FileRefused when the file cannot be written."""
    write_atomic(path, encode_png(image))


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
