"""Regenerate contact_usd/schema from schema.usda with the usdGenSchema of the installed pxr (needs jinja2).

python adapters/usd/generate_schema.py
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

SCHEMA = Path(__file__).parent / "contact_usd" / "schema"
# A codeless plugin beside its plugInfo.json.
PLACEHOLDERS = {
    "@PLUG_INFO_LIBRARY_PATH@": "",
    "@PLUG_INFO_RESOURCE_PATH@": ".",
    "@PLUG_INFO_ROOT@": ".",
}


def generate() -> dict[str, str]:
    """Texts of generatedSchema.usda and plugInfo.json by file name."""
    import pxr

    generator = Path(pxr.__file__).parent / "Usd" / "usdGenSchema.py"
    with tempfile.TemporaryDirectory() as folder:
        # In a process of its own: it sets variables of the environment that cripple every later USD.
        command = [sys.executable, str(generator), str(SCHEMA / "schema.usda"), folder]
        subprocess.run(command, check=True, capture_output=True, timeout=300)
        schema = (Path(folder) / "generatedSchema.usda").read_text(encoding="utf-8")
        plugin = (Path(folder) / "plugInfo.json").read_text(encoding="utf-8")
    for placeholder, value in PLACEHOLDERS.items():
        plugin = plugin.replace(placeholder, value)
    without_comments = re.sub(r"^#.*\n", "", plugin, flags=re.MULTILINE)
    return {
        "generatedSchema.usda": schema.rstrip() + "\n",
        "plugInfo.json": json.dumps(json.loads(without_comments), indent=2) + "\n",
    }


if __name__ == "__main__":
    for name, text in generate().items():
        (SCHEMA / name).write_text(text, encoding="utf-8")
