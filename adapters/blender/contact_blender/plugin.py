"""What the Blender adapter offers to the core: its host, by reference, so that nothing imports bpy before use."""

from __future__ import annotations

from contact_core.plugins import hookimpl


@hookimpl
def contact_hosts() -> list[object]:
    return ["contact_blender.host:BlenderHost"]
