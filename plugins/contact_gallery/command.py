"""`contact gallery [NAME ...] [--all] [--list] --out DIR`."""

from __future__ import annotations

import argparse
from pathlib import Path


class GalleryCommand:
    name = "gallery"
    summary = "make the paper's figures again, with pictures and measures"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument("figures", nargs="*", metavar="NAME", help="which figures; --list names them")
        parser.add_argument("--all", action="store_true", help="all of them (minutes)")
        parser.add_argument("--list", action="store_true", help="name the figures and stop")
        parser.add_argument(
            "--out", type=Path, metavar="DIR", default=Path("contact-gallery"),
            help="the folder for gallery.md and its pictures (contact-gallery)",
        )  # fmt: skip

    def run(self, arguments: argparse.Namespace) -> int:
        from contact_core.errors import InvalidInput
        from contact_gallery.exhibition import exhibit
        from contact_gallery.figure import figure, names

        if arguments.list:
            titles = {name: figure(name).title for name in names()}
            arguments.output.answer(titles, "\n".join(f"{name:<20} {title}" for name, title in titles.items()))
            return 0
        wanted = names() if arguments.all else tuple(arguments.figures)
        if not wanted:
            raise InvalidInput("which figure? Give names, or --all; --list names them.")
        made = exhibit(wanted, arguments.out, arguments.plugins, arguments.output)
        lines = [f"{one['name']:<20} {one['seconds']:6.1f} s  {one['operations']:3d} operations" for one in made]
        arguments.output.answer(made, "\n".join([*lines, f"wrote {arguments.out / 'gallery.md'}"]))
        return 0
