"""`contact grasp HAND OBJECT --out DIR`: good grasps from two files."""

from __future__ import annotations

import argparse
from pathlib import Path

from contact_core.cli.numbers import finite
from contact_core.cli.output import columns


class Grasp:
    name = "grasp"
    summary = (
        "suggest grasps of an object by a hand, from the two files alone; writes a contact sheet and documents"
    )

    def configure(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument("hand", metavar="HAND", help="file of a rig that is or has a hand, or sample:NAME")
        parser.add_argument("object", metavar="OBJECT", help="file of an object, or sample:NAME")
        parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="the folder for the results")
        parser.add_argument("--count", type=int, default=8, metavar="N", help="how many grasps (8)")
        parser.add_argument(
            "--kind",
            action="append",
            metavar="KIND",
            help="power, precision, hook, lateral or pinch; may be repeated",
        )
        parser.add_argument(
            "--at",
            type=finite,
            nargs=3,
            metavar=("X", "Y", "Z"),
            help="the place of the object to hold, in its file",
        )
        parser.add_argument("--scale", type=finite, default=1.0, help="of the object, where its size is wrong (1)")
        parser.add_argument("--like", metavar="NAME", help="of a saved grasp: it comes first, where it fits")
        parser.add_argument(
            "--library", type=Path, metavar="DIR", help="of --like ($CONTACT_LIBRARY, else the starter library)"
        )
        parser.add_argument("--seed", type=int, default=0, help="of everything random (0)")
        parser.add_argument("--check", action="store_true", help="exit with 1 when no good grasp was found")

    def run(self, arguments: argparse.Namespace) -> int:
        from contact_core.cli.library import library_of
        from contact_core.grasp_files.grasp import grasp
        from contact_core.grasping.searching import GraspSettings
        from contact_core.grasping.verdict import told_through

        like = None
        if arguments.like is not None:
            library = library_of(arguments.library)
            like = library.grasp(arguments.like), library.contacts(arguments.like)
        at = None if arguments.at is None else tuple(arguments.scale * x for x in arguments.at)
        settings = GraspSettings(arguments.count, tuple(arguments.kind or ()), at, arguments.seed)
        result = grasp(
            arguments.hand, arguments.object, arguments.out, settings, scale=arguments.scale, like=like,
            plugins=arguments.plugins, progress=arguments.output,
        )  # fmt: skip
        for note in result.report["notes"]:
            arguments.output.remark(f"contact: {note}")
        rows = [
            (
                " " if one.is_grasp else "!",
                str(place + 1),
                one.kind,
                f"{one.score:.2f}",
                "; ".join(filter(None, (told_through(one.facts.metrics), *one.verdict.failures))),
            )
            for place, one in enumerate(result.grasps)
        ]
        text = "\n".join([columns(rows), result.report["summary"], f"sheet: {arguments.out / 'sheet.png'}"])
        files = {name: str(path) for name, path in result.files.items()}
        arguments.output.answer({"report": result.report, "files": files}, text)
        return int(arguments.check and not any(one.is_grasp for one in result.grasps))
