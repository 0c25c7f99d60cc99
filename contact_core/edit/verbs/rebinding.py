"""An asset in another topology: project its patches and axes onto the new mesh, and say how far they moved."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from contact_core.contact.axis import Axis, draw_axis, reconstruct_axis
from contact_core.contact.linkage import link_to
from contact_core.contact.patch import parameterize_patch, points_from_axis
from contact_core.contact.placement import Link, Placement, Root
from contact_core.contact.shape import AxisShape, PatchShape
from contact_core.document.document import Surface
from contact_core.document.frozen_map import FrozenMap
from contact_core.document.timeline import Track, of_address
from contact_core.edit.commands import RebindSurface
from contact_core.edit.editor import Editor
from contact_core.errors import NotManifold
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_map import SurfaceMap
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import direction_to_heading, heading_to_direction
from contact_core.motion.placement_keys import PlacementKey, PlacementKeys


@dataclass(frozen=True, eq=False)
class RebindReport:
    """What a rebind did. moves: by patch, the largest distance that one of its points moved (surface units)."""

    moves: Mapping[str, float]

    @property
    def largest_move(self) -> float:
        """The largest of all (surface units)."""
        return max(self.moves.values(), default=0.0)


def plan_rebind(editor: Editor, new: Surface, mesh: TriangleMesh) -> tuple[RebindSurface, RebindReport]:
    """The command that puts the contacts of a surface onto a new mesh under the same name, or on another proxy.

    new: the record of it. mesh: what its contacts run on then.

    Points and axes of original patches are projected to their closest points and measured anew; copies keep their
    shape and get their root and direction projected. Links are drawn anew between the projected axes.
    """
    document, old_mesh = editor.document, editor.geometry.carrier(new.name)
    on_it = [name for name, patch in document.patches.items() if patch.surface == new.name]
    shapes: dict[str, PatchShape] = {}
    axes: dict[str, Axis] = {}
    for name in on_it:
        patch = document.patch(name)
        if patch.original:
            shapes[patch.shape], axes[name] = _projected_shape(editor, name, new, old_mesh, mesh)
    moves: dict[str, float] = {}
    for name in on_it:
        patch = document.patch(name)
        shape = shapes.get(patch.shape, document.shapes[patch.shape])
        own = _effective(shape, patch.turns if name not in axes else (), patch.along, patch.spread, name in axes)
        own = own.transformed(mirrored=patch.mirrored, unit=shape.meters_per_unit / new.meters_per_unit)
        if name not in axes:
            root = _projected_root(editor.geometry.root(name), old_mesh, mesh)
            axes[name] = reconstruct_axis(mesh, own, root)
        points = points_from_axis(mesh, shape.coordinates, axes[name], own)
        with contextlib.suppress(NotManifold):  # a copy that could not be walked where it was moved no distance
            before = editor.geometry.reconstruction(name).points.positions(old_mesh)
            moves[name] = float(np.linalg.norm(points.points.positions(mesh) - before, axis=1).max(initial=0.0))
    placements = [(name, _placed(editor, name, mesh, axes)) for name in on_it]
    placements += _links_elsewhere(editor, new.name, shapes)
    tracks = placed_tracks(editor, new.name, mesh, lambda root: _projected_root(root, old_mesh, mesh))
    return RebindSurface(new, FrozenMap(shapes), tuple(placements), tracks), RebindReport(moves)


def placed_tracks(
    editor: Editor, surface: str, mesh: TriangleMesh, moved: Callable[[Root], Root]
) -> FrozenMap[Track]:
    """The keys of places on a surface with other roots, and their ways over a mesh found anew."""
    document, tracks = editor.timed_document, dict[str, Track]()
    for where, track in document.tracks.items():
        kind, name = of_address(where)
        if kind == "placement" and document.patches[name].surface == surface:
            keys = [(key.frame, moved(key.root), key.interpolation) for key in track.of(PlacementKey)]
            tracks[where] = Track(PlacementKeys.of(mesh, keys).keys)
    return FrozenMap(tracks)


def _links_elsewhere(
    editor: Editor, surface: str, shapes: Mapping[str, PatchShape]
) -> Iterator[tuple[str, Placement]]:
    """Links on other surfaces between patches whose axes get other points: from first point to first point, where
    both stay."""
    for name, patch in editor.document.patches.items():
        link = patch.placement
        if not isinstance(link, Link) or patch.surface == surface:
            continue
        if {patch.shape, editor.document.patch(link.parent).shape} & set(shapes):
            root, above = editor.geometry.root(name), editor.geometry.root(link.parent)
            first = Axis(above.point(), np.array([above.heading]), np.zeros(1))
            yield name, link_to(editor.geometry.carrier_of(name), link.parent, first, root.point(), root.heading)


def _projected_shape(
    editor: Editor, name: str, new: Surface, old_mesh: TriangleMesh, mesh: TriangleMesh
) -> tuple[PatchShape, Axis]:
    """The shape of an original patch measured on the new mesh, its own deviation included."""
    patch = editor.document.patch(name)
    old = editor.document.shapes[patch.shape]
    axis_points = _closest(editor.geometry.axis(name).points, old_mesh, mesh)
    heading = _projected_root(editor.geometry.root(name), old_mesh, mesh).heading
    drawn, axis = draw_axis(mesh, axis_points, heading, dense=False)
    points = _closest(editor.geometry.reconstruction(name).points, old_mesh, mesh)
    unit = old.meters_per_unit / new.meters_per_unit
    there = drawn.transformed(mirrored=patch.mirrored, unit=unit)
    coordinates = parameterize_patch(mesh, axis, points, shape=there, engine=editor.derived.engine)
    turns = there.traced_turns
    own = dict(patch.turns)
    if own and len(turns):  # the deviation stays the patch's own
        turns = turns - np.array([own.get(k + 1, 0.0) for k in range(len(turns))])
    shape = AxisShape(drawn.lengths / unit, turns, 1.0 / patch.along, 1.0 / patch.spread)
    return replace(old, axis=shape, coordinates=coordinates), axis


def _effective(
    shape: PatchShape, turns: tuple[tuple[int, float], ...], along: float, spread: float, measured: bool
) -> AxisShape:
    """The axis shape as drawn: that of a measured original is its own already."""
    axis = shape.axis
    if measured:
        return replace(axis, along=1.0, spread=1.0)
    angles = axis.turning_angles.copy()
    for point, angle in turns:
        if 1 <= point <= len(angles):
            angles[point - 1] += angle
    return AxisShape(axis.lengths, angles, axis.along * along, axis.spread * spread)


def _placed(editor: Editor, name: str, mesh: TriangleMesh, axes: Mapping[str, Axis]) -> Placement:
    link = editor.document.patch(name).placement
    axis = axes[name]
    if not isinstance(link, Link):
        return axis.root()
    parent = axes[link.parent]
    at, own = min(link.parent_point, len(parent) - 1), min(link.own_point, len(axis) - 1)
    tangent = complex(axis.tangents[own])
    return link_to(mesh, link.parent, parent, axis.points[own], tangent, parent_point=at, own_point=own)


def _closest(points: SurfacePoints, old_mesh: TriangleMesh, mesh: TriangleMesh) -> SurfacePoints:
    return SurfaceMap(old_mesh, mesh).to_proxy(points)


def _projected_root(root: Root, old_mesh: TriangleMesh, mesh: TriangleMesh) -> Root:
    direction = heading_to_direction(old_mesh, root.point(), np.array([root.heading]))
    point = _closest(root.point(), old_mesh, mesh)
    return Root.at(point, complex(direction_to_heading(mesh, point, direction)[0]))
