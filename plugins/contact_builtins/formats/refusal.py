"""Bad files are refused in one sentence: no traceback, no hang, no surprise allocation."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from json import JSONDecodeError
from pathlib import Path

from contact_builtins.formats.mistaken import mistaken
from contact_core.errors import FileRefused, InvalidInput

_TOLD = 8  # names in a sentence
NO_FACES = "holds no faces, so there is nothing to touch; name a file with a mesh."
_POINTER = b"version https://git-lfs.github.com/spec/"  # what a clone without LFS has in the place of a large file
MAX_FILE_BYTES = 1 << 30
MAX_JOINTS = 4096
MAX_ELEMENTS = 20_000_000  # vertices, faces, accessor rows: far above any mesh that a person paints on

# What Python raises when a file's own words contradict one another.
DAMAGE = (
    InvalidInput,
    ArithmeticError,
    AttributeError,
    LookupError,
    MemoryError,
    RecursionError,
    TypeError,
    ValueError,
    struct.error,
)

_WORDS: dict[type[Exception], str] = {
    RecursionError: "it is nested too deeply",
    MemoryError: "it asks for more memory than there is",
    OverflowError: "a number in it is too large",
    UnicodeError: "its text is not UTF-8",
    LookupError: "it refers to something that it does not hold",
    TypeError: "a value in it is of the wrong kind",
    AttributeError: "a value in it is of the wrong kind",
    Exception: "a value in it is not what the format allows",
}


class NoSurface(InvalidInput):
    """A sound file that holds nothing to touch. The message goes on after "FILE "."""


@contextmanager
def refusing(path: Path, what: str) -> Iterator[None]:
    """Everything that a damaged `what` ("an OBJ file") can cause, as FileRefused naming the file.

    Where the file is something else by what it begins with, that is said.
    """
    try:
        yield
    except OSError as error:
        raise FileRefused(f"{path} cannot be read: {error.strerror or error}.") from error
    except (FileRefused, *DAMAGE) as error:
        if told := mistaken(path):
            raise FileRefused(told) from error
        if isinstance(error, FileRefused):
            raise
        if isinstance(error, NoSurface):
            raise FileRefused(f"{path} {error}") from error
        reason = _in_words(error)
        raise FileRefused(f"{path} was to be {what}, but is damaged: {reason[:300]}. Export it anew.") from error


def _in_words(error: Exception) -> str:
    """What our own checks say is a sentence already; what Python says of a file's wrong values becomes one."""
    if isinstance(error, InvalidInput):
        return str(error).strip().rstrip(".")
    if isinstance(error, JSONDecodeError):
        return f"line {error.lineno}, column {error.colno} is not JSON"
    if isinstance(error, KeyError):
        return f"{str(error)[:80]} is missing, or no word that the format knows"
    return next(words for kind, words in _WORDS.items() if isinstance(error, kind))


def file_bytes(path: Path) -> bytes:
    """The whole file, if it is a file and not too large. Raises FileRefused."""
    try:
        size = path.stat().st_size
        if not path.is_file():
            raise FileRefused(f"{path} is not a file; give the path of a mesh or rig file.")
        if size > MAX_FILE_BYTES:
            raise FileRefused(f"{path} has {size} bytes; files up to {MAX_FILE_BYTES} bytes are read. Split it.")
        data = path.read_bytes()
    except OSError as error:
        raise FileRefused(f"{path} cannot be read: {error.strerror or error}.") from error
    except ValueError as error:  # a zero byte, or half of a surrogate pair
        raise FileRefused(f"{str(path)!r} cannot be the name of a file.") from error
    if data.startswith(_POINTER):
        raise FileRefused(
            f"{path} is a pointer of Git LFS and not the file itself: fetch it (git lfs pull) and try again."
        )
    return data


def file_of(wanted: Path, below: Path) -> Path:
    """A file by its name, in whatever case it is written below a folder: Windows does not tell them apart."""
    if wanted.is_file() or not wanted.is_relative_to(below):
        return wanted
    found = below
    for part in wanted.relative_to(below).parts:
        there = found / part
        if not there.exists():
            alike = [child for child in _children(found) if child.name.casefold() == part.casefold()]
            if len(alike) != 1:
                return wanted
            there = alike[0]
        found = there
    return found.resolve()


def _children(folder: Path) -> list[Path]:
    try:
        return list(folder.iterdir())
    except OSError:
        return []


def bounded(count: int, what: str, most: int = MAX_ELEMENTS) -> int:
    """A count that a file states, if it is believable. Raises InvalidInput."""
    if not 0 <= count <= most:
        raise InvalidInput(f"it states {count} {what}; 0 to {most} are read")
    return count


def named(names: Sequence[str]) -> str:
    """The first names of a list for a sentence, and how many there are besides."""
    rest = len(names) - _TOLD
    return ", ".join(names[:_TOLD]) + (f" and {rest} more" if rest > 0 else "")
