"""What sliding promises: distances fall by 30 %, and skin gets no deeper than with the contacts left alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contact_builtins
from contact_builtins.demos import demo_recipe
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.job.run import perform
from contact_core.plugins.manager import PluginManager
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.proposals.depth_bound import DepthBound, measured
from contact_core.proposals.draft import Draft
from contact_core.proposals.proposal import SolveSettings, slide
from contact_core.recipe.reader import load_recipe
from contact_core.recipe.recipe import Recipe
from contact_core.rig.rig import skin
from contact_core.scene.problem import Objective
from contact_core.solve.body import Body, PairedPoints
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.penetration import Allowance, NoDeeperTerm
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import PoseSolution, PoseSolver, SolveOptions
from contact_core.solve.term import PoseTerm
from contact_core.testing import meshes, rigs
from contact_core.testing.term_contract import TermContract

PLUGINS = PluginManager([contact_builtins], discover=False)


def report_of(recipe: Recipe, slide: float) -> Mapping[str, Any]:
    """The metrics of report.json, contacts sliding or not."""
    return perform(replace(recipe, solve=replace(recipe.solve, slide=slide)), PLUGINS).metrics


def promised(recipe: Recipe, less: float) -> None:
    before, after = report_of(recipe, 0.0), report_of(recipe, 0.1)
    assert after["mean_contact_distance"] <= (1.0 - less) * before["mean_contact_distance"], (before, after)
    assert after["max_penetration"] <= before["max_penetration"] * (1.0 + 1e-9), (before, after)
    assert after["skin_inside"] <= before["skin_inside"] * (1.0 + 1e-9), (before, after)


@pytest.mark.parametrize("penetration", [12.0, 0.0])
def test_the_mug(repository: Path, penetration: float) -> None:
    """Also where the objective does not mention depth, and the hand stands deep in the mug before."""
    recipe = load_recipe(repository / "examples" / "07_mug_slide.toml")
    promised(replace(recipe, solve=replace(recipe.solve, penetration=penetration)), 0.3)


@pytest.mark.assets
@pytest.mark.parametrize(("example", "less"), [("04_bunny", 0.3), ("01_ball_fingertips", 0.1)])
def test_the_examples(assets: Path, repository: Path, example: str, less: float) -> None:
    """Fingertips on a ball gain little: a ball is the same everywhere, so where they are hardly matters."""
    promised(load_recipe(repository / "examples" / f"{example}.toml"), less)


@pytest.mark.parametrize("demo", ["baseball", "pole", "mug"])
def test_the_demos(demo: str) -> None:
    """However well their contacts fit as they are."""
    promised(demo_recipe(demo), 0.0)


class TestNoDeeper(TermContract):
    @pytest.fixture
    def term(self) -> PoseTerm:
        vertices = np.arange(0, 1000, 3)
        depths = np.linspace(-0.4, 0.4, len(vertices))
        return NoDeeperTerm({"hand-like": Allowance(vertices, depths)}, resolution=24)


def pulled_into_a_ball() -> PoseProblem:
    """A hand beside a ball; the skin that is nearest is pulled onto a ball inside that ball."""
    rig = rigs.hand_like(rigs.limited_freedom)
    inner = meshes.icosphere(3, 3.0)
    placed = np.eye(4)
    placed[:3, 3] = [9.0, 6.8, 0.0]
    middles = rig.surface.points[rig.faces].mean(axis=1)
    near = np.argsort(np.linalg.norm(middles - placed[:3, 3], axis=1), kind="stable")[:60]
    mine = SurfacePoints(near, np.full((60, 3), 1.0 / 3.0))
    theirs = Locator.of(inner).closest(middles[near] - placed[:3, 3]).points
    bodies = (Body.skinned(rig, name="hand"), Body.rigid("ball", inner, world_from_surface=placed))
    return PoseProblem(bodies, (PairedPoints("pull", "hand", mine, "ball", theirs),))


SOLIDS = {"ball": (meshes.icosphere(4, 4.0),)}


def test_walls_are_moved_until_true_depths_hold() -> None:
    """From one start: without walls the hand sinks in; with them a few rounds end no deeper, and still nearer."""
    problem = pulled_into_a_ball()
    bound = DepthBound.of(problem, SOLIDS)
    assert bound.holds(measured(problem, problem.start, bound.solids))
    free = LevenbergMarquardt().solve(problem)
    assert not bound.holds(measured(problem, free.theta, bound.solids))
    begin = problem
    for _ in range(8):
        found = LevenbergMarquardt().solve(replace(begin, terms=(*problem.terms, bound.term())))
        now = measured(problem, found.theta, bound.solids)
        if bound.holds(now):
            break
        begin, bound = problem.at(found.theta), bound.tightened(now)
    assert bound.holds(now)
    assert free.value < problem.value(problem.state(found.theta)) < problem.value(problem.start_state)


def test_true_depths_are_those_of_a_ball() -> None:
    """Against the formula, in a world of other units than the ball's, at another pose than the start."""
    problem = pulled_into_a_ball()
    placed = np.diag([0.5, 0.5, 0.5, 1.0])
    placed[:3, 3] = [9.0, 3.0, 0.5]
    ball = Body.rigid("ball", meshes.icosphere(5, 4.0), world_from_surface=placed)
    problem = replace(problem, bodies=(problem.bodies[0], ball))
    theta = np.random.default_rng(0).normal(0.0, 0.1, len(problem.start))
    bound = DepthBound.of(problem, None)
    found = measured(problem, theta, bound.solids)["hand"]
    state = problem.state(theta)
    points = skin(problem.bodies[0].rig, state.motions[0].world)
    exact = np.maximum(2.0 - np.linalg.norm(points - placed[:3, 3], axis=1), 0.0)
    assert exact.max() > 0.1
    assert np.abs(found.depths - exact).max() < 0.01
    assert found.deepest == found.depths.max() and 0.0 < found.share < 1.0


class ThroughWalls:
    """A solver that does not care how deep skin is, once something may slide."""

    name = "through walls"
    summary = "Leaves out what keeps skin outside."

    def solve(
        self, problem: PoseProblem, options: SolveOptions | None = None, progress: Progress = NO_PROGRESS
    ) -> PoseSolution:
        if any(term.name == "no deeper" for term in problem.terms):
            kept = tuple(term for term in problem.terms if term.name not in ("penetration", "no deeper"))
            problem = replace(problem, terms=kept)
        return LevenbergMarquardt().solve(problem, options, progress)


@dataclass(frozen=True, eq=False)
class Through(SolveSettings):
    def solver_of(self, plugins: PluginManager) -> PoseSolver:
        return ThroughWalls()


def test_where_skin_would_be_deeper_nothing_slides_and_it_is_said(repository: Path) -> None:
    recipe = load_recipe(repository / "examples" / "07_mug_slide.toml")
    job = perform(replace(recipe, solve=replace(recipe.solve, slide=0.0)), PLUGINS)
    draft = Draft(job.session.document, job.session.derived, job.session.rigs)
    settings = Through(objective=Objective(job.solution.problem.terms), solids=job.solids)
    proposal = slide(draft.document, draft, PLUGINS, job.session.revision, settings)
    assert proposal.command.placements == ()
    assert proposal.after.value == pytest.approx(proposal.before.value, rel=1e-9)
    assert any("stay where they are" in note for note in proposal.after.notes)
