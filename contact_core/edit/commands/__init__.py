"""Every built-in command; `edit.command_table` makes the default table of what is named here."""

from contact_core.edit.command import Macro
from contact_core.edit.commands.organising import (
    Group,
    Import,
    Pair,
    Recolor,
    Rename,
    SetExtra,
    Ungroup,
    Unpair,
)
from contact_core.edit.commands.painting import Detach, Erase, Extend, Paint, Remove, Reshape, Weigh
from contact_core.edit.commands.placing import (
    Bend,
    LinkPatch,
    Mirror,
    Rotate,
    Scale,
    Settle,
    Transfer,
    Translate,
    Unlink,
)
from contact_core.edit.commands.surfaces import (
    AddSurface,
    ClearPose,
    PlaceSurface,
    RebindSurface,
    RemoveSurface,
    RenameSurface,
    SetPose,
)
from contact_core.edit.commands.timing import ClearTrack, SetKeys, SetSpans, SetTimeline

__all__ = [
    "AddSurface",
    "Bend",
    "ClearPose",
    "ClearTrack",
    "Detach",
    "Erase",
    "Extend",
    "Group",
    "Import",
    "LinkPatch",
    "Macro",
    "Mirror",
    "Paint",
    "Pair",
    "PlaceSurface",
    "RebindSurface",
    "Recolor",
    "Remove",
    "RemoveSurface",
    "Rename",
    "RenameSurface",
    "Reshape",
    "Rotate",
    "Scale",
    "SetExtra",
    "SetKeys",
    "SetPose",
    "SetSpans",
    "SetTimeline",
    "Settle",
    "Transfer",
    "Translate",
    "Ungroup",
    "Unlink",
    "Unpair",
    "Weigh",
]
