"""The pads of a grasp: what an artist painted on the hand, else what the hand's description proposes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tracing import trace_geodesic
from contact_core.grasping.features import features_of
from contact_core.hands.description import Pad
from contact_core.proposals.draft import Draft

if TYPE_CHECKING:
    from contact_core.geometry.mesh import TriangleMesh
    from contact_core.grasping.suggest import GraspScene

POINTS, PALM_POINTS = 40, 100
PLACES, NARROWER = 48, 30  # of the object that are looked at, and the percentile of how wide it is there
LARGEST, LEAST = 0.4, 0.4  # a pad's radius as a share of that, and of what the hand's description says
_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


def painted_pads(scene: GraspScene, at: FloatArray | None = None) -> tuple[Draft, tuple[str, ...], bool]:
    """A draft with pads on the hand and none of its contacts with the object, their names, and whether they were
    only proposed: those may rightly touch nothing. at: (3,) the place that is to be held."""
    draft = Draft(scene.document, scene.derived, scene.rigs, scene.evaluated)
    for pair in scene.document.pairs.values():
        ends = [scene.document.patch(end).surface for end in (pair.manipulator, pair.object)]
        if ends == [scene.hand_name, scene.object_name]:
            draft.pairs.remove(pair.name)
            draft.patches.remove(pair.object)
    painted = tuple(n for n, patch in draft.document.patches.items() if patch.surface == scene.hand_name)
    own = {pad.name for pad in scene.hand.description.pads}
    if painted:
        return draft, painted, set(painted) <= own
    mesh = draft.geometry.mesh(scene.hand_name)
    largest = LARGEST * extent(scene, at)
    for pad in scene.hand.description.pads:
        draft.patches.paint(pad.name, disk(mesh, pad, largest), surface=scene.hand_name, axis=pad.axis)
    return draft, tuple(pad.name for pad in scene.hand.description.pads), True


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
