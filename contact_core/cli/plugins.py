"""`contact plugins`: every plugin that was found, what it offers, or why it failed."""

from __future__ import annotations

import argparse
from typing import Any

from contact_core.plugins.manager import PluginRecord


class Plugins:
    name = "plugins"
    summary = "list the plugins, what each offers, and what is wrong with those that failed"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument("--check", action="store_true", help="exit with 1 when any plugin has a problem")

    def run(self, arguments: argparse.Namespace) -> int:
        arguments.plugins.fill_all()
        records: tuple[PluginRecord, ...] = arguments.plugins.records()
        arguments.output.answer([_data(record) for record in records], "\n".join(map(_text, records)))
        return int(arguments.check and any(record.problems for record in records))


def _data(record: PluginRecord) -> dict[str, Any]:
    return {
        "name": record.name,
        "source": record.source,
        "origin": record.origin,
        "offers": record.offers,
        "absent": record.absent,
        "problems": record.problems,
    }


def _text(record: PluginRecord) -> str:
    lines = [f"{record.name}  ({record.source}, {record.origin})"]
    lines += [f"    {noun}: {', '.join(names)}" for noun, names in record.offers.items()]
    lines += [f"    - {sentence}" for sentence in record.absent]
    lines += [f"    ! {problem}" for problem in record.problems]
    return "\n".join(map(_printable, lines))


def _printable(line: str) -> str:
    """A line without what would steer a terminal: names and errors are as foreign as the plugins."""
    return "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in line)
