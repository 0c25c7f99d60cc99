"""Tools, each broken in one way. `test_tool_mutants` judges them."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

from contact_builtins.tools.move import Move, Moving
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.interaction.desk import Desk
from contact_core.interaction.events import Pointer
from contact_core.interaction.overlay import AxisLine, Overlay
from contact_core.interaction.tool import Gesture, Tool
from contact_core.settings import setting
from contact_core.testing.mutants import Mutant
from contact_core.testing.tool_contract import ToolContract


class NoSentence(Move):
    """Says nothing of itself."""

    summary: ClassVar[str] = "moves"


class TakesUndo(Move):
    """Wants a key that the core has."""

    key: ClassVar[str] = "Tab"


@dataclass(frozen=True)
class NoHelp(Move):
    """Has a setting without a word about it."""

    slow: bool = setting(False, help="slow")


class SelectsWhileHovering(Move):
    """Takes what it passes over."""

    def hover(self, desk: Desk, pointer: Pointer) -> Overlay:
        hit = desk.pick(pointer)
        patch = None if hit is None else desk.patch_at(hit)
        desk.selection = replace(desk.selection, patches=() if patch is None else (patch,))
        return super().hover(desk, pointer)


class DrawsNowhere(Move):
    """Draws a line to infinity."""

    def hover(self, desk: Desk, pointer: Pointer) -> Overlay:
        return Overlay(axes=(AxisLine(np.full((2, 3), np.nan)),))


class TakesAll(Move):
    """Lets no press through to the camera."""

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        return super().press(desk, pointer) or Gesture()


class CommitsWhileMoving(Move):
    """Edits the session beside the stroke."""

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        gesture = super().press(desk, pointer)
        if gesture is not None:
            desk.session.patches.recolor("pad", (0.1, 0.2, 0.3))
        return gesture


class KeepsWhatWasSeen(Moving):
    """Starts each move from where the last one left the patch."""

    def __init__(self, desk: Desk, pointer: Pointer, patch: str, grabbed: SurfacePoints | None) -> None:
        super().__init__(desk, pointer, patch, grabbed)
        self.turned = 0.0

    def move(self, pointer: Pointer) -> None:
        self.turned += 0.1
        self.desk.stroke.patches.rotate(self.patch, self.turned)


class Accumulates(Move):
    """A drag that comes back leaves something."""

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        gesture = super().press(desk, pointer)
        return gesture and KeepsWhatWasSeen(desk, pointer, gesture.patch, None)  # type: ignore[attr-defined]


class Fickle(Move):
    """Does something else every time."""

    counts = itertools.count(1)

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        gesture = super().press(desk, pointer)
        if isinstance(gesture, Moving):
            kept, factor = gesture, next(self.counts)
            return _Scaled(kept, 1.0 + 0.01 * factor)
        return gesture


class _Scaled(Gesture):
    def __init__(self, moving: Moving, factor: float) -> None:
        self.moving, self.factor = moving, factor

    def move(self, pointer: Pointer) -> None:
        if (pointer.x, pointer.y) == (self.moving.start.x, self.moving.start.y):
            self.moving.desk.preview_nothing()
        else:
            self.moving.desk.stroke.patches.scale(self.moving.patch, along=self.factor)

    def release(self, pointer: Pointer) -> None:
        self.move(pointer)


class Idle(Move):
    """Takes presses and does nothing."""

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        return None if super().press(desk, pointer) is None else Gesture()


class _Fragile(Moving):
    def drag(self, pointer: Pointer) -> None:
        if abs(pointer.x) > 1e6:
            raise ZeroDivisionError("the pointer left the screen")
        super().drag(pointer)


class Fragile(Move):
    """Falls over where the pointer leaves the screen."""

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        gesture = super().press(desk, pointer)
        return gesture and _Fragile(desk, pointer, gesture.patch, None)  # type: ignore[attr-defined]


class ReachesThrough(Move):
    """Takes patches of surfaces that are not worked on."""

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        for name in desk.scene.surfaces:
            hit = desk.pick(pointer, (name,))
            if hit is not None:
                patch = desk.patch_at(hit, reach=10.0)
                return None if patch is None else Moving(desk, pointer, patch, hit.point)
        return None


class TestNoSentence(Mutant, ToolContract):
    breaks = "U01"

    @pytest.fixture
    def tool(self) -> Tool:
        return NoSentence()


class TestTakesUndo(Mutant, ToolContract):
    breaks = "U01"

    @pytest.fixture
    def tool(self) -> Tool:
        return TakesUndo()


class TestNoHelp(Mutant, ToolContract):
    breaks = "U02"
    # The manager refuses it, so nothing else can be tried.
    consequences = tuple(f"U{number:02d}" for number in range(3, 12))

    @pytest.fixture
    def tool(self) -> Tool:
        return NoHelp()


class TestSelectsWhileHovering(Mutant, ToolContract):
    breaks = "U03"

    @pytest.fixture
    def tool(self) -> Tool:
        return SelectsWhileHovering()


class TestDrawsNowhere(Mutant, ToolContract):
    breaks = "U03"

    @pytest.fixture
    def tool(self) -> Tool:
        return DrawsNowhere()


class TestTakesAll(Mutant, ToolContract):
    breaks = "U04"

    @pytest.fixture
    def tool(self) -> Tool:
        return TakesAll()


class TestCommitsWhileMoving(Mutant, ToolContract):
    breaks = "U05"
    consequences = ("U06", "U09")

    @pytest.fixture
    def tool(self) -> Tool:
        return CommitsWhileMoving()


class TestFickle(Mutant, ToolContract):
    breaks = "U07"

    @pytest.fixture
    def tool(self) -> Tool:
        return Fickle()


class TestIdle(Mutant, ToolContract):
    breaks = "U08"

    @pytest.fixture
    def tool(self) -> Tool:
        return Idle()


class TestAccumulates(Mutant, ToolContract):
    breaks = "U09"

    @pytest.fixture
    def tool(self) -> Tool:
        return Accumulates()


class TestFragile(Mutant, ToolContract):
    breaks = "U10"

    @pytest.fixture
    def tool(self) -> Tool:
        return Fragile()


class TestReachesThrough(Mutant, ToolContract):
    breaks = "U11"

    @pytest.fixture
    def tool(self) -> Tool:
        return ReachesThrough()
