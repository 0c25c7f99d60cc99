"""Undo of the layer that we own: its whole content before and after each step.

`TransferContent` shares the arrays of both layers and copies only what differs (0.3 ms for 4 MB of text), and it
brings back removed prims too. Prim handles die with it, so nothing here or above keeps one: only paths.
Edits that somebody else makes in our layer are noticed and become steps of their own.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

from pxr import Sdf, Tf

from contact_core.errors import InvalidInput

KEPT_STEPS = 256


class LayerUndo:
    """The undo stack of one layer."""

    def __init__(self, layer: Sdf.Layer) -> None:
        self._layer = layer
        self._states = [("open", _copy(layer))]  # the layer after each step
        self._at = 0
        self._depth = 0
        self._touched = False
        self._listeners: list[Callable[[], None]] = []
        # USD holds the bound method weakly, so a host that nobody holds ends at once, and its layers with it.
        self._key = Tf.Notice.Register(Sdf.Notice.LayersDidChangeSentPerLayer, self._hear, layer)

    @contextlib.contextmanager
    def step(self, label: str) -> Iterator[None]:
        """All changes inside are one step; after an exception the layer is as it was."""
        if self._depth == 0:
            self._keep_foreign()
        before = _copy(self._layer)
        self._depth += 1
        try:
            yield
        except BaseException:
            self._layer.TransferContent(before)
            raise
        finally:
            self._depth -= 1
            if self._depth == 0:
                touched, self._touched = self._touched, False
        if self._depth == 0 and touched:
            self._push(label)

    def go(self, by: int) -> bool:
        """Undo (-1) or redo (+1); False at the end of the stack."""
        if self._depth:
            raise InvalidInput("undo and redo wait until the step that is under way has ended.")
        self._keep_foreign()
        if not 0 <= self._at + by < len(self._states):
            return False
        self._at += by
        self._layer.TransferContent(self._states[self._at][1])
        self._touched = False
        for listener in tuple(self._listeners):
            listener()
        return True

    def listen(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call after each undo and redo; the returned function stops that."""
        self._listeners.append(listener)

        def stop() -> None:
            if listener in self._listeners:
                self._listeners.remove(listener)

        return stop

    def _keep_foreign(self) -> None:
        if self._touched:
            self._touched = False
            self._push("Edit in the stage")

    def _push(self, label: str) -> None:
        self._states[self._at + 1 :] = [(label, _copy(self._layer))]
        del self._states[:-KEPT_STEPS]
        self._at = len(self._states) - 1

    def _hear(self, notice: object, sender: object) -> None:
        self._touched = True


def _copy(layer: Sdf.Layer) -> Sdf.Layer:
    copy = Sdf.Layer.CreateAnonymous()
    copy.TransferContent(layer)
    return copy
