"""Stages: a solve in steps, each with its own free set, contacts and prior, answered for the whole problem."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.progress import Progress
from contact_core.rig.rig import Pose
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import (
    Iteration,
    PoseSolution,
    PoseSolver,
    Run,
    SolveOptions,
    SolveStatus,
    unsolvable,
)


@dataclass(frozen=True, eq=False)
class Stage:
    """One step of a staged solve.

    free: joints or dofs per body that move in this stage (None: all that the problem frees). contacts: names
    (None: all). weights: contact name -> point weights (k,) that replace the contact's own. prior: as in the
    problem ("problem"), where the stage starts ("current"), rest, or poses. name: for reports.
    """

    free: Mapping[str, Iterable[str]] | None = None
    contacts: Sequence[str] | None = None
    weights: Mapping[str, FloatArray] | None = None
    prior: Literal["problem", "rest", "current"] | Mapping[str, Pose] = "problem"
    name: str = ""

    @classmethod
    def parse(cls, given: Any) -> Stage:
        """A stage out of plain data, as a recipe holds it."""
        if isinstance(given, Stage):
            return given
        known = ("free", "contacts", "prior", "name")
        if not isinstance(given, Mapping) or set(given) - set(known):
            raise InvalidInput(f"a stage is a table with some of {', '.join(known)}, but got {given!r}.")
        return cls(**given)

    def of(self, problem: PoseProblem, theta: FloatArray) -> PoseProblem:
        """The problem of this stage, starting at theta (d,) of the whole problem."""
        started = problem.at(theta)
        names = [contact.name for contact in problem.contacts]
        for name in [*(self.contacts or ()), *(self.weights or ())]:
            if name not in names:
                raise InvalidInput(f"a stage names the contact {name!r}; the problem has {', '.join(names)}.")
        contacts = tuple(
            replace(contact, weights=(self.weights or {}).get(contact.name, contact.weights))
            for contact in problem.contacts
            if self.contacts is None or contact.name in self.contacts
        )
        free = started.free if self.free is None else _within(started, self.free)
        prior = started.prior if self.prior == "problem" else self.prior
        return replace(started, contacts=contacts, free=free, prior=prior)


def _within(problem: PoseProblem, wanted: Mapping[str, Iterable[str]]) -> dict[str, list[str]]:
    """The dofs that both the problem and the stage free, by body."""
    stage = replace(problem, free=wanted)
    return {
        body.name: [
            problem.charts[i].dof_names[q] for q in stage.free_of_body[i] if q in set(problem.free_of_body[i])
        ]
        for i, body in enumerate(problem.bodies)
    }


def solve_stages(
    name: str,
    inner: PoseSolver,
    problem: PoseProblem,
    stages: Sequence[Stage],
    options: SolveOptions,
    progress: Progress,
) -> PoseSolution:
    """Solve stage after stage, each from where the last one ended; the best end by the whole objective counts.

    The first stage starts from the candidates of `options`, the later ones from where they are.
    """
    run = Run(name, problem, options)
    stopped = unsolvable(run)
    if stopped is not None:
        return stopped
    theta, status = problem.start, SolveStatus.CONVERGED
    for number, stage in enumerate(stages):
        staged = stage.of(problem, theta)
        settings = replace(options, watch=_relayed(run, theta))
        if number:
            settings = replace(settings, candidates=("current",))
        part = progress.part(number / len(stages), (number + 1) / len(stages), stage.name)
        solution = inner.solve(staged, settings, part)
        if solution.status is SolveStatus.NOTHING_FREE:
            run.notes.append(f"stage {stage.name or number + 1} frees nothing and was passed over.")
            continue
        status = solution.status
        theta = problem.theta_of(solution.poses)
        run.evaluate(theta)
        if status is SolveStatus.CANCELLED:
            break
    return run.solution(status)


def _relayed(run: Run, start: FloatArray) -> Callable[[Iteration], None]:
    """Shows a stage's iterations as those of the whole run."""

    def relay(seen: Iteration) -> None:
        run.evaluations += 1
        run.iteration(run.problem.theta_of(seen.poses()) if run.watch is not None else start, seen.value)

    return relay
