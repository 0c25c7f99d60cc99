"""Pictures of sub-commands, by the first renderer that can draw."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from contact_core.errors import ContactError, InvalidInput
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import RENDERERS
from contact_core.scene.picture import Picture


def draw(pictures: Sequence[Picture], plugins: PluginManager, path: Path) -> None:
    """Draw pictures side by side into a PNG. Raises InvalidInput where no renderer can."""
    reasons = []
    for renderer in sorted(plugins.offers(RENDERERS).values(), key=lambda r: (-r.priority, r.name)):
        try:
            return renderer.render(pictures, path, size=(1600, 800))
        except ContactError as error:
            reasons.append(f"{renderer.name}: {error}")
    raise InvalidInput("no renderer could draw the picture: " + ("; ".join(reasons) or "no plugin offers one."))
