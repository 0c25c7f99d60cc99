"""The pads of a grasp: what an artist painted on the hand, else what the hand's description proposes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tracing import trace_geodesic
from contact_core.hands.description import Pad
from contact_core.proposals.draft import RecordingDraft

if TYPE_CHECKING:
    from contact_core.geometry.mesh import TriangleMesh
    from contact_core.grasping.suggest import GraspScene

POINTS, PALM_POINTS = 40, 100
_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


def painted_pads(scene: GraspScene) -> tuple[RecordingDraft, tuple[str, ...], bool]:
    """A draft with pads on the hand and none of its contacts with the object, their names, and whether they were
    only proposed: those may rightly touch nothing."""
    draft = RecordingDraft(scene.document, scene.derived, scene.rigs, scene.evaluated)
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
    for pad in scene.hand.description.pads:
        draft.patches.paint(pad.name, disk(mesh, pad), surface=scene.hand_name, axis=pad.axis)
    return draft, tuple(pad.name for pad in scene.hand.description.pads), True


def disk(mesh: TriangleMesh, pad: Pad) -> SurfacePoints:
    """The points of a pad: a sunflower laid on the skin round its middle, equal areas to all."""
    count = PALM_POINTS if pad.role == "palm" else POINTS
    place = np.arange(count)
    spokes = pad.radius * np.sqrt(place / (count - 1)) * np.exp(1j * _GOLDEN_ANGLE * place)
    centres = SurfacePoints(np.repeat(pad.centre.faces, count), np.repeat(pad.centre.barycentric, count, axis=0))
    return trace_geodesic(mesh, centres, spokes).points
