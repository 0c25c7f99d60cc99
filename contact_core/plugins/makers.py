"""Brushes, axes and proxies that plugins make for the verbs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from contact_core.document.document import Proxy, Surface
from contact_core.edit.document_geometry import DocumentGeometry
from contact_core.edit.editor import Makers
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.plugins.proxies import made_proxy, named_proxy
from contact_core.plugins.registry import AXIS_GENERATORS, BRUSHES
from contact_core.progress import NO_PROGRESS, Progress

if TYPE_CHECKING:
    from contact_core.contact.axis_generator import AxisGenerator
    from contact_core.contact.brush import Brush
    from contact_core.plugins.manager import PluginManager


class PluginMakers(Makers):
    """Makers that ask plugins. manager: returns the plugins; it is asked at the first use."""

    mends = True

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

    def proxy(
        self,
        mesh: TriangleMesh,
        maker: str | None = None,
        settings: Mapping[str, Any] | None = None,
        progress: Progress = NO_PROGRESS,
    ) -> tuple[Proxy, TriangleMesh]:
        """A proxy by the maker that is named, or by the default for "repair"; kept with the mesh."""
        key = ("proxy", maker, repr(sorted((settings or {}).items())))
        if key not in mesh.kept:  # a stroke over a broken surface asks at every move
            mesh.kept[key] = made_proxy(mesh, self._manager(), maker, settings, progress)
        made: tuple[Proxy, TriangleMesh] = mesh.kept[key]
        return made

    def named_proxy(self, record: Surface, mesh: TriangleMesh) -> TriangleMesh:
        """The proxy that the record of a surface names. Raises InvalidInput where it comes out otherwise."""
        return named_proxy(record, mesh, self._manager())
