"""Proxies of broken surfaces: made by a plugin, and kept by digest."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from contact_core.arrays import digest
from contact_core.cache import cached_arrays
from contact_core.document.document import Proxy, Surface
from contact_core.document.frozen_map import FrozenMap
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.topology import closed_manifold
from contact_core.plugins.registry import PROXY_MAKERS
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.settings import settings_of

if TYPE_CHECKING:
    from contact_core.plugins.manager import PluginManager
    from contact_core.plugins.slots import ProxyMaker


def made_proxy(
    mesh: TriangleMesh,
    plugins: PluginManager,
    maker: str | None = None,
    settings: Mapping[str, Any] | None = None,
    progress: Progress = NO_PROGRESS,
    *,
    wanted: str | None = None,
) -> tuple[Proxy, TriangleMesh]:
    """The proxy that a maker makes of a mesh, and how a document names it; kept in this machine's cache.

    maker: a name; None is the default for "repair". wanted: the digest that it should have; what is kept of another
    is made anew. Made of positions as float32, so that hosts which store those get the same. Raises InvalidInput
    where the maker leaves no closed manifold, MissingExtra, Cancelled.
    """
    name = plugins.name_for(PROXY_MAKERS, "repair", maker)
    tool = plugins.make(PROXY_MAKERS, name, **(settings or {}))
    chosen = {each.name: each.default for each in settings_of(tool)}
    rounded = mesh.with_points(mesh.points.astype(np.float32))
    state = repr((name, sorted(chosen.items()))).encode()
    key = digest(np.frombuffer(state, np.uint8), np.frombuffer(rounded.digest.encode(), np.uint8))
    made = _kept(key, tool, rounded, progress)
    if wanted is not None and made.digest != wanted:
        made = closed_manifold(tool.make(rounded, progress), name)
    return Proxy(name, FrozenMap(chosen), made.digest, len(made.faces)), made


def _kept(key: str, tool: ProxyMaker, mesh: TriangleMesh, progress: Progress) -> TriangleMesh:
    def make() -> dict[str, Any]:
        made = closed_manifold(tool.make(mesh, progress), tool.name)
        return {"points": made.points, "faces": made.faces}

    arrays = cached_arrays("proxies", key, make)
    return TriangleMesh(arrays["points"], arrays["faces"])


def named_proxy(record: Surface, mesh: TriangleMesh, plugins: PluginManager) -> TriangleMesh:
    """The proxy that the record of a surface names, made again. Raises InvalidInput where it is not the same."""
    proxy, surface = record.proxy, record.name
    if proxy is None or not proxy.maker:
        raise InvalidInput(
            f"the proxy of {surface!r} was brought: bring it again by surfaces.know_proxy({surface!r}, mesh)."
        )
    _, made = made_proxy(mesh, plugins, proxy.maker, proxy.settings, wanted=proxy.digest)
    if made.digest != proxy.digest:
        raise InvalidInput(
            f"the proxy of {surface!r} comes out otherwise here than where its contacts were painted (another mesh,"
            f" or another release of its maker {proxy.maker!r}): bring that one by"
            f" surfaces.know_proxy({surface!r}, mesh)."
        )
    return made
