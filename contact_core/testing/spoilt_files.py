"""Files spoilt at random, as a bad disk, a careless editor and an attacker spoil them, and what a reader owes them.

Containers are opened first: a damaged archive is refused by its checksums, so that what it holds would never be
tried. Text has its numbers and words changed, so that most of it still parses.
"""

from __future__ import annotations

import io
import json
import random
import re
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from contact_core.errors import ContactError

PYTHON_WORDS = (
    "invalid literal", "could not convert", "Exceeds the limit", "embedded null", "recursion depth", "codec can't",
    "index out of range", "out of bounds for axis", "not iterable", "NoneType", "' object", "real number, not",
    "subscriptable", "values to unpack", "Traceback", "dtype", "reshape", "broadcast", "positional argument",
    "has no attribute", "unhashable", "<class", "0x7f", "ndarray", "errno", "Error: ",
)  # fmt: skip
LONGEST_SENTENCE = 1200
_ODD = (
    "0", "-1", "1", "2147483647", "-2147483648", "4294967296", "99999999999999999999", "1e999", "-1e-400", "nan",
    "inf", "1e38", "1e-38", "0.5", "9" * 5000, "1_0", "", "x", "null", "true", '"a"', "[]", "{}", "[" * 3000,
    "{" * 3000, "\0", "\ufeff", "\n", "..", "../../etc/passwd", "é", "\ud800", "\\",
)  # fmt: skip
_NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
_WORD = re.compile(rb"[A-Za-z_:]{2,}")
_DIGEST = re.compile(rb'"digest": ?"[0-9a-f]{64}"')


def spoilt(content: bytes, chance: random.Random) -> bytes:
    """The content with one to three changes; the digest of stored JSON is taken out half the time, so that what is
    behind it is reached."""
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        content = _changed(content, chance)
    if chance.random() < 0.5:
        content = _DIGEST.sub(b'"digest": null', content, count=1)
    return content


def survive(read: Callable[[Path], Any], path: Path, content: bytes) -> bool:
    """Give a reader a file; whether it was read. AssertionError for what is neither a thing nor a sentence."""
    path.write_bytes(content)
    try:
        read(path)
    except ContactError as refusal:
        told = str(refusal)
        words = [word for word in PYTHON_WORDS if word in told]
        assert not words, f"Python's words {words}: {told[:400]}"
        assert "\n" not in told.strip(), f"not one sentence: {told[:400]}"
        assert len(told) <= LONGEST_SENTENCE, f"{len(told)} letters: {told[:200]}"
        assert len(told.split()) >= 4, f"no sentence: {told!r}"
        return False
    return True


def _changed(content: bytes, chance: random.Random) -> bytes:
    if content.startswith(b"PK\x03\x04"):
        return _archive_changed(content, chance)
    if content.startswith(b"glTF") and len(content) > 28:
        return _glb_changed(content, chance)
    is_text = b"\0" not in content[:200]
    ways = (_bytes_changed, _cut, _repeated, *((_number_changed, _number_changed, _word_changed) * is_text))
    return chance.choice(ways)(content, chance)


def _archive_changed(content: bytes, chance: random.Random) -> bytes:
    """One member changed under a right checksum; sometimes the archive itself."""
    if chance.random() < 0.2:
        return _bytes_changed(content, chance)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
    except Exception:  # an earlier change has damaged it
        return content
    if not members:
        return content
    name = chance.choice(sorted(members))
    if chance.random() < 0.15:
        del members[name]
    else:
        members[name] = _changed(members[name], chance)
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return stream.getvalue()


def _glb_changed(content: bytes, chance: random.Random) -> bytes:
    """The JSON changed and put back with right lengths; sometimes the bytes themselves."""
    size = struct.unpack("<I", content[12:16])[0]
    text, rest = content[20 : 20 + size], content[20 + size :]
    if chance.random() < 0.3 or not text:
        return _bytes_changed(content, chance)
    text = _node_changed(text, chance) if chance.random() < 0.5 else _changed(text, chance)
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A)
    return head + text + rest


def _node_changed(text: bytes, chance: random.Random) -> bytes:
    """A value anywhere in JSON exchanged for another of the document, or an odd one."""
    try:
        document = json.loads(text)
    except (ValueError, RecursionError):
        return text
    places = list(_places(document))
    if not places:
        return text
    holder, key = chance.choice(places)
    other, of = chance.choice(places)
    holder[key] = chance.choice((other[of], None, -1, 2**31, 0.5, "x", [], {}, True, 10**300, [0] * 17))
    try:
        return json.dumps(document).encode()
    except (ValueError, RecursionError):  # a holder within itself
        return text


def _places(value: Any) -> list[tuple[Any, Any]]:
    """Every holder and key of a JSON value."""
    found: list[tuple[Any, Any]] = []
    rest = [value]
    while rest:
        one = rest.pop()
        inner = (
            list(one.items()) if isinstance(one, dict) else list(enumerate(one)) if isinstance(one, list) else []
        )
        found += [(one, key) for key, _ in inner]
        rest += [child for _, child in inner]
    return found


def _number_changed(content: bytes, chance: random.Random) -> bytes:
    return _exchanged(content, list(_NUMBER.finditer(content)), chance)


def _word_changed(content: bytes, chance: random.Random) -> bytes:
    """A word exchanged for another of the file, or an odd one."""
    words = list(_WORD.finditer(content))
    if words and chance.random() < 0.6:
        one, other = chance.choice(words), chance.choice(words)
        return content[: one.start()] + other[0] + content[one.end() :]
    return _exchanged(content, words, chance)


def _exchanged(content: bytes, found: list[re.Match[bytes]], chance: random.Random) -> bytes:
    if not found:
        return _bytes_changed(content, chance)
    one = chance.choice(found)
    return content[: one.start()] + chance.choice(_ODD).encode("utf-8", "surrogatepass") + content[one.end() :]


def _bytes_changed(content: bytes, chance: random.Random) -> bytes:
    """Bytes set, bits flipped, four bytes made a large number, a hole of zeros."""
    data = bytearray(content or b"\0")
    for _ in range(chance.choice((1, 1, 2, 8))):
        at = chance.randrange(len(data))
        kind = chance.randrange(4)
        if kind == 0:
            data[at] = chance.randrange(256)
        elif kind == 1:
            data[at] ^= 1 << chance.randrange(8)
        elif kind == 2:
            data[at : at + 4] = chance.choice(
                (b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", b"\0\0\xc0\x7f", b"\0\0\0\0")
            )
        else:
            data[at : at + 40] = bytes(len(data[at : at + 40]))
    return bytes(data)


def _cut(content: bytes, chance: random.Random) -> bytes:
    """The end, or a piece, is gone."""
    at = chance.randrange(len(content) + 1)
    return content[:at] if chance.random() < 0.5 else content[:at] + content[at + chance.randrange(200) :]


def _repeated(content: bytes, chance: random.Random) -> bytes:
    """A piece comes again, there or elsewhere."""
    at, to = chance.randrange(len(content) + 1), chance.randrange(len(content) + 1)
    return content[:to] + content[at : at + chance.randrange(400)] + content[to:]
