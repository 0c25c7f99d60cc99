"""The extension that an artist installs: tools, operators, a panel, preferences. Registering loads nothing heavy.

The zip's own `__init__.py` (adapters/blender/build_extension.py) puts the vendored packages on the path and calls
`register`; a script in a Blender that has contact-core installed may call it as well.
"""

from __future__ import annotations

from typing import Any

import bpy

from contact_blender.extension import (
    film,
    modal,
    operators,
    panel,
    preferences,
    shared,
    span_operators,
    toolbar,
    warming,
)

_DECLARING = operators, span_operators  # whose operators `declaring` has made
_registered: list[Any] = []


def register(package: str = __name__) -> None:
    """Add everything to Blender. package: the name under which Blender enabled the add-on. Twice is once."""
    if _registered:
        return
    warming.keep_kernels(package)
    kinds = (*panel.groups(), *operators.classes(), *modal.CLASSES, *film.CLASSES, *toolbar.classes())
    for kind in (*kinds, *panel.PANELS, preferences.of(package)):
        bpy.utils.register_class(kind)
        _registered.append(kind)
    bpy.types.WindowManager.contact = bpy.props.PointerProperty(type=panel.ContactSettings)
    toolbar.register()
    film.register()


def unregister() -> None:
    """Take everything out of Blender again, and close the sessions; their contacts stay in the scenes."""
    panel.stop_waiting()
    shared.close_all()
    if _registered:
        film.unregister()
        toolbar.unregister()
    if hasattr(bpy.types.WindowManager, "contact"):
        del bpy.types.WindowManager.contact
    while _registered:
        bpy.utils.unregister_class(_registered.pop())
