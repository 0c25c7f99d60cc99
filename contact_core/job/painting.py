"""From a recipe's words to points on a surface: patches and the axes drawn through them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from contact_core.arrays import IntArray
from contact_core.contact.axis_generator import AxisRequest
from contact_core.document.asset import Asset
from contact_core.errors import InvalidInput
from contact_core.geometry.exact_geodesics import log_map
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import direction_to_heading
from contact_core.geometry.tracing import trace_geodesic
from contact_core.job.recipe import DiskSpec, PatchSpec, PointSpec, RootSpec
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import AXIS_GENERATORS
from contact_core.rig.bones import bones_of
from contact_core.rig.rig import Rig

_UPRIGHT = 0.05  # sine of the angle to the normal below which a direction tells no heading
_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


def paint(spec: PatchSpec, asset: Asset) -> SurfacePoints:
    """The points of a patch on a manipulator's surface. Raises InvalidInput naming the patch."""
    try:
        if spec.disk is not None:
            return disk(asset, spec.disk)
        if spec.vertices:
            return SurfacePoints.at_vertices(asset.mesh, _mesh_vertices(asset, np.array(spec.vertices)))
        return Locator.of(asset.mesh).closest(np.array(spec.positions)).points
    except InvalidInput as error:
        raise type(error)(f"patch {spec.name!r}: {error}") from error


def disk(asset: Asset, spec: DiskSpec) -> SurfacePoints:
    """A geodesic disk as the exponential map of a sunflower: `count` points, evenly spread, centre first.

    Ring i of the sunflower lies at radius sqrt(i / count), so equal areas carry equal numbers of points.
    """
    reach = asset.mesh.bounding_box_diagonal
    if spec.radius > reach:
        raise InvalidInput(f"its radius is {spec.radius:g}, but {asset.name} is only {reach:.3g} units across.")
    centre = locate(spec.at, asset)
    place = np.arange(spec.count)
    spokes = spec.radius * np.sqrt(place / (spec.count - 1)) * np.exp(1j * _GOLDEN_ANGLE * place)  # (n,)
    centres = SurfacePoints(np.repeat(centre.faces, spec.count), np.repeat(centre.barycentric, spec.count, axis=0))
    return trace_geodesic(asset.mesh, centres, spokes).points


def axis_picks(
    spec: PatchSpec, asset: Asset, points: SurfacePoints, drawn: Mapping[str, SurfacePoints], plugins: PluginManager
) -> SurfacePoints:
    """The points that a patch's axis is drawn through: the recipe's, else its generator's. Raises InvalidInput."""
    try:
        if spec.axis:
            return SurfacePoints.concatenate([locate(point, asset) for point in spec.axis])
        bones, owner = (None, None) if asset.rig is None else bones_of(asset.rig, points)
        request = AxisRequest(asset.mesh, points, bones, owner, dict(drawn))
        name = plugins.name_for(AXIS_GENERATORS, "recipe", spec.generator)
        return plugins.make(AXIS_GENERATORS, name, **spec.generator_options).generate(request)
    except InvalidInput as error:
        raise type(error)(f"the axis of patch {spec.name!r}: {error}") from error


def explicit_root(spec: RootSpec, asset: Asset) -> tuple[SurfacePoints, complex]:
    """The root (one point) that a recipe gives a patch on the object, and the heading of its axis there."""
    root = locate(spec.root, asset)
    if spec.aim is None:
        direction = np.array([spec.direction])
        upright = np.linalg.norm(np.cross(direction, root.normals(asset.mesh))) / np.linalg.norm(direction)
        if upright < _UPRIGHT:
            raise InvalidInput(
                "the direction of a patch stands upright on the object at its root; give one along it."
            )
        return root, complex(direction_to_heading(asset.mesh, root, direction)[0])
    log = log_map(asset.mesh, root, locate(spec.aim, asset))
    if log.anchor[0] < 0 or not log.distance[0] > 0:
        raise InvalidInput("the point that a patch aims at must be another point on the same part of the object.")
    return root, complex(log.coordinates[0]) / float(log.distance[0])


def locate(spec: PointSpec, asset: Asset) -> SurfacePoints:
    """One surface point, as a batch of one. Raises InvalidInput."""
    if spec.vertex is not None:
        return SurfacePoints.at_vertices(asset.mesh, _mesh_vertices(asset, np.array([spec.vertex])))
    if spec.position is not None:
        return Locator.of(asset.mesh).closest(np.array([spec.position])).points
    if asset.rig is None:
        raise InvalidInput(f"a point at joint {spec.joint!r} needs a rig, but {asset.name} has none.")
    return _outside_of_joint(asset.rig, asset.mesh, str(spec.joint), spec)


def _outside_of_joint(rig: Rig, mesh: TriangleMesh, name: str, spec: PointSpec) -> SurfacePoints:
    """Where a ray from a bone leaves the skin; the closest point of the skin where it leaves none."""
    joint = rig.joint_index(name)
    children = np.flatnonzero(rig.parents == joint)
    head = rig.rest_world[joint, :3, 3]
    if len(children):
        along = rig.rest_world[children[0], :3, 3] - head
    else:  # the last joint goes on as its parent did
        along = head - rig.rest_world[rig.parents[joint], :3, 3] if rig.parents[joint] >= 0 else np.zeros(3)
    origin = head + spec.along * along
    if isinstance(spec.toward, str):  # the palmar side: second axis of the frame in which the joint flexes
        freedom = rig.freedoms[joint]
        if freedom.kind not in ("hinge", "euler"):
            raise InvalidInput(
                f'joint {name!r} has no flexion that tells its palm side; give toward = [x, y, z], not "palm".'
            )
        toward = (rig.rest_world[joint, :3, :3] @ freedom.frame)[:, 1]
    else:
        toward = np.asarray(spec.toward, float)
    hit = Locator.of(mesh).cast(origin[None], toward[None])
    return hit.points if hit.found[0] else Locator.of(mesh).closest(origin[None]).points


def _mesh_vertices(asset: Asset, vertices: IntArray) -> IntArray:
    """The mesh's vertices that the file's own vertices became. Raises InvalidInput."""
    count = len(asset.mesh.points) if asset.source_vertices is None else len(asset.source_vertices)
    if (vertices >= count).any():
        raise InvalidInput(f"{asset.name} has vertices 0..{count - 1}, but got {int(vertices.max())}.")
    mapped = vertices if asset.source_vertices is None else asset.source_vertices[vertices]
    if (mapped < 0).any():
        raise InvalidInput(f"vertex {int(vertices[np.argmax(mapped < 0)])} of {asset.name} belongs to no face.")
    return mapped
