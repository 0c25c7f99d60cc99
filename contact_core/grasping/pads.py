"""The pads of a grasp: what an artist painted on the hand, else what the hand's description proposes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.errors import Unreached
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import direction_to_heading
from contact_core.geometry.tracing import trace_geodesic
from contact_core.grasping.features import features_of
from contact_core.hands.description import Pad
from contact_core.proposals.draft import Draft

if TYPE_CHECKING:
    from contact_core.geometry.mesh import TriangleMesh
    from contact_core.grasping.scene import GraspScene

POINTS, PALM_POINTS = 40, 100
PLACES, NARROWER = 48, 30  # of the object that are looked at, and the percentile of how wide it is there
LARGEST, LEAST = 0.4, 0.4  # a pad's radius as a share of that, and of what the hand's description says
TINY, SPANNED = 0.04, 0.62  # hand lengths that are too small, too thick
THINNEST = 5  # the percentile of the thickness that is told
_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


def painted_pads(
    scene: GraspScene, at: FloatArray | None = None, sideways: bool = False
) -> tuple[Draft, tuple[str, ...], bool]:
    """A draft with pads on the hand and none of its contacts with the object, their names, and whether they were
    only proposed: those may rightly touch nothing. at: (3,) the place that is to be held. sideways: with one on the
    side of the first finger."""
    draft = Draft(scene.document, scene.derived, scene.rigs, scene.evaluated)
    for pair in scene.document.pairs.values():
        ends = [scene.document.patch(end).surface for end in (pair.manipulator, pair.object)]
        if ends == [scene.hand_name, scene.object_name]:
            draft.pairs.remove(pair.name)
            draft.patches.remove(pair.object)
    painted = tuple(n for n, patch in draft.document.patches.items() if patch.surface == scene.hand_name)
    pads, beside = scene.hand.description.pads, scene.hand.side_pad
    pads = (*pads, beside) if sideways and beside is not None else pads
    own = {pad.name for pad in pads}
    if painted:
        return draft, painted, set(painted) <= own
    mesh = draft.geometry.mesh(scene.hand_name)
    largest = LARGEST * extent(scene, at)
    for pad in pads:
        points = disk(mesh, pad, largest)
        try:
            draft.patches.paint(pad.name, points, surface=scene.hand_name, axis=pad.axis)
        except Unreached:  # a robot's links are shells of their own, and the axis ends on the next one
            draft.patches.paint(pad.name, points, surface=scene.hand_name, axis=axis_within(mesh, pad))
    return draft, tuple(pad.name for pad in pads), True


def extent(scene: GraspScene, at: FloatArray | None) -> float:
    """How wide the narrower parts of the object are: what hangs over their edges touches nothing."""
    found = features_of(scene.mesh, scene.hand.length, PLACES, 0, at)
    wide = np.maximum(found.thickness, found.width)
    return float(np.percentile(np.minimum(wide, scene.hand.length), NARROWER))


def disk(mesh: TriangleMesh, pad: Pad, largest: float) -> SurfacePoints:
    """The points of a pad: a sunflower laid on the skin round its middle, equal areas to all, no larger than so."""
    count = PALM_POINTS if pad.role == "palm" else POINTS
    place = np.arange(count)
    radius = max(min(pad.radius, largest), LEAST * pad.radius)
    spokes = radius * np.sqrt(place / (count - 1)) * np.exp(1j * _GOLDEN_ANGLE * place)
    centres = SurfacePoints(np.repeat(pad.centre.faces, count), np.repeat(pad.centre.barycentric, count, axis=0))
    return trace_geodesic(mesh, centres, spokes).points


def axis_within(mesh: TriangleMesh, pad: Pad) -> SurfacePoints:
    """A pad's axis on the shell on which its middle lies: as far as that goes, both ways."""
    centres = SurfacePoints(np.repeat(pad.centre.faces, 2), np.repeat(pad.centre.barycentric, 2, axis=0))
    ends = pad.axis.positions(mesh)
    heading = direction_to_heading(mesh, pad.centre, (ends[1] - ends[0])[None])[0]
    traced = trace_geodesic(mesh, centres, pad.radius * heading * np.array([-1.0, 1.0]))
    return traced.points


def remark_on_size(scene: GraspScene) -> str:
    """A sentence on why a hand may find no good grasp: an object too large, too small, or in other units."""
    length, sides = scene.hand.length, np.ptp(scene.mesh.points[np.unique(scene.mesh.faces)], axis=0)
    largest = float(sides.max()) / length
    if largest < TINY:
        return f"The object is {100 * largest:.2g} % of the hand's length; is its scale right?"
    found = features_of(scene.mesh, length, PLACES, 0)
    thinnest = float(np.percentile(np.minimum(found.thickness, found.width), THINNEST)) / length
    if thinnest > SPANNED:
        known = np.isfinite(thinnest)
        thick = f"its thinnest parts are {thinnest:.2g} hand lengths thick" if known else "it is open"
        return f"The object is {largest:.2g} hand lengths large and {thick}; is its scale right?"
    return f"The object is {largest:.2g} hand lengths large."
