"""Contact-area editing and contact-driven posing for animation, for every host.

What a studio's script, an adapter or a plugin needs is one import away:

    import contact_core as contact

    with contact.open("shot.usda") as session:
        solution = session.solve()
        session.accept(solution)

The names below load when they are first used: importing this package loads nothing heavy. What is named neither
here nor in a page of the documentation is private to contributors and may change.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from contact_core._version import __version__

if TYPE_CHECKING:
    from contact_core.contact.brush import BrushGesture as BrushGesture
    from contact_core.contact.placement import Link as Link
    from contact_core.contact.placement import Root as Root
    from contact_core.document.asset import Asset as Asset
    from contact_core.document.document import ContactDocument as ContactDocument
    from contact_core.errors import Cancelled as Cancelled
    from contact_core.errors import CommandRejected as CommandRejected
    from contact_core.errors import ContactError as ContactError
    from contact_core.errors import FileRefused as FileRefused
    from contact_core.errors import InvalidInput as InvalidInput
    from contact_core.geometry.mesh import TriangleMesh as TriangleMesh
    from contact_core.geometry.surface_point import SurfacePoints as SurfacePoints
    from contact_core.library.shelf import Library as Library
    from contact_core.opening import new as new
    from contact_core.opening import open as open  # noqa: A004 - said as `contact.open`
    from contact_core.plugins import hookimpl as hookimpl
    from contact_core.plugins.manager import PluginManager as PluginManager
    from contact_core.plugins.reading import read_asset as read_asset
    from contact_core.progress import CallbackProgress as CallbackProgress
    from contact_core.progress import Progress as Progress
    from contact_core.proposals.proposal import Proposal as Proposal
    from contact_core.proposals.proposal import SolveSettings as SolveSettings
    from contact_core.rig.rig import Pose as Pose
    from contact_core.rig.rig import Rig as Rig
    from contact_core.scene.memory_host import MemoryHost as MemoryHost
    from contact_core.scene.problem import Objective as Objective
    from contact_core.session import Session as Session
    from contact_core.solve.solver import SolveOptions as SolveOptions
    from contact_core.solve.solver import SolveStatus as SolveStatus

_HOME_OF_NAME = {
    "Asset": "document.asset",
    "BrushGesture": "contact.brush",
    "CallbackProgress": "progress",
    "Cancelled": "errors",
    "CommandRejected": "errors",
    "ContactDocument": "document.document",
    "ContactError": "errors",
    "FileRefused": "errors",
    "InvalidInput": "errors",
    "Library": "library.shelf",
    "Link": "contact.placement",
    "MemoryHost": "scene.memory_host",
    "Objective": "scene.problem",
    "PluginManager": "plugins.manager",
    "Pose": "rig.rig",
    "Progress": "progress",
    "Proposal": "proposals.proposal",
    "Rig": "rig.rig",
    "Root": "contact.placement",
    "Session": "session",
    "SolveOptions": "solve.solver",
    "SolveSettings": "proposals.proposal",
    "SolveStatus": "solve.solver",
    "SurfacePoints": "geometry.surface_point",
    "TriangleMesh": "geometry.mesh",
    "hookimpl": "plugins",
    "new": "opening",
    "open": "opening",
    "read_asset": "plugins.reading",
}

__all__ = ["__version__", *sorted(_HOME_OF_NAME)]


def __getattr__(name: str) -> Any:
    home = _HOME_OF_NAME.get(name)
    if home is None:
        raise AttributeError(f"contact_core offers {', '.join(sorted(_HOME_OF_NAME))}, but not {name!r}.")
    return getattr(import_module(f"contact_core.{home}"), name)


def __dir__() -> list[str]:
    return sorted([*_HOME_OF_NAME, "__version__"])
