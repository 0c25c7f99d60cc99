"""Settings of tools and of the interaction as Blender properties, made of the table beside this file.

Their values go to the interaction when a gesture or an action begins; what keys changed there (the brush's radius)
comes back. A number or a text that a tool may leave open is 0 or empty here.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import bpy

_GROUP = bpy.types.PropertyGroup
_CENTIMETRE = 0.01  # metres
_OPEN = "AUTO"  # of a choice that may be left open
LEFT_OUT = frozenset(("xray", "isolate", "heat"))  # Blender's own shading and local view do this
Plain = Mapping[str, Any]


@cache
def table() -> dict[str, Any]:
    """Tools, actions and settings of the product."""
    found: dict[str, Any] = json.loads((Path(__file__).parent / "tools.json").read_text(encoding="utf-8"))
    return found


def tools() -> list[Any]:
    """What the table says of each tool."""
    return list(table()["tools"])


def general() -> list[Any]:
    """The settings that hold for all tools."""
    return [each for each in table()["settings"] if each["name"] not in LEFT_OUT]


@cache
def groups() -> tuple[Any, ...]:
    """The property groups, in the order of registering; the last holds all others."""
    made = {tool["name"]: _group(tool["name"], tool["settings"]) for tool in tools()}
    everything = _group("all", general())
    pointers = {name: bpy.props.PointerProperty(type=kind) for name, kind in (*made.items(), ("all", everything))}
    whole = type("ContactToolSettings", (_GROUP,), {"__annotations__": pointers, "__module__": __name__})
    return (*made.values(), everything, whole)


def _group(name: str, settings: list[Plain]) -> Any:
    properties = {each["name"]: _property(each) for each in settings}
    properties |= {_switch(each["name"]): _left_open(each["name"]) for each in settings if _may_be_open(each)}
    return type(f"ContactSettings_{name}", (_GROUP,), {"__annotations__": properties, "__module__": __name__})


def _may_be_open(setting: Plain) -> bool:
    """Whether a setting is a number that a tool may leave open: it says "automatic" in place of its 0."""
    return bool(setting["optional"]) and setting["kind"] in ("number", "count")


def _switch(name: str) -> str:
    return f"{name}_is_automatic"


def _left_open(name: str) -> Any:
    """Whether a number is left open; switched off, it starts at a centimetre."""

    def read(group: Any) -> bool:
        return not getattr(group, name)

    def write(group: Any, automatic: bool) -> None:
        if automatic or not getattr(group, name):
            setattr(group, name, 0.0 if automatic else _CENTIMETRE / bpy.context.scene.unit_settings.scale_length)

    said = "Found for each surface by itself; click for a number of your own, or back"
    return bpy.props.BoolProperty(name="Automatic", description=said, get=read, set=write)


def _property(setting: Plain) -> Any:
    """The property that holds a setting."""
    label = setting["name"].replace("_", " ").capitalize()
    said = {"name": label, "description": setting["help"][:1].upper() + setting["help"][1:]}
    kind, default = setting["kind"], setting["default"]
    if kind == "flag":
        return bpy.props.BoolProperty(default=default, **said)
    if kind == "choice":
        items = [(each, each.replace("_", " ").capitalize(), "") for each in setting["choices"]]
        if setting["optional"]:
            items.insert(0, (_OPEN, "Automatic", "Decided by itself"))
        return bpy.props.EnumProperty(items=items, default=default or _OPEN, **said)
    if kind in ("number", "count"):
        return _number(setting, said)
    return bpy.props.StringProperty(
        default=", ".join(default) if isinstance(default, list) else default or "", **said
    )


def _number(setting: Plain, said: dict[str, str]) -> Any:
    """A number within its range; 0 stands for one that is left open."""
    limits: dict[str, Any] = {}
    low = 0.0 if setting["optional"] or setting["above"] is not None else setting["low"]
    if low is not None:
        limits["min"] = low
    if setting["high"] is not None:
        limits["max"] = setting["high"]
    if setting["kind"] == "count":
        whole = {key: int(value) for key, value in limits.items()}
        return bpy.props.IntProperty(default=int(setting["default"] or 0), **whole, **said)
    if setting["unit"] == "scene units":
        limits |= {"subtype": "DISTANCE", "precision": 4, "step": 0.1}
    return bpy.props.FloatProperty(default=setting["default"] or 0.0, **limits, **said)


def _value(group: Any, setting: Plain) -> Any:
    """The value of a setting as the core wants it."""
    value = getattr(group, setting["name"])
    if setting["optional"] and value in (0.0, "", _OPEN):
        return None
    if setting["above"] is not None and value <= setting["above"]:
        return setting["default"]
    if setting["kind"] == "texts":
        return tuple(part.strip() for part in value.split(",") if part.strip())
    return value


def values_of_tools(context: Any) -> dict[str, dict[str, Any]]:
    """What the headers of the tools say, by tool; of those that have settings."""
    held = getattr(context.window_manager, "contact_tools", None)
    if held is None:
        return {}
    return {
        tool["name"]: {each["name"]: _value(getattr(held, tool["name"]), each) for each in tool["settings"]}
        for tool in tools()
        if tool["settings"]
    }


def values_of_all(context: Any) -> dict[str, Any]:
    """What the panel says for all tools."""
    held = getattr(context.window_manager, "contact_tools", None)
    return {} if held is None else {each["name"]: _value(held.all, each) for each in general()}


def follow(context: Any, interaction: Any) -> None:
    """Show what keys have changed: the radius of the tool in the hand, and whether the hand follows."""
    held = getattr(context.window_manager, "contact_tools", None)
    if held is None:
        return
    group = getattr(held, interaction.tool, None)
    radius = getattr(interaction.tool_named(interaction.tool), "radius", None) if interaction.tool else None
    if radius is not None and group is not None and hasattr(group, "radius"):
        group.radius = radius
    held.all.live = interaction.settings.live


def draw(layout: Any, group: Any, settings: list[Plain]) -> None:
    """Each setting in its row or column."""
    for setting in settings:
        name = setting["name"]
        row = layout.row(align=True) if _may_be_open(setting) else layout
        if not _may_be_open(setting) or not getattr(group, _switch(name)):
            row.prop(group, name)
            if row is not layout:
                row.prop(group, _switch(name), text="", icon="LOOP_BACK", toggle=True)
        else:
            row.prop(group, _switch(name), text=f"{name.capitalize()}: automatic", toggle=True)
