"""The page of the add-on in Blender's preferences."""

from __future__ import annotations

import textwrap
from typing import Any

import bpy

from contact_blender.extension import shared


def of(package: str) -> Any:
    """The class of the page, for the name under which Blender enabled the add-on."""
    return type("CONTACT_AP_preferences", (bpy.types.AddonPreferences,), {"bl_idname": package, "draw": _draw})


def words() -> str:
    """What the page says."""
    return shared.missing() or "All libraries are here. The panel is in the 3D view's sidebar (N), tab Contact."


def _draw(self: Any, context: Any) -> None:
    for line in textwrap.wrap(words(), 90):
        self.layout.label(text=line, icon="ERROR" if shared.missing() else "CHECKMARK")
