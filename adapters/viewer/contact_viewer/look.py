"""How the viewer looks: two themes, and colours of contacts that a colour-blind artist tells apart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from contact_core.document.document import Color


@dataclass(frozen=True)
class Theme:
    """Colours of a view, RGB 0..1. skin: of surfaces with a rig; things: of the others, in turn."""

    name: str
    top: Color
    bottom: Color
    skin: Color
    things: tuple[Color, ...]
    ink: Color
    quiet: Color
    accent: Color
    alarm: Color

    def hexed(self, color: str) -> str:
        """One of its colours as "#rrggbb"."""
        value: Color = getattr(self, color)
        return hexed(value)


DARK = Theme(
    name="dark",
    top=(0.176, 0.188, 0.212),
    bottom=(0.098, 0.106, 0.122),
    skin=(0.800, 0.725, 0.675),
    things=((0.560, 0.585, 0.625), (0.600, 0.560, 0.510), (0.500, 0.560, 0.560)),
    ink=(0.925, 0.933, 0.949),
    quiet=(0.580, 0.604, 0.647),
    accent=(0.310, 0.639, 0.965),
    alarm=(0.980, 0.420, 0.380),
)
LIGHT = Theme(
    name="light",
    top=(0.968, 0.972, 0.980),
    bottom=(0.820, 0.835, 0.860),
    skin=(0.870, 0.775, 0.715),
    things=((0.690, 0.712, 0.750), (0.740, 0.700, 0.640), (0.640, 0.700, 0.690)),
    ink=(0.118, 0.133, 0.165),
    quiet=(0.400, 0.424, 0.470),
    accent=(0.082, 0.396, 0.753),
    alarm=(0.760, 0.130, 0.110),
)
THEMES: Mapping[str, Theme] = {theme.name: theme for theme in (DARK, LIGHT)}


def hexed(color: Color) -> str:
    """A colour as "#rrggbb"."""
    return "#" + "".join(f"{round(255 * part):02x}" for part in color)


def from_hex(text: str) -> Color:
    """The colour of "#rrggbb". Raises ValueError for anything else."""
    digits = text.removeprefix("#")
    if len(digits) != 6:
        raise ValueError(f"a colour is spelt #rrggbb, but got {text!r}.")
    red, green, blue = (int(digits[k : k + 2], 16) / 255 for k in (0, 2, 4))
    return red, green, blue


def darker(color: Color, by: float = 0.6) -> Color:
    """The same hue with less light, for outlines."""
    red, green, blue = (by * part for part in color)
    return red, green, blue
