"""The one table of actions and keys: it feeds help, documentation, menus and keymaps of hosts."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, TypeAlias

from contact_core.interaction.events import Key
from contact_core.interaction.tool import Tool

Group: TypeAlias = Literal["tool", "edit", "selection", "pose", "film", "show", "file", "view"]
GROUPS: tuple[Group, ...] = ("tool", "edit", "selection", "pose", "film", "show", "file", "view")


@dataclass(frozen=True)
class Action:
    """Something that a key, a button or a menu entry does.

    id: "tool.paint", "edit.undo". keys: chords as `Key.chord` spells them, the first shown in menus. by_host: the
    front end does it (files, its camera), the interaction takes no such key.
    """

    id: str
    label: str
    keys: tuple[str, ...]
    group: Group
    help: str
    by_host: bool = False


ACTIONS: tuple[Action, ...] = (
    Action("edit.undo", "Undo", ("Ctrl+Z",), "edit", "take back the last step; a gesture under way is cancelled"),
    Action("edit.redo", "Redo", ("Ctrl+Shift+Z", "Ctrl+Y"), "edit", "do again what was taken back"),
    Action("edit.cancel", "Cancel", ("Escape",), "edit", "put back what is under way, or leave the proposal"),
    Action("edit.accept", "Accept", ("Enter",), "edit", "commit what is proposed"),
    Action("edit.larger", "Larger brush", ("]",), "edit", "a radius larger by a seventh"),
    Action("edit.smaller", "Smaller brush", ("[",), "edit", "a radius smaller by a seventh"),
    Action("edit.radius", "Radius by the pointer", ("F",), "edit", "move the pointer to set it, then click"),
    Action("selection.surface", "Other surface", ("Tab",), "selection", "work on the next, through all others"),
    Action("selection.none", "Select nothing", ("Ctrl+Shift+A",), "selection", "no patch, and any surface"),
    Action("selection.all", "Select all", ("Ctrl+A",), "selection", "all patches of the surface worked on"),
    Action("selection.remove", "Remove", ("Delete", "Backspace"), "selection", "remove the selected patches"),
    Action("selection.clear", "Clear contacts", ("Ctrl+Delete",), "selection", "remove every patch and pair"),
    Action("selection.mirror", "Mirror", ("M",), "selection", "turn the selected patches into their mirror images"),
    Action("selection.detach", "Detach", ("Shift+D",), "selection", "give the active patch a shape of its own"),
    Action("selection.unlink", "Unlink", ("Shift+K",), "selection", "take the selected patches off their parents"),
    Action("selection.pair", "Pair the two", ("Ctrl+P",), "selection", "pair the two selected patches"),
    Action("selection.unpair", "Unpair", ("Shift+P",), "selection", "dissolve the pairs of the selected patches"),
    Action("selection.axis", "Default axis", ("Shift+W",), "selection", "lay the axis of the active patch anew"),
    Action("selection.lock", "Lock", ("Shift+L",), "selection", "no tool changes the selected patches, or unlock"),
    Action("pose.solve", "Solve", ("Space",), "pose", "propose the pose that brings all pairs together"),
    Action("pose.settle", "Settle", ("Shift+Space",), "pose", "propose closer contacts, and the pose"),
    Action("pose.slide", "Slide", ("Ctrl+Space",), "pose", "propose pose and contacts that give way together"),
    Action("pose.suggest", "Suggest", ("Shift+G",), "pose", "look for grasps of the object, and show the first"),
    Action("pose.another", "Next suggestion", ("Down",), "pose", "show the next grasp of those found so far"),
    Action("pose.before", "Previous suggestion", ("Up",), "pose", "show the grasp before"),
    Action("pose.live", "Live", ("V",), "pose", "whether the hand follows while contacts are dragged"),
    Action("pose.rest", "Rest pose", ("Shift+R",), "pose", "put the hands back to rest"),
    Action("film.play", "Play", ("Shift+Right",), "film", "play the film from here, or stop it"),
    Action("film.first", "First frame", ("Shift+Left",), "film", "go to the first frame of the film"),
    Action("film.solve", "Solve the film", ("Ctrl+Shift+Space",), "film", "propose the poses of all frames"),
    Action("film.window", "Solve round here", ("Shift+T",), "film", "propose two seconds round the frame anew"),
    Action("film.onion", "Onion skin", ("O",), "film", "ghosts of the pose before and after the frame"),
    Action("show.xray", "See through", ("X",), "show", "see through the surface that tools do not work on"),
    Action("show.isolate", "Isolate", ("I",), "show", "show only the surface that tools work on"),
    Action("show.heat", "Heat map", ("Shift+H",), "show", "colour the skin by its distance and depth"),
    Action("show.help", "Keys", ("?", "Shift+?"), "show", "this table", by_host=True),
    Action("show.tutorial", "Tutorial", ("F1",), "show", "begin the guided tutorial, or end it", by_host=True),
    Action("show.card", "Next card", ("F2",), "show", "go on with the tutorial", by_host=True),
    Action("show.card_before", "Card before", ("Shift+F2",), "show", "go back in the tutorial", by_host=True),
    Action("file.open", "Open", ("Ctrl+O",), "file", "open a file", by_host=True),
    Action("file.save", "Save", ("Ctrl+S",), "file", "save the document", by_host=True),
    Action("file.export", "Export", ("Ctrl+E",), "file", "write the posed scene", by_host=True),
    Action("file.library", "Library", ("Ctrl+G",), "file", "apply a saved grasp, or save this one", by_host=True),
    Action("pose.key", "Key the pose", ("A",), "pose", "key the pose at this frame", by_host=True),
    Action("pose.next", "Next key", ("Right",), "pose", "go to the next pose key", by_host=True),
    Action("pose.previous", "Previous key", ("Left",), "pose", "go to the pose key before", by_host=True),
    Action("view.home", "See all", ("Home",), "view", "bring everything into view", by_host=True),
    Action("view.selection", "See the selection", (".",), "view", "bring the selection into view", by_host=True),
    Action("view.split", "Split view", ("Shift+X",), "view", "the hand left, the object right", by_host=True),
    Action("view.front", "Front", ("1",), "view", "look from the front", by_host=True),
    Action("view.side", "Side", ("3",), "view", "look from the side", by_host=True),
    Action("view.top", "Top", ("7",), "view", "look from above", by_host=True),
)  # fmt: skip


def actions_of(tools: Iterable[Tool]) -> tuple[Action, ...]:
    """The whole table: an action to take up each tool, then ACTIONS. A key that is taken goes to nobody else."""
    table: list[Action] = []
    taken = {key for action in ACTIONS for key in action.keys}
    for tool in tools:
        keys = (tool.key,) if tool.key and tool.key not in taken else ()
        taken.update(keys)
        label = tool.name[:1].upper() + tool.name[1:]
        table.append(Action(f"tool.{tool.name}", label, keys, "tool", tool.summary))
    return (*table, *ACTIONS)


def action_of(key: Key, table: Iterable[Action]) -> Action | None:
    """What a key does; None where it does nothing."""
    chord = key.chord
    return next((action for action in table if chord in action.keys), None)


def key_table(table: Iterable[Action]) -> str:
    """The actions and keys as Markdown, group by group."""
    rows = ["| keys | action | what it does |", "|---|---|---|"]
    ordered = sorted(table, key=lambda action: GROUPS.index(action.group))
    for action in ordered:
        keys = ", ".join(f"`{key}`" for key in action.keys)
        by = " (the front end)" if action.by_host else ""
        rows.append(f"| {keys} | {action.label} | {action.help}{by} |")
    return "\n".join(rows) + "\n"
