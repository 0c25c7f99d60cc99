"""Contacts that slide with the pose, against contacts left where they were placed, by the metrics of the report."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

from harness import record

import contact_builtins
from contact_builtins.demos import demo_recipe
from contact_core.job.job import Job
from contact_core.job.run import perform
from contact_core.plugins.manager import PluginManager
from contact_core.proposals import PENALTY, SLACK
from contact_core.proposals.draft import Draft
from contact_core.proposals.proposal import SolveSettings, slide
from contact_core.recipe.reader import load_recipe
from contact_core.recipe.recipe import Recipe
from contact_core.scene.problem import Objective

HERE = Path(__file__).resolve().parent
FOLDERS = (HERE.parent / "examples", HERE / "grips")
BUILT_IN = ("07_mug_slide", "baseball", "pole", "demo mug")
WITH_ASSETS = ("04_bunny", "03_cup_body", "01_ball_fingertips")  # which this repository does not hold
PLUGINS = PluginManager([contact_builtins], discover=False)
TIMED = 5  # slides of each grip


def sliding_rows(assets: bool) -> list[str]:
    """The section of the page: per grip the distance of paired points and the penetration, fixed and sliding."""
    lines = [
        f"Slack {SLACK:g} of the length, penalty {PENALTY:g}; the same recipe without and with `slide`, measured as"
        " `report.json` measures: deepest skin vertex by winding number, % of the length, and share of the skin's"
        " area inside, %. Wanted on mug and bunny: 30 % less distance, no more penetration. Times are medians"
        f" of {TIMED} whole slides, the solve that they start from included; processor time is this process's own:"
        f" {os.getloadavg()[0]:.1f} processes wanted {os.cpu_count()} cores in the minute before.",
        "",
        "| | distance, fixed | sliding | less, % | deepest, fixed | sliding | inside, fixed | sliding |"
        " processor, ms | clock, ms |",
        "|---" * 10 + "|",
    ]
    rows = {}
    for name in (*BUILT_IN, *WITH_ASSETS * assets):
        files = [file for file in (folder / f"{name}.toml" for folder in FOLDERS) if file.exists()]
        recipe = load_recipe(files[0]) if files else demo_recipe(name.removeprefix("demo "))
        job, before = _performed(recipe, 0.0)
        after = _performed(recipe, SLACK)[1]
        processor, clock = _times(job)
        far, deep, inside = (
            [100.0 * metrics[key] for metrics in (before, after)]
            for key in ("mean_contact_distance", "max_penetration", "skin_inside")
        )
        less = 100.0 * (1.0 - far[1] / far[0])
        lines.append(
            f"| {name} | {far[0]:.2f} | {far[1]:.2f} | {less:.0f} | {deep[0]:.3f} | {deep[1]:.3f} |"
            f" {inside[0]:.2f} | {inside[1]:.2f} | {processor:.0f} | {clock:.0f} |"
        )
        rows[name] = f"{less:.0f} % less, {deep[0]:.3f} to {deep[1]:.3f} % deep, {processor:.0f} ms of processor"
    record("Grips: contacts that slide (30 % less distance at no more penetration)", rows)
    return lines


def _performed(recipe: Recipe, slack: float) -> tuple[Job, Mapping[str, Any]]:
    job = perform(replace(recipe, solve=replace(recipe.solve, slide=slack)), PLUGINS)
    return job, job.metrics


def _times(job: Job) -> tuple[float, float]:
    """Milliseconds of a slide from the solved pose: of this process, and by the clock."""
    took = []
    settings = SolveSettings(
        objective=Objective(job.solution.problem.terms),
        solids={name: solids for name, solids in job.solids.items() if solids},
    )
    for _ in range(TIMED + 1):
        draft = Draft(job.session.document, job.session.derived, job.session.rigs)
        processor, clock = time.process_time(), time.perf_counter()
        slide(draft.document, draft, PLUGINS, 0, settings)
        took.append((1e3 * (time.process_time() - processor), 1e3 * (time.perf_counter() - clock)))
    return median(t[0] for t in took[1:]), median(t[1] for t in took[1:])
