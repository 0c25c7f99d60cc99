"""A document in parts, as hosts store it: an edit writes the parts that it changed, and the digest follows.

A part is a piece of the document's JSON, `{"patches": {"grip": {...}}}`; the document is the union of its parts.
Documents are immutable and share what an edit leaves alone, so what changed is found by identity (`is`), and only
that is encoded. A part's key is an identifier of at most 63 characters, its text printable ASCII with line feeds:
any host can keep them. The digest of a document in parts is the SHA-256 over the digests of its parts in ascending
order: a Merkle tree of two levels, which costs 32 bytes a part and no text. It identifies a content as
`schema.document_digest` does for files, but is another number.
"""

from __future__ import annotations

import hashlib
import json
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cached_property, partial
from typing import Any, get_type_hints

from contact_core.contact.shape import PatchShape
from contact_core.document.codec import pretty, to_json
from contact_core.document.document import ContactDocument
from contact_core.document.frozen_map import FrozenMap
from contact_core.document.schema import MAX_BYTES, SCHEMA, document_from_json, parse_json
from contact_core.document.shape_texts import shape_to_json
from contact_core.document.timeline import Key, Track
from contact_core.errors import FileRefused

_FIELDS = tuple(item.name for item in fields(ContactDocument))
_ITEM_TYPES: dict[str, Any] = {name: get_type_hints(ContactDocument)[name].__args__[0] for name in _FIELDS}
_SHAPE_PIECES = {"axis": ("axis", "meters_per_unit"), "points": ("coordinates", "weights")}


@dataclass(frozen=True, eq=False)
class Change:
    """What leads from one document in parts to another: texts to put by key, and keys to remove."""

    put: Mapping[str, str]
    removed: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class DocumentParts:
    """A document and the digest of each of its parts, by key; the texts are made where they are wanted."""

    document: ContactDocument
    digests: Mapping[str, bytes]

    @classmethod
    def of(cls, document: ContactDocument) -> DocumentParts:
        """A document in parts; every value is encoded once."""
        return NO_PARTS.to(document)[0]

    @classmethod
    def read(cls, parts: Mapping[str, str], schema: int, digest: str, source: str) -> DocumentParts:
        """The document that parts say, written under this schema number and digest.

        Raises FileRefused in a sentence, also where the digest does not fit.
        """
        found = cls(_document_in(parts, schema, source), {key: _digest(key, text) for key, text in parts.items()})
        if found.digest != digest:
            raise FileRefused(
                f"{source} is not as it was stored: its digest does not fit its parts, so it is damaged or was"
                " edited by other means. Take that edit back. It is left untouched."
            )
        return found

    @cached_property
    def digest(self) -> str:
        """The identity of the content: 64 hex digits."""
        return hashlib.sha256(b"".join(sorted(self.digests.values()))).hexdigest()

    def to(self, document: ContactDocument) -> tuple[DocumentParts, Change]:
        """Another document in parts, and the change that leads there; values that both share cost nothing."""
        digests, put, removed = dict(self.digests), dict[str, str](), list[str]()
        for field in _FIELDS:
            before, after = getattr(self.document, field), getattr(document, field)
            for name in _differing(before, after):
                old, new = _pieces(field, name, before, after), _pieces(field, name, after, before)
                removed += [_key(field, name, piece) for piece in old if piece not in new]
                for piece, made in new.items():
                    if made.shares(old.get(piece)):
                        continue
                    key, text = _key(field, name, piece), pretty({field: {name: made.data()}}) + "\n"
                    digest = _digest(key, text)
                    if digests.get(key) != digest:
                        put[key], digests[key] = text, digest
        for key in removed:
            del digests[key]
        return DocumentParts(document, digests), Change(put, tuple(removed))


NO_PARTS = DocumentParts(ContactDocument(), FrozenMap())


@dataclass(frozen=True, slots=True)
class _Piece:
    """What one part holds of a value: the objects, by which it is told from another, and what makes its JSON."""

    held: tuple[object, ...]
    data: Callable[[], Any]

    def shares(self, other: _Piece | None) -> bool:
        """Whether both hold the very same objects."""
        return other is not None and all(map(operator.is_, self.held, other.held))


def _pieces(field: str, name: str, items: Mapping[str, Any], beside: Mapping[str, Any]) -> dict[str, _Piece]:
    """The pieces of a value, none where it is not there: a value is one.

    But bending the axis of a shape does not write its points again, nor setting a key the others of its track:
    those that the value of that name in `beside` has as well are left out.
    """
    if name not in items:
        return {}
    value = items[name]
    if isinstance(value, PatchShape):
        return {
            piece: _Piece(tuple(getattr(value, item) for item in taken), partial(_of_shape, value, taken))
            for piece, taken in _SHAPE_PIECES.items()
        }
    if isinstance(value, Track):
        other = beside.get(name)
        shared = set(map(id, other.keys)) if isinstance(other, Track) else set[int]()
        own = [key for key in value.keys if id(key) not in shared]
        return {repr(float(key.frame)): _Piece((key,), partial(_of_track, key)) for key in own}
    return {"": _Piece((value,), partial(to_json, value, _ITEM_TYPES[field]))}


def _of_shape(shape: PatchShape, taken: tuple[str, ...]) -> dict[str, Any]:
    return {name: item for name, item in shape_to_json(shape).items() if name in taken}


def _of_track(key: Key) -> dict[str, Any]:
    return {"keys": [to_json(key)]}


def _differing(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[str]:
    """Names of values that are not the very same object in both, or in one alone."""
    if before is after:
        return []
    new = [name for name, value in after.items() if name not in before or before[name] is not value]
    return new + [name for name in before if name not in after]


def _key(field: str, name: str, piece: str) -> str:
    return f"{field}_{hashlib.sha256(json.dumps([field, name, piece]).encode()).hexdigest()[:32]}"


def _digest(key: str, text: str) -> bytes:
    return hashlib.sha256(f"{key}\n{text}".encode(errors="replace")).digest()


def _document_in(parts: Mapping[str, str], schema: int, source: str) -> ContactDocument:
    """The union of parts, read as a document of that schema. Raises FileRefused."""
    size = sum(map(len, parts.values()))
    if size > MAX_BYTES:
        raise FileRefused(f"{source} has {size} bytes; more than {MAX_BYTES} are refused.")
    whole: dict[str, Any] = {}
    for key, text in parts.items():
        part = parse_json(text.encode(errors="replace"), f"{source}, part {key},")
        for field, items in _object(part, source).items():
            known = whole.setdefault(field, {})
            for name, item in _object(items, source).items():
                known[name] = _joined(field, known[name], item, source) if name in known else item
    for track in whole.get("tracks", {}).values():
        if isinstance(keys := _object(track, source).get("keys"), list):
            keys.sort(key=_frame)
    document = document_from_json({**whole, "schema": SCHEMA, "version": schema}, source)
    wanted = {
        _key(field, name, piece)
        for field in _FIELDS
        for name in getattr(document, field)
        for piece in _pieces(field, name, getattr(document, field), {})
    }
    if wanted != set(parts):
        odd = sorted(wanted ^ set(parts))[0]
        raise FileRefused(f"{source} is not as it was stored: {odd} is no part of what it says, or is missing.")
    return document


def _joined(field: str, one: Any, other: Any, source: str) -> dict[str, Any]:
    """Two pieces of one value. Raises FileRefused where both say the same thing."""
    a, b = _object(one, source), _object(other, source)
    if field == "shapes" and a.keys().isdisjoint(b):
        return a | b
    if field == "tracks" and isinstance(a.get("keys"), list) and isinstance(b.get("keys"), list):
        a["keys"] += b["keys"]
        return a
    raise FileRefused(f"{source} says twice what one of its {field} is: {str(other)[:60]!r}.")


def _frame(key: Any) -> float:
    """Of a key in JSON; whatever is none is refused by whoever reads it."""
    frame = key.get("frame") if isinstance(key, dict) else None
    return float(frame) if isinstance(frame, (int, float)) else 0.0


def _object(data: Any, source: str) -> dict[str, Any]:
    if not isinstance(data, dict):
        raise FileRefused(f"{source} has a part that is no object of a document, but {str(data)[:60]!r}.")
    return data
