"""Pose a hand by its skin: the point that is grabbed is pinned softly to the pointer; the solver does the rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from contact_builtins.terms.aims import Pin, PinTerm
from contact_builtins.tools.drag import Drag
from contact_core.interaction.desk import Desk
from contact_core.interaction.events import Pointer
from contact_core.interaction.overlay import ACCENT, NOTHING, AxisLine, Handle, Overlay
from contact_core.interaction.seen import Hit
from contact_core.interaction.tool import Gesture
from contact_core.interaction.view import on_plane
from contact_core.rig.rig import Pose, Rig, forward_kinematics
from contact_core.settings import HasSettings, setting


@dataclass(frozen=True)
class DragJoint(HasSettings):
    """The contacts pull on, the limits hold, and the prior keeps what the pin does not ask for."""

    name: ClassVar[str] = "joint"
    summary: ClassVar[str] = "drag a fingertip or a joint; the hand follows"
    key: ClassVar[str] = "J"
    hint: ClassVar[str] = "drag the skin of a hand; Shift keeps the wrist where it is"
    weight: float = setting(30.0, above=0.0, help="how strongly the pin pulls beside the contacts")

    def hover(self, desk: Desk, pointer: Pointer) -> Overlay:
        found = _grabbed(desk, pointer)
        if found is None:
            return NOTHING
        return Overlay(handles=(Handle("joint", "joint", found[0].position, color=ACCENT),))

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        found = _grabbed(desk, pointer)
        return None if found is None else DraggingJoint(self, desk, pointer, *found)


class DraggingJoint(Drag):
    """hit: where the skin was grabbed."""

    def __init__(self, tool: DragJoint, desk: Desk, pointer: Pointer, hit: Hit, rig: Rig) -> None:
        super().__init__(desk, pointer)
        self.tool, self.surface, self.held = tool, hit.surface, hit.position
        corners = rig.faces[hit.point.faces[0]]
        shares = np.bincount(
            rig.skin_joints[corners].ravel(),
            weights=(hit.point.barycentric[0][:, None] * rig.skin_weights[corners]).ravel(),
        )
        joint = int(shares.argmax())
        self.joint, self.target = rig.joints[joint], hit.position
        self.root = tuple(name for name, parent in zip(rig.joints, rig.parents, strict=True) if parent < 0)
        seen = self.scene.surfaces[hit.surface]
        world = seen.world @ _world_of(rig, seen.pose)[joint]
        x, y, z = (np.linalg.inv(world) @ np.append(hit.position, 1.0))[:3].tolist()
        self.point = (x, y, z)
        desk.stroke  # noqa: B018  (refuses here where nothing can be edited)

    def drag(self, pointer: Pointer) -> None:
        self.target = on_plane(self.desk.view, pointer.pixel, self.held)
        x, y, z = self.target.tolist()
        pin = Pin(self.surface, self.joint, (x, y, z), self.point)
        self.desk.held = self.root if pointer.holds("shift") else ()
        self.desk.pins = (PinTerm((pin,), weight=self.tool.weight),)

    def move(self, pointer: Pointer) -> None:
        if (pointer.x, pointer.y) == (self.start.x, self.start.y):
            self.desk.pins = ()
        super().move(pointer)

    def overlay(self) -> Overlay:
        line = AxisLine(np.stack([self.held, self.target]), ACCENT)
        return Overlay(axes=(line,), handles=(Handle("joint", "joint", self.target, color=ACCENT),))

    def hint(self) -> str:
        return f"{self.joint} of {self.surface}"


def _grabbed(desk: Desk, pointer: Pointer) -> tuple[Hit, Rig] | None:
    """Where the skin of a hand is under the pointer, through what is no hand."""
    hands = [name for name in desk.scene.surfaces if name in desk.session.rigs]
    chosen = desk.selection.surface
    hit = desk.pick(pointer, [chosen] if chosen in hands else hands)
    return None if hit is None else (hit, desk.session.rigs[hit.surface])


def _world_of(rig: Rig, pose: Pose | None) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """(j, 4, 4) rig-space transforms of the joints in a pose."""
    local = rig.rest_local.copy()
    for name, matrix in () if pose is None else zip(pose.joints, pose.local, strict=True):
        if name in rig.joints:
            local[rig.joint_index(name)] = matrix
    return forward_kinematics(rig.parents, local)
