"""`contact samples`: the sample assets, and writing one to a file."""

from __future__ import annotations

import argparse
from pathlib import Path

from contact_core.cli.output import columns
from contact_core.errors import FileRefused, InvalidInput
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import FORMATS, SAMPLES
from contact_core.plugins.slots import Format


class Samples:
    name = "samples"
    summary = "list the sample hands and objects, or write one to a file"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument("sample", nargs="?", help="the name of a sample")
        parser.add_argument("--out", type=Path, help="the file to write it to, such as hand.glb")

    def run(self, arguments: argparse.Namespace) -> int:
        samples = arguments.plugins.offers(SAMPLES)
        if arguments.sample is None:
            rows = [[name, sample.kind, sample.summary] for name, sample in sorted(samples.items())]
            data = [{"name": name, "kind": kind, "summary": summary} for name, kind, summary in rows]
            arguments.output.answer(data, columns(rows))
            return 0
        sample = arguments.plugins.get(SAMPLES, arguments.sample)
        if arguments.out is None:
            raise InvalidInput(f"where to? Add --out FILE, such as --out {sample.name}.glb.")
        writer = writer_of(arguments.plugins, arguments.out)
        writer.write(arguments.out, [sample.build()], {})
        arguments.output.answer({"written": str(arguments.out)}, f"wrote {arguments.out}")
        return 0


def writer_of(plugins: PluginManager, path: Path) -> Format:
    """The format that writes files with this ending."""
    writers = [offered for offered in plugins.offers(FORMATS).values() if offered.can_write]
    for offered in writers:
        if path.suffix.lower() in offered.suffixes:
            return offered
    endings = sorted({suffix for offered in writers for suffix in offered.suffixes})
    raise FileRefused(
        f"no format writes {path.suffix or 'a file without an ending'}; there are: {', '.join(endings)}."
    )
