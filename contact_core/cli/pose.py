"""`contact pose RECIPE.toml --out DIR`: from two files to a posed grasp."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from contact_core.cli.output import Output, columns

if TYPE_CHECKING:
    from contact_core.job.job import JobResult


class Pose:
    name = "pose"
    summary = "pose a hand on an object as a recipe says; writes document, pose, model, pictures and report"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument("recipe", type=Path, metavar="RECIPE.toml")
        parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="the folder for the results")
        parser.add_argument("--check", action="store_true", help="exit with 1 when the recipe's thresholds fail")

    def run(self, arguments: argparse.Namespace) -> int:
        from contact_core.job.run import run_recipe

        result = run_recipe(arguments.recipe, arguments.out, plugins=arguments.plugins, progress=arguments.output)
        tell(result, arguments.output)
        return int(arguments.check and not result.verdict.is_grasp)


def tell(result: JobResult, output: Output) -> None:
    """The metrics as a table, what failed, and where the files are."""
    for note in result.report["notes"]:
        if "renderer" in note:  # the picture is plainer than it could be, or missing
            output.remark(f"contact: {note}")
    lines = [columns([("!" if failed else " ", name, value) for name, value, failed in result.table])]
    lines += [f"! {failure}" for failure in result.verdict.failures]
    lines += [f"{role}: {path}" for role, path in result.files.items()]
    files = {role: str(path) for role, path in result.files.items()}
    output.answer({"report": dict(result.report), "files": files}, "\n".join(lines))
