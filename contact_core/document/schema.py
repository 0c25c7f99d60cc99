"""The document as JSON: a schema name, a version, a digest, equal bytes for equal documents, upgrades, checks."""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, get_type_hints

from contact_core.contact.placement import Link
from contact_core.contact.shape import PatchShape
from contact_core.document.codec import Fragment, from_json, pretty, to_json, without_collector
from contact_core.document.document import ContactDocument, Patch, is_name
from contact_core.document.frozen_map import FrozenMap
from contact_core.document.shape_texts import CUT, cut_out, keep_texts, shape_text
from contact_core.document.time_checks import time_inconsistencies
from contact_core.errors import EditedFile, FileRefused, quoted, shortened
from contact_core.sealed import json_mistake

SCHEMA = "contact-core.document"
VERSION = 1
DIGEST = "digest"
_DIGEST_LINE = b' "digest": '
MAX_BYTES = 1 << 30

# From each released version to the next: data of version k -> data of version k + 1. Nothing else reads old files.
UPGRADES: dict[int, Callable[[dict[str, Any]], dict[str, Any]]] = {}


def document_to_json(document: ContactDocument) -> dict[str, Any]:
    """JSON-able data with schema name and version."""
    return {"schema": SCHEMA, "version": VERSION, **to_json(document)}


def document_from_json(data: Any, source: str = "the document") -> ContactDocument:
    """The document that data stands for, upgraded where it is older. Raises FileRefused in a sentence."""
    body = open_envelope(data, SCHEMA, VERSION, UPGRADES, source)
    document: ContactDocument = from_json(ContactDocument, body, source)
    for problem in inconsistencies(document):
        raise FileRefused(f"{source} contradicts itself: {shortened(problem)}")
    return document


def dump_document(document: ContactDocument) -> bytes:
    """UTF-8 JSON, made for review: sorted, one item a line. Equal documents give equal bytes.

    The first line says the digest of all others, so that a damaged file is never read as another document.
    """
    return dump_with_digest(document)[0]


def dump_with_digest(document: ContactDocument) -> tuple[bytes, str]:
    """What `dump_document` and `document_digest` return, at the cost of one."""
    content, digest = content_with_digest(document)
    return with_digest(content, digest), digest


def content_with_digest(document: ContactDocument) -> tuple[bytes, str]:
    """The canonical bytes of a document, which state no digest, and their digest."""
    with without_collector():
        content = _content(document)
    return content, _digest(content)


def with_digest(content: bytes, digest: str) -> bytes:
    """A document file of canonical bytes: the same with the line that states their digest."""
    return b'{\n%b"%b",\n' % (_DIGEST_LINE, digest.encode()) + content.removeprefix(b"{\n")


def document_digest(document: ContactDocument) -> str:
    """The identity of a document's content: SHA-256, 64 hex digits.

    It is taken over the bytes that `dump_document` writes, without the line that states the digest itself. So two
    documents have the same digest exactly when a saved file of one is, byte for byte, a saved file of the other:
    everything in it, the schema name and its version count; the path, the revision, the history and the layout of a
    file do not. It is the same in every process, on every platform,
    until the version of the schema rises. It does not identify a history: two histories may lead to one document.
    """
    return _digest(_content(document))


def parse_document(text: bytes, source: str = "the document") -> ContactDocument:
    """The document in UTF-8 JSON. Raises FileRefused, EditedFile where only the digest does not fit the content.

    The layout of the text does not matter. A digest of null says that nothing is known: such a file is believed.
    """
    return parse_with_digest(text, source)[0]


def parse_with_digest(text: bytes, source: str = "the document") -> tuple[ContactDocument, str]:
    """What `parse_document` returns, and its `document_digest`. Raises FileRefused, EditedFile."""
    return parse_with_content(text, source)[:2]


def parse_with_content(text: bytes, source: str) -> tuple[ContactDocument, str, bytes | None]:
    """What `parse_with_digest` returns, and the document's canonical bytes where the file has them; None where it
    lies otherwise. Raises FileRefused, EditedFile."""
    with without_collector():
        data, texts = _parse(text, source)
        stated = data.pop(DIGEST, "") if isinstance(data, dict) else ""
        document = document_from_json(data, source)
        content = written_content(text)
        found = _digest(content)
        if stated is not None and stated != found and stated != _digest(_canonical(data)):
            raise EditedFile(_disbelief(source, bool(stated)))
        known = isinstance(stated, str) and data["version"] == VERSION
        digest = str(stated) if known else document_digest(document)
        if digest != found:
            return document, digest, None
        keep_texts(document.shapes, texts)
        return document, digest, content


def _parse(text: bytes, source: str) -> tuple[Any, dict[str, Fragment]]:
    """The JSON of a document, and the text of each of its shapes; none where it is not laid out for it."""
    with contextlib.suppress(ValueError, RecursionError):  # said below
        found = cut_out(text.decode()) if len(text) <= MAX_BYTES else None
        data = _DECODER.decode(found[0]) if found is not None else None
        if found is not None and isinstance(data, dict) and data.get("shapes") == CUT:
            return {**data, "shapes": {key: _DECODER.decode(item) for key, item in found[1].items()}}, found[1]
    return parse_json(text, source), {}


def written_digest(text: bytes) -> str:
    """The digest of a document file that lies as `dump_document` wrote it; any other file gets another digest."""
    return _digest(written_content(text))


def written_content(text: bytes) -> bytes:
    """A document file that lies as `dump_document` wrote it without the line that states the digest."""
    lines = text.split(b"\n", 2)
    return lines[0] + b"\n" + lines[2] if len(lines) == 3 and lines[1].startswith(_DIGEST_LINE) else text


def parse_edited(text: bytes, source: str = "the document") -> ContactDocument:
    """The document in a file that was edited by hand, whose digest is not asked. Raises FileRefused."""
    data = parse_json(text, source)
    if isinstance(data, dict):
        data.pop(DIGEST, None)
    return document_from_json(data, source)


def same_documents(a: ContactDocument, b: ContactDocument) -> bool:
    """Whether two documents say the same (arrays compare by value); what both share costs nothing."""
    return a is b or all(
        _same_items(getattr(a, name), getattr(b, name), kind)
        for name, kind in get_type_hints(ContactDocument).items()
    )


def _same_items(a: FrozenMap[Any], b: FrozenMap[Any], kind: Any) -> bool:
    if a is b or a.keys() != b.keys():
        return a is b
    unlike = [name for name in a if a[name] is not b[name]]
    return all(
        to_json(FrozenMap({name: a[name]}), kind) == to_json(FrozenMap({name: b[name]}), kind) for name in unlike
    )


def parse_json(text: bytes, source: str) -> Any:
    """JSON of bounded size, without NaN, each key once. Raises FileRefused naming the line."""
    if len(text) > MAX_BYTES:
        raise FileRefused(f"{source} has {len(text)} bytes; more than {MAX_BYTES} are refused.")
    try:
        return json.loads(text.decode(), parse_constant=_refuse_constant, object_pairs_hook=_object_of)
    except (ValueError, RecursionError) as error:  # JSONDecodeError and UnicodeDecodeError are ValueErrors
        raise FileRefused(f"{source} is not valid JSON: {json_mistake(error)}.") from error


def open_envelope(
    data: Any,
    schema: str,
    version: int,
    upgrades: dict[int, Callable[[dict[str, Any]], dict[str, Any]]],
    source: str,
    *,
    schema_key: str = "schema",
) -> dict[str, Any]:
    """The fields of schema-and-version data without those two, brought up to `version`. Raises FileRefused."""
    if not isinstance(data, dict) or data.get(schema_key) != schema:
        found = data.get(schema_key) if isinstance(data, dict) else type(data).__name__
        raise FileRefused(f"{source} is not a {schema} file (its schema is {quoted(found)}).")
    came = data.get("version")
    if not isinstance(came, int) or isinstance(came, bool) or came < 1:
        raise FileRefused(f"{source} names no version that exists ({quoted(came)}).")
    if came > version:
        raise FileRefused(
            f"{source} was written as {schema} version {quoted(came)}, but this release reads up to version"
            f" {version}: install a newer contact-core. The file is left untouched."
        )
    body = {key: item for key, item in data.items() if key not in (schema_key, "version")}
    for step in range(came, version):
        body = upgrades[step](body)
    return body


def inconsistencies(document: ContactDocument) -> Iterator[str]:
    """Sentences on what contradicts itself in a document; none for every document that commands can make."""
    for kind, items in (("surface", document.surfaces), ("patch", document.patches), ("pair", document.pairs)):
        for key, item in items.items():
            if item.name != key:
                yield f"{kind} {item.name!r} is filed under {key!r}."
    for patch in document.patches.values():
        yield from _patch_inconsistencies(document, patch)
    yield from _cycles(document)
    used = {patch.shape for patch in document.patches.values()}
    yield from (f"shape {key!r} belongs to no patch." for key in document.shapes if key not in used)
    for pair in document.pairs.values():
        for end in (pair.manipulator, pair.object):
            if end not in document.patches:
                yield f"pair {pair.name!r} names the patch {end!r}, which does not exist."
    for name, members in document.groups.items():
        if not members or len(set(members)) != len(members):
            yield f"group {name!r} needs patches, each once."
        for member in members:
            if member not in document.patches:
                yield f"group {name!r} names the patch {member!r}, which does not exist."
    for name, pose in document.poses.items():
        if name not in document.surfaces:
            yield f"a pose names the surface {name!r}, which does not exist."
        if len(set(pose.joints)) != len(pose.joints):
            yield f"the pose of {name!r} names a joint twice."
    yield from time_inconsistencies(document)
    for kind, names in (("a group", document.groups), ("a namespace", document.extras)):
        for name in names:
            if not is_name(name):
                yield f"{name!r} is no name for {kind}."


def _patch_inconsistencies(document: ContactDocument, patch: Patch) -> Iterator[str]:
    surface = document.surfaces.get(patch.surface)
    shape = document.shapes.get(patch.shape)
    if surface is None:
        yield f"patch {patch.name!r} lies on the surface {patch.surface!r}, which does not exist."
    if shape is None:
        yield f"patch {patch.name!r} has the shape {patch.shape!r}, which does not exist."
    place = patch.placement
    if not isinstance(place, Link):
        if surface is not None and place.face >= surface.carrier_faces:
            yield f"patch {patch.name!r} is rooted in face {place.face} of {surface.carrier_faces}."
        return
    parent = document.patches.get(place.parent)
    if parent is None:
        yield f"patch {patch.name!r} is a child of {place.parent!r}, which does not exist."
        return
    if parent.surface != patch.surface:
        yield f"patch {patch.name!r} is a child of {place.parent!r}, which lies on another surface."
    yield from _link_inconsistencies(document, patch, place, parent, shape)


def _link_inconsistencies(
    document: ContactDocument, patch: Patch, link: Link, parent: Patch, shape: PatchShape | None
) -> Iterator[str]:
    parent_shape = document.shapes.get(parent.shape)
    if parent_shape is not None and link.parent_point >= parent_shape.axis.point_count:
        yield f"patch {patch.name!r} is linked to point {link.parent_point} of {parent.name!r}, past its axis."
    if shape is not None and link.own_point >= shape.axis.point_count:
        yield f"patch {patch.name!r} is linked by its point {link.own_point}, past its axis."


def _cycles(document: ContactDocument) -> Iterator[str]:
    """Patches that are their own ancestors; each is walked over once, so that a long chain costs its length."""
    sound: set[str] = set()
    for name in document.patches:
        line: dict[str, None] = {}  # in order
        at = name
        while at in document.patches and at not in sound and at not in line:
            line[at] = None
            placement = document.patches[at].placement
            if not isinstance(placement, Link):
                break
            at = placement.parent
            if at in line:
                yield f"patch {at!r} is its own ancestor through {next(reversed(line))!r}."
        sound.update(line)


def _content(document: ContactDocument) -> bytes:
    """The canonical bytes of a document, without a digest."""
    shapes = {key: shape_text(shape) for key, shape in document.shapes.items()}
    return _canonical(document_to_json(replace(document, shapes=FrozenMap())) | {"shapes": shapes})


def _canonical(data: Any) -> bytes:
    return (pretty(data) + "\n").encode()


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _disbelief(source: str, has_digest: bool) -> str:
    trouble = "its digest does not fit its content" if has_digest else "it states no digest"
    return (
        f"{source} is not as it was saved: {trouble}, so it is damaged or was edited by other means. If the change"
        f" was meant, `contact accept FILE` states the digest anew; if not, bring back an older copy of the file,"
        f" or write what its journal holds: `contact replay FILE.journal --out NEW`. The file is left untouched."
    )


def _object_of(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A JSON object; one that names a key twice says two things at once."""
    found = dict(pairs)
    if len(found) != len(pairs):
        twice = Counter(key for key, _ in pairs).most_common(1)[0][0]
        raise ValueError(f"an object names {twice!r} twice")
    return found


def _refuse_constant(name: str) -> Any:
    raise ValueError(f"{name} is not a number that a document may hold")


_DECODER = json.JSONDecoder(parse_constant=_refuse_constant, object_pairs_hook=_object_of)
