"""What the viewer offers to the core: its renderer, by reference, so that nothing is imported before it is used."""

from __future__ import annotations

from contact_core.plugins import hookimpl


@hookimpl
def contact_renderers() -> list[object]:
    return ["contact_viewer.renderer:PyVistaRenderer"]
