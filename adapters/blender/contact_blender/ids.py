"""Object ids that outlive reads, undo, renaming and saving. Nothing else in this adapter keeps a Blender object.

After an undo Blender's Python objects point into freed memory: some raise, a pose bone or a modifier answers
with garbage. So every call resolves its id again. An id is the name under which an object was first seen. It is
held as the object's session uid (unchanged by renaming and by undo) and its last name (for an object that came
back under a new uid: a file that was loaded again).
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import bpy

from contact_core.errors import InvalidInput


@dataclass(frozen=True)
class Held:
    """What is kept of an object. library: path of the .blend that it is linked from, or ""."""

    session_uid: int
    name: str
    library: str


class ObjectIds:
    """The ids of one host. Holds numbers and names only."""

    def __init__(self) -> None:
        self._held: dict[str, Held] = {}
        self._id_of_uid: dict[int, str] = {}
        self._id_of_name: dict[tuple[str, str], str] = {}  # by last name and library
        self._used: set[str] = set()

    def id_of(self, scene_object: Any) -> str:
        """The id of an object, made at first sight and the same from then on."""
        held = _held(scene_object)
        known = self._id_of_uid.get(held.session_uid)
        if known is None:  # new, or the same object after its file was loaded again
            known = self._id_of_name.get((held.name, held.library))
            if known is not None and _by_uid(self._held[known]) is not None:
                known = None
        return self._hold(_free(_spelt(held), self._held) if known is None else known, held)

    def bind(self, object_id: str, scene_object: Any) -> None:
        """Let an id mean this object, as a stored document says."""
        self._hold(object_id, _held(scene_object))
        self._used.add(object_id)

    def resolve(self, object_id: str) -> Any:
        """The Blender object of an id, for immediate use. Raises InvalidInput naming near ids."""
        held = self._held.get(object_id)
        if held is None:
            fresh = bpy.data.objects.get((object_id, None))
            found = fresh if fresh is not None and self.id_of(fresh) == object_id else None
        else:
            found = _by_uid(held) or self._returned(held)
        if found is None:
            there = [_spelt(_held(each)) for each in bpy.data.objects]
            near = difflib.get_close_matches(object_id, there, n=3) or there[:5]
            raise InvalidInput(f"Blender has no object {object_id!r}; there are: {', '.join(near) or 'none'}.")
        self._hold(object_id, _held(found))
        self._used.add(object_id)
        return found

    def pairs(self, wanted: Iterable[str] | None = None) -> Iterator[tuple[str, Any]]:
        """(id, object) of the ids that still have an object, for immediate use; None: of those ever asked for."""
        for object_id in sorted(self._used) if wanted is None else tuple(wanted):
            held = self._held.get(object_id)
            found = None if held is None else _by_uid(held)
            if found is not None:
                yield object_id, found

    def _hold(self, object_id: str, held: Held) -> str:
        self._held[object_id] = held
        self._id_of_uid[held.session_uid] = object_id
        self._id_of_name[held.name, held.library] = object_id
        return object_id

    def _returned(self, held: Held) -> Any:
        """The object that has the lost one's name, unless it is known as another."""
        named = _by_name(held)
        return None if named is None or named.session_uid in self._id_of_uid else named


def _held(scene_object: Any) -> Held:
    library = scene_object.library.filepath if scene_object.library else ""
    return Held(int(scene_object.session_uid), str(scene_object.name), str(library))


def _spelt(held: Held) -> str:
    return f"{held.name} [{held.library}]" if held.library else held.name


def _free(wanted: str, taken: Mapping[str, Held]) -> str:
    """`wanted`, or with a number behind it where another object, since renamed, was first seen as that."""
    number, name = 1, wanted
    while name in taken:
        number += 1
        name = f"{wanted} ({number})"
    return name


def _by_name(held: Held) -> Any:
    return bpy.data.objects.get((held.name, held.library or None))


def _by_uid(held: Held) -> Any:
    """By session uid: where the name still fits at once, else among all objects."""
    named = _by_name(held)
    if named is not None and named.session_uid == held.session_uid:
        return named
    return next((each for each in bpy.data.objects if each.session_uid == held.session_uid), None)
