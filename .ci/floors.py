"""Draws docs/images/floors.svg: the floors of the core as pyproject.toml states them, with what each is for.

python .ci/floors.py          writes the picture
python .ci/floors.py --check  exits 1 where the one in docs/ is not current
"""

from __future__ import annotations

import ast
import sys
import tomllib
from html import escape
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / "docs" / "images" / "floors.svg"
ROW, GAP, LEFT, WIDTH = 34, 4, 150, 1080  # pixels
MOST_LETTERS = 118
HUES = {"cli": 28, "session": 200, "edit": 150, "geometry": 265}  # where a group of floors begins, from the top


def floors() -> list[list[str]]:
    """The layers of the core, top first; modules that share a floor know nothing of one another."""
    config = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = config["tool"]["importlinter"]["contracts"]
    layers = next(each["layers"] for each in contracts if each["type"] == "layers")
    return [[name.strip() for name in layer.split("|")] for layer in layers if not layer.startswith("_")]


def purpose(name: str) -> str:
    """The first sentence of a package or module of the core."""
    folder = ROOT / "contact_core" / name
    path = folder / "__init__.py" if folder.is_dir() else folder.with_suffix(".py")
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    first = " ".join(text.split("\n\n")[0].split())
    return first if len(first) <= MOST_LETTERS else first[: MOST_LETTERS - 2].rsplit(" ", 1)[0] + " ..."


def picture() -> str:
    """The floors as SVG, top first."""
    rows = [name for floor in floors() for name in floor if not name.startswith("_")]
    height = len(rows) * (ROW + GAP) + GAP
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" font-family="sans-serif"'
        ' role="img" aria-label="The floors of contact_core, top first">'
    ]
    hue, top = 0, GAP
    for floor in floors():
        names = [name for name in floor if not name.startswith("_")]
        hue = next((HUES[name] for name in names if name in HUES), hue)
        tall = len(names) * ROW + (len(names) - 1) * GAP
        lines.append(
            f'<rect x="0" y="{top}" width="{WIDTH}" height="{tall}" rx="4" fill="hsl({hue},45%,93%)"'
            f' stroke="hsl({hue},30%,70%)"/>'
        )
        for name in names:
            middle = top + ROW / 2 + 5
            lines.append(f'<text x="14" y="{middle}" font-size="15" font-weight="600">{escape(name)}</text>')
            lines.append(f'<text x="{LEFT}" y="{middle}" font-size="13" fill="#333">{escape(purpose(name))}</text>')
            top += ROW + GAP
    return "\n".join([*lines, "</svg>", ""])


def main() -> int:
    """Write or check the picture."""
    current = picture()
    if "--check" in sys.argv[1:]:
        return int(not PICTURE.exists() or PICTURE.read_text(encoding="utf-8") != current)
    PICTURE.write_text(current, encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
