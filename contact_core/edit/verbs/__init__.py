"""The artist's verbs: each finds out, with the meshes, what a command has to hold, and submits that command."""

from contact_core.edit.verbs.editor import Editor
from contact_core.edit.verbs.organising import OrganisingVerbs
from contact_core.edit.verbs.painting import PaintingVerbs
from contact_core.edit.verbs.placing import PlacingVerbs


class Verbs(PaintingVerbs, PlacingVerbs, OrganisingVerbs):
    """All verbs. A session commits what they submit, a stroke previews it."""


__all__ = ["Editor", "Verbs"]
