"""A draft of a document: verbs work on it one after the other, and nothing is committed."""

from __future__ import annotations

from collections.abc import Mapping

from contact_core.document.document import ContactDocument
from contact_core.document.frozen_map import FrozenMap
from contact_core.edit.command import Command, apply_command
from contact_core.edit.commands import Settle
from contact_core.edit.derived import Derived
from contact_core.edit.pose_problem import pose_problem, surfaces_of
from contact_core.edit.verbs import Verbs
from contact_core.rig.rig import Pose, Rig
from contact_core.solve.body import Body
from contact_core.solve.problem import Limits, PoseProblem
from contact_core.solve.terms import PoseTerm, paper_terms


class Draft(Verbs):
    """An editor of a document of its own. rigs: by surface."""

    def __init__(self, document: ContactDocument, derived: Derived, rigs: Mapping[str, Rig]) -> None:
        self._document, self._derived, self.rigs = document, derived, dict(rigs)

    @property
    def document(self) -> ContactDocument:
        """The document as the draft has it now."""
        return self._document

    @property
    def derived(self) -> Derived:
        """Reconstructed geometry, cached."""
        return self._derived

    def submit(self, command: Command, *, origin: str = "user") -> int:
        """Take a command into the draft; there are no revisions, so it answers 0."""
        self._document = apply_command(command, self._document)
        return 0

    def problem(self, terms: tuple[PoseTerm, ...] = paper_terms(), *, limits: Limits = "rig") -> PoseProblem:
        """All pairs, every rig in its pose, everything else where it stands. The world is the scene in the units of
        the first surface."""
        pairs = self.pairs()
        names = surfaces_of(pairs)
        unit = self.document.surface(names[0]).meters_per_unit if names else 1.0

        def body_of(name: str) -> Body:
            record = self.document.surface(name)
            world = record.world_from_surface.copy()
            world[:3] *= record.meters_per_unit / unit
            if name not in self.rigs:
                return Body.rigid(name, self.mesh(name), world_from_surface=world)
            rig = self.rigs[name]
            pose = self.document.poses.get(name) or Pose.rest(rig)
            return Body.skinned(rig, name=name, pose=pose, world_from_rig=world)

        return pose_problem(pairs, body_of, terms, limits=limits)


def change(before: ContactDocument, after: ContactDocument, title: str) -> Settle:
    """The one command that takes a document to another, as far as placements and poses go."""
    placements = tuple(
        (name, patch.placement)
        for name, patch in after.patches.items()
        if before.patch(name).placement != patch.placement
    )
    poses = {name: pose for name, pose in after.poses.items() if before.poses.get(name) is not pose}
    return Settle(placements, FrozenMap(poses), title)
