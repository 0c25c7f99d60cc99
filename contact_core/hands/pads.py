"""Where a hand touches: round pads below the bones, on the side to which they close, and one in the palm."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.hands.anatomy import Anatomy, across, unit
from contact_core.hands.description import Digit, Pad, Palm
from contact_core.rig.rig import Rig

OF_DEPTH = 0.85  # a pad's radius, of how deep the bone lies there
OF_WIDTH = 0.32  # the palm's, of the width between the outer knuckles
AT_TIP, AT_MIDDLE, SIDE = 0.6, 0.5, 0.6  # where on the last bone, on others, and of a pad on the side

LEAST_AXIS = 0.5  # of a pad's radius: an axis that is shorter says no direction


def pads_of(anatomy: Anatomy, digits: tuple[Digit, ...], palm: Palm, hub: int, width: float) -> tuple[Pad, ...]:
    """Pads at each digit's end, at the middle of each longer finger, and in the palm where it is a plane."""
    pads = []
    for digit in digits:
        flexing = [k for k, bone in enumerate(digit.bones) if bone.flexes]
        chosen = flexing[-1:] + (flexing[-2:-1] if len(flexing) >= 3 and not digit.is_thumb else [])
        for k in reversed(chosen):
            pad = _below_bone(anatomy, digit, k)
            pads += [pad] if pad is not None else []
    if palm.is_plane:
        radius = OF_WIDTH * width
        origin = palm.point - 1e-3 * width * palm.normal
        pad = _pad(anatomy.rig, "palm", "palm", hub, origin, palm.normal, palm.fingers, radius)
        pads += [pad] if pad is not None else []
    return tuple(pads)


def side_pad(rig: Rig, digit: Digit, out: FloatArray) -> Pad | None:
    """A pad on a finger's side: on its last bone but one, towards `out` (3,) in rig space. It is what a thing is
    held against by the thumb, as a key is. None for a finger with one bone that bends, or without skin there."""
    flexing = [k for k, bone in enumerate(digit.bones) if bone.flexes]
    if len(flexing) < 2:
        return None
    bone, after = digit.bones[flexing[-2]], digit.bones[flexing[-1]]
    here, end = (rig.rest_world[b.joint, :3, 3] for b in (bone, after))
    along = unit(end - here)
    origin = here + SIDE * (end - here)
    return _pad(rig, f"{digit.role} side", digit.role, bone.joint, origin, unit(across(out, along)), along, None)


def _below_bone(anatomy: Anatomy, digit: Digit, place: int) -> Pad | None:
    bone = digit.bones[place]
    last = place == len(digit.bones) - 1
    here = anatomy.position[bone.joint]
    end = digit.tip if last else anatomy.position[digit.bones[place + 1].joint]
    own = anatomy.rig.rest_world[bone.joint, :3, :3] @ bone.frame
    origin = here + (AT_TIP if last else AT_MIDDLE) * (end - here)
    along = unit(end - here)
    name = f"{digit.role} {'tip' if last else bone.segment}"
    return _pad(anatomy.rig, name, digit.role, bone.joint, origin, unit(across(own[:, 1], along)), along, None)


def _pad(
    rig: Rig, name: str, role: str, joint: int, origin: FloatArray, out: FloatArray, along: FloatArray,
    radius: float | None,
) -> Pad | None:  # fmt: skip
    """The skin that a ray from within meets, and its axis; None where there is no skin that way."""
    mesh = rig.surface
    locator = Locator.of(mesh)
    hit = locator.cast(origin[None], out[None])
    if not hit.found[0]:
        return None
    centre = hit.points
    normal = centre.normals(mesh)[0]
    size = OF_DEPTH * float(hit.distance[0]) if radius is None else radius
    heading = unit(across(along, normal))
    at = centre.positions(mesh)[0]
    ends = np.array([at - size * heading, at + size * heading])
    axis = locator.closest(ends, facing=np.tile(-normal, (2, 1)), facing_limit=-0.1)
    if not axis.found.all() or size <= 0:
        return None
    points, parts = axis.points, _parts(mesh)
    if (parts[points.faces] != parts[centre.faces]).any():
        own = np.flatnonzero(parts == parts[centre.faces])
        closest = Locator.of(TriangleMesh(mesh.points, mesh.faces[own])).closest(ends).points
        points = SurfacePoints(own[closest.faces], closest.barycentric)
        if np.linalg.norm(np.diff(points.positions(mesh), axis=0)) < LEAST_AXIS * size:
            return None
    return Pad(name, role, joint, centre, normal, points, size)


def _parts(mesh: TriangleMesh) -> IntArray:
    """(m,) which connected part each face is of; found once for a mesh. A robot's links are not connected, and a
    place beside one link may be nearest to another."""
    if _parts not in mesh.kept:
        edges = mesh.faces[:, [0, 1, 1, 2]].reshape(-1, 2)
        size = len(mesh.points)
        graph = coo_array((np.ones(len(edges), np.int8), (edges[:, 0], edges[:, 1])), shape=(size, size))
        mesh.kept[_parts] = connected_components(graph, directed=False)[1][mesh.faces[:, 0]]
    found: IntArray = mesh.kept[_parts]
    return found


def palm_point(anatomy: Anatomy, inside: FloatArray, normal: FloatArray) -> FloatArray:
    """(3,) the skin above a point within the palm; the point itself where no skin lies that way."""
    hit = Locator.of(anatomy.rig.surface).cast(inside[None], normal[None])
    return np.asarray(inside + float(hit.distance[0]) * normal if hit.found[0] else inside)
