"""The panel of the library: thumbnails of grasps, a search, and the grasp of this document saved."""

from __future__ import annotations

from typing import Any

_WORDS = "(library_word || '').toLowerCase().split(' ')"
_FOUND = f"shelves.filter((row) => {_WORDS}.every((word) => row.text.includes(word)))"


def library(v3: Any, html: Any) -> None:
    """Lay the panel out over the left of the view; open while `library_wanted`."""
    with html.Div(v_if=("library_wanted",), classes="contact-library"):
        with html.Div(classes="head"):
            html.Span("Library of grasps")
            with html.A(title="Close (Ctrl+G)", click="library_wanted = false"):
                v3.VIcon("mdi-close", size="16")
        html.Input(type="search", v_model=("library_word", ""), placeholder="Search by name, tag, kind, object",
                   classes="find")  # fmt: skip
        with html.Div(classes="contact-scroll grid"):
            with html.Div(
                v_for=f"row in {_FOUND}", key=("row.key",), classes="grasp",
                title=("row.problem || 'Propose it for this hand and object: Enter keeps it, Esc leaves it'",),
                click="row.problem || trigger('grasp', [row.shelf, row.name])",
            ):  # fmt: skip
                html.Img(src=("`/grasp/${row.shelf}/${encodeURIComponent(row.name)}?v=${row.version}`",),
                         alt=("row.name",), loading="lazy")  # fmt: skip
                html.Div("{{ row.name }}", classes="name")
                html.Div("{{ row.problem || row.tags }}", classes=("row.problem ? 'tags level2' : 'tags'",))
                html.Div("{{ row.shelf === 'own' ? 'yours' : row.made }}", classes="tags")
            html.Div("No grasp has these words.", v_if=(f"!{_FOUND}.length",), classes="none")
        with html.Div(classes="save"):
            html.Input(type="text", v_model=("grasp_name", ""), placeholder="Name of this grasp")
            html.Input(type="text", v_model=("grasp_tags", ""), placeholder="Tags, with commas")
            v3.VBtn("Save this grasp", size="small", variant="tonal", classes="text-none", block=True,
                    disabled=("!grasp_name.trim()",),
                    click="trigger('save_grasp', [grasp_name, grasp_tags])")  # fmt: skip
