"""What contacts slide on: all patches of one surface that may move a little on it, as one black-box body.

Each patch has three dofs: where its root goes, as a tangent vector at its first root, through the exact exponential
map, and how far its heading turns. Patches are traced anew at every evaluation, so what is optimised is what the
document will hold: one walk for all roots, one for all axes, one for all points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from contact_core.arrays import ComplexArray, FloatArray
from contact_core.contact.patch import patch_chains
from contact_core.contact.placement import Root
from contact_core.contact.shape import AxisShape, PatchShape
from contact_core.contact.tracer import PatchTracer, ShapedPatch, TracedPatches
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_map import SurfaceMap
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import heading_to_direction
from contact_core.geometry.tracing import trace_geodesic
from contact_core.solve.black_box import BlackBoxDof, Evaluate

DIRECTIONS = ("along", "across")  # of the first heading


@dataclass(frozen=True, eq=False)
class SlidingPatch:
    """A target patch that may slide. contact: name of the pair in the problem; its points are `shape` at `root`.

    slack: how far the root may go, surface units. turn: how far the heading may turn, radians. penalty: prior
    weight of a slide by the whole slack or a turn by the whole turn. axis: in place of the shape's own, as
    `reconstruct_patch` takes it.
    """

    contact: str
    shape: PatchShape
    root: Root
    slack: float
    turn: float = np.pi / 4.0
    penalty: float = 1.0
    axis: AxisShape | None = None

    def __post_init__(self) -> None:
        if not (self.slack > 0.0 and self.turn >= 0.0):
            raise InvalidInput(f"the slack of {self.contact!r} is a positive length, but got {self.slack}.")

    @property
    def dof_names(self) -> tuple[str, ...]:
        """Its dofs; a patch that may not turn has no third one."""
        names = (*DIRECTIONS, "turn") if self.turn > 0.0 else DIRECTIONS
        return tuple(f"{self.contact}.{name}" for name in names)


class SlidingTargets:
    """The sliding patches of one surface as a black-box body. theta: per patch, the root offset along and across
    the first heading, then the turn, each as a share of its slack, so that one penalty and one step fit all.

    surface: what they walk on. seen: where that is a proxy, the map to the mesh that their points are given on.
    meant: those points at theta 0. Raises InvalidInput for a patch whose points are others.
    """

    world_length = 0.0  # a target is not what distances are judged against

    def __init__(
        self,
        surface: TriangleMesh,
        patches: Sequence[SlidingPatch],
        world_from_surface: FloatArray,
        meant: Sequence[SurfacePoints],
        seen: SurfaceMap | None = None,
    ) -> None:
        self.surface, self.patches, self.world = surface, tuple(patches), np.asarray(world_from_surface, float)
        self.seen, self.mesh = seen, surface if seen is None else seen.source
        self.dofs = [BlackBoxDof(name, -1.0, 1.0, patch.penalty) for patch in patches for name in patch.dof_names]
        self.tracer = PatchTracer(surface, [ShapedPatch(patch.shape, patch.axis) for patch in patches])
        self._starts = SurfacePoints.concatenate(patch.root.point() for patch in patches)
        self._headings = np.array([patch.root.heading for patch in patches])
        self.has = np.concatenate([[True, True, patch.turn > 0.0] for patch in patches])  # (3 n,) which dofs exist
        self._last: tuple[bytes, TracedPatches] = b"", TracedPatches(self._starts, self._headings)
        self._check(meant)

    def _check(self, meant: Sequence[SurfacePoints]) -> None:
        found, owner = self.points(np.zeros(len(self.dofs))), self.tracer.patch_of_point
        near = 1e-6 * self.mesh.bounding_box_diagonal
        for i, (patch, points) in enumerate(zip(self.patches, meant, strict=True)):
            own, wanted = found[owner == i].positions(self.mesh), points.positions(self.mesh)
            if own.shape != wanted.shape or np.linalg.norm(own - wanted, axis=1).max(initial=0.0) > near:
                raise InvalidInput(f"the object points of {patch.contact!r} are not its patch at the given root.")

    @cached_property
    def slacks(self) -> FloatArray:
        """(n,) surface units."""
        return np.array([patch.slack for patch in self.patches])

    @cached_property
    def turns(self) -> FloatArray:
        """(n,) radians."""
        return np.array([patch.turn for patch in self.patches])

    def shares(self, theta: FloatArray) -> FloatArray:
        """(n, 3) along, across, turn of each patch out of theta (d,); no turn is 0."""
        result = np.zeros(3 * len(self.patches))
        result[self.has] = theta
        return result.reshape(-1, 3)

    def where(self, theta: FloatArray) -> tuple[SurfacePoints, ComplexArray]:
        """Roots (n,) and headings (n,) at theta: the exponential map of the offsets, the headings carried along and
        turned."""
        shares = self.shares(theta)
        shifts = self.slacks * (shares[:, 0] + 1j * shares[:, 1])
        trace = trace_geodesic(self.surface, self._starts, shifts * self._headings)
        size = np.abs(shifts)
        moved = size > 0.0
        # Parallel transport keeps the angle between the heading and the way.
        angle = np.where(moved, np.conj(shifts) / np.where(moved, size, 1.0), 1.0)
        carried = np.where(moved, trace.headings * angle, self._headings) * np.exp(1j * self.turns * shares[:, 2])
        return trace.points, carried / np.abs(carried)

    def roots(self, theta: FloatArray) -> dict[str, Root]:
        """Where each patch is at theta, by contact; bitwise where it was if it did not move."""
        points, headings = self.where(theta)
        moved = np.any(self.shares(theta) != 0.0, axis=1)
        return {
            patch.contact: Root.at(points[i], complex(headings[i])) if moved[i] else patch.root
            for i, patch in enumerate(self.patches)
        }

    def placed(self, theta: FloatArray) -> TracedPatches:
        """The patches at theta, traced; the last ones are kept, for derivatives come after values."""
        key = theta.tobytes()
        if key != self._last[0]:
            self._last = key, self.tracer.trace(*self.where(theta))
        return self._last[1]

    def points(self, theta: FloatArray) -> SurfacePoints:
        """The patches' points at theta on the mesh that is seen (`mesh`)."""
        walked = self.placed(theta).points
        return walked if self.seen is None else self.seen.to_source(walked)

    def watch(self, points: SurfacePoints) -> Evaluate:
        """The patches' own points, all of them; `points` are they at theta 0."""
        return _Slide(self)


class _Slide:
    """Points and normals of sliding patches in the world, with exact derivatives.

    A path of straight legs crosses a strip of faces that unfolds into the plane. So when the root moves by a small
    vector, each point moves by the same vector, carried along its path; and when the root turns, each point turns
    about it in the plane. Paths that meet a vertex have no derivative, and there this is that of one side. On a
    proxy what moves on the mesh is the foot of the moving point: its share along the foot's face or edge.
    """

    def __init__(self, targets: SlidingTargets) -> None:
        self.targets, self.surface = targets, targets.surface
        self.linear: FloatArray = targets.world[:3, :3]
        unfolded = [_unfold(patch) for patch in targets.patches]
        self.unfolded, self.ends = (np.concatenate([pair[i] for pair in unfolded]) for i in range(2))

    def __call__(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        points, mesh = self.targets.points(theta), self.targets.mesh
        normals = points.normals(mesh) @ self.linear.T
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        return points.positions(mesh) @ self.linear.T + self.targets.world[:3, 3], normals / length

    def derivatives(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(d, k, 3) of points and of normals; 0 where a dof is of another patch."""
        targets, owner = self.targets, self.targets.tracer.patch_of_point
        placed = targets.placed(theta)
        carried = placed.headings / self.ends  # (k,) from the plane into the frame of each point
        turned = np.exp(1j * targets.turns * targets.shares(theta)[:, 2])
        along = (targets.slacks / turned)[owner]
        plane = np.stack([along, 1j * along, 1j * targets.turns[owner] * self.unfolded])  # (3, k)
        ahead, aside = (heading_to_direction(self.surface, placed.points, turn * carried) for turn in (1.0, 1j))
        moved = plane.real[..., None] * ahead + plane.imag[..., None] * aside  # (3, k, 3)
        points = targets.points(theta)
        if targets.seen is not None:
            moved = _of_feet(targets.mesh, points, moved)
        return self._spread(moved @ self.linear.T), self._spread(self._normals_moved(points, moved))

    def _spread(self, own: FloatArray) -> FloatArray:
        """(d, k, 3) out of (3, k, 3), the derivatives by each point's own patch."""
        owner = self.targets.tracer.patch_of_point
        result = np.zeros((len(self.targets.patches), *own.shape))  # (n, 3, k, 3)
        result[owner, :, np.arange(len(owner))] = own.transpose(1, 0, 2)
        flat: FloatArray = result.reshape(-1, *own.shape[1:])
        return flat if self.targets.has.all() else flat[self.targets.has]

    def _normals_moved(self, points: SurfacePoints, moved: FloatArray) -> FloatArray:
        """(d, k, 3) derivative of the world normals where the points move by `moved` within their faces."""
        mesh = self.targets.mesh
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


def _of_feet(mesh: TriangleMesh, feet: SurfacePoints, moved: FloatArray) -> FloatArray:
    """(d, k, 3) how the feet (k) on a mesh of points that move by (d, k, 3) move: along the face, along the edge if
    the foot lies on one, not at all at a vertex."""
    corners = mesh.points[mesh.faces[feet.faces]]  # (k, 3, 3)
    off = feet.barycentric <= 1e-12  # (k, 3)
    normal = mesh.face_normals[feet.faces]
    inside = moved - np.einsum("qki,ki->qk", moved, normal)[..., None] * normal
    lone = off.argmax(axis=1)  # the corner opposite to the edge
    rows = np.arange(len(lone))
    edge = corners[rows, (lone + 2) % 3] - corners[rows, (lone + 1) % 3]
    edge /= np.maximum(np.linalg.norm(edge, axis=1, keepdims=True), 1e-300)
    along = np.einsum("qki,ki->qk", moved, edge)[..., None] * edge
    sides = off.sum(axis=1)[:, None]
    return np.where(sides == 0, inside, np.where(sides == 1, along, 0.0))


def _unfold(patch: SlidingPatch) -> tuple[ComplexArray, ComplexArray]:
    """A patch laid out in the plane along its paths, the root at 0 heading along 1: points (k,) and the unit
    directions (k,) in which their paths end."""
    shape, coordinates = patch.axis or patch.shape.axis, patch.shape.coordinates
    turns = np.concatenate([[0.0], shape.traced_turns, [0.0]])[: shape.point_count]
    headings = np.exp(1j * np.cumsum(turns))  # (m,) as `Axis.tangents`
    steps = shape.lengths * shape.along * headings[:-1]
    knots = np.concatenate([[0.0], np.cumsum(steps)])  # (m,)
    legs, angles, lengths = patch_chains(coordinates, shape)
    first = legs * headings[coordinates.anchors]
    size = np.abs(first)
    ends = np.where(size > 0.0, first / np.where(size > 0.0, size, 1.0), headings[coordinates.anchors])
    points = knots[coordinates.anchors] + first
    for i in np.flatnonzero(np.diff(coordinates.chain_starts)):
        for row in range(coordinates.chain_starts[i], coordinates.chain_starts[i + 1]):
            ends[i] *= np.exp(1j * angles[row])
            points[i] += lengths[row] * ends[i]
    return points, ends
