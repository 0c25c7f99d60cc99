"""Primitives that are compressed with Draco (KHR_draco_mesh_compression), by DracoPy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from contact_builtins.formats.gltf_container import WIDTHS, Gltf
from contact_builtins.formats.refusal import bounded
from contact_core.errors import FileRefused, InvalidInput


def without_draco(gltf: Gltf, primitive: dict[str, Any]) -> Callable[[Any], npt.NDArray[Any]]:
    """What reads a compressed primitive's accessors: (count, width) values by accessor index.

    Raises FileRefused without DracoPy, InvalidInput where the compressed bytes are damaged.
    """
    try:
        import DracoPy
    except ImportError as error:
        raise FileRefused(
            f"{gltf.path} is compressed with Draco, which is read with DracoPy: pip install contact-core[io]. Or"
            " export it without mesh compression."
        ) from error
    told = primitive["extensions"]["KHR_draco_mesh_compression"]
    wanted = {index: name for name, index in primitive["attributes"].items() if name in told["attributes"]}
    for index in (*wanted, primitive["indices"]):
        bounded(gltf.entry("accessors", index)["count"], "compressed elements")
    try:
        decoded = DracoPy.decode(gltf.view_bytes(told["bufferView"]))
    except Exception as error:  # DracoPy raises what its own layers have: FileTypeException, ValueError...
        raise InvalidInput("its Draco data cannot be decoded") from error

    def read(index: Any) -> npt.NDArray[Any]:
        if index == primitive.get("indices"):
            return np.asarray(decoded.faces, np.int64).reshape(-1, 1)
        if index not in wanted:
            return gltf.accessor(index)
        number = told["attributes"][wanted[index]]
        entry = gltf.entry("accessors", index)
        values = next((item["data"] for item in decoded.attributes if item["unique_id"] == number), None)
        if values is None or np.size(values) != entry["count"] * WIDTHS[entry["type"]]:
            raise InvalidInput(f"its Draco data does not hold {wanted[index]}")
        values = np.asarray(values).reshape(entry["count"], -1)
        if entry.get("normalized") and values.dtype.kind in "iu":
            return np.asarray(np.maximum(values / np.iinfo(values.dtype).max, -1.0))
        return values

    return read
