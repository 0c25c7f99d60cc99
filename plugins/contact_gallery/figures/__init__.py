"""The figures, one module each: `draw(sheet)` works on a session and shows what it did on the sheet.

The first line of a module's docstring is the figure's title, the rest stands under it on the page. PAPER names the
paper's own figures.
"""

from __future__ import annotations

ORDER = (
    "tool_overview",
    "geodesics",
    "parameterisation",
    "sampling",
    "tentacle_wrap",
    "static_grasps",
    "pitching",
    "bulk_transfer",
    "growing_sphere",
    "mug_handle",
    "scissors",
    "ablations",
    "sitting",
    "contact_models",
    "posing_methods",
    "failures",
    "crowding",
    "proxies",
)
