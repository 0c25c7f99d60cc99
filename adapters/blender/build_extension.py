"""Build the extension that Blender installs: `python adapters/blender/build_extension.py [--python 3.11]`.

One zip for one platform and one Python: 3.11 is Blender 4.2 to 5.0, 3.13 is 5.1 and later (3.14: Debian's); `--all`
makes those for which blender.org has a Blender. Our own packages are vendored; what they need comes as unmodified
wheels from the package index, whose SHA-256 the zip lists. numpy is never in it: Blender brings its own, and a
second one in front of it would break Blender (ADR 0078).
"""

from __future__ import annotations

import argparse
import hashlib
import platform
import re
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path, PurePosixPath
from typing import Any

REPOSITORY = Path(__file__).resolve().parents[2]
PACKAGES = {
    "contact_core": REPOSITORY / "contact_core",
    "contact_builtins": REPOSITORY / "plugins" / "contact_builtins",
    "contact_blender": REPOSITORY / "adapters" / "blender" / "contact_blender",
}
BLENDERS = {  # the first version, and the first no more
    "3.11": ("4.2.0", "5.1.0"),
    "3.13": ("5.1.0", None),
    "3.14": ("5.1.0", None),  # as distributions build it
}
NUMPY = {  # as in those Blenders: wheels must fit it
    "3.11": "numpy==1.26.4",
    "3.13": "numpy>=2,<3",
    "3.14": "numpy>=2,<3",
}
PLATFORMS = {
    ("Linux", "x86_64"): "linux-x64",
    ("Windows", "AMD64"): "windows-x64",
    ("Darwin", "arm64"): "macos-arm64",
    ("Darwin", "x86_64"): "macos-x64",
}
TAGS = {  # of wheels, the newest system first that every Blender for the platform runs on
    "linux-x64": ("manylinux_2_28_x86_64", "manylinux_2_27_x86_64", "manylinux_2_17_x86_64"),
    "windows-x64": ("win_amd64",),
    "macos-arm64": ("macosx_12_0_arm64",),
    "macos-x64": ("macosx_12_0_x86_64",),
}
RELEASED = tuple(
    (python, system) for python in ("3.11", "3.13") for system in TAGS if (python, system) != ("3.13", "macos-x64")
)
PERMISSIONS = {"files", "network", "clipboard", "camera", "microphone"}
ENTRY = '''"""Contact areas for posing. All of it is in vendor/contact_blender/extension."""

import sys
from pathlib import Path

VENDOR = str(Path(__file__).parent / "vendor")


def register():
    if VENDOR not in sys.path:
        sys.path.insert(0, VENDOR)
    from contact_blender import extension

    extension.register(__package__)


def unregister():
    from contact_blender import extension

    extension.unregister()
    if VENDOR in sys.path:
        sys.path.remove(VENDOR)
'''
NOTICE = """This extension is offered under GPL-3.0-or-later (https://www.gnu.org/licenses/gpl-3.0.html), as what is
shipped for Blender must be. The sources in vendor/ are under Apache-2.0 as well, see LICENSE; each wheel holds
its own licence.
"""


class NotBuilt(Exception):
    """The zip could not be made; the text says why."""


def this_platform() -> str:
    """Blender's name for the platform that this runs on. Raises NotBuilt."""
    here = PLATFORMS.get((platform.system(), platform.machine()))
    if here is None:
        raise NotBuilt(f"Blender has no name for this platform ({platform.system()}, {platform.machine()}).")
    return here


def manifest(wheels: Iterable[str], python: str, system: str | None = None) -> dict[str, Any]:
    """What blender_manifest.toml says. wheels: file names. system: Blender's name of a platform."""
    first, end = BLENDERS[python]
    return {
        "schema_version": "1.0.0",
        "id": "contact_core",
        "version": _version(),
        "name": "Contact",
        "tagline": "Pose hands and bodies by areas that touch",
        "maintainer": "The contact-core developers",
        "type": "add-on",
        "tags": ["Animation", "Rigging"],
        "license": ["SPDX:GPL-3.0-or-later"],
        "blender_version_min": first,
        **({} if end is None else {"blender_version_max": end}),
        "platforms": [system or this_platform()],
        "wheels": [f"./wheels/{name}" for name in wheels],
        "permissions": {"files": "Save and load contact documents and sets"},
    }


def mistakes(said: Mapping[str, Any], files: Iterable[str]) -> list[str]:
    """What Blender would refuse in a manifest, and what we do, in sentences. files: the zip's, relative."""
    there, found = set(files), []
    texts = ("schema_version", "id", "version", "name", "tagline", "maintainer", "type", "blender_version_min")
    found += [f"{key} is a text, but got {said.get(key)!r}." for key in texts if not _is_text(said.get(key))]
    for key in ("version", "blender_version_min", "blender_version_max"):
        if key in said and not re.fullmatch(r"\d+\.\d+\.\d+", str(said[key])):
            found.append(f"{key} is three numbers, but got {said[key]!r}.")
    if not str(said.get("id", "")).isidentifier():
        found.append(f"id is a name of Python, but got {said.get('id')!r}.")
    if said.get("license") != ["SPDX:GPL-3.0-or-later"]:
        found.append(f"what ships with Blender is under GPL-3.0-or-later, but got {said.get('license')!r}.")
    short = {"tagline": said.get("tagline", ""), **said.get("permissions", {})}
    for key, text in short.items():
        if len(text) > 64 or text[-1:] in ".!?":
            found.append(f"{key} has at most 64 characters and no full stop, but got {text!r}.")
    found += [f"there is no permission {key!r}." for key in sorted(set(said.get("permissions", {})) - PERMISSIONS)]
    for wheel in said.get("wheels", ()):
        path = PurePosixPath(wheel)
        if path.is_absolute() or ".." in path.parts or str(path) not in there:
            found.append(f"the wheel {wheel} is not in the zip.")
        if path.name.lower().startswith("numpy-"):
            found.append("numpy is never bundled: Blender brings its own.")
    return found


def download(folder: Path, python: str, system: str | None = None) -> list[Path]:
    """The wheels of what we need for a platform, without numpy. Raises NotBuilt."""
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    needed = [each for each in project["dependencies"] if not each.startswith("numpy")]
    pip = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check"]
    tags = [part for tag in TAGS[system or this_platform()] for part in ("--platform", tag)]
    chosen = ["--only-binary=:all:", "--python-version", python, *tags, "--dest", str(folder)]
    made = subprocess.run([*pip, *chosen, *needed, NUMPY[python]], capture_output=True, text=True)
    if made.returncode:
        raise NotBuilt("pip could not download the wheels: " + (made.stderr.strip().splitlines() or ["?"])[-1])
    return sorted(path for path in folder.glob("*.whl") if not path.name.lower().startswith("numpy-"))


def build(target: Path, wheels: Iterable[Path], python: str, system: str | None = None) -> Path:
    """Write the zip, the same bytes for the same content. Raises NotBuilt for a manifest with mistakes."""
    wheels = list(wheels)
    files = {f"vendor/{name}": data for name, data in vendored()}
    files["__init__.py"], files["NOTICE"] = ENTRY.encode(), NOTICE.encode()
    files["LICENSE"] = (REPOSITORY / "LICENSE").read_bytes()
    files |= {f"wheels/{path.name}": path.read_bytes() for path in wheels}
    sums = [f"{_sha256(path)}  {path.name}" for path in wheels]
    files["wheels/SHA256SUMS"] = "".join(f"{line}\n" for line in sums).encode()
    said = manifest([path.name for path in wheels], python, system)
    wrong = mistakes(said, files)
    if wrong:
        raise NotBuilt("the manifest is wrong: " + " ".join(wrong))
    files["blender_manifest.toml"] = _toml(said).encode()
    target.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(target, "w") as archive:
        for name in sorted(files):
            kind = zipfile.ZIP_STORED if name.endswith(".whl") else zipfile.ZIP_DEFLATED
            archive.writestr(zipfile.ZipInfo(name), files[name], kind)
    return target


def vendored() -> Iterable[tuple[str, bytes]]:
    """Our packages, with the metadata by which their plugins are found."""
    for name, folder in PACKAGES.items():
        for path in sorted(folder.rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts and path.suffix not in (".nbi", ".nbc", ".pyc"):
                yield f"{name}/{path.relative_to(folder).as_posix()}", path.read_bytes()
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    points = project["entry-points"]["contact_core.plugins"].items()
    ours = [f"{name} = {module}" for name, module in points if module.partition(".")[0] in PACKAGES]
    info = f"contact_core-{_version()}.dist-info"
    yield f"{info}/METADATA", f"Metadata-Version: 2.1\nName: contact-core\nVersion: {_version()}\n".encode()
    yield f"{info}/entry_points.txt", "\n".join(["[contact_core.plugins]", *ours, ""]).encode()


def _version() -> str:
    text = (REPOSITORY / "contact_core" / "_version.py").read_text(encoding="utf-8")
    found = re.search(r'__version__ = "([^"]+)"', text)
    assert found is not None
    return found[1]


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and bool(value.strip())


def _toml(said: Mapping[str, Any]) -> str:
    """Texts, lists of texts, and one table of texts, which comes last."""
    lines = []
    for key, value in said.items():
        if isinstance(value, dict):
            lines += ["", f"[{key}]", *(f'{name} = "{text}"' for name, text in value.items())]
        elif isinstance(value, list):
            lines += [f"{key} = [", *(f'  "{text}",' for text in value), "]"]
        else:
            lines.append(f'{key} = "{value}"')
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--python", choices=sorted(BLENDERS), default="3.11")
    parser.add_argument("--platform", choices=sorted(TAGS), help="by default this one")
    parser.add_argument("--all", action="store_true", help="every zip that is released")
    parser.add_argument("--out", type=Path, default=REPOSITORY / "dist")
    parser.add_argument("--no-wheels", action="store_true", help="for a Blender that has the libraries already")
    chosen = parser.parse_args()
    try:
        wanted = RELEASED if chosen.all else [(chosen.python, chosen.platform or this_platform())]
        for python, system in wanted:
            print(_built(chosen.out, python, system, not chosen.no_wheels), flush=True)
    except NotBuilt as reason:
        print(f"The extension was not built: {reason}")
        return 1
    return 0


def _built(folder: Path, python: str, system: str, bundles: bool) -> str:
    """Make one zip; what it is, in words, with the hashes of its wheels. Raises NotBuilt."""
    with tempfile.TemporaryDirectory(prefix="contact-wheels-") as scratch:
        wheels = download(Path(scratch), python, system) if bundles else []
        name = f"contact_core-{_version()}-{system}-python{python}.zip"
        target = build(folder / name, wheels, python, system)
        sizes = [f"{path.stat().st_size / 1e6:6.1f} MB  {_sha256(path)[:16]}  {path.name}" for path in wheels]
    return "\n  ".join([f"{target}: {target.stat().st_size / 1e6:.1f} MB, {len(wheels)} wheels", *sizes])


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


if __name__ == "__main__":
    sys.exit(main())
