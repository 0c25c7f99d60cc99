"""The document as overlay: patches as decals, axes, pairs, names. What did not change is the same object again."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.document.document import ContactDocument, Patch
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.interaction.overlay import WHITE, AxisLine, Decal, Label, Overlay, PairLine
from contact_core.interaction.seen import SeenSurface

if TYPE_CHECKING:
    from contact_core.interaction.desk import Desk

_AS_MANY = 12  # lines that show a pair beside the one between the roots
_LIFT = 0.0015  # of the surface's size: decals and lines are drawn off the skin by so much


class DocumentDrawing:
    """Draws the document that a desk shows."""

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._triangles: dict[str, IntArray] = {}
        self._decals: dict[str, tuple[tuple[object, ...], Decal]] = {}

    def overlay(self) -> Overlay:
        """Patches on loaded surfaces, the axes of selected ones, every pair."""
        desk, document = self._desk, self._desk.document
        shown, scene, selection = desk.shown, desk.scene, desk.selection
        decals, axes, labels = [], [], []
        for patch in document.patches.values():
            seen = scene.surfaces.get(patch.surface)
            if seen is None:
                continue
            where, chosen = shown.points(patch.name), patch.name in selection.patches
            decals.append(self._decal(document, patch, seen, where, chosen))
            if chosen:
                along = shown.axis_points(patch.name)
                line = lifted(seen, along)
                axes.append(AxisLine(line, WHITE, patch=patch.name, arrow=True, surface=patch.surface))
            if chosen and desk.settings.labels:
                root = seen.positions(shown.axis_points(patch.name)[0])[0]
                labels.append(Label(patch.name, root, patch.color, patch.surface))
        self._decals = {name: kept for name, kept in self._decals.items() if name in document.patches}
        return Overlay(tuple(decals), tuple(axes), pair_lines=self._pairs(document), labels=tuple(labels))

    def _decal(
        self, document: ContactDocument, patch: Patch, seen: SeenSurface, where: SurfacePoints, chosen: bool
    ) -> Decal:
        made_of: tuple[object, ...] = (where, seen, patch.color, chosen)
        kept = self._decals.get(patch.name)
        if kept is not None and kept[0][2:] == made_of[2:] and kept[0][0] is where and kept[0][1] is seen:
            return kept[1]
        shape = document.shapes[patch.shape]
        key = shape.coordinates.digest
        if key not in self._triangles:
            self._triangles[key] = self._desk.shown.area(patch.name).triangles
        points = lifted(seen, where)
        decal = Decal(patch.name, patch.surface, points, self._triangles[key], patch.color, chosen)
        self._decals[patch.name] = made_of, decal
        return decal

    def _pairs(self, document: ContactDocument) -> tuple[PairLine, ...]:
        scene, shown, lines = self._desk.scene, self._desk.shown, []
        for pair in document.pairs.values():
            ends = document.patch(pair.manipulator), document.patch(pair.object)
            if any(end.surface not in scene.surfaces for end in ends):
                continue
            where = [shown.points(end.name) for end in ends]
            both = [scene.surfaces[end.surface].positions(w) for end, w in zip(ends, where, strict=True)]
            middle = np.stack([points.mean(axis=0) for points in both])
            shared = ends[0].shape == ends[1].shape
            some = np.linspace(0, len(both[0]) - 1, min(_AS_MANY, len(both[0]))).astype(int)
            starts, stops = (both[0][some], both[1][some]) if shared else (middle[:1], middle[1:])
            chosen = bool({end.name for end in ends} & set(self._desk.selection.patches))
            lines.append(PairLine(pair.name, starts, stops, middle, ends[0].color, chosen))
        return tuple(lines)


def lifted(seen: SeenSurface, points: SurfacePoints) -> FloatArray:
    """(k, 3) world positions a little off the skin, so that what is drawn there is not hidden by it."""
    return seen.positions(points) + _LIFT * seen.scale * seen.rest.bounding_box_diagonal * seen.normals(points)
