"""`Library`: a folder of grasps that many can write at once, on a network drive too.

    LIBRARY/NAME/0001/grasp.json     the record (`library.record`)
    LIBRARY/NAME/0001/contacts.json  its patches and pairs, an ordinary contact set
    LIBRARY/NAME/0001/picture.png    how it looks

A version is written aside and put in place by one rename, which fails where that number is taken: nothing is ever
written over, nobody reads half a grasp, and of two who save at once both find their grasp on the shelf.
"""

from __future__ import annotations

import contextlib
import errno
import os
import re
import secrets
import shutil
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from contact_core.atomic_file import read_bounded, write_atomic
from contact_core.document.library import ContactSet, load_contact_set, save_contact_set
from contact_core.errors import ContactError, FileRefused, InvalidInput, quoted
from contact_core.library import record
from contact_core.library.record import Grasp, dump_grasp, parse_grasp

GRASP, CONTACTS, PICTURE = "grasp.json", "contacts.json", "picture.png"
MAX_CONTACTS, MAX_PICTURE = 64 << 20, 4 << 20
MOST_GRASPS, MOST_VERSIONS = 10_000, 9999
LONGEST_NAME = 80
_STAGING, _STALE = ".staging-", 24 * 3600.0
_FORBIDDEN = '<>:"/\\|?*@'
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)
_VERSION = re.compile(r"\d{4}")
_PNG = b"\x89PNG\r\n\x1a\n"


@dataclass(frozen=True)
class Entry:
    """A grasp of a library as a list shows it; problem says why it cannot be read, and then there is no grasp."""

    name: str
    version: int
    grasp: Grasp | None
    problem: str = ""


class Library:
    """The grasps in a folder. Names are file names on every system; NAME@2 is the second version of one."""

    def __init__(self, folder: Path | str) -> None:
        self.folder = Path(folder)

    # -- reading -------------------------------------------------------------------------------------------------

    def names(self) -> tuple[str, ...]:
        """The grasps by name, sorted. Raises FileRefused where there is no such folder."""
        try:
            entries = [entry.name for entry in os.scandir(self.folder) if entry.is_dir()]
        except OSError as error:
            raise FileRefused(f"there is no library in {self.folder}: {error.strerror or error}.") from error
        if len(entries) > MOST_GRASPS:
            raise FileRefused(f"{self.folder} holds {len(entries)} folders; a library has at most {MOST_GRASPS}.")
        return tuple(sorted(name for name in entries if is_grasp_name(name) and self.versions(name)))

    def versions(self, name: str) -> tuple[int, ...]:
        """The numbers of the versions of a grasp, the oldest first; none where there is no such grasp."""
        check_grasp_name(name)
        try:
            entries = [entry.name for entry in os.scandir(self.folder / name) if entry.is_dir()]
        except OSError:
            return ()
        return tuple(sorted(int(entry) for entry in entries if _VERSION.fullmatch(entry) and int(entry) > 0))

    def entries(self, word: str = "") -> Iterator[Entry]:
        """Every grasp, the latest version of each, also those that cannot be read. word: only those with it in
        their name, kind, tags, hand, object or note."""
        for name in self.names():
            version = self.versions(name)[-1]
            try:
                entry = Entry(name, version, self.grasp(f"{name}@{version}"))
            except ContactError as error:
                entry = Entry(name, version, None, str(error))
            if not word or word.casefold() in _text_of(entry).casefold():
                yield entry

    def grasp(self, name: str) -> Grasp:
        """The record of NAME or NAME@VERSION. Raises FileRefused."""
        path = self.path_of(name) / GRASP
        return parse_grasp(read_bounded(path, record.MAX_BYTES), str(path))

    def contacts(self, name: str) -> ContactSet:
        """The contacts of NAME or NAME@VERSION. Raises FileRefused."""
        path = self.path_of(name) / CONTACTS
        if path.is_file() and path.stat().st_size > MAX_CONTACTS:
            raise FileRefused(f"{path} has {path.stat().st_size} bytes; more than {MAX_CONTACTS} are refused.")
        return load_contact_set(path)

    def picture(self, name: str) -> bytes | None:
        """The PNG of NAME or NAME@VERSION, None where it has none. Raises FileRefused for what is no picture."""
        path = self.path_of(name) / PICTURE
        if not path.exists():
            return None
        data = read_bounded(path, MAX_PICTURE)
        if not data.startswith(_PNG):
            raise FileRefused(f"{path} is no PNG picture.")
        return data

    def path_of(self, name: str) -> Path:
        """The folder of NAME or NAME@VERSION. Raises FileRefused naming what is there."""
        plain, mark, number = name.partition("@")
        there = self.versions(plain)
        if not there:
            self._refuse_missing(plain)
        if mark and not (number.isdecimal() and len(number) < 5 and int(number) in there):
            versions = ", ".join(map(str, there))
            raise FileRefused(f"the grasp {plain!r} has no version {quoted(number)}; it has {versions}.")
        return self.folder / plain / f"{int(number) if mark else there[-1]:04}"

    def _refuse_missing(self, name: str) -> None:
        import difflib

        names = self.names()
        have = ", ".join(difflib.get_close_matches(name, names, n=3)) or "none yet"
        if names and have == "none yet":
            have = f"{len(names)}, among them {', '.join(names[:5])} (`contact library list`)"
        raise FileRefused(f"the library {self.folder} has no grasp {name!r}; it has {have}.")

    # -- writing -------------------------------------------------------------------------------------------------

    def add(
        self, name: str, grasp: Grasp, contacts: ContactSet, picture: bytes | None = None, *, replace: bool = False
    ) -> int:
        """Put a grasp on the shelf; returns the number of its version. replace: a name that is taken gets a further
        version, and those before it stay. Raises FileRefused; nothing is then there that was not before."""
        name = check_grasp_name(name)
        if picture is not None and not (picture.startswith(_PNG) and len(picture) <= MAX_PICTURE):
            raise InvalidInput(f"the picture of a grasp is a PNG of at most {MAX_PICTURE} bytes.")
        if not replace:
            self._check_free(name)
        try:
            with self._stage() as stage:
                write_atomic(stage / GRASP, dump_grasp(grasp))
                save_contact_set(contacts, stage / CONTACTS)
                if picture is not None:
                    write_atomic(stage / PICTURE, picture)
                return self._placed(stage, name, replace)
        except OSError as error:
            raise FileRefused(f"cannot write into {self.folder}: {error.strerror or error}.") from error

    def _check_free(self, name: str) -> None:
        if self.folder.is_dir():
            for other in self.names():
                if other.casefold() == name.casefold():
                    raise FileRefused(
                        f"the library has a grasp {other!r} already; give another name, or save it as a further"
                        " version."
                    )

    @contextlib.contextmanager
    def _stage(self) -> Iterator[Path]:
        """A folder beside the grasps in which one is written; what killed writers left a day ago goes."""
        self.folder.mkdir(parents=True, exist_ok=True)
        stage = self.folder / f"{_STAGING}{secrets.token_hex(8)}"
        stage.mkdir()
        try:
            now = stage.stat().st_mtime  # by the clock that dates the others: that of the server
            for old in self.folder.glob(_STAGING + "*"):
                with contextlib.suppress(OSError):
                    if now - old.stat().st_mtime > _STALE:
                        shutil.rmtree(old, ignore_errors=True)
            yield stage
        finally:
            shutil.rmtree(stage, ignore_errors=True)

    def _placed(self, stage: Path, name: str, replace: bool) -> int:
        """Rename the written folder to the first version that nobody took, if all of it is there."""
        if not all((stage / file).is_file() for file in (GRASP, CONTACTS)):
            raise FileRefused(
                f"somebody removed the unfinished grasp {name!r} while it was written; save it again."
            )
        home = self.folder / name
        home.mkdir(exist_ok=True)
        number = max(self.versions(name), default=0) + 1
        while number <= MOST_VERSIONS:
            if number > 1 and not replace:
                raise FileRefused(f"somebody saved a grasp {name!r} at this moment; give another name.")
            try:
                stage.rename(home / f"{number:04}")
            except OSError as error:  # sshfs and Windows name no reason that would tell; a list may be old there
                taken = error.errno in (errno.EEXIST, errno.ENOTEMPTY) or (home / f"{number:04}").is_dir()
                if not taken or not stage.is_dir():
                    raise
                number += 1
                continue
            return number
        raise FileRefused(f"the grasp {name!r} has too many versions; give another name.")


def is_grasp_name(name: str) -> bool:
    """Whether a name is that of a grasp: a file name on every system."""
    good = 0 < len(name) <= LONGEST_NAME and name.isprintable() and name == name.strip()
    return (
        good
        and not set(name) & set(_FORBIDDEN)
        and name[0] != "."
        and name[-1] != "."
        and not _DEVICES.fullmatch(name)
        and unicodedata.is_normalized("NFC", name)
    )


def check_grasp_name(name: str) -> str:
    """The name in its normal form. Raises InvalidInput for what is no file name on every system."""
    name = unicodedata.normalize("NFC", name)
    if not is_grasp_name(name):
        raise InvalidInput(
            f"the name of a grasp is 1..{LONGEST_NAME} printable characters without any of {_FORBIDDEN} and without"
            f" a dot at either end; got {quoted(name)}."
        )
    return name


def _text_of(entry: Entry) -> str:
    grasp = entry.grasp
    if grasp is None:
        return entry.name
    return " ".join([entry.name, grasp.kind, *grasp.tags, grasp.hand.name, grasp.object.name, grasp.note])
