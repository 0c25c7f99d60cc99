"""What the contacts of a surface run on: its own mesh, or a proxy near it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from contact_core.document.document import Surface
from contact_core.edit.editor import Editor
from contact_core.edit.verbs.rebinding import RebindReport, plan_rebind
from contact_core.geometry.mesh import TriangleMesh
from contact_core.progress import NO_PROGRESS, Progress


def carry(editor: Editor, record: Surface, carrier: TriangleMesh) -> RebindReport:
    """Put the contacts of a surface onto a mesh, which becomes what they run on. record: of the surface then."""
    command, report = plan_rebind(editor, record, carrier)
    editor.derived.bring(carrier)
    editor.do(command)
    return report


def give_proxy(
    editor: Editor,
    surface: str,
    maker: str | None = None,
    settings: Mapping[str, Any] | None = None,
    progress: Progress = NO_PROGRESS,
) -> RebindReport:
    """Have the contacts of a surface run on a proxy made of its mesh. maker: as for `Makers.proxy`, with what it
    raises."""
    record = editor.document.surface(surface)
    proxy, carrier = editor.makers.proxy(editor.geometry.mesh(surface), maker, settings, progress)
    return carry(editor, replace(record, proxy=proxy), carrier)
