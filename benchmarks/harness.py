"""What every benchmark shares: interleaved runs, medians, and one results file with the machine named.

Peers run in turn, round by round, so that a busy minute hits all of them alike; a ratio is the median of the
rounds' ratios. `record` merges a section into results/latest.json and rewrites the table beside it.
"""

from __future__ import annotations

import json
import platform
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from contact_core.solve.threads import one_blas_thread

PACE = 0.0024  # seconds of the fixed piece of work where pygeodesic's bounded call of bench_kernel takes 9.1 ms
RESULTS = Path(__file__).parent / "results" / "latest.json"


@dataclass(frozen=True)
class Times:
    """Seconds of one contestant, one per round."""

    seconds: tuple[float, ...]

    @property
    def median(self) -> float:
        return median(self.seconds)

    @property
    def best(self) -> float:
        return min(self.seconds)


def interleaved(contestants: Mapping[str, Callable[[], Any]], rounds: int) -> dict[str, Times]:
    """Call every contestant once per round, after one call of each that does not count. Each round begins with
    another, and every second one runs backwards: whoever comes after one that fills the caches pays for it."""
    seconds: dict[str, list[float]] = {name: [] for name in contestants}
    for call in contestants.values():
        call()
    names = list(contestants)
    for turn in range(rounds):
        first = turn % len(names)
        for name in (names[first:] + names[:first])[:: 1 if turn % 2 == 0 else -1]:
            began = time.process_time()
            contestants[name]()
            seconds[name].append(time.process_time() - began)
    return {name: Times(tuple(times)) for name, times in seconds.items()}


def ratio(slow: Times, fast: Times) -> float:
    """How many times faster `fast` is: the median over the rounds."""
    return median(a / b for a, b in zip(slow.seconds, fast.seconds, strict=True))


def pace(rounds: int = 9) -> float:
    """How many times as long a fixed piece of work takes here and now as on the machine that bars were set on:
    interpreter, sorting, and products of matrices, about a millisecond each. The median of some rounds."""
    random = np.random.default_rng(0)
    values, square = random.random(40_000), random.random((160, 160))
    ratios = []
    with one_blas_thread():  # several would count twice while they wait
        for _ in range(rounds):
            began = time.process_time()
            total = 0
            for k in range(30_000):
                total += k % 7
            np.sort(values)
            square @ square @ square
            ratios.append((time.process_time() - began) / PACE)
    return median(ratios)


def machine() -> dict[str, Any]:
    """The machine and the interpreter that the figures are from, and how fast it was."""
    cpu = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        names = [
            line.split(":", 1)[1].strip() for line in info.read_text().splitlines() if line.startswith("model name")
        ]
        cpu = f"{names[0]}, {len(names)} cores" if names else cpu
    return {"cpu": cpu, "system": platform.system(), "python": platform.python_version(), "pace": round(pace(), 2)}


def record(section: str, rows: Mapping[str, Any]) -> None:
    """Merge rows (name -> figure or sentence) into the results as `section`, and print them."""
    results = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    results[section] = {"machine": machine(), "rows": dict(rows)}
    RESULTS.parent.mkdir(exist_ok=True)
    RESULTS.write_text(json.dumps(results, indent=2) + "\n")
    RESULTS.with_suffix(".md").write_text(table(results))
    for name, value in rows.items():
        sys.stdout.write(f"{name}: {_spelled(value)}\n")
    sys.stdout.flush()


def table(results: Mapping[str, Any]) -> str:
    """The results as a markdown page."""
    lines = ["# Benchmarks", ""]
    for section, content in results.items():
        where = content["machine"]
        slow = f", {where['pace']} times as slow as where bars were set" if "pace" in where else ""
        lines += [f"## {section}", "", f"{where['cpu']}, {where['system']}, Python {where['python']}{slow}", ""]
        lines += ["| | |", "|---|---|"]
        lines += [f"| {name} | {_spelled(value)} |" for name, value in content["rows"].items()]
        lines.append("")
    return "\n".join(lines)


def _spelled(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
