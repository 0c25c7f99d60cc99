"""Grasps of a library on the hand and the object before an artist, beside the window.

One is applied as a proposal, or the one that the document holds is saved.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from contact_core.progress import Progress

if TYPE_CHECKING:
    from contact_core.interaction.interaction import Interaction
    from contact_core.library.applying import Applied
    from contact_core.library.shelf import Library

APPLY, SAVE = "Apply", "Save the grasp"


def apply_saved(interaction: Interaction, library: Library, name: str) -> None:
    """Begin to put the grasp NAME, or NAME@VERSION, on the selected hand and object, or the only ones.

    The best of as many ways as Suggest looks for is proposed, as suggestions are: Enter accepts, Escape refuses.
    Raises CommandRejected where it is not clear which are meant, FileRefused for a grasp that cannot be read.
    """
    from contact_core.library.applying import apply

    proposing = interaction.proposing
    grasp, contacts = library.grasp(name), library.contacts(name)
    scene, count = proposing.scene_of_those_meant(), interaction.settings.suggestions

    def work(progress: Progress) -> list[Applied]:
        return apply(replace(scene(), prior="current"), grasp, contacts, count=count, progress=progress)

    def done(found: list[Applied]) -> None:
        proposing.take([one.suggestion for one in found])
        interaction.desk.remark = " ".join(found[0].notes[:2])

    proposing.dismiss()
    interaction.worker.begin(APPLY, work, done)


def save_held(
    interaction: Interaction,
    library: Library,
    name: str,
    tags: Sequence[str],
    done: Callable[[str], None],
    *,
    replaces: bool = False,
) -> None:
    """Begin to save how the hand holds the object now, with a picture; `done` gets a sentence.

    replaces: a name that is taken gets a further version. Raises CommandRejected as `apply_saved` does; what the
    library refuses is told like all that work beside the window refuses.
    """
    from contact_core.library.capture import captured
    from contact_core.library.pictures import thumbnail

    scene, plugins = interaction.proposing.scene_of_those_meant(), interaction.session.plugins

    def work(progress: Progress) -> int:
        held = scene()
        grasp, contacts = captured(held, None, tuple(tags))
        progress.tell(0.3, "Drawing its picture")
        return library.add(name, grasp, contacts, thumbnail(held, plugins), replace=replaces)

    def told(version: int) -> None:
        again = f", version {version}" if version > 1 else ""
        done(f"saved the grasp {name!r}{again} in {library.folder}.")

    interaction.worker.begin(SAVE, work, told)
