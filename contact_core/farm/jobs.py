"""Which jobs there are: files that are named, patterns, folders that are searched, and lists of all of these."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from contact_core.atomic_file import read_bounded
from contact_core.errors import FileRefused, InvalidInput, shortened
from contact_core.plugins.slots import JobKind

LIST_SUFFIX = ".txt"
SUMMARY = "batch.json"  # a folder that holds one is the output of a batch: no jobs are looked for in it
MOST_JOBS = 100_000
_MOST_LIST_BYTES = 64_000_000
_LONGEST_NAME = 255  # bytes of a file's name, everywhere


@dataclass(frozen=True)
class FoundJob:
    """A job's file and the kind that runs it; name: of its folder among the results, with / between parts."""

    name: str
    kind: str
    path: Path


def find_jobs(sources: Iterable[Path | str], kinds: Mapping[str, JobKind], out: Path) -> list[FoundJob]:
    """The jobs of all sources in order, each once.

    A source is a job's file, a pattern with * ? or [, a folder (searched for files that a kind claims), or a list:
    a .txt file with one source a line, # before remarks, paths relative to it. out: where results go, which is not
    searched. Raises FileRefused, InvalidInput.
    """
    paths = list(dict.fromkeys(path for source in sources for path in _paths(str(source), Path(), kinds, out)))
    if not paths:
        known = ", ".join(sorted({suffix for kind in kinds.values() for suffix in kind.suffixes}))
        raise FileRefused(f"no jobs were found; a job is a file in {known}, of: {', '.join(kinds)}.")
    if len(paths) > MOST_JOBS:
        raise InvalidInput(f"{len(paths)} jobs were found; at most {MOST_JOBS} go into one batch.")
    root = Path(os.path.commonpath([path.parent for path in paths]))
    jobs: dict[str, FoundJob] = {}
    for path in paths:
        name = path.relative_to(root).with_suffix("").as_posix()
        if name in jobs:
            raise InvalidInput(
                f"{jobs[name].path} and {path} would both write into {name} there; give one of them another name."
            )
        jobs[name] = FoundJob(name, _kind_of(path, kinds), path)
    return list(jobs.values())


def _paths(source: str, folder: Path, kinds: Mapping[str, JobKind], out: Path) -> Iterator[Path]:
    """Absolute paths of the files behind one source. folder: what relative paths start from."""
    path = Path(os.path.normpath((folder / source).absolute()))  # a link stays: it is a name that somebody chose
    if any(len(os.fsencode(part)) > _LONGEST_NAME for part in path.parts):
        raise FileRefused(f"{shortened(source)} is no job: no file has a name as long as that.")
    if not path.exists() and any(letter in source for letter in "*?["):
        try:
            found = sorted(p for p in Path(path.anchor).glob(str(path.relative_to(path.anchor))) if p.is_file())
        except (OSError, ValueError) as error:
            raise FileRefused(
                f"{shortened(source)} is no pattern of files: use *, ? and ** between slashes."
            ) from error
        if not found:
            raise FileRefused(f"no file is called as {shortened(source)} says.")
        yield from found
    elif path.is_dir():
        yield from _claimed(path, kinds, out)
    elif path.suffix.lower() == LIST_SUFFIX:
        for line in _lines(path):
            yield from _paths(line, path.parent, kinds, out)
    else:
        yield path


def _lines(path: Path) -> Iterator[str]:
    try:
        text = read_bounded(path, _MOST_LIST_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileRefused(f"{path} is no list of jobs: it is not UTF-8 text.") from error
    for line in text.splitlines():
        name = line.strip()
        if name.lower().endswith(LIST_SUFFIX):
            raise FileRefused(f"{path} names another list, {name}; give both lists to the command.")
        if name and not name.startswith("#"):
            yield name


def _claimed(folder: Path, kinds: Mapping[str, JobKind], out: Path) -> Iterator[Path]:
    """The files below a folder that a kind claims; results of batches and hidden folders are passed by."""
    for place, folders, names in os.walk(folder):
        if SUMMARY in names or Path(place) == out.absolute():
            folders.clear()
            continue
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(names):
            path = Path(place) / name
            if any(path.suffix.lower() in kind.suffixes and kind.claims(path) for kind in kinds.values()):
                yield path


def _kind_of(path: Path, kinds: Mapping[str, JobKind]) -> str:
    for name, kind in kinds.items():
        if path.suffix.lower() in kind.suffixes:
            return name
    known = ", ".join(f"{'/'.join(kind.suffixes)} ({name})" for name, kind in kinds.items())
    raise FileRefused(f"{path} is no job: its name ends in none of {known}.")
