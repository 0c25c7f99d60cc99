"""Contact sets: patches with their shapes, links, pairs and groups, saved under a name to be used again."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from contact_core.atomic_file import read_bounded, write_atomic
from contact_core.contact.placement import Link
from contact_core.contact.shape import PatchShape
from contact_core.document.codec import from_json, pretty, to_json
from contact_core.document.document import ContactDocument, ContactPair, Patch, Surface
from contact_core.document.frozen_map import FrozenMap
from contact_core.document.schema import MAX_BYTES, inconsistencies, open_envelope, parse_json
from contact_core.errors import FileRefused
from contact_core.sealed import sealed, unsealed

SCHEMA = "contact-core.contact-set"
VERSION = 1
UPGRADES: dict[int, Callable[[dict[str, Any]], dict[str, Any]]] = {}


@dataclass(frozen=True, eq=False)
class ContactSet:
    """A named set of patches, complete in itself: parents, shapes and both ends of pairs are in it.

    surfaces: those that the patches were on, to recognise them or to convert units.
    """

    title: str
    surfaces: FrozenMap[Surface]
    patches: FrozenMap[Patch]
    shapes: FrozenMap[PatchShape]
    pairs: FrozenMap[ContactPair] = field(default_factory=FrozenMap)
    groups: FrozenMap[tuple[str, ...]] = field(default_factory=FrozenMap)

    def parents_first(self) -> tuple[Patch, ...]:
        """The patches so that each comes after its parent."""
        ordered: dict[str, Patch] = {}
        waiting = list(self.patches.values())
        while waiting:
            ready = [p for p in waiting if not isinstance(p.placement, Link) or p.placement.parent in ordered]
            if not ready:
                raise FileRefused(f"the contact set {self.title!r} holds links without a beginning.")
            ordered |= {patch.name: patch for patch in ready}
            waiting = [patch for patch in waiting if patch.name not in ordered]
        return tuple(ordered.values())


def save_contact_set(contact_set: ContactSet, path: Path | str) -> None:
    """Write a set atomically. Raises FileRefused."""
    data = {"schema": SCHEMA, "version": VERSION, **to_json(contact_set)}
    write_atomic(path, pretty(sealed(json.loads(json.dumps(data)))) + "\n")


def load_contact_set(path: Path | str) -> ContactSet:
    """Read a set. Raises FileRefused for what is none, is damaged, or is newer than this release."""
    path = Path(path)
    data = parse_json(read_bounded(path, MAX_BYTES), str(path))
    open_envelope(data, SCHEMA, VERSION, UPGRADES, str(path))  # what it is comes before whether it is whole
    body = open_envelope(unsealed(data, str(path)), SCHEMA, VERSION, UPGRADES, str(path))
    found: ContactSet = from_json(ContactSet, body, path.name)
    document = ContactDocument(found.surfaces, found.patches, found.shapes, found.pairs, found.groups)
    for problem in inconsistencies(document):
        raise FileRefused(f"{path} contradicts itself: {problem}")
    return found
