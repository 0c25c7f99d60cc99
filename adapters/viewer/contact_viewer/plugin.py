"""What the viewer offers to the core: its renderer, by reference, so that nothing is imported before it is used."""

from __future__ import annotations

from contact_core.plugins import hookimpl


@hookimpl
def contact_renderers() -> list[object]:
    return ["contact_viewer.renderer:PyVistaRenderer"]


@hookimpl
def contact_hosts() -> list[object]:
    return ["contact_viewer.host:ViewerHost"]


@hookimpl
def contact_cli() -> list[object]:
    return ["contact_viewer.command:ViewCommand"]
