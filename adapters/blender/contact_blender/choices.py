"""An artist's choice of the bones that are posed, by armature: one property of the scene, which the user may write.

An armature may be linked from another file, whose own properties would not be saved. The pointers follow renaming,
saving and appending, as those of the document do.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

KEY = "contact_bones"


def read(scene: Any, armature: Any) -> str | None:
    """What was chosen for an armature, None where nothing was."""
    return next((str(each["bones"]) for each in _entries(scene) if each.get("armature") == armature), None)


def write(scene: Any, armature: Any, choice: str) -> Callable[[Any], None]:
    """Keep a choice; returns what takes that back, given the scene anew. Those of lost armatures go too."""
    before = scene[KEY].to_dict() if KEY in scene else None
    others = [e for e in _entries(scene) if e.get("armature") not in (None, armature)]
    kept = [(each["armature"], str(each["bones"])) for each in others]
    _put(scene, [*kept, (armature, choice)])

    def take_back(again: Any) -> None:
        if before is None:
            del again[KEY]
        else:
            _put(again, [(each["armature"], each["bones"]) for each in before.values()])

    return take_back


def _put(scene: Any, chosen: list[tuple[Any, str]]) -> None:
    scene[KEY] = {str(place): {"armature": owner, "bones": choice} for place, (owner, choice) in enumerate(chosen)}


def _entries(scene: Any) -> list[Any]:
    """The entries, none where somebody else uses the name."""
    group = scene.get(KEY)
    found = list(group.values()) if hasattr(group, "values") else []
    return [each for each in found if hasattr(each, "get") and "bones" in each]
