"""Tools in the toolbar of Object and Pose Mode, their keys, the operators of the table's actions, and a pie menu.

All of it is made of the table (`settings.table`): a tool that the product gains gets a button, its header and its
key by running `adapters/blender/tool_table.py`. Keys are in the keymaps of the tools, so that they act while one of
them is in the hand and never else; the one global chord opens the pie menu.
"""

from __future__ import annotations

from typing import Any

import bpy

from contact_blender.extension import chords, settings, shared
from contact_blender.extension.declaring import why_not
from contact_blender.extension.modal import OF_ITS_OWN, is_ready, refuse

MODES = ("OBJECT", "POSE")
PIE_CHORD = {"type": "J", "value": "PRESS", "shift": True, "alt": True}
# Groups of the toolbar, the first of each the one that is shown at first, with Blender's own drawings.
GROUPS = (
    ("select",),
    ("paint", "erase", "lasso", "curve"),
    ("transfer", "pair", "link"),
    ("move", "turn", "bend", "scale", "axis", "weigh"),
    ("joint",),
    ("measure",),
)
ICONS = {
    "select": "ops.generic.select", "paint": "brush.sculpt.paint", "erase": "brush.gpencil_draw.erase",
    "lasso": "ops.generic.select_lasso", "curve": "ops.curve.draw", "transfer": "ops.gpencil.sculpt_clone",
    "pair": "ops.curve.extrude_move", "link": "ops.armature.extrude_move", "move": "ops.transform.translate",
    "turn": "ops.transform.rotate", "bend": "ops.gpencil.edit_bend", "scale": "ops.transform.resize",
    "axis": "ops.gpencil.draw.line", "weigh": "ops.gpencil.radius", "joint": "ops.pose.push",
    "measure": "ops.view3d.ruler",
}  # fmt: skip
PIE = (
    "tool.paint",
    "tool.transfer",
    "tool.move",
    "tool.bend",
    "pose.solve",
    "pose.settle",
    "pose.suggest",
    "pose.key",
)


def operator_of(action: str) -> str:
    """The id of the operator that does an action of the table."""
    return f"contact.do_{action.replace('.', '_')}"


def tool_id(name: str) -> str:
    """The id of the tool of this name in Blender."""
    return f"contact.{name}"


def _actions() -> list[Any]:
    """The actions that have an operator: all that are the interaction's or are done here."""
    there = (each for each in settings.table()["actions"] if each["id"] not in chords.WHILE_PROPOSED)
    return [each for each in there if not chords.is_blenders(each)]


def operators() -> tuple[Any, ...]:
    """An operator for every action, for keys, menus and the search."""
    return tuple(_operator(action) for action in _actions())


def _operator(action: Any) -> Any:
    name, label = action["id"], action["label"]

    def poll(cls: Any, context: Any) -> bool:
        reason = shared.missing() or why_not(context, "")
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def run(self: Any, context: Any) -> set[str]:
        return _did(self, context, name)

    content = {
        "__module__": __name__,
        "bl_idname": operator_of(name),
        "bl_label": f"Contact: {label}",
        "bl_description": action["help"][:1].upper() + action["help"][1:],
        "bl_options": {"REGISTER"},
        "poll": classmethod(poll),
        "execute": run,
    }
    return type(f"CONTACT_OT_do_{name.replace('.', '_')}", (bpy.types.Operator,), content)


def _did(operator: Any, context: Any, action: str) -> set[str]:
    """Do an action; a refusal is a report."""
    if action.startswith("tool."):
        return _take_up(operator, context, action.removeprefix("tool."))
    if action in OF_ITS_OWN:
        return _begun(bpy.ops.contact.propose("INVOKE_DEFAULT", action=action))
    if not is_ready(operator, context):
        return {"CANCELLED"}
    from contact_core.errors import ContactError

    try:
        if action == "pose.key":
            operator.report({"INFO"}, key_pose(context))
        elif action == "edit.radius":
            return _begun(bpy.ops.contact.radius("INVOKE_DEFAULT"))
        else:
            shared.artist().do(action)
            shared.follow_selection()
    except ContactError as error:
        refuse(operator, context, str(error))
        return {"CANCELLED"}
    return {"FINISHED"}


def _begun(result: set[str]) -> set[str]:
    """A modal operator that was begun goes on by itself."""
    return {"FINISHED"} if "RUNNING_MODAL" in result else result


def key_pose(context: Any) -> str:
    """Key the pose of every hand of the document at the current frame, as one step. Raises InvalidInput."""
    from contact_core.errors import InvalidInput

    session, frame = shared.session(), float(context.scene.frame_current_final)
    bound = session.binding.surfaces
    hands = [name for name in session.document.surfaces if name in session.rigs and name in bound]
    if not hands:
        raise InvalidInput("no hand or body of the scene is a surface yet: paint on one first.")
    with session.host.step(f"Key the pose at frame {frame:g}"):
        for name in hands:
            object_id = bound[name].object_id
            session.host.write_pose(object_id, session.host.read_pose(object_id), frame)
    return f"Keyed {', '.join(hands)} at frame {frame:g}."


def _take_up(operator: Any, context: Any, name: str) -> set[str]:
    if context.mode not in MODES:
        refuse(operator, context, "contact tools are in the toolbar of Object Mode and Pose Mode: go there first.")
        return {"CANCELLED"}
    bpy.ops.wm.tool_set_by_id(name=tool_id(name), space_type="VIEW_3D")
    return {"FINISHED"}


# -- tools --------------------------------------------------------------------------------------------------------


def _tools(mode: str) -> list[tuple[Any, dict[str, Any]]]:
    """The classes of the tools of a mode, each with how it is registered."""
    mine = {action["id"] for action in _actions()}
    told = {tool["name"]: tool for tool in settings.tools() if f"tool.{tool['name']}" in mine}
    grouped = {name for group in GROUPS for name in group}
    groups = [tuple(n for n in group if n in told) for group in GROUPS]
    groups += [(name,) for name in told if name not in grouped]
    found, last = [], None
    for number, group in enumerate(each for each in groups if each):
        for name in group:
            first = name == group[0]
            place: dict[str, Any] = {"separator": number == 0, "group": True} if first else {"after": {last}}
            found.append((_tool(told[name], mode), place))
            last = tool_id(name)
    return found


def _tool(tool: Any, mode: str) -> Any:
    name = tool["name"]

    def draw_settings(context: Any, layout: Any, _tool: Any) -> None:
        held = getattr(context.window_manager, "contact_tools", None)
        if held is None:
            return
        settings.draw(layout, getattr(held, name), tool["settings"])
        layout.prop(held.all, "live")
        layout.popover("CONTACT_PT_live", text="Following")

    content = {
        "__module__": __name__,
        "bl_space_type": "VIEW_3D",
        "bl_context_mode": mode,
        "bl_idname": tool_id(name),
        "bl_label": f"Contact {name.capitalize()}",
        "bl_description": f"{tool['summary'][:1].upper()}{tool['summary'][1:]}.\n{tool['hint']}",
        "bl_icon": ICONS.get(name, "ops.generic.cursor"),
        "bl_keymap": keymap(name),
        "draw_settings": staticmethod(draw_settings),
    }
    return type(f"CONTACT_WT_{name}_{mode.lower()}", (bpy.types.WorkSpaceTool,), content)


def keymap(tool: str) -> tuple[Any, ...]:
    """The items of a tool's keymap: the pointer, then the keys of all actions."""
    mine = {"properties": [("tool", tool)]}
    items: list[Any] = [
        ("contact.gesture", {"type": "LEFTMOUSE", "value": "PRESS", "any": True}, mine),
        ("contact.hover", {"type": "MOUSEMOVE", "value": "ANY", "any": True}, mine),
    ]
    for action in _actions():
        items += [(operator_of(action["id"]), chords.item_of(chord), None) for chord in chords.chords_of(action)]
    return tuple(items)


# -- the pie menu -------------------------------------------------------------------------------------------------


class CONTACT_MT_pie(bpy.types.Menu):  # noqa: N801 (Blender's spelling)
    """Contact tools and what is solved for, round the pointer."""

    bl_label = "Contact"

    def draw(self, context: Any) -> None:
        pie = self.layout.menu_pie()
        labels = {action["id"]: action["label"] for action in settings.table()["actions"]}
        for action in PIE:
            pie.operator(operator_of(action), text=labels[action])


class CONTACT_PT_live(bpy.types.Panel):  # noqa: N801 (Blender's spelling)
    """How the hand follows while contacts are dragged."""

    bl_label = "Following"
    bl_space_type = "VIEW_3D"
    bl_region_type = "HEADER"
    bl_ui_units_x = 14

    def draw(self, context: Any) -> None:
        held = getattr(context.window_manager, "contact_tools", None)
        if held is not None:
            settings.draw(self.layout.column(), held.all, settings.general())


def classes() -> tuple[Any, ...]:
    """What has to be registered beside the tools."""
    return (*settings.groups(), *operators(), CONTACT_MT_pie, CONTACT_PT_live)


_registered: list[Any] = []
_items: list[tuple[Any, Any]] = []


def register() -> None:
    """Put the tools into the toolbar, and the chord of the pie menu into the keymap."""
    bpy.types.WindowManager.contact_tools = bpy.props.PointerProperty(type=settings.groups()[-1])
    for mode in MODES:
        for kind, place in _tools(mode):
            bpy.utils.register_tool(kind, **place)
            _registered.append(kind)
    config = bpy.context.window_manager.keyconfigs.addon
    if config is None:  # without a window
        return
    found = config.keymaps.new(name="3D View", space_type="VIEW_3D")
    item = found.keymap_items.new("wm.call_menu_pie", **PIE_CHORD)
    item.properties.name = "CONTACT_MT_pie"
    _items.append((found, item))


def unregister() -> None:
    """Take them out again."""
    while _items:
        keymaps, item = _items.pop()
        keymaps.keymap_items.remove(item)
    while _registered:
        bpy.utils.unregister_tool(_registered.pop())
    if hasattr(bpy.types.WindowManager, "contact_tools"):
        del bpy.types.WindowManager.contact_tools
