"""Blender's undo, in steps: it is the authority for the scene, and the core's history follows it by revision.

Measured on 4.2 to 5.2: pushing, undoing and redoing work without a window; nothing can be undone before a first
push; operators called from Python push no step; in a mesh's Edit Mode, in Particle Edit and (before 5.2) in Texture
Paint a step holds what is being edited and nothing else.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any

import bpy

from contact_core.errors import InvalidInput

WHOLE_SCENE = frozenset(("OBJECT", "POSE", "SCULPT", "PAINT_WEIGHT", "PAINT_VERTEX"))  # what a step holds there


class UndoBridge:
    """Steps of one host. Holds functions and numbers, never Blender objects."""

    def __init__(self) -> None:
        self._depth = 0
        self._undo_of_writes: list[Callable[[], None]] = []
        self._listeners: list[Callable[[], None]] = []
        self._failure: Exception | None = None
        self._based_on: int | None = None
        self._left_to_operator = False

    @contextlib.contextmanager
    def left_to_operator(self) -> Iterator[None]:
        """Inside, steps push nothing: Blender pushes one itself when the operator that runs has ended, by its flag
        UNDO. Then the panel of the last operator (F9) can take that step back and run it again."""
        before, self._left_to_operator = self._left_to_operator, True
        try:
            yield
        finally:
            self._left_to_operator = before

    @contextlib.contextmanager
    def step(self, label: str) -> Iterator[None]:
        """All that is written inside becomes one step of Blender's undo; steps inside a step join it."""
        if self._depth == 0:
            _refuse_partial_modes(label)
            self._ensure_base()
        self._depth += 1
        already = len(self._undo_of_writes)
        try:
            yield
        except BaseException:
            for take_back in reversed(self._undo_of_writes[already:]):
                take_back()
            del self._undo_of_writes[already:]
            raise
        finally:
            self._depth -= 1
            if self._depth == 0:
                wrote, self._undo_of_writes = bool(self._undo_of_writes), []
                if wrote and not self._left_to_operator:
                    bpy.ops.ed.undo_push(message=label)

    def wrote(self, take_back: Callable[[], None]) -> None:
        """Tell of a write inside a step, and how to take it back should the step fail."""
        self._undo_of_writes.append(take_back)

    def undo(self) -> bool:
        return self._run(bpy.ops.ed.undo)

    def redo(self) -> bool:
        return self._run(bpy.ops.ed.redo)

    def on_undo(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call `listener` after every undo and redo of Blender, by the user's keys as well; the result stops it."""
        if not self._listeners:
            for handlers in _handlers():
                handlers.append(self._after)
        self._listeners.append(listener)

        def stop() -> None:
            if listener in self._listeners:
                self._listeners.remove(listener)
                if not self._listeners:
                    for handlers in _handlers():
                        if self._after in handlers:
                            handlers.remove(self._after)

        return stop

    def _run(self, operator: Any) -> bool:
        if self._depth:
            raise InvalidInput("undo and redo wait until the step that is under way has ended.")
        if not operator.poll():
            return False
        self._failure = None
        operator()
        if self._failure is not None:  # Blender only prints what a handler raises
            raise self._failure
        return True

    def _ensure_base(self) -> None:
        """Blender can go back only to a step: without a window, a file that was just opened has none."""
        scene = bpy.context.scene
        if self._based_on == scene.session_uid or bpy.ops.ed.undo.poll() or bpy.ops.ed.redo.poll():
            return
        if bpy.app.background:
            bpy.ops.ed.undo_push(message="Original")
        self._based_on = scene.session_uid

    @bpy.app.handlers.persistent  # type: ignore[untyped-decorator]  # bpy ships no types
    def _after(self, *_: Any) -> None:
        for listener in tuple(self._listeners):
            try:
                listener()
            except Exception as error:
                self._failure = self._failure or error
                raise


def _handlers() -> tuple[Any, Any]:
    return bpy.app.handlers.undo_post, bpy.app.handlers.redo_post


def _refuse_partial_modes(label: str) -> None:
    mode = str(bpy.context.mode)
    if mode in WHOLE_SCENE:
        return
    name = "Edit Mode" if mode.startswith("EDIT") else mode.replace("_", " ").title()
    raise InvalidInput(
        f"{label!r} waits until you leave {name} ({mode.lower()}): Blender's undo there remembers only the"
        " data being edited, so the step could not be undone."
    )
