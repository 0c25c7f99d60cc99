"""Proposing the contacts of an animation: patches where skin touches objects, paired, with spans while it does."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.contact.point_sets import connected_parts
from contact_core.document.document import ContactDocument
from contact_core.document.timeline import Span
from contact_core.edit.command import Macro
from contact_core.edit.commands import SetSpans
from contact_core.edit.derived import Derived
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import direction_to_heading
from contact_core.motion.detection import ContactSpan, DetectionOptions, detect_contacts
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.proposals.draft import Draft
from contact_core.proposals.proposal import Ghost
from contact_core.rig.chart import pose_on
from contact_core.rig.rig import Pose, Rig, forward_kinematics, skin
from contact_core.scene.problem import world_from_surface

EVEN = 0.005  # of the skin's extent: how much farther from the object than the nearest a vertex still touches
EASE = 0.2  # seconds over which a contact that was found fades in and out


@dataclass(frozen=True, eq=False)
class FoundContact:
    """A contact that an animation has. patch, target: the patches that were painted for it. pair: of both."""

    pair: str
    patch: str
    target: str
    span: ContactSpan


@dataclass(frozen=True, eq=False)
class Detection(Ghost):
    """Contacts that are proposed: accepted, they are patches, pairs and spans. found: in the order they come on."""

    found: tuple[FoundContact, ...] = field(default=(), kw_only=True)


def detect(
    timed: ContactDocument,
    frame: float,
    frames: Sequence[float],
    draft_at: Callable[[float], Draft],
    derived: Derived,
    rigs: Mapping[str, Rig],
    revision: int,
    options: DetectionOptions | None = None,
    progress: Progress = NO_PROGRESS,
) -> Detection:
    """The contacts between every rig and every object without one, as both move in the scene at frames.

    timed: the document that accepting changes. frame: which one a ghost shows. draft_at: the document at a frame.
    Raises InvalidInput without a rig or an object, Cancelled.
    """
    frames = [float(each) for each in frames]
    seen = [draft_at(each).document for each in frames]
    hands = [name for name in timed.surfaces if name in rigs]
    things = [name for name in timed.surfaces if name not in rigs and name in derived.meshes(timed)]
    if not hands or not things or not frames:
        raise InvalidInput("to find contacts, a rig, an object beside it, and frames are needed.")
    made = _Made(timed, derived, rigs)
    pairs = list(itertools.product(hands, things))
    for number, (hand, thing) in enumerate(pairs):
        rig, part = rigs[hand], progress.part(number / len(pairs), (number + 1) / len(pairs), f"{hand}, {thing}")
        poses = [document.poses.get(hand) or Pose.rest(rig) for document in seen]
        placed = np.array([_into(document, hand, thing) for document in seen])
        spans = detect_contacts(
            rig, frames, poses, derived.mesh(timed, thing), placed,
            rate=timed.timeline.frames_per_second, options=options, progress=part,
        )  # fmt: skip
        for span in spans:
            row = frames.index(span.closest)
            made.add(hand, thing, span, _posed(rig, poses[row], placed[row]))
    return made.proposal(frame, revision)


class _Made:
    """What accepting does, as it comes together."""

    def __init__(self, timed: ContactDocument, derived: Derived, rigs: Mapping[str, Rig]) -> None:
        self.draft = Draft(timed, derived, rigs)
        self.start = timed
        self.found: list[FoundContact] = []
        self._painted: dict[tuple[str, str], tuple[str, int, int]] = {}  # patch, its centre and a vertex beside it

    def add(self, hand: str, thing: str, span: ContactSpan, posed: FloatArray) -> None:
        """A contact. posed: (n, 3) the skin in the object's space where it is closest."""
        rig = self.draft.rigs[hand]
        if (hand, span.joint) not in self._painted:
            self._painted[hand, span.joint] = self._paint(hand, rig.surface, span, thing, posed)
        patch, centre, beside = self._painted[hand, span.joint]
        way = posed[beside] - posed[centre]
        mesh = self.draft.geometry.mesh(thing)
        at = int(np.argmin(np.linalg.norm(span.object_points.positions(mesh) - posed[centre], axis=1)))
        name = self.draft.document.free_name(f"{patch} on {thing}")
        self.draft.patches.transfer(patch, thing, span.object_points[[at]], direction=way, name=name)
        pair = self.draft.pairs.add(patch, name)
        ease = EASE * self.start.timeline.frames_per_second
        self.draft.do(SetSpans(pair, (Span(span.on, span.off, ease, ease),)))
        self.found.append(FoundContact(pair, patch, name, span))

    def proposal(self, frame: float, revision: int) -> Detection:
        """All of it as one step."""
        command = Macro("Detect contacts", self.draft.commands)
        ghost = self.draft.document.at(frame)
        order = sorted(self.found, key=lambda each: each.span.on)
        return Detection(command, ghost, revision, found=tuple(order))

    def _touching(self, mesh: TriangleMesh, span: ContactSpan, thing: str, posed: FloatArray) -> IntArray:
        """(k,) the vertices that are about as near as the nearest; those farther off only come near by the bending
        of the skin, and are no part of what holds."""
        places = span.object_points.positions(self.draft.geometry.mesh(thing))
        away = np.linalg.norm(posed[span.vertices] - places, axis=1)
        limit = float(away.min()) + EVEN * float(np.ptp(posed, axis=0).max())
        return span.vertices[away <= limit]

    def _paint(
        self, hand: str, mesh: TriangleMesh, span: ContactSpan, thing: str, posed: FloatArray
    ) -> tuple[str, int, int]:
        """A patch of the vertices that touch and hang together."""
        parts = connected_parts(mesh, SurfacePoints.at_vertices(mesh, self._touching(mesh, span, thing, posed)))
        points = max(parts, key=len)
        places = points.positions(mesh)
        near = np.argsort(np.linalg.norm(places - places.mean(axis=0), axis=1), kind="stable")
        centre = points[near[:1]]
        vertices = [int(np.argmin(np.linalg.norm(mesh.points - place, axis=1))) for place in places[near[[0, -1]]]]
        away = mesh.points[vertices[1]] - mesh.points[vertices[0]]
        if len(points) == 1 or not away.any():  # any direction will do
            corners = mesh.faces[int(centre.faces[0])]
            vertices[1] = int(next(v for v in corners if int(v) != vertices[0]))
            away = mesh.points[vertices[1]] - mesh.points[vertices[0]]
        heading = complex(direction_to_heading(mesh, centre, away[None])[0])
        name = self.draft.document.free_name(span.joint)
        self.draft.patches.paint(name, points, surface=hand, axis=centre, heading=heading)
        return name, vertices[0], vertices[1]


def _into(document: ContactDocument, hand: str, thing: str) -> FloatArray:
    """(4, 4) from the rig's space into that of an object's surface."""
    return np.asarray(np.linalg.inv(world_from_surface(document, thing)) @ world_from_surface(document, hand))


def _posed(rig: Rig, pose: Pose, placed: FloatArray) -> FloatArray:
    """(n, 3) the skin in a pose, in the object's space."""
    points = skin(rig, forward_kinematics(rig.parents, pose_on(rig, pose)))
    return np.asarray(points @ placed[:3, :3].T + placed[:3, 3])
