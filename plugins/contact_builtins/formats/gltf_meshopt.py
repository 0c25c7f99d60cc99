"""Buffer views that are compressed with meshoptimizer (EXT_meshopt_compression), by meshopt."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from contact_builtins.formats.refusal import bounded
from contact_core.errors import FileRefused, InvalidInput

NAMES = ("EXT_meshopt_compression", "KHR_meshopt_compression")


def decoded(told: dict[str, Any], data: bytes, path: Path) -> bytes:
    """The bytes of a view out of its compressed ones. told: the extension of the view.

    Raises FileRefused without meshopt, InvalidInput where the compressed bytes are damaged.
    """
    try:
        import meshopt
    except ImportError as error:
        raise FileRefused(
            f"{path} is compressed with meshoptimizer, which is read with meshopt: pip install contact-core[io]. Or"
            " export it without mesh compression."
        ) from error
    count = bounded(told["count"], "compressed elements")
    stride = bounded(told["byteStride"], "bytes of a compressed element")
    bounded(count * stride, "bytes out of compressed ones")
    if not count:
        return b""
    try:
        found = meshopt.decode_gltf_buffer(data, count, stride, told["mode"], told.get("filter"))
    except Exception as error:  # ValueError for what it is told, RuntimeError for damaged bytes, and more
        raise InvalidInput("its meshopt data cannot be decoded") from error
    return np.ascontiguousarray(found).tobytes()
