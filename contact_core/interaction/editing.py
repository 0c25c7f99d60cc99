"""What actions do to the selection and to the whole document; each is one step of the session."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from contact_core.contact.placement import Link
from contact_core.document.document import ContactDocument
from contact_core.edit.command import Command, Macro
from contact_core.edit.commands import Remove, Unpair
from contact_core.errors import CommandRejected
from contact_core.interaction.lock import Kind
from contact_core.interaction.settings import Selection

if TYPE_CHECKING:
    from contact_core.interaction.desk import Desk


def _chosen(desk: Desk) -> tuple[str, ...]:
    """The selected patches. Raises CommandRejected where there is none."""
    if not desk.selection.patches:
        raise CommandRejected("no patch is selected: click one first.")
    return desk.selection.patches


def _free(desk: Desk, *, active: bool = False, reaching: bool = False) -> tuple[str, ...]:
    """The selected patches, or the active one, to be changed. Raises CommandRejected for a locked one."""
    names = _chosen(desk)[-1:] if active else _chosen(desk)
    desk.locks.check_patches(desk.session.document, names, reaching=reaching)
    return names


def remove(desk: Desk) -> None:
    """Remove the selected patches; their children stay."""
    desk.session.patches.remove(*_free(desk))


def clear(desk: Desk) -> None:
    """Remove every patch, and so every pair."""
    if not desk.session.document.patches:
        raise CommandRejected("there are no contacts to clear.")
    desk.locks.check_patches(desk.session.document, desk.session.document.patches)
    desk.session.do(Macro("Clear contacts", (Remove(tuple(desk.session.document.patches), ()),)))


def mirror(desk: Desk) -> None:
    """Turn the selected patches into their mirror images."""
    chosen = _free(desk, reaching=True)
    with desk.session.macro("Mirror " + ", ".join(chosen)):
        for patch in chosen:
            desk.session.patches.mirror(patch)


def detach(desk: Desk) -> None:
    """Give the active patch a shape of its own."""
    desk.session.patches.detach(_free(desk, active=True)[-1])


def unlink(desk: Desk) -> None:
    """Take the selected patches off their parents."""
    document = desk.session.document
    linked = [name for name in _chosen(desk) if isinstance(document.patch(name).placement, Link)]
    if not linked:
        raise CommandRejected("none of the selected patches is the child of another.")
    desk.locks.check_patches(document, linked)
    with desk.session.macro("Unlink " + ", ".join(linked)):
        for patch in linked:
            desk.session.patches.unlink(patch)


def unpair(desk: Desk) -> None:
    """Dissolve the pairs of the selected patches."""
    chosen = set(_chosen(desk))
    pairs = [p.name for p in desk.session.document.pairs.values() if {p.manipulator, p.object} & chosen]
    if not pairs:
        raise CommandRejected("none of the selected patches is paired.")
    commands: tuple[Command, ...] = tuple(map(Unpair, pairs))
    desk.session.do(Macro("Unpair " + ", ".join(sorted(chosen)), commands))


def in_order(document: ContactDocument, first: str, second: str) -> tuple[str, str]:
    """The patch of the manipulator, then that of the object: what has a rig comes first."""
    rigged = [document.surface(document.patch(name).surface).rig is not None for name in (first, second)]
    return (second, first) if rigged == [False, True] else (first, second)


def pair(desk: Desk) -> None:
    """Pair the two selected patches; they stay selected. Raises CommandRejected where two cannot meet."""
    document, chosen = desk.session.document, _chosen(desk)
    if len(chosen) != 2:
        raise CommandRejected(f"two patches make a pair, but got {len(chosen)}: select one on each surface.")
    if document.patch(chosen[0]).surface == document.patch(chosen[1]).surface:
        raise CommandRejected("patches of two surfaces are paired, but both are on one: link them instead.")
    if any({pair.manipulator, pair.object} == set(chosen) for pair in document.pairs.values()):
        raise CommandRejected("the two are paired already.")
    desk.session.pairs.add(*in_order(document, *chosen))


def default_axis(desk: Desk) -> None:
    """Lay the axis of the active patch anew, by the default generator."""
    desk.session.patches.set_axis(_free(desk, active=True, reaching=True)[-1])


def lock(desk: Desk) -> None:
    """Lock the selected patches, or unlock them where all are; without any, the surface that tools work on."""
    surface = desk.selection.surface
    kind: Kind = "patch" if desk.selection.patches or surface is None else "surface"
    names = set(_chosen(desk)) if kind == "patch" or surface is None else {surface}
    had = desk.locks.patches if kind == "patch" else desk.locks.surfaces
    for name in names if names <= had else names - had:
        desk.locks = desk.locks.turned(kind, name)


def rest(desk: Desk) -> None:
    """Put every hand back to rest."""
    posed = list(desk.session.document.poses)
    if not posed:
        raise CommandRejected("every hand is at rest already.")
    with desk.session.macro("Rest pose"):
        for surface in posed:
            desk.session.surfaces.clear_pose(surface)


def other_surface(desk: Desk) -> None:
    """Tools work on the next surface, after the last on whatever is in front."""
    names: list[str | None] = [*desk.scene.surfaces, None]
    here = names.index(desk.selection.surface) if desk.selection.surface in names else len(names) - 1
    desk.selection = replace(desk.selection, surface=names[(here + 1) % len(names)])


def select_nothing(desk: Desk) -> None:
    """No patch, and whatever surface is in front."""
    desk.selection = Selection()


def select_all(desk: Desk) -> None:
    """Every patch of the surface that tools work on, of all surfaces where there is none such."""
    document, surface = desk.session.document, desk.selection.surface
    names = (patch.name for patch in document.patches.values() if surface in (None, patch.surface))
    desk.selection = replace(desk.selection, patches=tuple(names))


EDITS: Mapping[str, Callable[[Desk], None]] = {
    "selection.remove": remove,
    "selection.clear": clear,
    "selection.mirror": mirror,
    "selection.detach": detach,
    "selection.unlink": unlink,
    "selection.pair": pair,
    "selection.unpair": unpair,
    "selection.axis": default_axis,
    "selection.lock": lock,
    "selection.surface": other_surface,
    "selection.none": select_nothing,
    "selection.all": select_all,
    "pose.rest": rest,
}
