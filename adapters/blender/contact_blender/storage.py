"""The document in the .blend: one ID property of the scene, with pointers to the objects that it speaks of.

Its parts are properties of a group within, so that an edit writes those that it changed. Texts are kept as bytes (a
text datablock in one line is quadratic to load: 3.4 MB took 321 s). The pointers follow renaming, saving and
appending of the scene, so an id keeps its object.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import bpy

from contact_blender.ids import ObjectIds
from contact_core.document.frozen_map import FrozenMap
from contact_core.errors import FileRefused
from contact_core.scene.host import DocumentStamp, StoredDocument, check_overwrite

KEY = "contact_core"
TakeBack = Callable[[Any, ObjectIds], None]  # given scene and ids anew


def open_file(source: Path) -> None:
    """Let this process's Blender open a file. Raises FileRefused."""
    if not source.is_file():
        raise FileRefused(f"there is no file {source}.")
    try:
        bpy.ops.wm.open_mainfile(filepath=str(source.resolve()), load_ui=False)
    except RuntimeError as error:
        raise FileRefused(f"Blender cannot open {source}: {str(error).strip()}") from error


def read_stamp(scene: Any) -> DocumentStamp | None:
    """The stamp of what the scene holds. Raises FileRefused when somebody damaged it."""
    group = _group(scene)
    if group is None:
        return None
    try:
        group["parts"].keys()
        return DocumentStamp(int(group["revision"]), str(group["digest"]), int(group["schema"]))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise _damaged(scene, error) from error


def read(scene: Any) -> StoredDocument | None:
    """What the scene holds, bit for bit. Raises FileRefused when somebody damaged it."""
    stamp = read_stamp(scene)
    if stamp is None:
        return None
    try:
        parts = {str(key): bytes(text).decode() for key, text in scene[KEY]["parts"].items()}
    except (TypeError, ValueError, AttributeError) as error:
        raise _damaged(scene, error) from error
    return StoredDocument(stamp, FrozenMap(parts))


def write(
    scene: Any,
    stamp: DocumentStamp,
    put: Mapping[str, str],
    remove: Iterable[str],
    objects: Iterable[tuple[str, Any]],
) -> TakeBack:
    """Change the document, with (id, object) pairs; returns what takes that back, for a step that fails.

    Raises FileRefused where a newer release wrote what is there, or it is damaged, and for a scene of another file.
    """
    if scene.library is not None:
        raise FileRefused(
            f"the scene {scene.name!r} is linked from {scene.library.filepath}, so contacts in it are not saved:"
            " work in a scene of this file that has the same objects."
        )
    before = read_stamp(scene)
    check_overwrite(before)
    if before is None:
        scene[KEY] = {"parts": {}}
    group, gone = scene[KEY], tuple(remove)
    parts, names = group["parts"], _names(scene)
    old = {key: bytes(parts[key]).decode() if key in parts else None for key in (*put, *gone)}
    for key in gone:
        if key in parts:
            del parts[key]
    for key, text in put.items():
        parts[key] = text.encode()
    group["revision"], group["digest"], group["schema"] = stamp.revision, stamp.digest, stamp.schema
    _point_at(group, dict(objects))

    def take_back(again: Any, ids: ObjectIds) -> None:
        if before is None:
            del again[KEY]
            return
        was = {key: text for key, text in old.items() if text is not None}
        write(again, before, was, old.keys() - was.keys(), ids.pairs(names))

    return take_back


def restore_ids(scene: Any, ids: ObjectIds) -> None:
    """Bind the ids that the stored document uses to the objects that it points to, whatever they are called now."""
    for place, object_id in enumerate(_names(scene)):
        scene_object = scene[KEY]["objects"].get(str(place))
        if scene_object is not None:
            ids.bind(object_id, scene_object)


def _group(scene: Any) -> Any:
    """The property, None where there is none. Raises FileRefused for one of an early release."""
    group = scene.get(KEY)
    if group is not None and hasattr(group, "keys") and "data" in group:
        raise FileRefused(
            f"the property {KEY!r} of scene {scene.name!r} is a contact document in one piece, as early versions of"
            " contact-core stored it; this release stores it in parts and reads no other. Remove the property to"
            " begin anew. It was left untouched."
        )
    return group


def _point_at(group: Any, objects: Mapping[str, Any]) -> None:
    """Have the ids with pointers to their objects; nothing is written where they are there already."""
    names = json.dumps(list(objects))
    pointers = {str(place): found for place, found in enumerate(objects.values())}  # a name has 63 bytes at most
    there = group.get("objects")
    if group.get("ids") == names and there is not None and dict(there.items()) == pointers:
        return
    group["ids"], group["objects"] = names, pointers


def _names(scene: Any) -> list[str]:
    group = scene.get(KEY)
    return [] if group is None else [str(name) for name in json.loads(group.get("ids", "[]"))]


def _damaged(scene: Any, error: Exception) -> FileRefused:
    return FileRefused(
        f"the property {KEY!r} of scene {scene.name!r} is not a contact document ({error!r});"
        " it was left untouched."
    )
