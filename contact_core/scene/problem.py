"""The one road from a document to a pose problem: its pairs as contacts, its surfaces as bodies where they stand.

A host is read into the document first (`binding.Binding.read`), so a document in memory, a stage, a Blender scene
and a recipe all come this way.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from contact_core.arrays import FloatArray
from contact_core.document.document import ContactDocument
from contact_core.edit.document_geometry import DocumentGeometry, PairGeometry
from contact_core.rig.rig import Pose, Rig
from contact_core.scene.evaluated_rig import EvaluatedRig, HostRig
from contact_core.solve.body import Body, PairedPoints
from contact_core.solve.layout import Limits
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import PoseSolution
from contact_core.solve.term import PoseTerm
from contact_core.solve.terms import paper_terms


@dataclass(frozen=True, eq=False)
class Objective:
    """What is solved for, beside the contacts. The fields are those of `PoseProblem`; bodies are named as surfaces.

    pairs: the names of the pairs that count; all by default. bodies: surfaces that take part though no pair names
    them: a hand that is dragged by a fingertip. length: of the manipulator, where it shall not be measured: a
    hand's whose whole body may move.
    """

    terms: tuple[PoseTerm, ...] = field(default_factory=paper_terms)
    limits: Limits = "rig"
    free: Mapping[str, Iterable[str]] | None = None
    held: Mapping[str, Iterable[str]] | None = None
    prior: Literal["rest", "current"] | Mapping[str, Pose] = "rest"
    pairs: tuple[str, ...] | None = None
    bodies: tuple[str, ...] = ()
    length: float | None = None


def problem_of(
    geometry: DocumentGeometry,
    rigs: Mapping[str, Rig],
    objective: Objective | None = None,
    evaluated: Mapping[str, HostRig] | None = None,
    meters_per_unit: float | None = None,
) -> PoseProblem:
    """The pose problem of a document: every rig in its pose, everything else where it stands.

    The world is the scene in units of `meters_per_unit`, by default those of the first surface of the first pair.
    rigs: by surface, what may be posed. evaluated: by surface, rigs whose skin only the host can evaluate
    (`evaluated_rig`). Raises InvalidInput where the mesh of a surface is not loaded.
    """
    objective, evaluated = objective or Objective(), evaluated or {}
    document = geometry.document
    pairs = [pair for pair in geometry.pairs() if objective.pairs is None or pair.pair.name in objective.pairs]
    names = dict.fromkeys(name for pair in pairs for name in (pair.manipulator_surface, pair.object_surface))
    names.update(dict.fromkeys(objective.bodies))
    unit = meters_per_unit or (document.surface(next(iter(names))).meters_per_unit if names else 1.0)

    def body_of(name: str) -> Body:
        world = world_from_surface(document, name, unit)
        pose = document.poses.get(name)
        if name in evaluated:
            return evaluated[name].body(name, pose, world)
        if name in rigs:
            return Body.skinned(rigs[name], name=name, pose=pose or Pose.rest(rigs[name]), world_from_rig=world)
        return Body.rigid(name, geometry.mesh(name), world_from_surface=world)

    return PoseProblem(
        tuple(map(body_of, names)),
        tuple(map(contact_of, pairs)),
        terms=objective.terms,
        free=objective.free,
        held=objective.held,
        prior=objective.prior,
        limits=objective.limits,
        length=objective.length,
    )


def contact_of(pair: PairGeometry) -> PairedPoints:
    """A pair of the document as a contact of a problem."""
    return PairedPoints(
        pair.pair.name,
        pair.manipulator_surface,
        pair.manipulator_points,
        pair.object_surface,
        pair.object_points,
        pair.weights,
        pair.pair.gain,
        pair.pair.hold,
    )


def world_from_surface(document: ContactDocument, name: str, meters_per_unit: float = 1.0) -> FloatArray:
    """(4, 4) where a surface stands in the scene, in world units of `meters_per_unit`, so with a uniform scale."""
    surface = document.surface(name)
    world = surface.world_from_surface.copy()
    world[:3] *= surface.meters_per_unit / meters_per_unit
    return world


def poses_of(solution: PoseSolution, rigs: Mapping[str, Rig]) -> dict[str, Pose]:
    """The solved pose of every rig by surface, in joints also where the host evaluated it."""
    poses: dict[str, Pose] = {}
    for body in solution.problem.bodies:
        if body.name in rigs and body.name in solution.poses:
            solved = solution.poses[body.name]
            box = body.black_box
            poses[body.name] = box.pose(solved) if isinstance(box, EvaluatedRig) else solved
    return poses
