"""The artist's verbs: each finds out, with the meshes, what a command has to hold, and submits that command."""

from contact_core.edit.verbs.brushing import BrushVerbs
from contact_core.edit.verbs.editor import Editor
from contact_core.edit.verbs.gathering import GatheringVerbs
from contact_core.edit.verbs.organising import OrganisingVerbs
from contact_core.edit.verbs.placing import PlacingVerbs
from contact_core.edit.verbs.reshaping import ReshapingVerbs
from contact_core.edit.verbs.sets import SetVerbs
from contact_core.edit.verbs.surfaces import SurfaceVerbs


class Verbs(BrushVerbs, GatheringVerbs, ReshapingVerbs, PlacingVerbs, OrganisingVerbs, SetVerbs):
    """All verbs. A session commits what they submit, a stroke previews it."""


__all__ = ["Editor", "SurfaceVerbs", "Verbs"]
