"""The end of a scene: another file is opened, a new one begun, or this one reverted."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy


class SceneEnd:
    """Calls listeners before Blender lets go of what is open. It holds functions, never Blender objects."""

    def __init__(self) -> None:
        self._listeners: list[Callable[[], None]] = []

    def on_close(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call `listener` when the file goes, while it can still be read; the result stops that."""
        if not self._listeners:
            bpy.app.handlers.load_pre.append(self._before)
        self._listeners.append(listener)

        def stop() -> None:
            if listener in self._listeners:
                self._listeners.remove(listener)
                if not self._listeners and self._before in bpy.app.handlers.load_pre:
                    bpy.app.handlers.load_pre.remove(self._before)

        return stop

    def closed(self) -> None:
        """Tell the listeners that the scene is gone."""
        for listener in tuple(self._listeners):
            listener()

    @bpy.app.handlers.persistent  # type: ignore[untyped-decorator]  # bpy ships no types
    def _before(self, *_: Any) -> None:
        self.closed()
