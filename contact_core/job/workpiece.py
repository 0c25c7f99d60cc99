"""The workpiece of the job: what its stages pass on to one another, and what comes out."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset
from contact_core.geometry.mesh import TriangleMesh
from contact_core.job.recipe import Recipe
from contact_core.job.report import Verdict
from contact_core.plugins.slots import PlacementResult
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.rig.rig import Pose, Rig
from contact_core.session import Session
from contact_core.solve.body import manipulator_length
from contact_core.solve.solver import PoseSolution

HAND, OBJECT = "manipulator", "object"  # names of the two surfaces in the document


@dataclass
class Job:
    """The workpiece: what the stages of one job know so far."""

    recipe: Recipe
    session: Session
    progress: Progress = NO_PROGRESS
    seconds: dict[str, float] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    manipulator: Asset = field(init=False)
    object: Asset = field(init=False)  # in the manipulator's units, the recipe's scale applied
    solids: tuple[TriangleMesh, ...] = field(init=False)
    placed: FloatArray = field(init=False)  # (4, 4) world_from_object; world is rig space
    start: Pose = field(init=False)
    start_distance: float = field(init=False)  # of the open hand to the object, surface units
    placement: PlacementResult = field(init=False)
    solution: PoseSolution = field(init=False)
    pose: Pose = field(init=False)
    metrics: dict[str, Any] = field(init=False)
    verdict: Verdict = field(init=False)

    @property
    def rig(self) -> Rig:
        assert self.manipulator.rig is not None
        return self.manipulator.rig

    @cached_property
    def length(self) -> float:
        """The manipulator's length: everything is free in a job, so that of the whole skin (surface units)."""
        return manipulator_length(self.rig)

    @contextmanager
    def stage(self, name: str, fraction: float, text: str) -> Iterator[None]:
        """One stage: tell the user, take the time."""
        self.progress.tell(fraction, text)
        began = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - began


@dataclass(frozen=True, eq=False)
class JobResult:
    """What a job came to. report: the content of report.json. files: what was written, by role."""

    recipe: Recipe
    report: Mapping[str, Any]
    verdict: Verdict
    files: Mapping[str, Path]
    table: tuple[tuple[str, str, bool], ...]
