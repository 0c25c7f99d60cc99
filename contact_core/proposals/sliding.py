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

from contact_core.arrays import ComplexArray, FloatArray
from contact_core.contact.patch import PatchPoints, reconstruct_patch, scaled_legs
from contact_core.contact.placement import Root
from contact_core.contact.shape import AxisShape, PatchShape
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import heading_to_direction
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
    weight of a slide by the whole slack or a turn by the whole turn. mirrored, unit, axis: as in
    `reconstruct_patch`.
    """

    contact: str
    shape: PatchShape
    root: Root
    slack: float
    turn: float = np.pi / 4.0
    penalty: float = 1.0
    mirrored: bool = True
    unit: float = 1.0
    axis: AxisShape | None = None


@dataclass(frozen=True, eq=False)
class SlidSolution:
    """The pose, and where each patch went: roots by contact name. solution: of the problem with sliding targets;
    fixed: before anything slid."""

    fixed: PoseSolution
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
        self._last: dict[bytes, PatchPoints] = {}
        self.dofs = [BlackBoxDof(name, -1.0, 1.0, patch.penalty, step=1e-4) for name in names]
        found = self.placed(np.zeros(len(names))).points
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

    def placed(self, theta: FloatArray) -> PatchPoints:
        """The patch at theta, traced; the last one is kept, for derivatives come after values."""
        key = theta.tobytes()
        if key not in self._last:
            patch, root = self.patch, self.root(theta)
            traced = reconstruct_patch(
                self.surface, patch.shape, root, axis_shape=patch.axis, mirrored=patch.mirrored, unit=patch.unit
            )
            self._last = {key: traced}
        return self._last[key]

    def watch(self, points: SurfacePoints) -> Evaluate:
        """The patch's own points, all of them; `points` are they at theta 0."""
        return _Slide(self)


class _Slide:
    """Points and normals of a sliding patch in the world, with exact derivatives.

    A path of straight legs crosses a strip of faces that unfolds into the plane. So when the root moves by a small
    vector, each point moves by the same vector, carried along its path; and when the root turns, each point turns
    about it in the plane. Paths that meet a vertex have no derivative, and there this is that of one side.
    """

    def __init__(self, target: SlidingTarget) -> None:
        self.target, self.surface = target, target.surface
        self.linear: FloatArray = target.world[:3, :3]
        self.unfolded, self.ends = _unfold(target.patch)

    def __call__(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        placed = self.target.placed(theta).points
        normals = placed.normals(self.surface) @ self.linear.T
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        return placed.positions(self.surface) @ self.linear.T + self.target.world[:3, 3], normals / length

    def derivatives(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(d, k, 3) of points and of normals."""
        patch, placed = self.target.patch, self.target.placed(theta)
        anchors = patch.shape.coordinates.anchors
        stays = patch.shape.coordinates.legs == 0.0
        arrived = np.where(stays, placed.axis.tangents[anchors], placed.headings)
        carried = arrived / self.ends  # (k,) from the plane into the frame of each point
        turned = np.exp(1j * patch.turn * theta[2]) if len(theta) > 2 else 1.0
        along = np.full(len(carried), patch.slack / turned)
        plane = np.stack([along, 1j * along, 1j * patch.turn * self.unfolded][: len(theta)])  # (d, k)
        ahead, aside = (heading_to_direction(self.surface, placed.points, turn * carried) for turn in (1.0, 1j))
        moved = plane.real[..., None] * ahead + plane.imag[..., None] * aside  # (d, k, 3)
        return moved @ self.linear.T, self._normals_moved(placed.points, moved)

    def _normals_moved(self, points: SurfacePoints, moved: FloatArray) -> FloatArray:
        """(d, k, 3) derivative of the world normals where the points move by `moved` within their faces."""
        mesh = self.surface
        corners = mesh.faces[points.faces]  # (k, 3)
        position = mesh.points[corners]  # (k, 3, 3)
        opposite = np.roll(position, -2, axis=1) - np.roll(position, -1, axis=1)
        normal = np.cross(opposite[:, 0], opposite[:, 1])  # (k, 3) twice the area long
        slope = np.cross(normal[:, None], opposite) / np.einsum("ki,ki->k", normal, normal)[:, None, None]
        vertex = mesh.vertex_normals[corners] @ self.linear.T  # (k, 3, 3)
        blended = np.einsum("kc,kci->ki", points.barycentric, vertex)
        change = np.einsum("kcj,qkj,kci->qki", slope, moved, vertex)
        length = np.linalg.norm(blended, axis=1, keepdims=True)
        unit = blended / length
        change = change - np.einsum("qki,ki->qk", change, unit)[..., None] * unit
        return np.asarray(change / length)


def _unfold(patch: SlidingPatch) -> tuple[ComplexArray, ComplexArray]:
    """A patch laid out in the plane along its paths, the root at 0 heading along 1: points (k,) and the unit
    directions (k,) in which their paths end."""
    shape, coordinates = patch.axis or patch.shape.axis, patch.shape.coordinates
    sign = -1.0 if patch.mirrored else 1.0
    turns = np.concatenate([[0.0], sign * shape.turning_angles, [0.0]])[: shape.point_count]
    headings = np.exp(1j * np.cumsum(turns))  # (m,) as `Axis.tangents`
    steps = shape.lengths * (shape.along * patch.unit) * headings[:-1]
    knots = np.concatenate([[0.0], np.cumsum(steps)])  # (m,)
    legs, lengths = scaled_legs(coordinates, shape.along * patch.unit, shape.spread * patch.unit)
    first = (legs.conj() if patch.mirrored else legs) * headings[coordinates.anchors]
    size = np.abs(first)
    ends = np.where(size > 0.0, first / np.where(size > 0.0, size, 1.0), headings[coordinates.anchors])
    points = knots[coordinates.anchors] + first
    for i in np.flatnonzero(np.diff(coordinates.chain_starts)):
        for row in range(coordinates.chain_starts[i], coordinates.chain_starts[i + 1]):
            ends[i] *= np.exp(1j * sign * coordinates.chain_angles[row])
            points[i] += lengths[row] * ends[i]
    return points, ends


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

    Every iteration traces each patch once, so sliding is for when the pose is nearly there: some 40 iterations by
    default.
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
    return SlidSolution(fixed, solution, roots)
