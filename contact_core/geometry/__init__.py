"""Surfaces and exact geodesics on them.

The names below load when they are first used, and numba when a kernel is first called: importing this package
costs next to nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from contact_core.geometry.exact_geodesics import Geodesic as Geodesic
    from contact_core.geometry.exact_geodesics import LogMap as LogMap
    from contact_core.geometry.exact_geodesics import exact_geodesic as exact_geodesic
    from contact_core.geometry.exact_geodesics import log_map as log_map
    from contact_core.geometry.exact_geodesics import parallel_transport as parallel_transport
    from contact_core.geometry.mesh import TriangleMesh as TriangleMesh
    from contact_core.geometry.surface_point import SurfacePoints as SurfacePoints
    from contact_core.geometry.topology import Topology as Topology
    from contact_core.geometry.tracing import Trace as Trace
    from contact_core.geometry.tracing import trace_chains as trace_chains
    from contact_core.geometry.tracing import trace_geodesic as trace_geodesic

_HOME_OF_NAME = {
    "Geodesic": "exact_geodesics",
    "LogMap": "exact_geodesics",
    "exact_geodesic": "exact_geodesics",
    "log_map": "exact_geodesics",
    "parallel_transport": "exact_geodesics",
    "TriangleMesh": "mesh",
    "SurfacePoints": "surface_point",
    "Topology": "topology",
    "Trace": "tracing",
    "trace_chains": "tracing",
    "trace_geodesic": "tracing",
}


def __getattr__(name: str) -> Any:
    home = _HOME_OF_NAME.get(name)
    if home is None:
        raise AttributeError(f"contact_core.geometry offers {', '.join(sorted(_HOME_OF_NAME))}, but not {name!r}.")
    return getattr(import_module(f"contact_core.geometry.{home}"), name)


def __dir__() -> list[str]:
    return sorted(_HOME_OF_NAME)
