"""One session for each open scene, shared by panel, operators and scripts.

Blender imports a module once, so what is kept here is what every part of the add-on sees. Scenes are known by their
session uid; no Blender object is kept.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import bpy

if TYPE_CHECKING:
    from contact_blender.extension.artist import Artist
    from contact_core.document.document import ContactDocument
    from contact_core.interaction.film_shapes import FilmShapes
    from contact_core.proposals.film import FilmMeasures
    from contact_core.proposals.proposal import Proposal
    from contact_core.session import Session

KEY = "contact_core"  # as storage.KEY: that module loads more than a panel may wait for
OLDEST_NUMPY = (1, 26)  # as in pyproject.toml
LIBRARIES = ("numpy", "scipy", "numba", "pluggy", "threadpoolctl", "rich")


@dataclass
class Held:
    """What is kept of a scene. residuals: 95 % of a pair's points are nearer than this (scene units), by pair, as
    the solve of `solved` (a revision) left them. artist: the interaction with its views, once a tool was used.
    measured: the document whose film was measured last, and the figures. shapes: what the timelines show, and of
    what (`film.shapes`)."""

    session: Session
    residuals: dict[str, float] = field(default_factory=dict)
    solved: int = -1
    artist: Artist | None = None
    measured: tuple[ContactDocument, FilmMeasures] | None = None
    shapes: tuple[object, FilmShapes] | None = None


_held: dict[int, Held] = {}
_listing: list[bool] = []
_broken: list[str] = []  # why a library cannot be loaded, found once


def missing() -> str:
    """A sentence about libraries that are not there, too old or broken, "" where all is well. Looked up once; what
    is broken shows when it is loaded."""
    return _broken[-1] if _broken else _missing(LIBRARIES, OLDEST_NUMPY)


@cache
def _missing(libraries: tuple[str, ...], oldest_numpy: tuple[int, int]) -> str:
    gone = [name for name in libraries if find_spec(name) is None]
    if not gone:
        return _old_numpy(oldest_numpy)
    return (
        f"Contact cannot work: this Blender's Python has no {', '.join(gone)}. Install the extension's zip that was"
        " built for this Blender and this platform."
    )


def _old_numpy(oldest: tuple[int, int]) -> str:
    import numpy  # Blender's own

    here = tuple(int(part) for part in numpy.__version__.split(".")[:2])
    if here >= oldest:
        return ""
    wanted = ".".join(map(str, oldest))
    return f"Contact cannot work: numpy {wanted} is needed, and this Blender has {numpy.__version__}."


def _load_libraries() -> None:
    """Load what the wheels brought. Raises InvalidInput where one is there and cannot be loaded."""
    from contact_core.errors import InvalidInput

    try:
        for name in ("llvmlite.binding", "numba", "scipy.sparse"):
            import_module(name)
    except Exception as error:  # a file that was cut, one for another platform, one built for another numpy
        _broken.append(
            f"Contact cannot work: {name.partition('.')[0]} is here and cannot be loaded ({error}). Remove the"
            " extension, restart Blender, and install the zip that was built for this Blender and this platform."
        )
        raise InvalidInput(_broken[-1]) from error


def held() -> Held | None:
    """What is kept of the scene that is open, None before the first use and after its end. Begins nothing."""
    found = _held.get(int(bpy.context.scene.session_uid))
    return None if found is None or found.session.host is None else found


def is_stored() -> bool:
    """Whether the open scene holds contacts."""
    return KEY in bpy.context.scene


def session() -> Session:
    """The session of the scene that is open, begun at the first use; the scene's end ends it.

    Raises InvalidInput where a library is missing, and FileRefused for contacts that cannot be read.
    """
    found = held()
    if found is not None:
        return found.session
    _forget_ended()
    gone = missing()
    if gone:
        from contact_core.errors import InvalidInput

        raise InvalidInput(gone)
    _load_libraries()
    from contact_blender.host import BlenderHost
    from contact_core.session import Session

    begun = Session(host=BlenderHost())
    _held[int(bpy.context.scene.session_uid)] = Held(begun)
    begun.listen(lambda change: list_patches() if change.kind != "preview" else None)
    list_patches()
    return begun


def artist() -> Artist:
    """The interaction with the session of the open scene, begun at the first use. Raises as `session`."""
    session()
    found = held()
    assert found is not None  # the session that has just been begun
    if found.artist is None:
        from contact_blender.extension.artist import Artist

        found.artist = Artist(found.session)
    return found.artist


def follow_selection() -> None:
    """The patch that a tool has made the active one is that of the panel, too."""
    found = held()
    if found is not None and found.artist is not None and hasattr(bpy.context.window_manager, "contact"):
        patch = found.artist.interaction.selection.patch
        if patch is not None:
            bpy.context.window_manager.contact.patch = patch


def list_patches() -> None:
    """Bring the rows of the panel in line with the document: after every edit, undo and redo."""
    found, manager = held(), bpy.context.window_manager
    if found is None or not hasattr(manager, "contact"):  # a script may use the session without the panel
        return
    _listing.append(True)
    try:
        _fill(manager.contact, found.session.document)
    finally:
        _listing.pop()
    for window in manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def is_listing() -> bool:
    """Whether rows change because the document did, and not by the user's hand."""
    return bool(_listing)


def _fill(settings: Any, document: ContactDocument) -> None:
    """Rows of patches and pairs; the active ones stay, where they are still there."""
    if settings.patch not in document.patches:
        settings.patch = next(iter(reversed(list(document.patches))), "")
    if settings.pair not in document.pairs:
        settings.pair = next(iter(reversed(list(document.pairs))), "")
    pair_of = {end: name for name, pair in document.pairs.items() for end in (pair.manipulator, pair.object)}
    settings.rows.clear()
    for patch in document.patches.values():
        row = settings.rows.add()
        row.name = row.label = patch.name
        row.color, row.pair = patch.color, pair_of.get(patch.name, "")
    settings.pairs.clear()
    for name, pair in document.pairs.items():
        row = settings.pairs.add()
        row.name, row.ends = name, f"{pair.manipulator} \N{RIGHTWARDS ARROW} {pair.object}"


def keep_residuals(proposal: Proposal) -> None:
    """Keep how well the pairs are met, for the panel. The proposal has just been accepted."""
    found = held()
    if found is not None:
        found.residuals = {name: each.p95 for name, each in proposal.after.patches.items()}
        found.solved = found.session.revision


def close_all() -> None:
    """Close every session; contacts stay in their scenes."""
    for found in _held.values():
        _close(found)
    _held.clear()


def _forget_ended() -> None:
    """Let go of sessions that have ended, and of those whose scene was removed."""
    there: set[Any] = {scene.session_uid for scene in bpy.data.scenes}
    for uid, found in tuple(_held.items()):
        if uid not in there or found.session.host is None:
            _close(found)
            del _held[uid]


def _close(found: Held) -> None:
    """End the interaction, then the session where its scene has not ended it."""
    if found.artist is not None:
        found.artist.close()
        found.artist = None
    if found.session.host is not None:
        found.session.close()
