"""How the gallery draws a session: surfaces in their poses, patches painted onto them, axes as lines."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.contact.patch import patch_chains
from contact_core.geometry.inside import depth_inside
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tracing import trace_chains
from contact_core.geometry.transform import transform_points
from contact_core.scene.picture import Picture, PictureMesh
from contact_core.session import Session

RGB = tuple[float, float, float]
SKIN, THING, WOOD, STONE, SLIME = (
    (0.87, 0.69, 0.58),
    (0.74, 0.77, 0.82),
    (0.68, 0.53, 0.38),
    (0.8, 0.8, 0.8),
    (0.6, 0.5, 0.72),
)
LOOKS: Mapping[str, RGB] = {
    "chair": WOOD,
    "floor": STONE,
    "tentacle": SLIME,
    "witch": (0.66, 0.74, 0.56),
    "alien": (0.62, 0.72, 0.8),
}
AXIS: RGB = (0.85, 0.05, 0.55)
LETTERING = 1.7  # the pictures are seen at half their size
LIFT = 0.0025  # of the extent of what is drawn: painted patches lie this high over their surface


def view(
    session: Session,
    *surfaces: str,
    camera_from: RGB,
    up: RGB = (0.0, 1.0, 0.0),
    caption: str = "",
    patches: Iterable[str] | None = None,
    axes: bool = True,
    see_through: Iterable[str] = (),
    colors: Mapping[str, RGB] | None = None,
    focus: FloatArray | None = None,
    frame: Iterable[str] | None = None,
    heat: Mapping[str, FloatArray] | None = None,
) -> Picture:
    """A picture of surfaces (all by default) with patches (all by default) and their axes, in world space.

    see_through: surfaces that are drawn as glass. frame: surfaces that have to be in the picture. heat: by patch,
    RGB (n, 3) of its points in place of the patch's colour.
    """
    drawn = surfaces or tuple(session.surfaces.meshes)
    posed = {name: in_world(session, name) for name in drawn}
    chosen = session.document.patches if patches is None else tuple(patches)
    shown = [name for name in chosen if session.document.patch(name).surface in posed]
    lift = LIFT * max(mesh.bounding_box_diagonal for mesh in posed.values())
    meshes = [
        PictureMesh(
            mesh, (colors or {}).get(name, look_of(session, name)), 0.3 if name in set(see_through) else 1.0
        )
        for name, mesh in posed.items()
    ]
    starts = []
    for name in shown:
        patch = session.document.patch(name)
        mesh = posed[patch.surface]
        meshes.append(painted(session, name, mesh, lift, (heat or {}).get(name)))
        if axes:
            line = on(mesh, seen(session, name, session.geometry.axis(name).points), 1.5 * lift)
            meshes.append(PictureMesh(tube(line, 1.1 * lift), AXIS))
            starts.append(line[0])
    if focus is None:
        focus = np.concatenate([posed[name].points for name in frame or drawn])
    black = ((np.array(starts), (0.0, 0.0, 0.0)),) if starts else ()
    return Picture(
        tuple(meshes), black, camera_from=camera_from, up=up, caption=caption, focus=focus, lettering=LETTERING
    )


def seen(session: Session, patch: str, points: SurfacePoints) -> SurfacePoints:
    """Axis points of a patch on the mesh that is drawn, also where the contacts of its surface run on a proxy."""
    surface = session.document.patch(patch).surface
    has_proxy = session.document.surface(surface).proxy is not None
    return session.geometry.seen(surface, points) if has_proxy else points


def look_of(session: Session, surface: str) -> RGB:
    """The colour of a surface: by its name, else skin for what has a rig."""
    by_name = [color for name, color in LOOKS.items() if surface.startswith(name)]
    return by_name[0] if by_name else SKIN if surface in session.rigs else THING


def in_world(session: Session, surface: str) -> TriangleMesh:
    """The mesh of a surface in its pose, where it stands in the scene."""
    mesh, record = session.geometry.posed_mesh(surface), session.document.surface(surface)
    world = record.world_from_surface
    return mesh if np.array_equal(world, np.eye(4)) else mesh.with_points(transform_points(world, mesh.points))


def on(mesh: TriangleMesh, points: SurfacePoints, lift: float) -> FloatArray:
    """(n, 3) surface points, lifted off their surface."""
    return points.positions(mesh) + lift * points.normals(mesh)


def polyline(points: FloatArray) -> FloatArray:
    """(n - 1, 2, 3) the segments through points (n, 3)."""
    return np.stack([points[:-1], points[1:]], axis=1)


def painted(
    session: Session, patch: str, mesh: TriangleMesh, lift: float, heat: FloatArray | None = None
) -> PictureMesh:
    """A patch as paint on its surface: its points triangulated, a hair above."""
    record, points = session.document.patch(patch), session.geometry.points(patch)
    triangles = session.geometry.area(patch).triangles
    faces = triangles[:, ::-1] if record.mirrored else triangles
    return PictureMesh(TriangleMesh(on(mesh, points, lift), faces), record.color, vertex_colors=heat)


def tube(points: FloatArray, radius: float, sides: int = 8) -> TriangleMesh:
    """A tube of `radius` through points (n, 3), n >= 1, with its ends open; a line that is lit."""
    points = points[np.concatenate([[True], np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-3 * radius])]
    if len(points) < 2:
        points = np.concatenate([points, points + np.array([[0.0, radius, 0.0]])])
    along = np.gradient(points, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
    aside = np.cross(along, np.eye(3)[np.abs(along).sum(axis=0).argmin()])
    aside /= np.maximum(np.linalg.norm(aside, axis=1, keepdims=True), 1e-300)
    angle = 2.0 * np.pi * np.arange(sides)[None, :, None] / sides
    ring = np.cos(angle) * aside[:, None] + np.sin(angle) * np.cross(along, aside)[:, None]  # (n, sides, 3)
    row, column = np.arange(len(points) - 1)[:, None] * sides, np.arange(sides)[None, :]
    a, b = row + column, row + (column + 1) % sides
    faces = np.concatenate([np.stack([a, b, b + sides], -1), np.stack([a, b + sides, a + sides], -1)])
    return TriangleMesh((points[:, None] + radius * ring).reshape(-1, 3), faces.reshape(-1, 3))


def spokes(session: Session, patch: str, every: int = 1) -> FloatArray:
    """(k, 2, 3) segments of the geodesics from a patch's axis to every so manieth of its points."""
    document, mesh, axis = session.document, session.geometry.mesh_of(patch), session.geometry.axis(patch)
    coordinates = document.shape_of(patch).coordinates
    legs, angles, lengths = patch_chains(coordinates, document.surface_axis(patch))
    anchors = coordinates.anchors
    traced = trace_chains(
        mesh, axis.points[anchors], legs * axis.tangents[anchors], coordinates.chain_starts, angles, lengths,
        polyline=True,
    ).polylines  # fmt: skip
    assert traced is not None
    lift = 2.0 * LIFT * mesh.bounding_box_diagonal
    return np.concatenate([polyline(on(mesh, traced[k], lift)) for k in range(0, len(anchors), every)])


def edges(mesh: TriangleMesh) -> FloatArray:
    """(e, 2, 3) the edges of a mesh, to show how coarse it is."""
    pairs = np.unique(np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    return np.asarray((mesh.points + 0.5 * LIFT * mesh.bounding_box_diagonal * mesh.vertex_normals)[pairs])


def dots(mesh: TriangleMesh, points: SurfacePoints, color: RGB) -> tuple[FloatArray, RGB]:
    """Surface points as the dots of a picture."""
    return points.positions(mesh), color


def heat_of(ratio: FloatArray, octaves: float = 1.0) -> FloatArray:
    """(n, 3) colours of a ratio per point: yellow where it is 1, blue where it shrank, red where it grew."""
    amount = np.clip(np.log2(np.where(np.isfinite(ratio) & (ratio > 0.0), ratio, 1.0)) / octaves, -1.0, 1.0)[
        :, None
    ]
    even, grown, shrunk = np.array([0.95, 0.84, 0.35]), np.array([0.8, 0.07, 0.1]), np.array([0.1, 0.25, 0.8])
    return np.asarray(even + np.abs(amount) * (np.where(amount > 0.0, grown, shrunk) - even))


def rotation(axis: Any, degrees: float, translation: Any = (0.0, 0.0, 0.0)) -> FloatArray:
    """(4, 4) a turn about an axis through the origin, then a shift."""
    from scipy.spatial.transform import Rotation

    matrix = np.eye(4)
    direction = np.asarray(axis, float) / np.linalg.norm(axis)
    matrix[:3, :3] = Rotation.from_rotvec(np.radians(degrees) * direction).as_matrix()
    matrix[:3, 3] = translation
    return matrix


def paint_pad(
    session: Session, surface: str, patch: str, joint: str, *, along: float = 0.5, radius: float = 0.006
) -> None:
    """A stroke of one click on the palm side of a bone, with its axis along the bone, as artists paint pads.

    along: where on the bone, 0 to 1. radius: metres.
    """
    rig, skin = session.rigs[surface], Locator.of(session.geometry.mesh(surface))
    index = rig.joint_index(joint)
    child = int(np.flatnonzero(rig.parents == index)[0])
    head, tail = rig.rest_world[index, :3, 3], rig.rest_world[child, :3, 3]
    palmar = (rig.rest_world[index, :3, :3] @ rig.freedoms[index].frame)[:, 1]
    pad = skin.cast([head + along * (tail - head)], [palmar]).points
    ahead = 0.7 * radius * (tail - head) / np.linalg.norm(tail - head)
    axis = skin.closest(pad.positions(session.geometry.mesh(surface)) + np.array([-ahead, ahead])).points
    session.patches.brush("disk", patch, surface=surface, at=pad, radius=radius, spacing=0.17 * radius, axis=axis)


def deepest(session: Session, surface: str, solid: str) -> float:
    """How deep the skin of a surface in its pose is inside another that is closed, in metres; 0 where it is not."""
    return float(max(depth_inside(in_world(session, surface).points, in_world(session, solid)).max(), 0.0))
