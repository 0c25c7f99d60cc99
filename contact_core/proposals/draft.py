"""A draft of a document to pose: verbs and solvers work on it one after the other, and nothing is committed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from contact_core.document.document import ContactDocument
from contact_core.document.frozen_map import FrozenMap
from contact_core.edit.command import Command, Macro
from contact_core.edit.commands import PlaceSurface, Settle
from contact_core.edit.derived import Derived
from contact_core.edit.draft import DocumentDraft
from contact_core.edit.editor import Makers
from contact_core.edit.verbs import Pairs, Patches, Surfaces
from contact_core.rig.rig import Rig
from contact_core.scene.evaluated_rig import HostRig
from contact_core.scene.problem import Objective, poses_of, problem_of
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import PoseSolution


class _QuietPatches(Patches):
    """Verbs whose results are looked at and mostly thrown away, again with each move of a pointer: the log keeps
    quiet."""

    def _warn_where_crowded(self, copies: Iterable[str]) -> None:
        pass


class Draft(DocumentDraft):
    """A draft whose rigs can be posed. evaluated: by surface, rigs whose skin only the host evaluates."""

    def __init__(
        self,
        document: ContactDocument,
        derived: Derived,
        rigs: Mapping[str, Rig],
        evaluated: Mapping[str, HostRig] | None = None,
        makers: Makers | None = None,
    ) -> None:
        super().__init__(document, derived, rigs, makers)
        self.evaluated = dict(evaluated or {})
        self.patches, self.pairs, self.surfaces = _QuietPatches(self), Pairs(self), Surfaces(self)

    def copy(self) -> Draft:
        """Another that goes on from here."""
        other = Draft(self.document, self.derived, self.rigs, self.evaluated, self.makers)
        other.commands = self.commands
        return other

    def problem(self, objective: Objective | None = None) -> PoseProblem:
        """The pose problem of the document as the draft has it now (`scene.problem.problem_of`)."""
        return problem_of(self.geometry, self.rigs, objective, self.evaluated)

    def take(self, solution: PoseSolution) -> None:
        """Pose the rigs as a solution has them."""
        for name, pose in poses_of(solution, self.rigs).items():
            self.surfaces.set_pose(name, pose)


def change(before: ContactDocument, after: ContactDocument, title: str) -> Command:
    """The one command that takes a document to another, as far as placements and poses go."""
    moved = tuple(
        PlaceSurface(name, surface.world_from_surface)
        for name, surface in after.surfaces.items()
        if not np.array_equal(before.surface(name).world_from_surface, surface.world_from_surface)
    )
    placements = tuple(
        (name, patch.placement)
        for name, patch in after.patches.items()
        if before.patch(name).placement != patch.placement
    )
    poses = {name: pose for name, pose in after.poses.items() if before.poses.get(name) is not pose}
    settled = Settle(placements, FrozenMap(poses), title)
    return Macro(title, (*moved, settled)) if moved else settled
