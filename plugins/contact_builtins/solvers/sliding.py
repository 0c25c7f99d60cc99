"""Sliding contacts: target patches may move a little on their surface while the pose is solved.

Each target patch gets three dofs: where its root goes, as a tangent vector at its first root, through the exact
exponential map, and how far its heading turns. The patch is traced anew from there at every evaluation, so what
is optimised is what the document will hold. The slide is limited by the artist's slack and penalised. It answers
three complaints about transferred contacts: lost finger spacing, other curvature, roots placed a little off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.contact.patch import reconstruct_patch
from contact_core.contact.placement import Root
from contact_core.contact.shape import PatchShape
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tracing import trace_geodesic
from contact_core.pose.black_box import BlackBoxDof, Evaluate
from contact_core.pose.body import Body
from contact_core.pose.problem import PoseProblem
from contact_core.pose.solver import PoseSolution, PoseSolver, Progress, SolveOptions

SLIDING = ".sliding"  # what the body of a sliding patch is called: its contact's name and this
DIRECTIONS = ("along", "across")  # of the first heading


@dataclass(frozen=True, eq=False)
class SlidingPatch:
    """A target patch that may slide. contact: name of the pair in the problem; its points are `shape` at `root`.

    slack: how far the root may go, surface units. turn: how far the heading may turn, radians. penalty: prior
    weight of a slide by the whole slack or a turn by the whole turn.
    """

    contact: str
    shape: PatchShape
    root: Root
    slack: float
    turn: float = np.pi / 4.0
    penalty: float = 1.0
    mirrored: bool = True
    unit: float = 1.0


@dataclass(frozen=True, eq=False)
class SlidSolution:
    """The pose, and where each patch went: roots by contact name. solution: of the problem with sliding targets."""

    solution: PoseSolution
    roots: dict[str, Root]


class SlidingTarget:
    """One sliding patch as a black-box body. theta: root offset along and across the first heading, then the turn,
    each as a share of its slack, so that one penalty and one step fit all."""

    world_length = 0.0  # a target is not what distances are judged against

    def __init__(
        self, surface: TriangleMesh, patch: SlidingPatch, world_from_surface: FloatArray, meant: SurfacePoints
    ):
        if not (patch.slack > 0.0 and patch.turn >= 0.0):
            raise InvalidInput(f"the slack of {patch.contact!r} is a positive length, but {patch.slack} came.")
        self.surface, self.patch, self.world = surface, patch, np.asarray(world_from_surface, float)
        names = (*DIRECTIONS, "turn") if patch.turn > 0.0 else DIRECTIONS
        self.dofs = [BlackBoxDof(name, -1.0, 1.0, patch.penalty, step=1e-4) for name in names]
        found = self._points(np.zeros(len(names)))
        away = np.linalg.norm(found.positions(surface) - meant.positions(surface), axis=1)
        if len(found) != len(meant) or away.max(initial=0.0) > 1e-6 * surface.bounding_box_diagonal:
            raise InvalidInput(f"the object points of {patch.contact!r} are not its patch at the given root.")

    def root(self, theta: FloatArray) -> Root:
        """Where the patch is at theta: the exponential map of the offset, the heading carried along and turned."""
        start, shift = self.patch.root, self.patch.slack * complex(theta[0], theta[1])
        turned = np.exp(1j * self.patch.turn * theta[2]) if len(theta) > 2 else 1.0
        if shift == 0.0:
            return start.heading_to(start.heading * turned)
        vector = shift * start.heading
        trace = trace_geodesic(self.surface, start.point(), np.array([vector]))
        carried = trace.headings[0] * start.heading * abs(vector) / vector  # parallel transport keeps the angle
        return Root.at(trace.points, complex(carried * turned))

    def _points(self, theta: FloatArray) -> SurfacePoints:
        patch = self.patch
        return reconstruct_patch(
            self.surface, patch.shape, self.root(theta), mirrored=patch.mirrored, unit=patch.unit
        ).points

    def watch(self, points: SurfacePoints) -> Evaluate:
        """The patch's own points, all of them; `points` are they at theta 0."""

        def evaluate(theta: FloatArray) -> tuple[FloatArray, FloatArray]:
            placed = self._points(theta)
            normals = placed.normals(self.surface) @ self.world[:3, :3].T
            length = np.linalg.norm(normals, axis=1, keepdims=True)
            return placed.positions(self.surface) @ self.world[:3, :3].T + self.world[:3, 3], normals / length

        return evaluate


def sliding_problem(problem: PoseProblem, patches: Sequence[SlidingPatch]) -> PoseProblem:
    """The problem in which the named contacts meet sliding targets instead of fixed points."""
    bodies, contacts = list(problem.bodies), list(problem.contacts)
    for patch in patches:
        number = next((i for i, c in enumerate(contacts) if c.name == patch.contact), None)
        if number is None:
            raise InvalidInput(f"the problem has no contact {patch.contact!r} whose target could slide.")
        contact = contacts[number]
        owner = problem.bodies[problem.body_index(contact.object)]
        if len(owner.rig.joints) > 1 or len(problem.free_of_body[problem.body_index(contact.object)]):
            raise InvalidInput(f"{contact.object!r} moves or bends; contacts slide on bodies that stay.")
        world = problem.start_state.world[int(problem.bone_offsets[problem.body_index(contact.object)])]
        placed = world @ np.linalg.inv(owner.rig.bind_world[0])
        target = SlidingTarget(owner.rig.surface, patch, placed, contact.object_points)
        bodies.append(Body.evaluated(patch.contact + SLIDING, target))
        contacts[number] = replace(contact, object=patch.contact + SLIDING)
    free = problem.free
    if free is not None:
        free = {**free, **{p.contact + SLIDING: [*DIRECTIONS, *["turn"] * (p.turn > 0.0)] for p in patches}}
    return replace(
        problem, bodies=tuple(bodies), contacts=tuple(contacts), free=free, length=problem.manipulator_length
    )


def solve_sliding(
    solver: PoseSolver,
    problem: PoseProblem,
    patches: Sequence[SlidingPatch],
    options: SolveOptions | None = None,
    progress: Progress | None = None,
) -> SlidSolution:
    """Solve the pose with fixed targets first, then pose and slides together from there.

    Every iteration traces each patch seven times, so sliding is for when the pose is nearly there: some 40
    iterations by default.
    """
    fixed = solver.solve(problem, options, progress)
    targets = {patch.contact: patch for patch in patches}
    together = sliding_problem(problem.at(fixed.theta), list(targets.values()))
    settings = replace(options or SolveOptions(max_iterations=40), candidates=("current",))
    solution = solver.solve(together, settings, progress)
    roots: dict[str, Root] = {}
    for patch in patches:
        index = together.body_index(patch.contact + SLIDING)
        target = together.bodies[index].black_box
        assert isinstance(target, SlidingTarget)
        roots[patch.contact] = target.root(together.full_theta(index, solution.theta))
    return SlidSolution(solution, roots)
