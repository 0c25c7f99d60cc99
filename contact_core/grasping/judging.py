"""What a session's grasp is worth: the verdict on its first hand and its first thing."""

from __future__ import annotations

from contact_core.edit.document_geometry import DocumentGeometry
from contact_core.grasping.metrics import measure
from contact_core.grasping.posed_scene import posed_scene
from contact_core.grasping.verdict import Verdict, judge
from contact_core.scene.surfaces import BoundEditor
from contact_core.solve.body import manipulator_length


def verdict(session: BoundEditor) -> Verdict:
    """By the usual limits, on the hand as the document, or the scene behind it, poses it."""
    hand, thing = sorted(session.document.surfaces, key=lambda name: name not in session.rigs)[:2]
    document, rig = session.binding.read(session.document), session.rigs[hand]
    geometry = DocumentGeometry(lambda: document, session.derived, session.rigs)
    return judge(measure(posed_scene(geometry, rig, hand, thing, manipulator_length(rig))), {}, {})
