"""From the interaction to the canvas: only what changed is sent."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.interaction.interaction import Interaction
from contact_core.interaction.overlay import NOTHING, Overlay
from contact_viewer.canvas import GHOST
from contact_viewer.eye import Eye
from contact_viewer.panes import Panes


class Drawer:
    """Keeps the canvases as an interaction says, with an overlay `beside` its own.

    hidden_surfaces, hidden_patches: names that the artist has hidden; `stale` after they were changed.
    """

    def __init__(
        self, interaction: Interaction, panes: Panes, beside: Callable[[], Overlay] = lambda: NOTHING
    ) -> None:
        self._interaction, self._panes, self._beside = interaction, panes, beside
        self.hidden_surfaces: set[str] = set()
        self.hidden_patches: set[str] = set()
        self._drawn: dict[str, TriangleMesh] = {}
        self.stale = True

    def follow(self) -> frozenset[str]:
        """Send what changed; the names of the parts that did, "surfaces" among them."""
        changes = self._interaction.changes()
        if not changes and not self.stale:
            return frozenset()
        parts: set[str] = set(changes.parts)
        if changes.surfaces or self.stale:
            parts.add("surfaces")
            self._shapes()
        if self.stale or changes.surfaces or "visibility" in parts or "document" in parts:
            self._looks()
        if self.stale or changes.surfaces or parts & {"overlay", "document", "selection"}:
            self._draw(self._visible(self._interaction.overlay().joined(self._beside())))
        self.stale = False
        return frozenset(parts)

    def anew(self) -> None:
        """Send everything again, in the canvases that there are now."""
        self._drawn.clear()
        self.stale = True

    def _draw(self, overlay: Overlay) -> None:
        panes = self._panes
        for pane in panes.all:
            only, pointed = pane.eye.surfaces, pane is panes.active
            pane.show(overlay if only is None else overlay.on(only, pointed=pointed))

    def points(self, patches: tuple[str, ...] = (), eye: Eye | None = None) -> FloatArray:
        """(k, 3) world: of patches, or of all surfaces that are shown; by an eye, where only its own are meant."""
        overlay = self._interaction.overlay()
        found = [decal.points for decal in overlay.decals if decal.patch in patches]
        if not found:
            scene = self._interaction.desk.scene
            found = [
                seen.points
                for name, seen in scene.surfaces.items()
                if name not in self.hidden_surfaces and (eye is None or eye.shows(name))
            ]
        return np.concatenate(found) if found else np.zeros((0, 3))

    def _shapes(self) -> None:
        scene = self._interaction.desk.scene
        for pane in self._panes.all:
            pane.keep_surfaces(filter(pane.eye.shows, scene.surfaces))
        for name, seen in scene.surfaces.items():
            actor = self._panes.of(name).surface(name)
            if self._drawn.get(name) is not seen.mesh:
                actor.set_shape(seen.mesh.points, seen.mesh.faces)
                self._drawn[name] = seen.mesh
            actor.set_place(seen.world)

    def _looks(self) -> None:
        theme, document = self._panes.canvas.theme, self._interaction.desk.document
        things = 0
        for name in self._interaction.desk.scene.surfaces:
            surface = document.surfaces.get(name)
            rigged = surface is not None and surface.rig is not None
            color = theme.skin if rigged else theme.things[things % len(theme.things)]
            things += not rigged
            opacity = 0.0 if name in self.hidden_surfaces else self._opacity(name, rigged=rigged)
            self._panes.of(name).surface(name).set_look(color, opacity=opacity, visible=opacity > 0.0)

    def _opacity(self, name: str, *, rigged: bool) -> float:
        """As the interaction says; with no surface in hand, X-ray looks through things and not through hands."""
        if self._panes.is_split:
            return 1.0
        settings, opacity = self._interaction.settings, self._interaction.opacity(name)
        nothing_in_hand = self._interaction.selection.surface is None
        ghost = 0.0 < opacity < 1.0 or (settings.xray and nothing_in_hand and not rigged)
        return GHOST if ghost else opacity

    def _visible(self, overlay: Overlay) -> Overlay:
        """The overlay without what is hidden."""
        hidden = self.hidden_patches
        away = self.hidden_surfaces | {
            name for name in self._interaction.desk.scene.surfaces if self._interaction.opacity(name) == 0.0
        }
        if not hidden and not away:
            return overlay
        return replace(
            overlay,
            decals=tuple(d for d in overlay.decals if d.patch not in hidden and d.surface not in away),
            axes=tuple(axis for axis in overlay.axes if axis.patch not in hidden),
        )
