"""`contact batch JOBS --out DIR`: many jobs, on this machine's cores or on a Dask cluster."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from contact_core.cli.numbers import finite
from contact_core.cli.output import Output, columns

if TYPE_CHECKING:
    from contact_core.farm.batch import BatchResult
    from contact_core.farm.workers import Workers

_MOST_LINES = 40  # of failures on a terminal; the report has all


class Batch:
    name = "batch"
    summary = "run many recipes, shots or documents: what is done is left out, the report shows the worst first"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument(
            "jobs", nargs="+", metavar="JOBS", help="files, 'patterns', folders, or a .txt with one of these a line"
        )
        parser.add_argument(
            "--out", type=Path, required=True, metavar="DIR", help="a folder for results and report"
        )
        parser.add_argument(
            "--workers",
            type=int,
            metavar="N",
            help="processes on this machine (one for each core; 0: none but this one)",
        )
        parser.add_argument(
            "--scheduler", metavar="ADDRESS", help="a Dask scheduler in place of this machine's cores"
        )
        parser.add_argument("--frames", metavar="1,5,10-20", help="of shots; without, the scene as it stands")
        parser.add_argument("--solver", metavar="NAME", help="of shots and documents")
        parser.add_argument("--assets", type=Path, metavar="DIR", help="where documents find the files of surfaces")
        parser.add_argument("--retries", type=int, default=2, metavar="N", help="after a worker died (2)")
        parser.add_argument("--limit", type=finite, metavar="SECONDS", help="for one job")
        parser.add_argument("--again", action="store_true", help="run also what is done")
        parser.add_argument(
            "--check", action="store_true", help="exit with 1 also where a result is beyond its limit"
        )

    def run(self, arguments: argparse.Namespace) -> int:
        from contact_core.cli.frames import frames_of
        from contact_core.errors import InvalidInput
        from contact_core.farm.batch import BatchSettings, run_batch
        from contact_core.farm.workers import DaskWorkers, LocalWorkers, NoWorkers

        if arguments.scheduler and arguments.workers is not None:
            raise InvalidInput("--workers is for this machine; a scheduler has its own. Leave one of the two out.")
        settings = BatchSettings(
            None if arguments.frames is None else frames_of(arguments.frames),
            arguments.solver,
            arguments.assets,
            arguments.retries,
            arguments.limit,
            arguments.again,
        )
        if arguments.scheduler:
            workers: Workers = DaskWorkers(arguments.scheduler)
        else:
            workers = NoWorkers() if arguments.workers == 0 else LocalWorkers(arguments.workers)
        result = run_batch(
            arguments.jobs, arguments.out, settings, plugins=arguments.plugins, workers=workers,
            progress=arguments.output,
        )  # fmt: skip
        tell(result, arguments.output)
        below = arguments.check and any(not each.is_good for each in result.results)
        return int(below or not result.is_done)


def tell(result: BatchResult, output: Output) -> None:
    """What failed and what is beyond its limit, the counts, and where the report is."""
    wrong = [(each.name, each.sentence or "; ".join(each.failures)) for each in result.results if not each.is_good]
    lines = [columns([("!", name, why) for name, why in wrong[:_MOST_LINES]])] if wrong else []
    if len(wrong) > _MOST_LINES:
        lines.append(f"! and {len(wrong) - _MOST_LINES} more, in the report")
    counts = {"solved": result.count("done"), "as before": result.count("same"), "failed": result.count("failed")}
    lines.append(", ".join(f"{number} {word}" for word, number in counts.items()) + f" in {result.seconds:.1f} s")
    lines.append(f"report: {result.page}")
    output.answer({**result.facts, "report": str(result.page), "summary": str(result.summary)}, "\n".join(lines))
