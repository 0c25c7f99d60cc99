"""Words and numbers of text formats, whatever editor wrote them; what is not a number is said in words.

Text stays bytes: names and comments may be in any code page, numbers are ASCII in all of them.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable, Sequence

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import InvalidInput

_WIDE_MARKS = {  # the longest first: UTF-32 begins as UTF-16 does
    codecs.BOM_UTF32_LE: "utf-32",
    codecs.BOM_UTF32_BE: "utf-32",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}
_MOST_DIGITS = 18  # of a whole number that fits 64 bits
_COMMENT = re.compile(rb"(?<!\.)#.*")  # but not "-1.#IND", which is how old Windows runtimes print no number


def plain(data: bytes) -> bytes:
    """The bytes of a text without its byte order mark; UTF-16 and UTF-32 as UTF-8. Raises InvalidInput."""
    if data.startswith(codecs.BOM_UTF8):
        return data[len(codecs.BOM_UTF8) :]
    encoding = next((name for mark, name in _WIDE_MARKS.items() if data.startswith(mark)), None)
    if encoding is None and len(data) > 3 and (data[:1] == b"\0") != (data[1:2] == b"\0"):
        encoding = "utf-16-be" if data[:1] == b"\0" else "utf-16-le"  # without a mark: ASCII has one zero a pair
        if data[2:4].count(0) != 1:
            return data
    if encoding is None:
        return data
    try:
        return data.decode(encoding).encode("utf-8", "replace")
    except UnicodeDecodeError:
        raise InvalidInput(f"it begins as {encoding.upper()} text, but is not; save it as UTF-8") from None


def without_comment(line: bytes) -> bytes:
    """The part of a line before `#`."""
    return _COMMENT.sub(b"", line) if b"#" in line else line


def numbers(words: Sequence[bytes], where: Callable[[int], str]) -> FloatArray:
    """(k,) numbers of words. where: names the place of the word with an index. Raises InvalidInput."""
    try:
        values = np.array(list(map(float, words)), np.float64)
        if not any(b"_" in word for word in words):
            return values
    except ValueError:
        pass
    return np.array([_number(word, k, where) for k, word in enumerate(words)], np.float64)


def wholes(words: Sequence[bytes], where: Callable[[int], str]) -> IntArray:
    """(k,) whole numbers of words. where: names the place of the word with an index. Raises InvalidInput."""
    try:
        values = np.array(list(map(int, words)), np.int64)
        if not any(b"_" in word for word in words):
            return values
    except (ValueError, OverflowError):
        pass
    return np.array([whole(word, where(k)) for k, word in enumerate(words)], np.int64)


def whole(word: bytes, where: str) -> int:
    """A whole number. Raises InvalidInput."""
    digits = word[1:] if word[:1] in (b"-", b"+") else word
    if not digits.isdigit():
        raise InvalidInput(f"{where}: {shown(word)} is not a whole number")
    if len(digits) > _MOST_DIGITS:
        raise InvalidInput(f"{where}: {shown(word)} is too large a number")
    return int(word)


def as_whole(values: FloatArray, what: str) -> IntArray:
    """Numbers that must be whole as integers. Raises InvalidInput."""
    good = np.isfinite(values) & (np.abs(values) < 2.0**53)
    good[good] = values[good] == np.trunc(values[good])
    if not good.all():
        raise InvalidInput(f"{what} must be whole numbers, but {values[np.argmin(good)]:g} is none")
    return values.astype(np.int64)


def shown(word: bytes) -> str:
    """A word as an error quotes it: short, and printable."""
    text = word[:24].decode("ascii", "backslashreplace") + ("..." if len(word) > 24 else "")
    return repr("".join(letter if letter.isprintable() else "?" for letter in text))


def _number(word: bytes, index: int, where: Callable[[int], str]) -> float:
    if b".#" in word:
        return float("nan")
    try:
        if b"_" not in word:
            return float(word)
    except ValueError:
        pass
    hint = "; decimals need a point, not a comma" if b"," in word else ""
    raise InvalidInput(f"{where(index)}: {shown(word)} is not a number{hint}")
