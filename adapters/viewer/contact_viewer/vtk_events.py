"""Events of a VTK interactor, as events of the interaction.

VTK swallows what an observer raises: it is collected here, for whoever runs the loop to raise.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from contact_core.interaction.events import KEY_NAMES, Button, Event, Key, Modifier, Pointer, PointerKind

_PRIORITY = 10.0  # before anything that VTK itself does
_BUTTONS: dict[str, Button] = {"Left": "left", "Middle": "middle", "Right": "right"}
_KEYS = {
    "Return": "Enter", "KP_Enter": "Enter", "space": "Space", "Prior": "", "bracketleft": "[", "bracketright": "]",
    "period": ".", "comma": ",", "question": "?", "slash": "/", "minus": "-", "plus": "+", "BackSpace": "Backspace",
    "ISO_Left_Tab": "Tab",
}  # fmt: skip


class VtkEvents:
    """Listens to an interactor. handle: takes each event. errors: what handling raised.

    typed: asked first with the name of each key and the letter that it writes; whether it took the key. dropped:
    gets the files that were let go over the window.
    """

    def __init__(
        self,
        interactor: Any,
        handle: Callable[[Event], None],
        typed: Callable[[str, str], bool] = lambda key, letter: False,
        dropped: Callable[[list[str]], None] = lambda files: None,
    ) -> None:
        self._interactor, self._handle, self._typed, self._dropped = interactor, handle, typed, dropped
        self.errors: list[BaseException] = []
        interactor.SetInteractorStyle(None)  # nothing of VTK's own: no w for wireframe, no q that ends it
        for side, button in _BUTTONS.items():
            self._on(f"{side}ButtonPressEvent", self._pointer("press", button))
            self._on(f"{side}ButtonReleaseEvent", self._pointer("release", button))
        self._on("MouseMoveEvent", self._pointer("move"))
        self._on("LeaveEvent", self._pointer("leave"))
        self._on("MouseWheelForwardEvent", self._pointer("wheel", wheel=1.0))
        self._on("MouseWheelBackwardEvent", self._pointer("wheel", wheel=-1.0))
        self._on("KeyPressEvent", self._key)
        self._listen_for_files()

    def raise_errors(self) -> None:
        """Raise the first error that was collected."""
        if self.errors:
            raise self.errors.pop(0)

    def _on(self, event: str, make: Callable[[], Event | None]) -> None:
        def observe(*_: object) -> None:
            try:
                made = make()
                if made is not None:
                    self._handle(made)
            except BaseException as error:
                self.errors.append(error)

        self._interactor.AddObserver(event, observe, _PRIORITY)

    def _listen_for_files(self) -> None:
        from vtkmodules.util.vtkConstants import VTK_OBJECT

        def observe(_: object, __: object, names: Any) -> None:
            try:
                self._dropped([names.GetValue(place) for place in range(names.GetNumberOfValues())])
            except BaseException as error:
                self.errors.append(error)

        told: Any = observe
        told.CallDataType = VTK_OBJECT  # what VTK hands over with the event
        self._interactor.AddObserver("DropFilesEvent", told, _PRIORITY)

    def _pointer(
        self, kind: PointerKind, button: Button = "none", wheel: float = 0.0
    ) -> Callable[[], Event | None]:
        def make() -> Event:
            x, y = self._interactor.GetEventPosition()
            height = self._interactor.GetRenderWindow().GetSize()[1]
            return Pointer(
                kind, x + 0.5, height - y - 0.5, button, self._modifiers(), time=time.monotonic(), wheel=wheel
            )

        return make

    def _key(self) -> Event | None:
        symbol = self._interactor.GetKeySym() or ""
        if self._typed(symbol, (self._interactor.GetKeyCode() or "").strip("\0")):
            return None
        name = _KEYS.get(symbol, symbol.removeprefix("KP_"))
        if len(name) != 1 and name not in KEY_NAMES:
            return None
        return Key(name, self._modifiers(), time.monotonic())

    def _modifiers(self) -> frozenset[Modifier]:
        held: dict[Modifier, bool] = {
            "ctrl": self._interactor.GetControlKey() != 0,
            "alt": self._interactor.GetAltKey() != 0,
            "shift": self._interactor.GetShiftKey() != 0,
        }
        return frozenset(name for name, down in held.items() if down)
