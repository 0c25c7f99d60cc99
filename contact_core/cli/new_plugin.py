"""`contact new-plugin NAME`: a distribution with a plugin and its tests, ready to install."""

from __future__ import annotations

import argparse
import keyword
import re
import tempfile
from pathlib import Path

from contact_core._version import __version__
from contact_core.errors import FileRefused, InvalidInput

_TEMPLATE = Path(__file__).parent / "template"


class NewPlugin:
    name = "new-plugin"
    summary = "write a package with a plugin of your own, tests included"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument("plugin", metavar="NAME", help="the name of the distribution, such as studio-contact")
        parser.add_argument("--in", dest="folder", type=Path, default=Path(), help="where to put the folder NAME")

    def run(self, arguments: argparse.Namespace) -> int:
        written = write_plugin(arguments.plugin, arguments.folder)
        steps = f'cd {written}\npip install -e ".[test]"\ncontact plugins\npytest --contact-report'
        arguments.output.answer({"written": str(written)}, f"wrote {written}. Next:\n\n{steps}")
        return 0


def write_plugin(name: str, folder: Path) -> Path:
    """Write the template as folder/name; whole or not at all. Raises InvalidInput, FileRefused."""
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9]*([-_.][A-Za-z0-9]+)*", name):
        raise InvalidInput(f"a plugin's name is letters and digits joined by hyphens, but got {name!r}.")
    import_name = re.sub(r"[-.]", "_", name).lower()
    if keyword.iskeyword(import_name) or import_name in ("contact_core", "contact_builtins", "test", "tests"):
        raise InvalidInput(f"{name!r} cannot be the name of a package; choose another, such as studio-{name}.")
    target = folder / name
    if target.exists():
        raise FileRefused(f"{target} exists already; choose another name or remove it first.")
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder, prefix=".new-plugin-") as scratch:
        made = Path(scratch) / name
        for source in sorted(_TEMPLATE.rglob("*.template")):
            place = made / _filled(str(source.relative_to(_TEMPLATE)), name, import_name).removesuffix(".template")
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text(_filled(source.read_text(encoding="utf-8"), name, import_name), encoding="utf-8")
        made.rename(target)
    return target


def _filled(text: str, name: str, import_name: str) -> str:
    from contact_core.plugins.hookspecs import API_VERSION

    values = {
        "DISTRIBUTION": name,
        "IMPORT_NAME": import_name,
        "CORE_VERSION": __version__,
        "API_MAJOR": str(API_VERSION[0]),
        "API_NEXT": str(API_VERSION[0] + 1),
    }
    for word, value in values.items():
        text = text.replace(word, value)
    return text
