"""Drawing with plugins: the best renderer that can."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from contact_core.atomic_file import check_no_null
from contact_core.atomic_set import check_writable
from contact_core.errors import ContactError, FileRefused, InvalidInput
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import RENDERERS
from contact_core.scene.picture import Picture


@dataclass(frozen=True)
class Drawn:
    """renderer: the name of the one that drew. passed_over: of each better one, a sentence on what it lacks."""

    renderer: str
    passed_over: tuple[str, ...]


def draw(
    pictures: Sequence[Picture], path: Path, plugins: PluginManager, *, size: tuple[int, int] = (1280, 720)
) -> Drawn:
    """Draw pictures side by side into a PNG of `size` pixels, with the best renderer that can.

    Raises FileRefused where `path` is no PNG file that can be written, and InvalidInput with what each renderer
    lacks where none can.
    """
    if path.suffix.lower() != ".png":
        raise FileRefused(f"a picture is a PNG file, but got {str(path)!r}; name it like picture.png.")
    check_no_null(path)
    check_writable(path.parent, [path.name])
    reasons: list[str] = []
    for renderer in sorted(plugins.offers(RENDERERS).values(), key=lambda r: (-r.priority, r.name)):
        try:
            renderer.render(pictures, path, size=size)
        except ContactError as error:
            reasons.append(f"renderer {renderer.name}: {error}")
        else:
            return Drawn(renderer.name, tuple(reasons))
    raise InvalidInput("no renderer could draw a picture: " + ("; ".join(reasons) or "no plugin offers one."))
