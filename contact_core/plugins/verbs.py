"""The verbs that ask plugins: for axes, for brushes, for engines."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from contact_core.edit.announcer import DocumentChanged
from contact_core.edit.verbs import SurfaceVerbs, Verbs
from contact_core.geometry.surface_point import SurfacePoints

if TYPE_CHECKING:
    from contact_core.contact.axis_generator import AxisGenerator
    from contact_core.contact.brush import Brush
    from contact_core.geometry.engine import GeodesicEngine
    from contact_core.plugins.manager import PluginManager


class PluginVerbs(Verbs, SurfaceVerbs):
    """An editor with a plugin manager of its own, which looks for plugins at the first use."""

    def _equip(self, plugins: PluginManager | Iterable[object], *, discover: bool) -> None:
        """plugins: a manager to share, or modules of highest precedence. discover: read entry points."""
        given = plugins if isinstance(plugins, Iterable) else ()
        self._plugins: PluginManager | None = None if isinstance(plugins, Iterable) else plugins
        self._plugin_arguments = (tuple(given), discover)

    @property
    def plugins(self) -> PluginManager:
        """The plugins of this session, found at the first use."""
        if self._plugins is None:
            from contact_core.plugins.manager import PluginManager

            given, discover = self._plugin_arguments
            self._plugins = PluginManager(given, discover=discover)
        return self._plugins

    def default_axis(
        self, surface: str, patch: str, points: SurfacePoints, generator: str | AxisGenerator | None
    ) -> SurfacePoints:
        """Axis points from an axis generator: the one given or named, or the one that the plugins choose."""
        from contact_core.plugins.registry import AXIS_GENERATORS

        offered = self.plugins.offers(AXIS_GENERATORS)
        if generator is None and offered:
            generator = self.plugins.choose(
                "contact_choose_axis_generator", offered, surface=surface, patch=patch
            ) or self.plugins.name_for(AXIS_GENERATORS, "paint")
        if generator is None:
            return super().default_axis(surface, patch, points, generator)
        made = self.plugins.get(AXIS_GENERATORS, generator) if isinstance(generator, str) else generator
        return made.generate(self.axis_request(surface, patch, points))

    def named_brush(self, name: str, **settings: Any) -> Brush:
        """A brush of this session's plugins. Raises InvalidInput that lists what there is, and for settings that
        it does not have or refuses."""
        from contact_core.plugins.registry import BRUSHES

        return self.plugins.make(BRUSHES, name, **settings)

    def named_engine(self, name: str) -> GeodesicEngine:
        """A geodesic engine of this session's plugins. Raises InvalidInput that lists what there is."""
        from contact_core.plugins.registry import GEODESIC_ENGINES

        return self.plugins.get(GEODESIC_ENGINES, name)

    def _tell_plugins(self, change: DocumentChanged) -> None:
        """Plugins hear what is committed, from the first commit on, whether or not they were asked for before."""
        if change.kind != "preview":
            self.plugins.notify(
                "contact_document_changed", document=change.after, revision=change.revision, origin=change.origin
            )
