"""What a session does with a library: save the grasp that its document holds, and propose a saved one.

library = contact.Library("/net/grasps")
save_grasp(session, library, "mug by the body", "hand", "mug", tags=("kitchen",))
found = apply_grasp(session, library, "mug by the body", "hand", "cup")
session.accept(found[0].suggestion.proposal)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace as changed
from typing import TYPE_CHECKING

import numpy as np

from contact_core.errors import InvalidInput
from contact_core.grasping.verbs import grasp_scene
from contact_core.library.applying import Applied, apply
from contact_core.library.capture import captured
from contact_core.library.pictures import thumbnail
from contact_core.library.shelf import Library
from contact_core.progress import NO_PROGRESS, Progress

if TYPE_CHECKING:
    from contact_core.grasping.scene import GraspScene
    from contact_core.grasping.slots import Kind
    from contact_core.hands.description import HandWords
    from contact_core.proposals.verbs import ProposingSession


def library_scene(session: ProposingSession, hand: str, thing: str, words: Sequence[HandWords] = ()) -> GraspScene:
    """As `grasp_scene`; digits that touch nothing stay as the grasp has them."""
    return changed(grasp_scene(session, hand, thing, words), prior="current")


def save_grasp(
    session: ProposingSession,
    library: Library,
    name: str,
    hand: str,
    thing: str,
    *,
    kind: Kind | None = None,
    tags: Sequence[str] = (),
    note: str = "",
    origin: str = "",
    words: Sequence[HandWords] = (),
    picture: bool = True,
    replace: bool = False,
) -> int:
    """Save how the surface `hand` holds the surface `thing` now; returns the number of the version.

    kind: told by how the hand touches where none is given. words: what the rig's sidecar says about its hands.
    picture: whether one is drawn. replace: a name that is taken gets a further version. Raises InvalidInput where
    no patches of the two are paired, and FileRefused.
    """
    scene = grasp_scene(session, hand, thing, words)
    grasp, contacts = captured(scene, kind, tags, note, origin)
    drawn = thumbnail(scene, session.plugins) if picture else None
    return library.add(name, grasp, contacts, drawn, replace=replace)


def apply_grasp(
    session: ProposingSession,
    library: Library,
    name: str,
    hand: str,
    thing: str,
    *,
    at: tuple[float, float, float] | None = None,
    count: int = 1,
    words: Sequence[HandWords] = (),
    progress: Progress = NO_PROGRESS,
) -> list[Applied]:
    """A saved grasp, NAME or NAME@VERSION, on the surfaces `hand` and `thing`, at most `count` ways, the best
    first.

    Nothing is committed: `session.accept` takes the proposal of one as one undo step; the first is shown as a
    ghost. at: (3,) the place that is to be held, in the object's surface space. Raises FileRefused, InvalidInput,
    Cancelled.
    """
    if not 1 <= count <= 64:
        raise InvalidInput(f"from 1 to 64 ways can be asked for, but {count} were.")
    grasp, contacts = library.grasp(name), library.contacts(name)
    scene = library_scene(session, hand, thing, words)
    where = None if at is None else np.array(at, float)
    found = apply(scene, grasp, contacts, at=where, count=count, progress=progress)
    session.show_ghost(found[0].suggestion.proposal)
    return found
