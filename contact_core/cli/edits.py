"""`contact history` and `contact replay`: what was done to a document, in the artist's words."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from contact_core.cli.output import columns
from contact_core.errors import FileRefused

if TYPE_CHECKING:
    from contact_core.edit.history import History as Edits


class History:
    name = "history"
    summary = "list the edits of a document, or of a journal"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument("file", type=Path, metavar="FILE", help="a document, or a journal")

    def run(self, arguments: argparse.Namespace) -> int:
        history = _replayed(_journal_of(arguments.file), arguments)
        done = {step.revision for step in history.done}
        data = [
            {
                "revision": step.revision,
                "label": step.command.label(),
                "origin": step.origin,
                "done": step.revision in done,
            }
            for step in history.steps
        ]
        rows = [
            (str(step["revision"]), str(step["label"]), f"({step['origin']})", "" if step["done"] else "undone")
            for step in data
        ]
        arguments.output.answer(data, columns(rows) or "no edits")
        return 0


class Replay:
    name = "replay"
    summary = "carry out a journal again and write the document that it leads to"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument("journal", type=Path, metavar="JOURNAL")
        parser.add_argument("--out", type=Path, metavar="FILE", help="the document to write; without it, only tell")

    def run(self, arguments: argparse.Namespace) -> int:
        from contact_core.edit.recovery import write_document

        history = _replayed(arguments.journal, arguments)
        if arguments.out is not None:
            write_document(arguments.out, history.document)
        told = f"{len(history.done)} edits lead to revision {history.revision}"
        data = {
            "edits": len(history.done),
            "revision": history.revision,
            "patches": sorted(history.document.patches),
            "written": None if arguments.out is None else str(arguments.out),
        }
        arguments.output.answer(data, told + ("" if arguments.out is None else f"; wrote {arguments.out}"))
        return 0


def _journal_of(path: Path) -> Path:
    """The journal of a document, the one of the last session where it was closed in order; or `path` itself."""
    from contact_core.edit.recovery import journal_path

    beside = journal_path(path)
    for candidate in (beside, beside.with_name(beside.name + ".previous")):
        if candidate.exists():
            return candidate
    if path.suffix == ".json" and path.exists():
        raise FileRefused(f"{path} has no journal beside it ({beside.name}), so its edits are not known.")
    return path


def _replayed(journal: Path, arguments: argparse.Namespace) -> Edits:
    """The history in a journal, commands of plugins included; what is damaged is remarked on."""
    from contact_core.edit.command import register_command
    from contact_core.edit.journal import read_journal, replay
    from contact_core.plugins.registry import COMMANDS

    for command in arguments.plugins.offers(COMMANDS).values():
        register_command(command)
    contents = read_journal(journal)
    history, trouble = replay(contents)
    for sentence in (contents.damage, trouble):
        if sentence:
            arguments.output.remark(sentence)
    return history
