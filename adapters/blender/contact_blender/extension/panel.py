"""The panel "Contact" in the sidebar of the 3D view. Drawing reads what is kept and computes nothing."""

from __future__ import annotations

from typing import Any

import bpy

from contact_blender.extension import shared

_Group = bpy.types.PropertyGroup


def _settings(name: str, properties: dict[str, Any]) -> Any:
    return type(name, (_Group,), {"__annotations__": properties, "__module__": __name__})


Row = _settings(
    "ContactRow",
    {"pair": bpy.props.StringProperty(), "color": bpy.props.FloatVectorProperty(subtype="COLOR", min=0.0, max=1.0)},
)
ContactSettings = _settings(
    "ContactSettings",
    {
        "patch": bpy.props.StringProperty(name="Patch", description="The active patch"),
        "other": bpy.props.StringProperty(name="Other", description="The patch to pair with or to link to"),
        "name": bpy.props.StringProperty(name="New name"),
        "angle": bpy.props.FloatProperty(name="Angle", subtype="ANGLE", default=0.2617993877991494),
        "along": bpy.props.FloatProperty(name="Along", default=1.0, min=0.001),
        "spread": bpy.props.FloatProperty(name="Across", default=1.0, min=0.001),
        "penetration": bpy.props.BoolProperty(name="Keep skin out of what is solid", default=True),
        "keyed": bpy.props.BoolProperty(name="Key the scene's frames", default=False),
        "rows": bpy.props.CollectionProperty(type=Row),
    },
)


def groups() -> tuple[Any, ...]:
    """The property groups, in the order of registering."""
    return Row, ContactSettings


class CONTACT_PT_contacts(bpy.types.Panel):  # noqa: N801 (Blender's spelling)
    """Surfaces, patches and pairs, and what can be done with them."""

    bl_label = "Contact"
    bl_category = "Contact"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"

    def draw(self, context: Any) -> None:
        layout, gone, found = self.layout, shared.missing(), shared.held()
        if gone:
            layout.label(text="A library is missing: see the add-on's preferences", icon="ERROR")
            return
        if found is None:
            if shared.is_stored():
                layout.operator("contact.begin")
            _draw_painting(layout)
            return
        settings, document = context.window_manager.contact, found.session.document
        layout.label(text=f"Surfaces: {', '.join(document.surfaces) or 'none yet'}")
        _draw_painting(layout)
        _draw_patches(layout, settings, document)
        if document.patches:
            _draw_editing(layout, settings)
        if document.pairs:
            _draw_pairs(layout, settings, found, context.scene)


PANELS = (CONTACT_PT_contacts,)


def _draw_painting(layout: Any) -> None:
    layout.operator("contact.add_surfaces")
    layout.operator("contact.paint")


def _draw_patches(layout: Any, settings: Any, document: Any) -> None:
    box = layout.box()
    box.label(text=f"Patches: {len(document.patches)}")
    colors = {row.name: row for row in settings.rows}
    for name in document.patches:
        line = box.row()
        if name in colors:
            swatch = line.row()
            swatch.enabled = False  # it shows, and sets nothing
            swatch.prop(colors[name], "color", text="")
            line.label(text=colors[name].pair, icon="LINKED" if colors[name].pair else "UNLINKED")
        line.label(text=name)
    box.prop_search(settings, "patch", settings, "rows")
    box.prop_search(settings, "other", settings, "rows")


def _draw_editing(layout: Any, settings: Any) -> None:
    column = layout.column(align=True)
    column.operator("contact.paint", text="Add Selection to Patch").patch = settings.patch
    for names in (("erase", "select"), ("transfer", "translate"), ("pair", "link"), ("unpair", "unlink")):
        row = column.row(align=True)
        for name in names:
            row.operator(f"contact.{name}")
    column.prop(settings, "angle")
    row = column.row(align=True)
    row.operator("contact.rotate").angle = settings.angle
    row.operator("contact.bend").angle = settings.angle
    column.prop(settings, "along")
    column.prop(settings, "spread")
    scale = column.operator("contact.scale")
    scale.along, scale.spread = settings.along, settings.spread
    column.prop(settings, "name")
    row = column.row(align=True)
    row.operator("contact.rename").name = settings.name
    row.operator("contact.remove")


def _draw_pairs(layout: Any, settings: Any, found: shared.Held, scene: Any) -> None:
    box = layout.box()
    fresh = found.solved == found.session.revision
    box.label(text="Pairs" if fresh or not found.residuals else "Pairs (edited since the last solve)")
    for name in found.session.document.pairs:
        residual = found.residuals.get(name)
        line = box.row()
        line.label(text=name)
        line.label(text="not solved" if residual is None else f"within {residual:.3g}")
    box.prop(settings, "penetration")
    box.prop(settings, "keyed")
    solve = box.operator("contact.solve")
    solve.penetration, solve.keyed = settings.penetration, settings.keyed
    solve.first, solve.last = scene.frame_start, scene.frame_end
    row = box.row(align=True)
    row.operator("contact.settle")
    row.operator("contact.slide")
    row.operator("contact.clear_pose")
