"""From a recipe's words to points on a surface: patches, the axes drawn through them, and roots on objects."""

from __future__ import annotations

from typing import Any

import numpy as np

from contact_core.arrays import IntArray
from contact_core.contact.point_sets import geodesic_disk
from contact_core.document.asset import Asset
from contact_core.edit.document_geometry import DocumentGeometry
from contact_core.errors import InvalidInput
from contact_core.geometry.exact_geodesics import log_map
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.recipe.recipe import PatchSpec, PointSpec, RootSpec
from contact_core.rig.bones import skin_point

_UPRIGHT = 0.05  # sine of the angle to the normal below which a direction tells no heading


def painted_points(spec: PatchSpec, asset: Asset, surface: str, geometry: DocumentGeometry) -> SurfacePoints:
    """The points of a patch on a manipulator's surface, whose mesh is the asset's. Raises InvalidInput naming the
    patch, NotManifold where a disk needs a proxy."""
    try:
        if spec.disk is not None:
            reach = asset.mesh.bounding_box_diagonal
            if spec.disk.radius > reach:
                raise InvalidInput(
                    f"its radius is {spec.disk.radius:g}, but {asset.name} is only {reach:.3g} units across."
                )
            centre = geometry.on_carrier(surface, surface_point(spec.disk.at, asset))
            disk = geodesic_disk(geometry.carrier(surface), centre, spec.disk.radius, spec.disk.count)
            return geometry.seen(surface, disk)
        if spec.vertices:
            return SurfacePoints.at_vertices(asset.mesh, _mesh_vertices(asset, np.array(spec.vertices)))
        return Locator.of(asset.mesh).closest(np.array(spec.positions)).points
    except InvalidInput as error:
        raise type(error)(f"patch {spec.name!r}: {error}") from error


def axis_points(spec: PatchSpec, asset: Asset) -> SurfacePoints | None:
    """The points that the recipe draws the axis through; None leaves it to the generator. Raises InvalidInput."""
    if not spec.axis:
        return None
    return SurfacePoints.concatenate([surface_point(point, asset) for point in spec.axis])


def target_root(spec: RootSpec, asset: Asset) -> tuple[SurfacePoints, dict[str, Any]]:
    """The root (one point) that a recipe gives a patch on the object, and its heading or direction there, as verbs
    take them."""
    root = surface_point(spec.root, asset)
    if spec.aim is None:
        direction = np.array([spec.direction])
        upright = np.linalg.norm(np.cross(direction, root.normals(asset.mesh))) / np.linalg.norm(direction)
        if upright < _UPRIGHT:
            raise InvalidInput(
                "the direction of a patch stands upright on the object at its root; give one along it."
            )
        return root, {"direction": direction[0]}
    log = log_map(asset.mesh, root, surface_point(spec.aim, asset))
    if log.anchor[0] < 0 or not log.distance[0] > 0:
        raise InvalidInput("the point that a patch aims at must be another point on the same part of the object.")
    return root, {"heading": complex(log.coordinates[0]) / float(log.distance[0])}


def surface_point(spec: PointSpec, asset: Asset) -> SurfacePoints:
    """One surface point, as a batch of one. Raises InvalidInput."""
    if spec.vertex is not None:
        return SurfacePoints.at_vertices(asset.mesh, _mesh_vertices(asset, np.array([spec.vertex])))
    if spec.position is not None:
        return Locator.of(asset.mesh).closest(np.array([spec.position])).points
    if asset.rig is None:
        raise InvalidInput(f"a point at joint {spec.joint!r} needs a rig, but {asset.name} has none.")
    return skin_point(asset.rig, str(spec.joint), spec.along, spec.toward)


def _mesh_vertices(asset: Asset, vertices: IntArray) -> IntArray:
    """The mesh's vertices that the file's own vertices became. Raises InvalidInput."""
    count = len(asset.mesh.points) if asset.source_vertices is None else len(asset.source_vertices)
    if (vertices >= count).any():
        raise InvalidInput(f"{asset.name} has vertices 0..{count - 1}, but got {int(vertices.max())}.")
    mapped = vertices if asset.source_vertices is None else asset.source_vertices[vertices]
    if (mapped < 0).any():
        raise InvalidInput(f"vertex {int(vertices[np.argmax(mapped < 0)])} of {asset.name} belongs to no face.")
    return mapped
