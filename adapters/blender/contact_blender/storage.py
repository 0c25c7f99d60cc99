"""The document in the .blend: one ID property of the scene, with pointers to the objects that it speaks of.

The bytes are kept as they came (a text datablock in one line is quadratic to load: 3.4 MB took 321 s). The pointers
follow renaming, saving and appending of the scene, so an id keeps its object.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from typing import Any

from contact_blender.ids import ObjectIds
from contact_core.errors import FileRefused
from contact_core.scene.host import StoredDocument, check_overwrite

KEY = "contact_core"


def read(scene: Any) -> StoredDocument | None:
    """What the scene holds, bit for bit. Raises FileRefused when somebody damaged it."""
    group = scene.get(KEY)
    if group is None:
        return None
    try:
        return StoredDocument(bytes(group["data"]), int(group["revision"]), int(group["schema"]))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise FileRefused(
            f"the property {KEY!r} of scene {scene.name!r} is not a contact document ({error!r});"
            " it was left untouched."
        ) from error


def write(scene: Any, document: StoredDocument, objects: Iterable[tuple[str, Any]]) -> None:
    """Replace the document, with (id, object) pairs. Raises FileRefused where a newer release wrote the old one."""
    check_overwrite(read(scene))
    names: list[str] = []
    pointers: dict[str, Any] = {}
    for object_id, scene_object in objects:
        pointers[str(len(names))] = scene_object  # a property's name is at most 63 bytes; an id is not
        names.append(object_id)
    scene[KEY] = {
        "schema": document.schema,
        "revision": document.revision,
        "data": document.data,
        "ids": json.dumps(names),
        "objects": pointers,
    }


def remember(scene: Any) -> Callable[[Any, ObjectIds], None]:
    """What puts the document back as it is now, given scene and ids anew: for a step that fails."""
    document, names = read(scene), _names(scene)

    def restore(again: Any, ids: ObjectIds) -> None:
        if KEY in again:
            del again[KEY]
        if document is not None:
            write(again, document, ids.pairs(names))

    return restore


def restore_ids(scene: Any, ids: ObjectIds) -> None:
    """Bind the ids that the stored document uses to the objects that it points to, whatever they are called now."""
    for place, object_id in enumerate(_names(scene)):
        scene_object = scene[KEY]["objects"].get(str(place))
        if scene_object is not None:
            ids.bind(object_id, scene_object)


def _names(scene: Any) -> list[str]:
    group = scene.get(KEY)
    return [] if group is None else [str(name) for name in json.loads(group.get("ids", "[]"))]
