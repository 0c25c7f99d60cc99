"""The contract of pose terms. Subclass it; give the fixtures `term` and, if it needs other bodies, `problem`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from contact_core.arrays import FloatArray
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import Pose, Rig
from contact_core.solve.body import Body, PairedPoints
from contact_core.solve.problem import PoseProblem
from contact_core.solve.term import PoseTerm
from contact_core.testing import meshes, rigs
from contact_core.testing.contract import Contract, needs
from contact_core.testing.settings_checks import check_settings

STEP = 1e-5
SEEDS = (0, 1, 2)


def scene(rig: Rig | None = None, seed: int = 0, pose: Pose | None = None) -> PoseProblem:
    """A rig with joints of every kind and a ball, both free, pairs between them and within the rig."""
    rig = rig or rigs.hand_like(rigs.any_freedom)
    ball = meshes.icosphere(2, 4.0)
    placed = np.eye(4)
    placed[:3, :3] *= 1.25
    placed[:3, 3] = [9.0, 3.0, 1.0]
    random = np.random.default_rng(seed)
    on_ball = SurfacePoints(random.integers(0, len(ball.faces), 40), random.dirichlet(np.ones(3), 40))
    held = rigs.scattered_points(rig, 40, seed)
    one, two = (rigs.scattered_points(rig, 10, seed + k) for k in (1, 2))
    contacts = (
        PairedPoints("hold", rig.name, held, "ball", on_ball, np.linspace(0.0, 2.0, 40)),
        PairedPoints("self", rig.name, one, rig.name, two),
    )
    bodies = (
        Body.skinned(rig, pose=pose),
        Body.rigid("ball", ball, world_from_surface=placed, movable=True),
    )
    return PoseProblem(bodies, contacts)


def differences(problem: PoseProblem, theta: FloatArray, step: float = STEP) -> FloatArray:
    """(d,) fourth-order central differences of the objective."""
    result = np.empty(len(theta))
    for q, unit in enumerate(np.eye(len(theta)) * step):
        one, two = ([problem.value(problem.state(theta + k * s * unit)) for s in (1, -1)] for k in (1, 2))
        result[q] = (8.0 * (one[0] - one[1]) - (two[0] - two[1])) / (12.0 * step)
    return result


class TermContract(Contract):
    """Fixtures: `term`, a PoseTerm with weight > 0; `problem`, in which it has something to say."""

    about, letter = "pose term", "T"

    @pytest.fixture
    def problem(self) -> PoseProblem:
        return scene()

    def test_t01_is_named(self, term: PoseTerm) -> None:
        """Has a name and a weight, and says in a sentence what it does."""
        assert term.name == term.name.strip() != ""
        assert len(term.summary.split()) >= 3, term.summary
        assert term.weight > 0.0

    @pytest.mark.parametrize("seed", SEEDS)
    def test_t02_has_an_exact_gradient(self, term: PoseTerm, problem: PoseProblem, seed: int) -> None:
        """Its gradient equals central differences to 1e-6, for all bodies, with dofs on their limits among them."""
        problem = replace(problem, terms=(term,))
        theta = self.somewhere(problem, seed)
        numeric, finer = differences(problem, theta), differences(problem, theta, STEP / 8.0)
        largest = np.abs(numeric).max()
        assert largest > 0.0, "the term says nothing here; give the contract another problem"
        smooth = np.abs(numeric - finer) <= 5e-7 * largest  # where steps disagree, one of them met a kink
        assert smooth.mean() > 0.8, "the term has a kink at nearly every dof"
        assert np.abs(problem.gradient(problem.state(theta)) - numeric)[smooth].max() <= 1e-6 * largest

    @pytest.mark.parametrize("seed", SEEDS)
    def test_t03_has_a_usable_matrix(self, term: PoseTerm, problem: PoseProblem, seed: int) -> None:
        """Its matrix is symmetric and has no negative eigenvalue beyond rounding."""
        problem = replace(problem, terms=(term,))
        matrix = problem.normal_matrix(problem.state(self.somewhere(problem, seed)))
        assert np.abs(matrix - matrix.T).max() <= 1e-9 * np.abs(matrix).max()
        eigenvalues = np.linalg.eigvalsh(matrix)
        assert eigenvalues[0] >= -1e-9 * eigenvalues[-1], eigenvalues

    @pytest.mark.parametrize("seed", SEEDS)
    def test_t04_lets_newton_descend(self, term: PoseTerm, problem: PoseProblem, seed: int) -> None:
        """A damped step of its own gradient and matrix lowers it."""
        problem = replace(problem, terms=(term,))
        state = problem.state(self.somewhere(problem, seed))
        gradient, matrix = problem.gradient(state), problem.normal_matrix(state)
        damped = matrix + 1e-2 * np.diag(np.diagonal(matrix)) + 1e-9 * np.eye(len(matrix)) * np.trace(matrix)
        step = -np.linalg.solve(damped, gradient)
        values = [problem.value(problem.state(state.theta + t * step)) for t in (0.0, 1.0, 0.3, 0.1, 0.01, 1e-3)]
        assert min(values[1:]) < values[0], values

    def test_t05_is_never_negative(self, term: PoseTerm, problem: PoseProblem) -> None:
        """Its value is never below zero."""
        problem = replace(problem, terms=(term,))
        assert all(problem.value(problem.state(self.somewhere(problem, seed))) >= 0.0 for seed in range(8))

    def test_t06_is_in_proportion_to_its_weight(self, term: PoseTerm, problem: PoseProblem) -> None:
        """Twice the weight gives twice the value, gradient and matrix."""
        once = replace(problem, terms=(term,))
        twice = replace(problem, terms=(replace(term, weight=2.0 * term.weight),))  # type: ignore[type-var]
        theta = self.somewhere(once, 0)
        for method in ("value", "gradient", "normal_matrix"):
            one, two = (np.asarray(getattr(p, method)(p.state(theta))) for p in (once, twice))
            assert np.allclose(2.0 * one, two, rtol=1e-12, atol=1e-12 * np.abs(two).max())

    @needs("scale_free")
    def test_t07_is_free_of_units(self, term: PoseTerm, problem: PoseProblem) -> None:
        """The whole scene a hundred times larger gives the same value."""
        large = replace(problem, bodies=tuple(enlarged(body, 100.0) for body in problem.bodies), terms=(term,))
        small = replace(problem, terms=(term,))
        values = [p.value(p.start_state) for p in (small, large)]
        assert values[1] == pytest.approx(values[0], rel=1e-6)

    def test_t08_pulls_to_the_bit_alike(self, term: PoseTerm, problem: PoseProblem) -> None:
        """The same state gives the same value, gradient and matrix, to the bit."""
        answers = []
        for _ in range(2):
            fresh = replace(problem, terms=(term,))
            state = fresh.state(self.somewhere(fresh, 1))
            answers.append((fresh.value(state), fresh.gradient(state), fresh.normal_matrix(state)))
        assert answers[0][0] == answers[1][0]
        assert all(np.array_equal(one, two) for one, two in zip(answers[0][1:], answers[1][1:], strict=True))

    def test_t09_declares_its_settings(self, term: PoseTerm) -> None:
        """Its settings say unit, range and help; a value out of range and a name it does not know are refused."""
        check_settings(term)

    @staticmethod
    def somewhere(problem: PoseProblem, seed: int) -> FloatArray:
        """A theta (d,) near the start, within the limits, every fourth limited dof on its limit."""
        random = np.random.default_rng(seed)
        lower, upper = problem.limits_of_theta
        theta = np.clip(problem.start + random.normal(0.0, 0.1, len(problem.start)), lower, upper)
        limited = np.flatnonzero(np.isfinite(upper) & (upper < 3.0))[seed::4]
        theta[limited] = upper[limited]
        return theta


def enlarged(body: Body, factor: float) -> Body:
    """The body in other units."""
    placed = body.world_from_rig.copy()
    placed[:3] *= factor
    return replace(body, world_from_rig=placed)
