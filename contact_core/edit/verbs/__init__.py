"""The artist's verbs, in groups: each finds out, on the geometry, what a command has to hold, and has it done."""

from contact_core.edit.verbs.brushing import BrushVerbs
from contact_core.edit.verbs.gathering import GatheringVerbs
from contact_core.edit.verbs.organising import OrganisingVerbs
from contact_core.edit.verbs.pairs import Pairs
from contact_core.edit.verbs.placing import PlacingVerbs
from contact_core.edit.verbs.reshaping import ReshapingVerbs
from contact_core.edit.verbs.sets import ContactSets
from contact_core.edit.verbs.surfaces import Surfaces
from contact_core.edit.verbs.timing import Film


class Patches(BrushVerbs, GatheringVerbs, ReshapingVerbs, PlacingVerbs, OrganisingVerbs):
    """Everything that is done to patches."""


__all__ = ["ContactSets", "Film", "Pairs", "Patches", "Surfaces"]
