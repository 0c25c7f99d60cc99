"""A picture of a document: surfaces in their poses where they stand, patches painted onto them, axes as lines."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.edit.document_geometry import DocumentGeometry
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.transform import transform_points
from contact_core.scene.picture import Picture, PictureMesh
from contact_core.scene.problem import world_from_surface

Color = tuple[float, float, float]
SKIN: Color = (0.87, 0.69, 0.58)  # of what has a pose
THING: Color = (0.74, 0.77, 0.82)
AXIS: Color = (0.15, 0.15, 0.15)
LIFT = 0.0025  # of the extent of what is drawn: painted patches lie this high over their surface


def document_picture(
    geometry: DocumentGeometry,
    surfaces: Iterable[str] = (),
    *,
    camera_from: Color | None = None,
    up: Color = (0.0, 1.0, 0.0),
    caption: str = "",
    colors: Mapping[str, Color] | None = None,
    see_through: Iterable[str] = (),
) -> Picture:
    """A picture of surfaces, by default of all whose mesh is loaded, in world space, units of the first.

    camera_from: direction from the scene to the eye. colors: by surface. see_through: surfaces drawn as glass.
    Raises InvalidInput where there is nothing to draw.
    """
    document, glass = geometry.document, set(see_through)
    drawn = tuple(surfaces) or geometry.loaded
    if not drawn:
        raise InvalidInput("there is nothing to draw: no surface of the document has its mesh loaded.")
    unit = document.surface(drawn[0]).meters_per_unit
    posed = {name: world_mesh(geometry, name, unit) for name in drawn}
    lift = LIFT * max(mesh.bounding_box_diagonal for mesh in posed.values())
    meshes, lines = [], []
    for name, mesh in posed.items():
        usual = SKIN if name in document.poses else THING
        meshes.append(PictureMesh(mesh, (colors or {}).get(name, usual), 0.3 if name in glass else 1.0))
    for patch in document.patches.values():
        if patch.surface in posed:
            mesh = posed[patch.surface]
            meshes.append(painted(geometry, patch.name, mesh, lift))
            axis = lifted(mesh, geometry.axis_points(patch.name), 2.0 * lift)
            lines.append((np.stack([axis[:-1], axis[1:]], axis=1), AXIS))
    return Picture(tuple(meshes), lines=tuple(lines), camera_from=camera_from, up=up, caption=caption)


def world_mesh(geometry: DocumentGeometry, surface: str, meters_per_unit: float) -> TriangleMesh:
    """The mesh of a surface in its pose, where it stands in the scene."""
    mesh = geometry.posed_mesh(surface)
    world = world_from_surface(geometry.document, surface, meters_per_unit)
    return mesh if np.array_equal(world, np.eye(4)) else mesh.with_points(transform_points(world, mesh.points))


def lifted(mesh: TriangleMesh, points: SurfacePoints, lift: float) -> FloatArray:
    """(n, 3) surface points, this high over their surface."""
    return points.positions(mesh) + lift * points.normals(mesh)


def painted(
    geometry: DocumentGeometry, patch: str, mesh: TriangleMesh, lift: float, heat: FloatArray | None = None
) -> PictureMesh:
    """A patch as paint on its surface: its points triangulated, a hair above. heat: RGB (n, 3) in place of the
    patch's colour."""
    record, points = geometry.document.patch(patch), geometry.points(patch)
    triangles = geometry.area(patch).triangles
    faces = triangles[:, ::-1] if record.mirrored else triangles
    return PictureMesh(TriangleMesh(lifted(mesh, points, lift), faces), record.color, vertex_colors=heat)
