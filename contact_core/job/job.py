"""A job: what its stages pass on to one another, and what comes out; contacts and poses are the session's."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from contact_core.document.asset import Asset
from contact_core.geometry.mesh import TriangleMesh
from contact_core.grasping.verdict import Verdict
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.recipe.recipe import PatchSpec, Recipe
from contact_core.rig.rig import Pose
from contact_core.session import Session
from contact_core.solve.body import manipulator_length
from contact_core.solve.solver import PoseSolution


@dataclass
class Job:
    """What the stages of one job know so far; all that is by name is by surface.

    assets: as they were read, objects in the units of the first manipulator, the recipe's scale applied. solids:
    of objects, whose inside counts for depth. start: the pose that the solve begins with; start_distance: how far
    the open hand is from its objects then (surface units). left_out: patches without a place, with the reason.
    """

    recipe: Recipe
    session: Session
    progress: Progress = NO_PROGRESS
    seconds: dict[str, float] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    assets: dict[str, Asset] = field(default_factory=dict)
    solids: dict[str, tuple[TriangleMesh, ...]] = field(default_factory=dict)
    start: dict[str, Pose] = field(default_factory=dict)
    start_distance: dict[str, float] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)
    solution: PoseSolution = field(init=False)
    metrics: dict[str, Any] = field(init=False)
    verdict: Verdict = field(init=False)

    def length(self, manipulator: str) -> float:
        """A manipulator's length: everything is free in a job, so that of its whole skin (surface units)."""
        return manipulator_length(self.session.rigs[manipulator])

    def touches(self, spec: PatchSpec) -> tuple[str, str]:
        """The surface that a patch is painted on, and the one that it goes to."""
        return spec.on or self.recipe.manipulators[0].name, spec.onto or self.recipe.objects[0].name

    @property
    def touching(self) -> tuple[tuple[str, str], ...]:
        """Every manipulator with every object that one of its patches goes to, in the recipe's order."""
        return tuple(dict.fromkeys(map(self.touches, self.recipe.patches)))

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
