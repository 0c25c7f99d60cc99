"""COLLADA by pycollada, which is given what it needs and no more: shapes and where they stand."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

import numpy as np

from contact_builtins.formats.placed import Parsed, Placed, parsed_xml
from contact_builtins.formats.refusal import bounded, named
from contact_core.errors import InvalidInput, MissingExtra, shortened
from contact_core.scene.mesh_names import MOST_AROUND, MeshNames, shown

# What pycollada would look into, and refuse a shape for, though none of it changes the shape.
_LOOKS = ("bind_material", "library_images", "library_effects", "library_materials", "library_animations",
          "library_lights", "library_cameras", "extra")  # fmt: skip
_SHAPES = ("instance_geometry", "instance_controller")


def parse_dae(data: bytes) -> Parsed:
    """The geometry of a COLLADA scene by pycollada. Raises InvalidInput, MissingExtra."""
    try:
        import collada
    except ImportError as error:
        raise MissingExtra("Reading COLLADA (.dae)", "io") from error
    root = parsed_xml(data)
    notes = _prepared(root)
    try:
        scene = collada.Collada(
            io.BytesIO(ElementTree.tostring(root)),
            ignore=[collada.common.DaeError],
            aux_file_loader=lambda name: None,
        )
        objects = _objects(scene, notes)
        parts = list(_parts(objects))
    except collada.common.DaeError as error:
        raise InvalidInput(f"pycollada says: {' '.join(str(error).split())[:120]}") from error
    said = dict.fromkeys(shortened(" ".join(str(getattr(error, "msg", error)).split())) for error in scene.errors)
    if said:
        notes.append(f"Parts of it that pycollada could not read were left out: {named(list(said))}.")
    if any(hasattr(item, "skin") for item in objects):
        notes.append("The file's skin was read as it stands; for a rig, export glTF or USD.")
    up = {"X_UP": "X", "Z_UP": "Z"}.get(str(scene.assetInfo.upaxis), "Y")
    return parts, _unit(root, notes), up, notes  # type: ignore[return-value]


def _unit(root: ElementTree.Element, notes: list[str]) -> float:
    """Metres per unit. pycollada takes a number that it cannot read, such as 0,01, for 1 without a word."""
    space = _space(root)
    entry = root.find(f"{space}asset/{space}unit")
    told = "1" if entry is None else entry.get("meter") or "1"
    try:
        unit = float(told.replace(",", "."))
    except ValueError:
        unit = math.nan
    if not 0.0 < unit < math.inf:
        notes.append(f"Its unit is {told[:40]!r} metres, which is no length; metres were taken.")
        return 1.0
    return unit


def _objects(scene: Any, notes: list[str]) -> list[Any]:
    """What the scene shows; what the file holds, where its scene shows nothing."""
    found = [] if scene.scene is None else [*scene.scene.objects("geometry"), *scene.scene.objects("controller")]
    if found or not len(scene.geometries):
        return found
    notes.append("Its scene shows none of its shapes, so all were read where their own numbers put them.")
    return list(scene.geometries)


def _prepared(root: ElementTree.Element) -> list[str]:
    """Takes out what does not change the shape, hulls and coarser copies, and notes the latter."""
    space = _space(root)
    for above in list(root.iter()):
        for tag in _LOOKS:
            for child in above.findall(space + tag):
                above.remove(child)
    titles = {
        entry.get("id"): entry.get("name") or entry.get("id") or ""
        for tag in ("geometry", "controller")
        for entry in root.iter(space + tag)
    }
    places = [place for scene in root.iter(space + "visual_scene") for place in _places(scene, space)]
    names = []
    for _, shape, around in places:
        own = (*around[:1], titles.get((shape.get("url") or "").lstrip("#"), ""))
        names.append(MeshNames(tuple(filter(None, own)) or ("",), around[1:]))
    kept, notes = shown(names)
    for k in set(range(len(places))) - set(kept):
        places[k][0].remove(places[k][1])
    return notes


def _space(root: ElementTree.Element) -> str:
    """What the tags of a document begin with."""
    return root.tag.rpartition("}")[0] + "}" if root.tag.startswith("{") else ""


def _places(
    scene: ElementTree.Element, space: str
) -> Iterator[tuple[ElementTree.Element, ElementTree.Element, tuple[str, ...]]]:
    """Each shape of a scene with the node that holds it, and the names of that and of the nodes around it."""
    waiting: list[tuple[ElementTree.Element, tuple[str, ...]]] = [(scene, ())]
    while waiting:
        node, around = waiting.pop()
        for tag in _SHAPES:
            yield from ((node, shape, around) for shape in node.findall(space + tag))
        waiting += [
            (child, (child.get("name") or child.get("id") or "", *around[:MOST_AROUND]))
            for child in node.findall(space + "node")
        ]


def _parts(objects: list[Any]) -> Iterator[Placed]:
    total = 0
    for item in objects:
        for outer in item.primitives() if callable(item.primitives) else item.primitives:
            primitive = getattr(outer, "primitive", outer)  # a skin wraps its primitives
            corners = getattr(primitive, "vertex_index", None)
            if corners is None or primitive.vertex is None or not len(corners):
                continue
            corners = np.asarray(corners, np.int64)
            if corners.ndim == 2 and corners.shape[1] == 3:
                sizes = np.full(len(corners), 3)
            elif hasattr(primitive, "polyindex"):
                ranges = np.asarray(primitive.polyindex, np.int64)  # (f, 2) start and end of each polygon
                sizes = ranges[:, 1] - ranges[:, 0]
            else:
                continue  # lines
            total = bounded(total + len(primitive.vertex) + len(sizes), "vertices and faces in all")
            yield np.asarray(primitive.vertex, np.float64), sizes, corners.ravel()
