"""`contact library`: list, show, save and apply the grasps of a folder."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from contact_core.cli.numbers import finite
from contact_core.cli.output import columns

if TYPE_CHECKING:
    from contact_core.library.record import Grasp
    from contact_core.library.shelf import Library as Shelf

VARIABLE = "CONTACT_LIBRARY"


class Library:
    name = "library"
    summary = "grasps saved to be used again: list, show, save, apply, and a page of their pictures"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument(
            "--library", type=Path, metavar="DIR", help=f"the folder (${VARIABLE}, else the starter library)"
        )
        again = argparse.ArgumentParser(add_help=False, argument_default=argparse.SUPPRESS)
        again.add_argument("--library", type=Path, metavar="DIR", help="the folder")
        for flag in ("--json", "--quiet"):  # said before the act or after it
            again.add_argument(flag, action="store_true", help=argparse.SUPPRESS)
        acts = parser.add_subparsers(title="acts", metavar="ACT", required=True)
        listing = acts.add_parser("list", parents=[again], help="the grasps, with their kinds and tags")
        listing.add_argument("word", nargs="?", default="", help="only those with it in name, tags, kind or note")
        show = acts.add_parser("show", parents=[again], help="what a grasp is")
        show.add_argument("grasp", metavar="NAME", help="of the grasp; NAME@2 is its second version")
        show.add_argument("--picture", type=Path, metavar="FILE", help="write its picture there")
        _configure_save(acts.add_parser("save", parents=[again], help="save the grasp in a document or scene"))
        _configure_apply(acts.add_parser("apply", parents=[again], help="put a grasp onto a hand and an object"))
        sheet = acts.add_parser("sheet", parents=[again], help="a page with the pictures of all grasps")
        sheet.add_argument("out", type=Path, metavar="FILE", help="the page, .html")
        sheet.add_argument("word", nargs="?", default="", help="only those with it in name, tags, kind or note")
        making = acts.add_parser(
            "make", parents=[again], help="make the starter library anew, into an empty folder"
        )
        making.add_argument("out", type=Path, metavar="DIR", help="the folder")
        for name, act in acts.choices.items():
            act.set_defaults(act=name)

    def run(self, arguments: argparse.Namespace) -> int:
        acts = {"list": _list, "show": _show, "save": _save, "apply": _apply, "sheet": _sheet, "make": _make}
        return acts[arguments.act](arguments)


def _configure_save(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("grasp", metavar="NAME", help="under which it is saved")
    parser.add_argument("source", type=Path, metavar="FILE", help="a document (.json), or a scene")
    parser.add_argument(
        "files", nargs="*", metavar="HAND OBJECT", help="of a document: the files of its hand and its object"
    )
    parser.add_argument("--scale", type=finite, default=1.0, help="of the object's file, as it was made with (1)")
    parser.add_argument(
        "--kind", metavar="KIND", help="power, precision, hook, lateral or pinch; told if not given"
    )
    parser.add_argument("--tag", action="append", default=[], metavar="WORD", help="may be repeated")
    parser.add_argument("--note", default="", metavar="TEXT", help="a few words on it")
    parser.add_argument("--replace", action="store_true", help="save as a further version of a name that is taken")


def _configure_apply(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("grasp", metavar="NAME", help="of the grasp; NAME@2 is its second version")
    parser.add_argument("hand", metavar="HAND", help="file of a rig that is or has a hand, or sample:NAME")
    parser.add_argument("object", metavar="OBJECT", help="file of an object, or sample:NAME")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="the folder for the results")
    parser.add_argument("--count", type=int, default=1, metavar="N", help="at how many places (1)")
    parser.add_argument(
        "--at", type=finite, nargs=3, metavar=("X", "Y", "Z"), help="the place to hold, in its file"
    )
    parser.add_argument("--scale", type=finite, default=1.0, help="of the object, where its size is wrong (1)")
    parser.add_argument("--check", action="store_true", help="exit with 1 when it is no good grasp there")


def library_of(folder: Path | None) -> Shelf:
    """The library that was named, that of the environment, or the starter library."""
    from contact_core.library.shelf import Library as Shelf
    from contact_core.library.starter import starter_library

    named = folder or (Path(os.environ[VARIABLE]) if os.environ.get(VARIABLE) else None)
    return Shelf(named) if named is not None else starter_library()


def _list(arguments: argparse.Namespace) -> int:
    library = library_of(arguments.library)
    entries = list(library.entries(arguments.word))
    rows = [
        (entry.name, f"v{entry.version}", "!", entry.problem)
        if entry.grasp is None
        else (entry.name, f"v{entry.version}", entry.grasp.kind, ", ".join(entry.grasp.tags))
        for entry in entries
    ]
    data = [
        {"name": entry.name, "version": entry.version, "problem": entry.problem}
        if entry.grasp is None
        else {
            "name": entry.name,
            "version": entry.version,
            "kind": entry.grasp.kind,
            "tags": list(entry.grasp.tags),
        }
        for entry in entries
    ]
    arguments.output.answer(data, columns(rows) if rows else f"{library.folder} has no such grasp.")
    return 0


def _show(arguments: argparse.Namespace) -> int:
    from contact_core.atomic_file import write_atomic
    from contact_core.errors import FileRefused

    library = library_of(arguments.library)
    grasp = library.grasp(arguments.grasp)
    facts = _facts(grasp)
    plain = arguments.grasp.partition("@")[0]
    facts["versions"] = list(library.versions(plain))
    facts["folder"] = str(library.path_of(arguments.grasp))
    if arguments.picture is not None:
        picture = library.picture(arguments.grasp)
        if picture is None:
            raise FileRefused(f"{arguments.grasp!r} has no picture.")
        write_atomic(arguments.picture, picture)
    arguments.output.answer(facts, columns([(key, _spelt(value)) for key, value in facts.items()]))
    return 0


def _facts(grasp: Grasp) -> dict[str, Any]:
    return {
        "kind": grasp.kind,
        "tags": list(grasp.tags),
        "note": grasp.note,
        "hand": f"{grasp.hand.name} ({grasp.hand.side or 'either side'}, {100 * grasp.hand.length:.1f} cm)",
        "object": grasp.object.name,
        "digits": list(grasp.touching),
        "pads": [pad.patch for pad in grasp.pads],
        "origin": grasp.origin,
    }


def _spelt(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _save(arguments: argparse.Namespace) -> int:
    from contact_core.errors import InvalidInput
    from contact_core.grasp_files.library import save_file
    from contact_core.grasping.slots import KINDS
    from contact_core.library.shelf import Library as Shelf

    folder = arguments.library or os.environ.get(VARIABLE)
    if not folder:
        raise InvalidInput(f"say into which library: --library DIR before the act, or ${VARIABLE}.")
    if arguments.kind is not None and arguments.kind not in KINDS:
        raise InvalidInput(f"a grasp is one of {', '.join(KINDS)}, but {arguments.kind!r} was given.")
    library = Shelf(folder)
    version = save_file(
        library, arguments.grasp, arguments.source, arguments.files, scale=arguments.scale, kind=arguments.kind,
        tags=arguments.tag, note=arguments.note, replace=arguments.replace, plugins=arguments.plugins,
    )  # fmt: skip
    path = library.path_of(f"{arguments.grasp}@{version}")
    answer = {"name": arguments.grasp, "version": version, "folder": str(path)}
    arguments.output.answer(answer, f"saved {arguments.grasp}, version {version}: {path}")
    return 0


def _apply(arguments: argparse.Namespace) -> int:
    from contact_core.grasp_files.library import apply_files

    at = None if arguments.at is None else tuple(arguments.scale * x for x in arguments.at)
    result = apply_files(
        library_of(arguments.library), arguments.grasp, arguments.hand, arguments.object, arguments.out,
        scale=arguments.scale, at=at, count=arguments.count, plugins=arguments.plugins, progress=arguments.output,
    )  # fmt: skip
    for note in result.report["notes"]:
        arguments.output.remark(f"contact: {note}")
    rows = [
        (" " if one.is_grasp else "!", str(place + 1), one.kind, "; ".join(one.verdict.failures))
        for place, one in enumerate(result.grasps)
    ]
    text = "\n".join([columns(rows), result.report["summary"], f"sheet: {arguments.out / 'sheet.png'}"])
    files = {name: str(path) for name, path in result.files.items()}
    arguments.output.answer({"report": result.report, "files": files}, text)
    return int(arguments.check and not any(one.is_grasp for one in result.grasps))


def _sheet(arguments: argparse.Namespace) -> int:
    from contact_core.atomic_file import write_atomic
    from contact_core.errors import FileRefused
    from contact_core.library.pictures import page_of

    if arguments.out.suffix.lower() != ".html":
        raise FileRefused(f"the page is an HTML file, but got {arguments.out.name!r}; name it like grasps.html.")
    library = library_of(arguments.library)
    entries = list(library.entries(arguments.word))
    write_atomic(arguments.out, page_of(library, entries, f"{library.folder.name}: {len(entries)} grasps"))
    arguments.output.answer({"page": str(arguments.out), "grasps": len(entries)}, f"page: {arguments.out}")
    return 0


def _make(arguments: argparse.Namespace) -> int:
    from contact_core.errors import FileRefused
    from contact_core.grasp_files.starter_making import write_starter
    from contact_core.library.shelf import Library as Shelf

    if arguments.out.exists() and any(arguments.out.iterdir()):
        raise FileRefused(f"{arguments.out} is not empty; name a new folder.")
    made = write_starter(Shelf(arguments.out), arguments.plugins, arguments.output)
    rows = [
        (
            " " if one.suggestion.is_grasp else "!",
            one.type.name,
            one.type.kind,
            "; ".join(one.suggestion.verdict.failures),
        )
        for one in made
    ]
    data = [{"name": one.type.name, "failures": list(one.suggestion.verdict.failures)} for one in made]
    arguments.output.answer(data, columns(rows))
    return 0
