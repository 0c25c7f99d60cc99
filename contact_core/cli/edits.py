"""`contact history`, `replay`, `diff` and `accept`: what was done to a document, in the artist's words."""

from __future__ import annotations

import argparse
from pathlib import Path


class History:
    name = "history"
    summary = "list the edits of a document, or of a journal"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument("file", type=Path, metavar="FILE", help="a document or a journal")

    def run(self, arguments: argparse.Namespace) -> int:
        from contact_core.edit.summaries import history_lines
        from contact_core.plugins.registry import COMMANDS

        lines = history_lines(arguments.file, arguments.plugins.offers(COMMANDS))
        arguments.output.answer({"edits": lines}, "\n".join(lines) or "no edits")
        return 0


class Replay:
    name = "replay"
    summary = "carry out a journal again, and write the document that it leads to"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument("journal", type=Path, metavar="JOURNAL")
        parser.add_argument("--out", type=Path, metavar="FILE", help="the document to write; without it, only tell")

    def run(self, arguments: argparse.Namespace) -> int:
        from contact_core.edit.summaries import replay_lines
        from contact_core.plugins.registry import COMMANDS

        lines = replay_lines(arguments.journal, arguments.out, arguments.plugins.offers(COMMANDS))
        written = None if arguments.out is None else str(arguments.out)
        arguments.output.answer({"told": lines, "written": written}, "\n".join(lines))
        return 0


class Diff:
    name = "diff"
    summary = "tell what changed from one document to another; exits with 1 when anything did"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument("before", type=Path, metavar="A")
        parser.add_argument("after", type=Path, metavar="B")

    def run(self, arguments: argparse.Namespace) -> int:
        from contact_core.edit.summaries import diff_lines

        lines = diff_lines(arguments.before, arguments.after)
        arguments.output.answer({"changes": lines}, "\n".join(lines) or "nothing changed")
        return int(bool(lines))


class Accept:
    name = "accept"
    summary = "accept a document that was edited by hand: check it, and state its digest anew"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument("file", type=Path, metavar="FILE", help="the document")

    def run(self, arguments: argparse.Namespace) -> int:
        from contact_core.edit.recovery import accept_file

        digest = accept_file(arguments.file)
        arguments.output.answer({"file": str(arguments.file), "digest": digest}, f"accepted {arguments.file}")
        return 0
