"""The tab "Contact" in the sidebar of the 3D view. Drawing reads what is kept and computes nothing.

A row that is renamed or recoloured in a list calls its operator a moment later: the rows are made anew by that, and
Blender still holds the row while it tells of the change.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from contact_blender.extension import shared

_Group = bpy.types.PropertyGroup
_SETTLED = 0.4  # seconds without a change after which a colour that is being picked is taken


def _settings(name: str, properties: dict[str, Any], **functions: Any) -> Any:
    return type(name, (_Group,), {"__annotations__": properties, "__module__": __name__, **functions})


# Changes of rows, told to operators


def _renamed(row: Any, context: Any) -> None:
    if not shared.is_listing() and row.label != row.name:
        old, new = row.name, row.label
        _later(lambda: bpy.ops.contact.rename(patch=old, name=new), 0.0)


def _recolored(row: Any, context: Any) -> None:
    if not shared.is_listing():
        name, color = row.name, tuple(row.color)
        _later(lambda: bpy.ops.contact.recolor(patch=name, color=color), _SETTLED)


_waiting: list[Callable[[], None]] = []


def _later(act: Callable[[], Any], seconds: float) -> None:
    """Run an operator when Blender has let go of the row; of several changes the last counts."""
    stop_waiting()

    def run() -> None:
        _waiting.clear()
        manager = bpy.context.window_manager
        try:
            with bpy.context.temp_override(window=manager.windows[0]):
                act()
        except RuntimeError as error:  # how Blender hands on what an operator reports
            said = str(error).removeprefix("Error: ").strip()
            manager.popup_menu(lambda menu, _: menu.layout.label(text=said), title="Contact", icon="ERROR")
            shared.list_patches()  # the row says again what is true

    _waiting.append(run)
    bpy.app.timers.register(run, first_interval=seconds)


def stop_waiting() -> None:
    """Forget what was about to be told."""
    for run in _waiting:
        if bpy.app.timers.is_registered(run):
            bpy.app.timers.unregister(run)
    _waiting.clear()


def _row_of(rows: str, active: str) -> Any:
    """An index for a list of Blender, of which the name is what is kept."""

    def read(settings: Any) -> int:
        names = [row.name for row in getattr(settings, rows)]
        name = getattr(settings, active)
        return names.index(name) if name in names else -1

    def write(settings: Any, index: int) -> None:
        there = getattr(settings, rows)
        if 0 <= index < len(there):
            setattr(settings, active, there[index].name)

    return bpy.props.IntProperty(get=read, set=write, options={"HIDDEN"})


Row = _settings(
    "ContactRow",
    {
        "label": bpy.props.StringProperty(name="Name", description="Double-click to rename", update=_renamed),
        "pair": bpy.props.StringProperty(),
        "color": bpy.props.FloatVectorProperty(
            name="Colour",
            description="The colour of the patch",
            subtype="COLOR",
            min=0.0,
            max=1.0,
            update=_recolored,
        ),
    },
)
PairRow = _settings("ContactPairRow", {"ends": bpy.props.StringProperty()})
ContactSettings = _settings(
    "ContactSettings",
    {
        "patch": bpy.props.StringProperty(name="Patch", description="The active patch"),
        "other": bpy.props.StringProperty(
            name="Other Patch", description="The patch that the active one is paired with or linked to"
        ),
        "pair": bpy.props.StringProperty(name="Pair", description="The active pair"),
        "name": bpy.props.StringProperty(name="New name"),
        "angle": bpy.props.FloatProperty(
            name="Angle", description="How far to turn or to bend", subtype="ANGLE", default=0.2617993877991494
        ),
        "along": bpy.props.FloatProperty(
            name="Along", description="Size along the axis; 1 is as painted", default=1.0, min=0.001, soft_max=3.0
        ),
        "spread": bpy.props.FloatProperty(
            name="Across", description="Size across the axis; 1 is as painted", default=1.0, min=0.001, soft_max=3.0
        ),
        "penetration": bpy.props.BoolProperty(
            name="No Penetration", description="Keep skin out of what is solid", default=True
        ),
        "keyed": bpy.props.BoolProperty(
            name="Key All Frames", description="Solve every frame of the scene's range and key it", default=False
        ),
        "rows": bpy.props.CollectionProperty(type=Row),
        "pairs": bpy.props.CollectionProperty(type=PairRow),
        "row": _row_of("rows", "patch"),
        "pair_row": _row_of("pairs", "pair"),
    },
)


def groups() -> tuple[Any, ...]:
    """The property groups, in the order of registering."""
    return Row, PairRow, ContactSettings


class CONTACT_UL_patches(bpy.types.UIList):  # noqa: N801 (Blender's spelling)
    """Patches: colour, name, and whether one is paired."""

    def draw_item(
        self, context: Any, layout: Any, data: Any, item: Any, icon: Any, owner: Any, active: Any
    ) -> None:
        row = layout.row(align=True)
        swatch = row.row()
        swatch.ui_units_x = 1.0
        swatch.prop(item, "color", text="")
        row.prop(item, "label", text="", emboss=False)
        row.label(text="", icon="LINKED" if item.pair else "BLANK1")


class CONTACT_UL_pairs(bpy.types.UIList):  # noqa: N801 (Blender's spelling)
    """Pairs: what touches what, and how near it came."""

    def draw_item(
        self, context: Any, layout: Any, data: Any, item: Any, icon: Any, owner: Any, active: Any
    ) -> None:
        split = layout.split(factor=0.68)
        split.label(text=item.ends, icon="LINKED")
        near = split.row()
        near.alignment = "RIGHT"
        near.label(text=nearness(item.name, context.scene))


def nearness(pair: str, scene: Any) -> str:
    """How near 95 % of a pair's points came, in the scene's unit of length; a question mark after a later edit."""
    found = shared.held()
    value = None if found is None else found.residuals.get(pair)
    if found is None or value is None:
        return "not solved"
    units = scene.unit_settings
    if units.system == "NONE":
        told = f"{value:.3g}"
    else:
        told = bpy.utils.units.to_string(units.system, "LENGTH", value * units.scale_length, precision=3)
    return told if found.solved == found.session.revision else f"{told} ?"


class _InSidebar:
    """Where the panels are."""

    bl_category = "Contact"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"


class _OfPatches(_InSidebar):
    """A panel that is there as soon as there is a patch."""

    bl_parent_id = "CONTACT_PT_contacts"

    @classmethod
    def poll(cls, context: Any) -> bool:
        found = shared.held()
        return found is not None and bool(found.session.document.patches)


class CONTACT_PT_contacts(_InSidebar, bpy.types.Panel):  # noqa: N801 (Blender's spelling)
    """Surfaces and patches."""

    bl_label = "Contact"

    def draw(self, context: Any) -> None:
        layout, gone, found = self.layout, shared.missing(), shared.held()
        if gone:
            layout.label(text="A library is missing or broken:", icon="ERROR")
            layout.label(text="see the add-on's preferences")
            return
        if found is None and shared.is_stored():
            layout.operator("contact.begin", icon="FILE_REFRESH")
            return
        if found is None or not found.session.document.patches:
            _draw_start(layout)
        else:
            _draw_patches(layout, context.window_manager.contact, found.session.document)


class CONTACT_PT_shape(_OfPatches, bpy.types.Panel):  # noqa: N801 (Blender's spelling)
    """Where the active patch lies, and its shape."""

    bl_label = "Edit Patch"

    def draw(self, context: Any) -> None:
        layout, settings = self.layout, context.window_manager.contact
        row = layout.row(align=True)
        row.operator("contact.transfer", icon="PASTEDOWN")
        row.operator("contact.translate")
        column = layout.column(align=True)
        column.prop(settings, "angle")
        row = column.row(align=True)
        row.operator("contact.rotate").angle = settings.angle
        row.operator("contact.bend").angle = settings.angle
        column = layout.column(align=True)
        row = column.row(align=True)
        row.prop(settings, "along")
        row.prop(settings, "spread")
        scale = column.operator("contact.scale")
        scale.along, scale.spread = settings.along, settings.spread


class CONTACT_PT_pairs(_OfPatches, bpy.types.Panel):  # noqa: N801 (Blender's spelling)
    """What touches what, and what follows what."""

    bl_label = "Pairs and Links"

    def draw(self, context: Any) -> None:
        layout, settings = self.layout, context.window_manager.contact
        if len(settings.pairs):
            layout.template_list("CONTACT_UL_pairs", "", settings, "pairs", settings, "pair_row", rows=2)
        layout.prop_search(settings, "other", settings, "rows", text="Other", icon="MESH_GRID")
        column = layout.column(align=True)
        row = column.row(align=True)
        row.operator("contact.pair", icon="LINKED").other = settings.other
        row.operator("contact.unpair", icon="UNLINKED").pair = settings.pair
        row = column.row(align=True)
        row.operator("contact.link", icon="CON_CHILDOF").parent = settings.other
        row.operator("contact.unlink")


class CONTACT_PT_pose(_OfPatches, bpy.types.Panel):  # noqa: N801 (Blender's spelling)
    """The pose in which the pairs touch."""

    bl_label = "Pose"

    def draw(self, context: Any) -> None:
        layout, settings, scene = self.layout, context.window_manager.contact, context.scene
        column = layout.column()
        column.prop(settings, "penetration")
        column.prop(settings, "keyed")
        large = layout.row()
        large.scale_y = 1.4
        solve = large.operator("contact.solve", icon="POSE_HLT")
        solve.penetration, solve.keyed = settings.penetration, settings.keyed
        solve.first, solve.last = scene.frame_start, scene.frame_end
        column = layout.column(align=True)
        row = column.row(align=True)
        row.operator("contact.settle", text="Settle")
        row.operator("contact.slide", text="Slide")
        column.operator("contact.clear_pose", icon="LOOP_BACK")
        _draw_bones(layout, settings.patch)


class CONTACT_MT_bones(bpy.types.Menu):  # noqa: N801 (Blender's spelling)
    """Which bones of the rig under the active patch a solve may pose."""

    bl_label = "Bones"
    bl_idname = "CONTACT_MT_bones"

    def draw(self, context: Any) -> None:
        found = _rig_under(context.window_manager.contact.patch)
        for choice, label in found[1] if found else ():
            self.layout.operator("contact.choose_bones", text=label).bones = choice


class CONTACT_PT_time(_OfPatches, bpy.types.Panel):  # noqa: N801 (Blender's spelling)
    """When the active pair holds; its bars are in the timeline."""

    bl_label = "Over Time"

    @classmethod
    def poll(cls, context: Any) -> bool:
        found = shared.held()
        return found is not None and bool(found.session.document.pairs)

    def draw(self, context: Any) -> None:
        column = self.layout.column(align=True)
        column.operator("contact.span_add", icon="ADD")
        row = column.row(align=True)
        row.operator("contact.span_trim", text="Start Here", icon="TRACKING_FORWARDS_SINGLE").end = "on"
        row.operator("contact.span_trim", text="End Here", icon="TRACKING_BACKWARDS_SINGLE").end = "off"
        row = column.row(align=True)
        row.operator("contact.span_move", text="Earlier", icon="TRIA_LEFT").frames = -1.0
        row.operator("contact.span_move", text="Later", icon="TRIA_RIGHT").frames = 1.0
        row = column.row(align=True)
        row.operator("contact.span_ease", icon="IPO_EASE_IN_OUT")
        row.operator("contact.span_remove", icon="REMOVE")
        column = self.layout.column(align=True)
        column.operator("contact.film_measure", icon="DRIVER_DISTANCE")
        column.operator_menu_enum("contact.film_worst", "curve")


PANELS = (
    CONTACT_UL_patches,
    CONTACT_UL_pairs,
    CONTACT_PT_contacts,
    CONTACT_PT_shape,
    CONTACT_PT_pairs,
    CONTACT_PT_time,
    CONTACT_PT_pose,
    CONTACT_MT_bones,
)


def _draw_bones(layout: Any, patch: str) -> None:
    """The choice of the rig under a patch, nothing on what has none."""
    found = _rig_under(patch)
    if found is not None:
        layout.menu("CONTACT_MT_bones", text=f"Bones: {dict(found[1]).get(found[0], found[0])}", icon="BONE_DATA")


def _rig_under(patch: str) -> tuple[str, list[tuple[str, str]]] | None:
    """Of the rig under a patch: what is chosen, and (choice, label) of what can be."""
    held = shared.held()
    if held is None or patch not in held.session.document.patches:
        return None
    bound = held.session.binding.surfaces.get(held.session.document.patch(patch).surface)
    if bound is None or bound.rig is None:
        return None
    host = held.session.host
    return host.bones_of(bound.object_id), host.bone_choices(bound.object_id)


def _draw_start(layout: Any) -> None:
    """What to do first."""
    column = layout.column(align=True)
    column.scale_y = 0.8
    column.label(text="Select vertices in Edit Mode,", icon="INFO")
    column.label(text="leave it (Tab), and paint:", icon="BLANK1")
    column = layout.column(align=True)
    column.operator("contact.paint", icon="BRUSH_DATA")
    column.operator("contact.add_surfaces", icon="MESH_DATA")


def _draw_patches(layout: Any, settings: Any, document: Any) -> None:
    row = layout.row()
    row.template_list("CONTACT_UL_patches", "", settings, "rows", settings, "row", rows=3)
    column = row.column(align=True)
    column.operator("contact.paint", text="", icon="ADD").patch = ""
    column.operator("contact.remove", text="", icon="REMOVE")
    column.separator()
    column.operator("contact.select", text="", icon="RESTRICT_SELECT_OFF")
    if settings.patch in document.patches:
        layout.label(text=f"On {document.patch(settings.patch).surface}", icon="MESH_DATA")
    row = layout.row(align=True)
    row.operator("contact.paint", text="Add Selection", icon="BRUSH_DATA").patch = settings.patch
    row.operator("contact.erase", text="Erase Selection")
    layout.operator("contact.add_surfaces", icon="MESH_DATA")
