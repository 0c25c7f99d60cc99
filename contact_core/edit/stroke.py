"""A stroke: one drag of the artist, previewed from the document at its start, committed once or not at all."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from contact_core.contact.axis_generator import AxisGenerator
from contact_core.contact.brush import Brush
from contact_core.document.document import ContactDocument, Proxy
from contact_core.edit.command import Command, Macro, apply_command
from contact_core.edit.derived import Derived
from contact_core.edit.document_geometry import DocumentGeometry
from contact_core.edit.editor import Editor, Makers
from contact_core.edit.verbs import Pairs, Patches, Surfaces
from contact_core.errors import CommandRejected
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.progress import NO_PROGRESS, Progress


class Stroke:
    """An editor whose verbs do not commit: each replaces the preview by what it makes of the starting document.
    Brushes and axes by name are those of the session; a brush is made once, at its first use in the stroke.

    Nothing accumulates, so a drag there and back ends where it began. When the `with` block of
    `Session.stroke` ends, the last command is committed as one step; when it raises, nothing has happened.
    """

    def __init__(
        self, editor: Editor, preview: Callable[[ContactDocument], None], seen: ContactDocument | None = None
    ) -> None:
        self.rigs = editor.rigs
        self.makers: Makers = KeptBrushes(editor.makers)
        self._start = editor.document if seen is None else seen
        self._derived = editor.derived
        self._preview = preview
        self._edit: Command | None = None
        self._following: tuple[Command, ...] = ()
        self._shown = self._start
        self._open = True
        self.geometry = DocumentGeometry(lambda: self._start, self._derived, self.rigs)
        self.patches, self.pairs, self.surfaces = Patches(self), Pairs(self), Surfaces(self)

    @property
    def document(self) -> ContactDocument:
        """The document at the start of the stroke: what every verb starts from."""
        return self._start

    @property
    def preview_document(self) -> ContactDocument:
        """The document as the stroke shows it now."""
        return self._shown

    @property
    def timed_document(self) -> ContactDocument:
        """The same: a stroke is drawn at one frame."""
        return self._start

    @property
    def derived(self) -> Derived:
        """Reconstructed geometry, cached."""
        return self._derived

    @property
    def edit(self) -> Command | None:
        """What the last verb previews, without what follows it."""
        return self._edit

    @property
    def command(self) -> Command | None:
        """What would be committed now."""
        return _joined(self._edit, self._following)

    def do(self, command: Command, *, origin: str = "user") -> None:
        """Preview a command in place of the one before. Raises CommandRejected; then the old preview stays."""
        self._show(command, self._following)

    def follow(self, commands: tuple[Command, ...]) -> None:
        """Preview these after the edit, and after each that takes its place, and commit them with it: the pose that
        follows what is dragged. Raises CommandRejected; then the old preview stays."""
        self._show(self._edit, commands)

    def cancel(self) -> None:
        """Back to the start; nothing will be committed unless another verb comes."""
        self._edit, self._following, self._shown = None, (), self._start
        self._preview(self._start)

    def abandon(self) -> None:
        """End it with nothing to commit, nor to show."""
        self._edit, self._following, self._shown, self._open = None, (), self._start, False

    def end(self) -> Command | None:
        """Close the stroke; returns what is to be committed."""
        self._open = False
        return self.command

    def _show(self, edit: Command | None, following: tuple[Command, ...]) -> None:
        if not self._open:
            raise CommandRejected("this stroke is over.")
        whole = _joined(edit, following)
        self._shown = self._start if whole is None else apply_command(whole, self._start)
        self._edit, self._following = edit, following
        self._preview(self._shown)


def _joined(edit: Command | None, following: tuple[Command, ...]) -> Command | None:
    """An edit and what follows it as one step, under the name of the edit."""
    if not following:
        return edit
    if edit is None:
        return Macro(", ".join(each.label() for each in following), following)
    return Macro(edit.label(), (edit, *following))


class KeptBrushes(Makers):
    """Makers whose brushes are made once for each name and settings."""

    def __init__(self, makers: Makers) -> None:
        self._makers = makers
        self.mends = makers.mends
        self._brushes: dict[str, Brush] = {}

    def brush(self, name: str, **settings: Any) -> Brush:
        """A brush by name, made at its first use with these settings."""
        key = repr((name, sorted(settings.items())))
        if key not in self._brushes:
            self._brushes[key] = self._makers.brush(name, **settings)
        return self._brushes[key]

    def axis(
        self,
        geometry: DocumentGeometry,
        surface: str,
        patch: str,
        points: SurfacePoints,
        generator: str | AxisGenerator | None = None,
    ) -> SurfacePoints:
        """Axis points, as the makers behind have them."""
        return self._makers.axis(geometry, surface, patch, points, generator)

    def proxy(
        self,
        mesh: TriangleMesh,
        maker: str | None = None,
        settings: Mapping[str, Any] | None = None,
        progress: Progress = NO_PROGRESS,
    ) -> tuple[Proxy, TriangleMesh]:
        """A proxy, as the makers behind have it."""
        return self._makers.proxy(mesh, maker, settings, progress)
