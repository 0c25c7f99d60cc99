"""The surfaces of a session, with the objects of a scene behind them."""

from __future__ import annotations

from typing import Protocol

from contact_core.document.document import Surface
from contact_core.edit.command import Macro
from contact_core.edit.commands import RenameSurface, SetExtra
from contact_core.edit.editor import Editor
from contact_core.edit.verbs import Surfaces
from contact_core.errors import InvalidInput
from contact_core.scene.binding import Binding
from contact_core.scene.host import BoneChoosing


class BoundEditor(Editor, Protocol):
    """An editor of a document that is bound to a scene."""

    @property
    def binding(self) -> Binding:
        """Which objects of the scene stand behind the surfaces."""


class SceneSurfaces(Surfaces):
    """Surfaces that may be objects of a scene."""

    def __init__(self, editor: BoundEditor) -> None:
        super().__init__(editor)
        self._bound = editor

    def bring(self, surface: Surface, object_id: str | None = None) -> Surface:
        """Add a surface of another document, bound to the object of this scene that has its triangles.

        object_id: where several have. Raises InvalidInput where there is none.
        """
        binding = self._bound.binding
        found = binding.find(surface, object_id)
        binding.surfaces[surface.name] = found
        asset = found.asset
        return self.add(
            surface.name,
            asset.mesh,
            rig=asset.rig,
            meters_per_unit=asset.meters_per_unit or 1.0,
            up_axis=asset.up_axis,
            world_from_surface=binding.placement(found.object_id),
        )

    def choose_bones(self, surface: str, choice: str) -> None:
        """Say which bones of the rig behind a surface a solve may pose, in the host's words; one step of its undo.

        Raises InvalidInput where the host has no such choice.
        """
        binding = self._bound.binding
        found, host = binding.surfaces.get(surface), binding.host
        if found is None or found.rig is None or not isinstance(host, BoneChoosing):
            raise InvalidInput(f"behind {surface!r} is no rig of a scene of which bones can be chosen.")
        host.choose_bones(found.object_id, choice)
        self.follow_freedoms()

    def follow_freedoms(self) -> None:
        """Take over what has changed in the scene of what rigs may do: locks, limits, the choice of bones."""
        self._editor.rigs.update(self._bound.binding.follow_freedoms())

    def rename(self, surface: str, name: str) -> None:
        """Give a surface another name, everywhere; the object behind it stays behind it."""
        binding = self._bound.binding
        renaming = RenameSurface(surface, name)
        if surface not in binding.surfaces:
            super().rename(surface, name)
            return
        after = renaming.apply(self._document)
        binding.surfaces[name] = binding.surfaces[surface]  # the old name stays known: an undo brings it back
        self._keep_rig(surface, name)
        remembered = binding.remembering(after)
        if remembered is after:
            self._editor.do(renaming)
            return
        objects = SetExtra(binding.key, remembered.extras[binding.key])
        self._editor.do(Macro(renaming.label(), (renaming, objects)))
