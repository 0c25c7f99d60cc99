"""A glTF document under construction, and the binary that its accessors point into."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

COMPONENT_OF = {"|u1": 5121, "<u2": 5123, "<u4": 5125, "<f4": 5126}
TYPE_OF = {1: "SCALAR", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


@dataclass
class GlbScene:
    """What a GLB will hold; `binary` grows with every accessor."""

    nodes: list[dict[str, Any]] = field(default_factory=list)
    meshes: list[dict[str, Any]] = field(default_factory=list)
    skins: list[dict[str, Any]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)
    views: list[dict[str, Any]] = field(default_factory=list)
    animations: list[dict[str, Any]] = field(default_factory=list)
    roots: list[int] = field(default_factory=list)
    binary: bytearray = field(default_factory=bytearray)

    def accessor(self, values: npt.NDArray[Any], target: int | None = None, *, bounds: bool = False) -> int:
        """Store (count, width) values; the new accessor's index."""
        self.binary += b"\0" * (-len(self.binary) % 4)
        view: dict[str, Any] = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": values.nbytes}
        if target is not None:
            view["target"] = target
        self.binary += np.ascontiguousarray(values).tobytes()
        self.views.append(view)
        entry: dict[str, Any] = {
            "bufferView": len(self.views) - 1,
            "componentType": COMPONENT_OF[values.dtype.str],
            "count": len(values),
            "type": TYPE_OF[values.shape[1]],
        }
        if bounds:
            entry |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        self.accessors.append(entry)
        return len(self.accessors) - 1

    def node(self, **entry: Any) -> int:
        self.nodes.append(entry)
        return len(self.nodes) - 1
