"""Pictures as one .npz of plain arrays and a JSON text: how a scene travels to the drawing process."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from contact_core.geometry.mesh import TriangleMesh
from contact_core.scene.picture import Picture, PictureMesh


def write_scene(path: Path, pictures: Sequence[Picture], size: tuple[int, int]) -> None:
    """Write pictures and the size of the image in pixels."""
    arrays: dict[str, Any] = {}

    def keep(array: Any) -> str:
        arrays[f"a{len(arrays)}"] = np.asarray(array)
        return f"a{len(arrays) - 1}"

    described = [
        {
            "meshes": [
                {
                    "points": keep(item.mesh.points),
                    "faces": keep(item.mesh.faces),
                    "color": item.color,
                    "opacity": item.opacity,
                    "vertex_colors": None if item.vertex_colors is None else keep(item.vertex_colors),
                }
                for item in picture.meshes
            ],
            "points": [(keep(points), tuple(color)) for points, color in picture.points],
            "lines": [(keep(lines), tuple(color)) for lines, color in picture.lines],
            "camera_from": picture.camera_from,
            "up": picture.up,
            "row": picture.row,
            "caption": picture.caption,
            "table": picture.table,
            "legend": picture.legend,
            "lettering": picture.lettering,
            "focus": None if picture.focus is None else keep(picture.focus),
        }
        for picture in pictures
    ]
    text = json.dumps({"size": size, "pictures": described})
    np.savez(path, scene=np.frombuffer(text.encode(), np.uint8), **arrays)


def read_scene(path: Path) -> tuple[list[Picture], tuple[int, int]]:
    """What `write_scene` wrote."""
    with np.load(path, allow_pickle=False) as stored:
        scene = json.loads(stored["scene"].tobytes())
        pictures = [
            Picture(
                meshes=tuple(
                    PictureMesh(
                        TriangleMesh(stored[item["points"]], stored[item["faces"]]),
                        tuple(item["color"]),
                        item["opacity"],
                        None if item["vertex_colors"] is None else stored[item["vertex_colors"]],
                    )
                    for item in one["meshes"]
                ),
                points=tuple((stored[name], tuple(color)) for name, color in one["points"]),
                lines=tuple((stored[name], tuple(color)) for name, color in one["lines"]),
                camera_from=None if one["camera_from"] is None else tuple(one["camera_from"]),
                up=tuple(one["up"]),
                row=one["row"],
                caption=one["caption"],
                table=tuple((name, value, bool(failed)) for name, value, failed in one["table"]),
                legend=tuple((name, tuple(color)) for name, color in one["legend"]),
                focus=None if one["focus"] is None else stored[one["focus"]],
                lettering=one["lettering"],
            )
            for one in scene["pictures"]
        ]
    return pictures, tuple(scene["size"])
