"""The page: tools at the left, the bar at the top, the view, the tree and the settings at the right."""

from __future__ import annotations

from importlib import resources
from typing import Any

from contact_viewer.web.library import library
from contact_viewer.web.timeline import timeline

ICONS = {
    "select": "mdi-cursor-default-outline",
    "paint": "mdi-brush-variant",
    "erase": "mdi-eraser",
    "lasso": "mdi-lasso",
    "curve": "mdi-vector-curve",
    "axis": "mdi-arrow-top-right-thin",
    "move": "mdi-arrow-all",
    "rotate": "mdi-rotate-right",
    "turn": "mdi-rotate-right",
    "bend": "mdi-vector-polyline",
    "scale": "mdi-arrow-expand-all",
    "transfer": "mdi-content-duplicate",
    "link": "mdi-link-variant",
    "pair": "mdi-handshake-outline",
    "place": "mdi-axis-arrow",
    "object": "mdi-axis-arrow",
    "joint": "mdi-bone",
    "pose": "mdi-hand-back-right-outline",
    "measure": "mdi-ruler",
    "weigh": "mdi-weight",
}
# two patches are selected that do not meet yet
_TWO = (
    "((two) => two.length === 2 && two[0].pair !== two[1].name)"
    "(tree.filter((row) => row.kind === 'patch' && row.selected))"
)
_OTHER_ICON = "mdi-circle-outline"


def build(server: Any, stream_name: str) -> None:
    """Lay the page out. What is behind it answers to the controller's names `act_*` and to the state."""
    from trame.ui.vuetify3 import VAppLayout
    from trame.widgets import client, html, rca
    from trame.widgets import vuetify3 as v3

    with VAppLayout(server, full_height=True, theme=("theme", "dark")) as layout:
        layout.root.theme = ("theme",)
        client.Style(_text("page.css") + _text("timeline.css") + _text("library.css"))
        client.Script(_text("page.js") + _text("timeline.js"))
        _top(v3, html)
        _tools(v3, html)
        _right(v3, html)
        with v3.VMain(style="position: relative; height: 100vh;"):
            with html.Div(
                classes="contact-view", style=("`inset: 44px 320px ${film_open ? 300 : 38}px 64px;`",)
            ):  # fmt: skip
                with rca.RemoteControlledArea(
                    name=stream_name, display="image", event_throttle_ms=0, style="width: 100%; height: 100%;",
                ):  # fmt: skip
                    html.Canvas(classes="contact-image")
                html.Div(v_if=("split",), classes="contact-divider")
                library(v3, html)
                with html.Div(v_if=("heat",), classes="contact-legend"):
                    with html.Div(v_for="stop in legend", key=("stop.text",)):
                        html.Span(classes="contact-mark", style=("'background: ' + stop.color",))
                        html.Span("{{ stop.text }}")
                html.Div("{{ next_step }}", v_if=("next_step && !proposed",), classes="contact-empty")
                with html.Div(classes="contact-line", style=("library_wanted ? 'left: 278px' : ''",)):
                    html.Div("{{ line }}", classes="contact-chip")
                    html.Div("{{ refusal }}", v_if=("refusal",), classes="contact-chip contact-refusal")
            timeline(v3, html, _button)
        _dialogs(v3, html)


def _button(v3: Any, icon: str, tip: str, **attributes: Any) -> None:
    with v3.VBtn(icon=True, size="small", density="comfortable", title=tip, **attributes):
        v3.VIcon(icon, size="20")


def _top(v3: Any, html: Any) -> None:
    busy = ("work || proposed ? 'contact-busy' : ''",)
    with v3.VAppBar(height=44, flat=True, color="surface", border="b", classes=busy):
        html.Div(
            "{{ title }}",
            style="padding: 0 8px 0 14px; font-weight: 500; max-width: 210px;",
            classes="text-truncate",
        )
        _button(v3, "mdi-folder-open-outline", "Open (Ctrl+O)", click="open_wanted = true")
        _button(v3, "mdi-content-save-outline", "Save (Ctrl+S)", click="trigger('act', ['file.save'])")
        _button(v3, "mdi-export-variant", "Export (Ctrl+E)", click="export_wanted = true")
        _button(v3, "mdi-bookshelf", "Library of grasps (Ctrl+G)", click="library_wanted = !library_wanted")
        v3.VDivider(vertical=True, classes="mx-2")
        for icon, name, action, key in (
            ("mdi-undo-variant", "undo_name", "edit.undo", "Ctrl+Z"),
            ("mdi-redo-variant", "redo_name", "edit.redo", "Ctrl+Shift+Z"),
        ):
            with v3.VBtn(
                size="small", variant="text", classes="px-2 text-none", disabled=(f"!{name}",),
                title=(f"{name} + ' ({key})'",), click=f"trigger('act', ['{action}'])",
            ):  # fmt: skip
                v3.VIcon(icon, size="20")
                html.Span(
                    f"{{{{ {name} }}}}", classes="ml-1 text-truncate d-none d-lg-inline-block",
                    style="max-width: 150px; font-weight: 400;",
                )  # fmt: skip
        html.Span("open in {{ pages }} pages, one document", v_if=("pages > 1",), classes="text-caption ml-3",
                  style="opacity: .7;")  # fmt: skip
        v3.VSpacer()
        with html.Div(v_if=("work",), classes="d-flex align-center mr-2", style="gap: 8px; min-width: 190px;"):
            html.Span(
                "{{ work.title }} {{ work.text }}", classes="text-caption text-truncate", style="max-width: 190px;"
            )
            v3.VProgressLinear(
                indeterminate=("work.fraction === null",), model_value=("100 * (work.fraction || 0)",),
                color="primary", rounded=True, style="width: 90px;",
            )  # fmt: skip
            v3.VBtn(
                "Cancel",
                size="small",
                variant="tonal",
                classes="text-none",
                click="trigger('act', ['edit.cancel'])",
            )
        with html.Div(v_if=("proposed",), classes="d-flex align-center mr-2", style="gap: 6px;"):
            _button(v3, "mdi-chevron-up", "The suggestion before (Up)", v_show=("suggested > 1",),
                    click="trigger('act', ['pose.before'])")  # fmt: skip
            _button(v3, "mdi-chevron-down", "The next suggestion (Down)", v_show=("suggested > 1",),
                    click="trigger('act', ['pose.another'])")  # fmt: skip
            v3.VBtn("Keep", size="small", color="primary", variant="flat", classes="text-none", title="Enter",
                    click="trigger('act', ['edit.accept'])")  # fmt: skip
            v3.VBtn("Leave", size="small", variant="tonal", classes="text-none", title="Esc",
                    click="trigger('act', ['edit.cancel'])")  # fmt: skip
        v3.VBtn("Solve", prepend_icon="mdi-hand-back-right-outline", size="small", color="primary", variant="flat",
                classes="text-none mr-1", title="Solve (Space)",
                click="trigger('act', ['pose.solve'])")  # fmt: skip
        v3.VBtn("Suggest", prepend_icon="mdi-lightbulb-outline", size="small", variant="tonal",
                classes="text-none mr-1", title="Look for grasps of the object (Shift+G)",
                click="trigger('act', ['pose.suggest'])")  # fmt: skip
        for name, icon, label, action, tip in (
            (
                "live",
                "mdi-lightning-bolt-outline",
                "Live",
                "pose.live",
                "The hand follows while contacts are dragged (V)",
            ),
            ("xray", "mdi-eye-circle-outline", "X-ray", "show.xray", "See through the other surfaces (X)"),
            ("heat", "mdi-thermometer", "Heat", "show.heat", "Colour the skin by distance and depth (Shift+H)"),
            ("isolate", "mdi-crop-free", "Isolate", "show.isolate", "Show only the surface in hand (I)"),
            (
                "split",
                "mdi-view-split-vertical",
                "Split",
                "view.split",
                "The hand left, the object right, each with a camera (Shift+X)",
            ),
        ):
            v3.VBtn(
                label, prepend_icon=icon, size="small", classes="contact-toggle text-none mx-1 px-2", title=tip,
                variant=(f"{name} ? 'tonal' : 'text'",), color=(f"{name} ? 'primary' : undefined",),
                click=f"trigger('act', ['{action}'])",
            )  # fmt: skip
        v3.VDivider(vertical=True, classes="mx-1")
        _button(v3, "mdi-fit-to-page-outline", "See all (Home)", click="trigger('act', ['view.home'])")
        _button(v3, "mdi-theme-light-dark", "Dark or light", click="theme = theme === 'dark' ? 'light' : 'dark'")
        _button(v3, "mdi-school-outline", "Tutorial (F1)", click="trigger('act', ['show.tutorial'])")
        _button(v3, "mdi-keyboard-outline", "Keys (?)", click="help_wanted = !help_wanted")


def _tools(v3: Any, html: Any) -> None:
    with v3.VNavigationDrawer(permanent=True, width=64, color="surface", border="e"):
        with html.Div(classes="contact-scroll", style="padding: 6px 4px; height: 100%;"):
            with html.Div(
                v_for="tool in tools", key=("tool.id",),
                classes=("'contact-tool' + (tool.active ? ' active' : '')",),
                title=("tool.label + (tool.key ? ' (' + tool.key + ')' : '') + ': ' + tool.help",),
                click="trigger('act', [tool.id])",
            ):  # fmt: skip
                v3.VIcon("{{ tool.icon }}", size="20")
                html.Span("{{ tool.label }}")
                html.Span("{{ tool.key }}", classes="key")


def _right(v3: Any, html: Any) -> None:
    with v3.VNavigationDrawer(permanent=True, location="right", width=320, color="surface", border="s"):
        with html.Div(style="display: flex; flex-direction: column; height: 100%;"):
            _card(v3, html)
            with html.Div(classes="contact-head"):
                html.Span("Surfaces and contacts")
                v3.VBtn("Pair", size="x-small", variant="tonal", color="primary", classes="text-none",
                        prepend_icon="mdi-handshake-outline", title="Pair the two selected patches (Ctrl+P)",
                        v_if=(_TWO,), click="trigger('act', ['selection.pair'])")  # fmt: skip
                html.Span("{{ report.head }}", style="text-transform: none; letter-spacing: 0;",
                          classes=("report.rows.length ? 'level' + report.rows[0].level : ''",))  # fmt: skip
            with html.Div(classes="contact-scroll", style="flex: 1 1 46%; min-height: 120px;"):
                _tree_row(v3, html)
            v3.VDivider()
            with html.Div(v_if=("report.rows.some((row) => row.level > 0)",)):
                html.Div("What is wrong", classes="contact-head")
                with html.Div(classes="contact-scroll", style="max-height: 118px;"):
                    with html.Div(
                        v_for="row in report.rows.filter((row) => row.level > 0)", key=("row.pair",),
                        classes="contact-row", style="padding-left: 12px;",
                        click="trigger('choose', ['patch', row.patch, false])",
                    ):  # fmt: skip
                        html.Span(classes="contact-mark", style=("'background: ' + row.color",))
                        html.Span("{{ row.patch }}", style="font-weight: 500;", classes="text-truncate")
                        html.Span("{{ row.words }}", classes=("'name level' + row.level",))
                v3.VDivider()
            with html.Div(classes="contact-scroll", style="flex: 1 1 40%; padding-bottom: 10px;"):
                with html.Div(v_for="group in settings", key=("group.slot + group.name",)):
                    html.Div("{{ group.title }}", classes="contact-head")
                    _field(html)


def _card(v3: Any, html: Any) -> None:
    """The card of the tutorial: which step, its words with keys, a tick, and the ways on."""
    with html.Div(v_if=("card",), classes="contact-card"):
        with html.Div(classes="steps"):
            html.Span(
                v_for="step in card.steps", key=("step.name",), title=("step.name",),
                classes=("(step.done ? 'done' : '') + (step.now ? ' now' : '')",),
            )  # fmt: skip
            html.Span(style="flex: 1;")
            with html.A(title="End the tutorial (F1)", click="trigger('card', ['end'])"):
                v3.VIcon("mdi-close", size="16")
        with html.Div(classes="title"):
            v3.VIcon("mdi-check-circle", v_if="card.done", size="18", color="success")
            html.Span("{{ card.title }}")
            html.Span("{{ card.progress }}", classes="count")
        with html.Div(classes="words"):
            with html.Template(v_for="part in card.words", key=("part.text",)):
                html.Kbd("{{ part.text }}", v_if="part.key")
                html.Span("{{ part.text }}", v_else=True)
        with html.Div(v_if="card.far_side", classes="turn"):
            v3.VIcon("mdi-rotate-3d-variant", size="16")
            html.Span("The mark is on the far side: drag with the middle button to turn the view.")
        with html.Div(classes="ways"):
            v3.VBtn("Back", size="small", variant="text", classes="text-none", disabled=("card.first",),
                    title="Shift+F2", click="trigger('card', ['back'])")  # fmt: skip
            html.Span(style="flex: 1;")
            v3.VBtn("{{ card.over ? 'Close' : card.done ? 'Next' : 'Skip' }}", size="small", classes="text-none",
                    variant=("card.done ? 'flat' : 'text'",), color=("card.done ? 'primary' : undefined",),
                    title="F2", click="trigger('card', ['next'])")  # fmt: skip


def _tree_row(v3: Any, html: Any) -> None:
    with html.Div(
        v_for="row in tree", key=("row.key",), classes=("'contact-row' + (row.selected ? ' chosen' : '')",),
        style=("'padding-left: ' + (10 + 14 * row.depth) + 'px'",),
        click="trigger('choose', [row.kind, row.name, $event.shiftKey || $event.ctrlKey])",
    ):  # fmt: skip
        v3.VIcon(
            "{{ row.rig ? 'mdi-hand-back-right-outline' : 'mdi-cube-outline' }}",
            v_if="row.kind === 'surface'",
            size="16",
        )
        html.Input(
            v_if="row.kind === 'patch'", type="color", value=("row.color",), click="$event.stopPropagation()",
            change="trigger('recolor', [row.name, $event.target.value])", title="Colour; its partners follow",
        )  # fmt: skip
        html.Input(
            v_if="renaming === row.key", type="text", value=("row.name",), click="$event.stopPropagation()",
            blur="renaming = ''; trigger('rename', [row.name, $event.target.value])", autofocus=True,
        )  # fmt: skip
        html.Span(
            "{{ row.name }}", v_if="renaming !== row.key", classes="name",
            style=("row.kind === 'surface' ? 'font-weight: 500' : ''",),
            title=(
                "row.pair ? 'meets ' + row.pair : (row.loaded === false ? 'its mesh is not loaded' : row.name)",
            ),
            dblclick="renaming = row.kind === 'patch' ? row.key : ''",
        )  # fmt: skip
        v3.VIcon("mdi-link-variant", v_if="row.copies", size="13", style="opacity: .55;",
                 title=("'patches that share its shape: ' + row.copies",))  # fmt: skip
        html.Span("{{ row.gap }}", v_if="row.gap", classes=("'gap level' + row.level",))
        v3.VIcon("{{ row.locked ? 'mdi-lock-outline' : 'mdi-lock-open-variant-outline' }}", size="15",
                 style=("row.locked ? 'opacity: .9' : 'opacity: .3'",),
                 title=("row.locked ? 'Unlock: tools may change it again' : 'Lock: no tool changes it'",),
                 click="$event.stopPropagation(); trigger('lock', [row.kind, row.name])")  # fmt: skip
        v3.VIcon("{{ row.hidden ? 'mdi-eye-off-outline' : 'mdi-eye-outline' }}", size="16",
                 style=("row.hidden ? 'opacity: .9' : 'opacity: .4'",),
                 click="$event.stopPropagation(); trigger('hide', [row.kind, row.name])")  # fmt: skip


def _field(html: Any) -> None:
    tell = "trigger('set', [group.slot, group.name, item.name, {}])"
    with html.Div(v_for="item in group.items", key=("item.name",), classes="contact-field", title=("item.help",)):
        html.Label("{{ item.label }}")
        with html.Div(style="display: flex; align-items: center; gap: 6px;"):
            html.Input(v_if="item.kind === 'flag'", type="checkbox", checked=("item.value",),
                       change=tell.format("$event.target.checked"))  # fmt: skip
            with html.Select(v_else_if="item.kind === 'choice'", value=("item.value",),
                             change=tell.format("$event.target.value")):  # fmt: skip
                html.Option("decide for me", v_if="item.optional", value="")
                html.Option("{{ choice }}", v_for="choice in item.choices", key=("choice",), value=("choice",),
                            selected=("choice === item.value",))  # fmt: skip
            html.Input(v_else=True, type=("['number', 'count'].includes(item.kind) ? 'number' : 'text'",),
                       value=("item.value",), min=("item.low",), max=("item.high",), step="any",
                       placeholder=("item.optional ? 'decide for me' : ''",),
                       change=tell.format("$event.target.value"))  # fmt: skip
            html.Span("{{ item.unit }}", v_if="item.unit", classes="contact-unit")


def _dialogs(v3: Any, html: Any) -> None:
    with v3.VDialog(v_model=("help_wanted", False), max_width=1480, width="92vw"), v3.VCard(title="Keys"):
        with v3.VCardText(style="max-height: calc(100vh - 130px);", classes="contact-scroll"):
            with html.Div(v_for="group in help_groups", key=("group.name",)):
                html.Div("{{ group.name }}", classes="contact-head px-0")
                with (
                    html.Div(classes="contact-keys"),
                    html.Div(
                        v_for="entry in group.entries",
                        key=("entry.id",),
                        classes="entry",
                        title=("entry.help",),
                    ),
                ):
                    html.Kbd("{{ entry.keys }}")
                    html.Span("{{ entry.label }}")
            html.Div("Camera", classes="contact-head px-0")
            html.Div(
                "Drag where nothing is, or with the middle button: orbit. Shift + middle or right button: pan."
                " Wheel: zoom at the pointer.",
                style="font-size: 12.5px;",
            )
    with v3.VDialog(v_model=("open_wanted", False), width=560):
        with v3.VCard(title="Open"):
            with v3.VCardText():
                html.P(
                    "A hand and an object (glb, gltf, urdf, obj, ply, stl ...), a scene (contactscene, usd), or a"
                    " document with its meshes. Files can be dropped on the window, too.",
                    classes="mb-3",
                )
                v3.VTextField(v_model=("open_path", ""), label="Files on this machine, separated by ;",
                              density="compact", variant="outlined", hide_details=True)  # fmt: skip
                with html.Div(classes="d-flex flex-wrap mt-3", style="gap: 8px;"):
                    v3.VBtn("Open", color="primary", variant="flat", classes="text-none",
                            click="open_wanted = false; trigger('open', [open_path, false])")  # fmt: skip
                    v3.VBtn("Add to the scene", variant="tonal", classes="text-none",
                            click="open_wanted = false; trigger('open', [open_path, true])")  # fmt: skip
                    v3.VSpacer()
                    v3.VBtn("Upload ...", variant="tonal", classes="text-none", click="$refs.upload.click()")
                    html.Input(type="file", multiple=True, style="display: none;", ref="upload",
                               change="open_wanted = false;"
                               " utils.get('contactUpload')([...$event.target.files], 'add')")  # fmt: skip
                html.Div("Built in", classes="contact-head px-0 mt-2")
                with html.Div(classes="d-flex flex-wrap", style="gap: 6px;"):
                    v3.VBtn("{{ sample }}", v_for="sample in samples", key=("sample",), size="small",
                            variant="outlined",
                            classes="text-none", title="Add to the scene",
                            click="open_wanted = false; trigger('open', ['sample:' + sample, true])")  # fmt: skip
    with v3.VDialog(v_model=("export_wanted", False), width=480), v3.VCard(title="Save as, or export"):
        with v3.VCardText():
            v3.VTextField(v_model=("export_path", ""), label="File on this machine", density="compact",
                          variant="outlined", hide_details=True,
                          placeholder="grasp.contactscene, grasp.glb, grasp.usda")  # fmt: skip
            with html.Div(classes="d-flex mt-3", style="gap: 8px;"):
                v3.VBtn("Write", color="primary", variant="flat", classes="text-none",
                        click="export_wanted = false; trigger('write', [export_path])")  # fmt: skip
                v3.VSpacer()
                for suffix in ("contactscene", "glb", "usda"):
                    v3.VBtn(suffix, variant="tonal", classes="text-none", href=f"/download/scene.{suffix}",
                            title="Download")  # fmt: skip


def icon_of(tool: str) -> str:
    """The icon of a tool by its name."""
    return next((icon for name, icon in ICONS.items() if tool.startswith(name)), _OTHER_ICON)


def _text(name: str) -> str:
    """A file beside this one."""
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")
