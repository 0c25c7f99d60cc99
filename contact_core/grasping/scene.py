"""What a grasp is looked for on: a document with its hand and its object, and what is solved there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.document.document import ContactDocument
from contact_core.geometry.distance_field import DistanceField
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.transform import transform_points
from contact_core.grasping.filled import KeepOutTerm, beyond, filled
from contact_core.grasping.hand import Hand
from contact_core.grasping.loops import Loop, loops_near
from contact_core.plugins.registry import POSE_TERMS
from contact_core.proposals.proposal import AGAIN, SolveSettings
from contact_core.rig.poses import posed_points
from contact_core.rig.rig import Pose
from contact_core.scene.problem import Objective, world_from_surface
from contact_core.solve.body import manipulator_length, uniform_scale
from contact_core.solve.penetration import thinned, thinned_among
from contact_core.solve.solver import SolveOptions
from contact_core.solve.term import PoseTerm
from contact_core.solve.terms import paper_terms

if TYPE_CHECKING:
    from contact_core.edit.derived import Derived
    from contact_core.plugins.manager import PluginManager
    from contact_core.rig.rig import Rig
    from contact_core.scene.evaluated_rig import HostRig

CELL = 0.014  # hand lengths: of the distance field, where the object is small enough for it
NODES = 1_500_000  # of the field, at most
NEAR_CELL, NEAR_ROOM = 0.02, 0.12  # hand lengths: of a field round one hand, and how far beyond its skin it goes
FILLED = 0.2  # hand lengths: what a ball of this radius does not reach is filled
PENETRATION = 16.0
ON_HAND, ON_REST = 1200, 300  # vertices that stand for the skin of a hand, and of the body that it is on


@dataclass(frozen=True, eq=False)
class GraspScene:
    """The document, its hand and its object, and what solves there. hand_name, object_name: of their surfaces.
    prior: what draws the digits that touch nothing: the closed hand with its thumb at rest ("closed"), or
    the pose from which a solve starts ("current"). at: (3,) the place that is to be held, in the object's space in
    the hand's units, if one was named."""

    document: ContactDocument
    derived: Derived
    rigs: Mapping[str, Rig]
    hand: Hand
    hand_name: str
    object_name: str
    plugins: PluginManager
    revision: int = 0
    evaluated: Mapping[str, HostRig] | None = None
    prior: Literal["closed", "current"] = "closed"
    at: FloatArray | None = None

    @property
    def rig(self) -> Rig:
        return self.hand.rig

    @cached_property
    def object_from_world(self) -> FloatArray:
        """(4, 4) rigid; world lengths are the hand's units, and so is the object's space here."""
        world = world_from_surface(self.document, self.object_name, self._unit)
        world = world.copy()
        world[:3, :3] /= uniform_scale(world)
        return np.asarray(np.linalg.inv(world))

    @cached_property
    def object_from_rig(self) -> FloatArray:
        """(4, 4) rigid, from the hand's rig space, where it stands, into the object's in the hand's units."""
        return self.object_from_world @ world_from_surface(self.document, self.hand_name, self._unit)

    @property
    def _unit(self) -> float:
        return self.document.surface(self.hand_name).meters_per_unit

    @cached_property
    def mesh(self) -> TriangleMesh:
        """The object in the hand's units."""
        mesh = self.derived.mesh(self.document, self.object_name)
        scale = self.document.surface(self.object_name).meters_per_unit / self._unit
        return mesh if scale == 1.0 else TriangleMesh(mesh.points * scale, mesh.faces)

    @cached_property
    def resolution(self) -> int:
        """Nodes of the distance field along the object's longest side."""
        sides = np.ptp(self.mesh.points[np.unique(self.mesh.faces)], axis=0) + 0.3 * self.mesh.bounding_box_diagonal
        fine = float(sides.max()) / (CELL * self.hand.length)
        share = float(np.prod(sides / sides.max()))
        return int(np.clip(min(fine, (NODES / share) ** (1.0 / 3.0)), 48, 256))

    @cached_property
    def field(self) -> DistanceField:
        return DistanceField.of(self.mesh, resolution=self.resolution)

    @cached_property
    def solid(self) -> DistanceField:
        """The object with its hollows filled (`filled`)."""
        return self.filled(self.field)

    @cached_property
    def loops(self) -> tuple[Loop, ...]:
        """Those at the place that is to be held, the nearest first."""
        return loops_near(self.mesh, self.hand.length, self.at)

    def filled(self, field: DistanceField) -> DistanceField:
        """A field of the object with the hollows filled that no ball of a fifth of the hand reaches into."""
        return filled(field, FILLED * self.hand.length)

    def near(self, skin: FloatArray) -> DistanceField:
        """The field round skin of the hand (n, 3): where the object is so large that its own is too coarse, a finer
        one of that part."""
        fine = NEAR_CELL * self.hand.length
        if self.field.spacing <= fine:
            return self.field
        room = NEAR_ROOM * self.hand.length
        part = DistanceField.within(self.mesh, skin.min(axis=0) - room, skin.max(axis=0) + room, fine)
        return part or self.field

    @cached_property
    def samples(self) -> tuple[IntArray, FloatArray]:
        """The vertices (k,) that stand for the skin, and the area (k,) of each: of a body most are on its hand."""
        surface, own = self.rig.surface, self.hand.own_skin
        if not self.hand.is_in_body:
            return thinned(surface, ON_HAND + ON_REST)
        rest = np.setdiff1d(np.arange(len(surface.points)), own)
        parts = thinned_among(surface, own, ON_HAND), thinned_among(surface, rest, ON_REST)
        return np.concatenate([v for v, _ in parts]), np.concatenate([a for _, a in parts])

    def terms(self, kept: DistanceField, closed: Pose) -> tuple[PoseTerm, ...]:
        """The paper's, depth in what is kept out of, and self-collision where a plugin offers it."""
        result: tuple[PoseTerm, ...] = paper_terms()
        fields = (kept, beyond(self.field, kept)) if self._reaches_beyond(kept, closed) else (kept,)
        scale = uniform_scale_of(self)
        own = tuple(
            DistanceField(each.origin / scale, each.spacing / scale, each.values / scale) for each in fields
        )
        keep_out = KeepOutTerm(
            weight=PENETRATION,
            resolution=48,
            fields={self.object_name: own},
            stand_in={self.hand_name: self.samples},
        )
        result += (keep_out,)
        if "self-collision" in self.plugins.offers(POSE_TERMS):
            result += (self.plugins.make(POSE_TERMS, "self-collision"),)
        return result

    def _reaches_beyond(self, kept: DistanceField, closed: Pose) -> bool:
        """Whether skin lies where a field does not reach, but the object may: a body's, beyond its hand."""
        if kept.spacing == self.field.spacing:
            return False
        skin = transform_points(self.object_from_rig, posed_points(self.rig, closed))
        high = kept.origin + kept.spacing * (np.array(kept.values.shape) - 1)
        return bool((skin < kept.origin).any() or (skin > high).any())

    def settings(self, kept: DistanceField, closed: Pose) -> SolveSettings:
        """How grasps are solved: from the closed hand and near it, digits and root free, a body's other joints as
        they are. kept: what it keeps out of. closed: the pose that digits without a contact keep.
        """
        rig = self.rig
        moving = [rig.joints[j] for j in {*np.flatnonzero(rig.parents < 0).tolist(), *self.hand.joints.tolist()}]
        prior = self.prior if self.prior == "current" else {self.hand_name: self._drawn_to(closed)}
        objective = Objective(
            self.terms(kept, closed), free={self.hand_name: moving}, prior=prior, length=self.hand.length
        )
        return SolveSettings(objective=objective, options=SolveOptions(candidates=AGAIN, max_iterations=60))

    def _drawn_to(self, closed: Pose) -> Pose:
        """The closed hand with its thumb at rest: what its root was searched over stretches the skin there."""
        if self.hand.thumb < 0:
            return closed
        local = closed.local.copy()
        for joint in self.hand.joints[self.hand.bones[self.hand.thumb] : self.hand.bones[self.hand.thumb + 1]]:
            local[closed.joints.index(self.rig.joints[joint])] = self.rig.rest_local[joint]
        return Pose(closed.joints, local)


def uniform_scale_of(scene: GraspScene) -> float:
    """Hand units per unit of the object's surface."""
    surfaces = scene.document.surfaces
    return surfaces[scene.object_name].meters_per_unit / surfaces[scene.hand_name].meters_per_unit


def hand_share(scene: GraspScene) -> float:
    """The hand's length as a share of the whole manipulator's, which placers measure by."""
    return scene.hand.length / manipulator_length(scene.rig)
