"""Brushes and axes that plugins make for the verbs."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from contact_core.edit.document_geometry import DocumentGeometry
from contact_core.edit.editor import Makers
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.plugins.registry import AXIS_GENERATORS, BRUSHES

if TYPE_CHECKING:
    from contact_core.contact.axis_generator import AxisGenerator
    from contact_core.contact.brush import Brush
    from contact_core.plugins.manager import PluginManager


class PluginMakers(Makers):
    """Makers that ask plugins. manager: returns the plugins; it is asked at the first use."""

    def __init__(self, manager: Callable[[], PluginManager]) -> None:
        self._manager = manager

    def brush(self, name: str, **settings: Any) -> Brush:
        """A brush by name. Raises InvalidInput that lists what there is, and for settings that it does not have or
        refuses."""
        return self._manager().make(BRUSHES, name, **settings)

    def axis(
        self,
        geometry: DocumentGeometry,
        surface: str,
        patch: str,
        points: SurfacePoints,
        generator: str | AxisGenerator | None = None,
    ) -> SurfacePoints:
        """Axis points from an axis generator: the one given or named, or the one that the plugins choose."""
        plugins = self._manager()
        offered = plugins.offers(AXIS_GENERATORS)
        if generator is None and offered:
            generator = plugins.choose(
                "contact_choose_axis_generator", offered, surface=surface, patch=patch
            ) or plugins.name_for(AXIS_GENERATORS, "paint")
        if generator is None:
            return super().axis(geometry, surface, patch, points, generator)
        made = plugins.get(AXIS_GENERATORS, generator) if isinstance(generator, str) else generator
        return made.generate(geometry.axis_request(surface, patch, points))
