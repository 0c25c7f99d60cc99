"""A stroke: one drag of the artist, previewed from the document at its start, committed once or not at all."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from contact_core.contact.axis_generator import AxisGenerator
from contact_core.contact.brush import Brush
from contact_core.document.document import ContactDocument
from contact_core.edit.command import Command, apply_command
from contact_core.edit.derived import Derived
from contact_core.edit.verbs.brushing import BrushVerbs
from contact_core.edit.verbs.gathering import GatheringVerbs
from contact_core.edit.verbs.organising import OrganisingVerbs
from contact_core.edit.verbs.placing import PlacingVerbs
from contact_core.edit.verbs.reshaping import ReshapingVerbs
from contact_core.errors import CommandRejected
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import Rig


class Stroke(BrushVerbs, GatheringVerbs, ReshapingVerbs, PlacingVerbs, OrganisingVerbs):
    """The verbs that change the document, none of which commits: each replaces the preview by what it makes of the
    starting document. What reads and writes files is not among them. Brushes and axes by name are those of the
    session; a brush is made once, at its first use in the stroke.

    Nothing accumulates, so a drag there and back ends where it began. When the `with` block of
    `Session.stroke` ends, the last command is committed as one step; when it raises, nothing has happened.
    """

    def __init__(
        self,
        start: ContactDocument,
        revision: int,
        derived: Derived,
        rigs: dict[str, Rig],
        preview: Callable[[ContactDocument], None],
        session: BrushVerbs,
    ) -> None:
        self.rigs = rigs
        self._start = start
        self._revision = revision
        self._derived = derived
        self._preview = preview
        self._session = session
        self._brushes: dict[str, Brush] = {}
        self._command: Command | None = None
        self._shown = start
        self._open = True

    @property
    def document(self) -> ContactDocument:
        """The document at the start of the stroke: what every verb starts from."""
        return self._start

    @property
    def preview_document(self) -> ContactDocument:
        """The document as the stroke shows it now."""
        return self._shown

    @property
    def derived(self) -> Derived:
        """Reconstructed geometry, cached."""
        return self._derived

    def named_brush(self, name: str, **settings: Any) -> Brush:
        """A brush of the session by name, made at its first use with these settings."""
        key = repr((name, sorted(settings.items())))
        if key not in self._brushes:
            self._brushes[key] = self._session.named_brush(name, **settings)
        return self._brushes[key]

    def default_axis(
        self, surface: str, patch: str, points: SurfacePoints, generator: str | AxisGenerator | None
    ) -> SurfacePoints:
        """Axis points for a new patch, from an axis generator of the session."""
        return self._session.default_axis(surface, patch, points, generator)

    @property
    def command(self) -> Command | None:
        """What would be committed now."""
        return self._command

    def submit(self, command: Command, *, origin: str = "user") -> int:
        """Preview a command in place of the one before. Raises CommandRejected; then the old preview stays."""
        if not self._open:
            raise CommandRejected("this stroke is over.")
        self._shown = apply_command(command, self._start)
        self._command = command
        self._preview(self._shown)
        return self._revision

    def cancel(self) -> None:
        """Back to the start; nothing will be committed unless another verb comes."""
        self._command, self._shown = None, self._start
        self._preview(self._start)

    def abandon(self) -> None:
        """End it with nothing to commit, nor to show."""
        self._command, self._shown, self._open = None, self._start, False

    def end(self) -> Command | None:
        """Close the stroke; answers what is to be committed."""
        self._open = False
        return self._command
