"""The chart of docs/sizes.md out of results/latest.json: what single operations take, on a logarithmic scale.

python -m benchmarks.size_chart
"""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

from benchmarks.harness import RESULTS

OUT = Path(__file__).resolve().parents[1] / "docs" / "images" / "sizes.png"
GROUPS = ("4M faces (144 MB)", "500 joints", "2000 patches", "50,000 points", "10,000 edits")
WIDTH, ROW, LEFT, RIGHT = 1400, 34, 590, 170
LEAST, MOST = 0.03, 1e4  # milliseconds at the ends of the axis
INK, PALE, BAR, BEYOND = "#222222", "#dddddd", "#3d6f8e", "#b3541e"
_TIME = re.compile(r"^([\d.e+]+) (ms|s)\b")


def main() -> None:
    rows = json.loads(RESULTS.read_text())["Sizes"]["rows"]
    groups = [(group, _times(rows, group)) for group in GROUPS]
    height = ROW * (sum(len(times) + 1 for _, times in groups) + 2)
    picture = Image.new("RGB", (WIDTH, height), "white")
    draw = ImageDraw.Draw(picture)
    _grid(draw, height)
    y = ROW // 2
    for group, times in groups:
        draw.text((20, y + 6), group, INK, _font(22))
        y += ROW
        for name, milliseconds, missed in times:
            draw.text((LEFT - 14, y + 5), name, INK, _font(19), anchor="ra")
            draw.rectangle((LEFT, y + 4, _x(milliseconds), y + ROW - 8), BEYOND if missed else BAR)
            draw.text((_x(milliseconds) + 8, y + 5), _spelled(milliseconds), INK, _font(19))
            y += ROW
    OUT.parent.mkdir(exist_ok=True)
    picture.save(OUT, optimize=True)


def _times(rows: dict[str, str], group: str) -> list[tuple[str, float, bool]]:
    """Name, milliseconds, and whether a bar was missed, of the rows of a group that are times."""
    found = []
    for name, told in rows.items():
        match = _TIME.match(told)
        if name.startswith(group + ": ") and match:
            factor = 1.0 if match[2] == "ms" else 1e3
            found.append((name[len(group) + 2 :], factor * float(match[1]), "MISSED" in told))
    return found


def _grid(draw: ImageDraw.ImageDraw, height: int) -> None:
    for power in range(math.ceil(math.log10(LEAST)), round(math.log10(MOST)) + 1):
        x = _x(10.0**power)
        draw.line((x, ROW // 2, x, height - ROW), PALE)
        draw.text((x, height - ROW + 4), _spelled(10.0**power), INK, _font(17), anchor="ma")


def _x(milliseconds: float) -> float:
    share = math.log(max(milliseconds, LEAST) / LEAST) / math.log(MOST / LEAST)
    return LEFT + share * (WIDTH - LEFT - RIGHT)


def _spelled(milliseconds: float) -> str:
    value, unit = (milliseconds, "ms") if milliseconds < 1e3 else (milliseconds / 1e3, "s")
    return f"{float(format(value, '.2g')):g} {unit}"


def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


if __name__ == "__main__":
    main()
