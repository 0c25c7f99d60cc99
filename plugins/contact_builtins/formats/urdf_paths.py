"""Where the mesh files of a URDF lie: beside it, in its ROS package, or in a package under a root that was given.

A file that somebody sent may name any path. It is read only below the URDF's own folder, below the package that
the URDF lies in (the nearest folder above it with a `package.xml`, else one of the two above it that has the
package's name), and in packages below roots that the user names, by `UrdfFiles(package_roots=...)` or in
ROS_PACKAGE_PATH, as ROS itself has it.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree

from contact_builtins.formats.refusal import file_of
from contact_core.errors import FileRefused

_SCHEMES = ("package://", "model://")
_ABOVE = 2  # folders above a URDF's own, of which one may be its package: package/urdf/arm/arm.urdf
_OUTERMOST = 2  # parts of a path that is no package: /home holds what is nobody's business
_DEPTH = 4  # folders below a root in which packages are sought: a workspace's src/group/package at most


@dataclass(frozen=True)
class MeshPaths:
    """The places of one URDF's meshes. roots: folders that hold packages, or are packages themselves."""

    urdf: Path
    roots: tuple[Path, ...] = ()

    @cached_property
    def folder(self) -> Path:
        return self.urdf.resolve().parent

    @cached_property
    def package(self) -> Path | None:
        """The ROS package around the URDF."""
        return next((f for f in (self.folder, *self.folder.parents) if (f / "package.xml").is_file()), None)

    def find(self, filename: str) -> Path:
        """The file that a mesh's filename means. Raises FileRefused."""
        name = filename.replace("\\", "/")
        if name.lower().startswith(_SCHEMES):
            package, _, rest = name.partition("://")[2].partition("/")
            bases = self._packages(package)
        elif "://" in name and not name.lower().startswith("file://"):
            raise FileRefused(f"{self.urdf} wants the mesh {filename[:200]!r}: only files are read, no addresses.")
        else:
            rest = name[7:] if name.lower().startswith("file://") else name
            bases = [(self.folder, self.package or self.folder)]
        inside = False
        for base, bound in bases:
            for spelled in dict.fromkeys((rest, unquote(rest))):
                wanted = _resolved(base / spelled)
                if wanted is None or not any(wanted.is_relative_to(b) for b in (bound, *self._given)):
                    continue
                wanted = file_of(wanted, bound)
                if not any(wanted.is_relative_to(b) for b in (bound, *self._given)):
                    continue  # another case led by a link out of it
                inside = True
                if wanted.is_file():
                    return wanted
        self._refuse(filename, inside)
        raise AssertionError("unreachable")

    def _refuse(self, filename: str, inside: bool) -> None:
        help_ = "name the folder of its packages in ROS_PACKAGE_PATH"
        if inside:
            raise FileRefused(
                f"{self.urdf} needs the mesh {filename[:200]!r}, but there is no such file. Copy it, or {help_}."
            )
        where = f"its package {self.package}" if self.package else "its folder"
        raise FileRefused(
            f"{self.urdf} wants the mesh {filename[:200]!r}, outside {where}; only files below that are read."
            f" To read others, {help_}."
        )

    @cached_property
    def _given(self) -> tuple[Path, ...]:
        from_ros = [Path(item) for item in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if item]
        return tuple(root for item in (*self.roots, *from_ros) if (root := _resolved(item)) is not None)

    def _packages(self, package: str) -> list[tuple[Path, Path]]:
        """Folders that `package://NAME/` may mean, each with the folder that must not be left."""
        found = []
        if self.package is not None and _is_package(self.package, package):
            found.append((self.package, self.package))
        for root in self._given:
            found += [(folder, root) for folder in _below(root) if _is_package(folder, package)]
        if self.package is None:  # a copy without its package.xml: the folder above that is called so
            above = [folder for folder in self.folder.parents[:_ABOVE] if len(folder.parts) > _OUTERMOST]
            found += [(folder, folder) for folder in above if folder.name == package]
        # without that the URDF's own folder stands for its package
        return [*found, (self.folder, self.package or self.folder)]


def _resolved(path: Path) -> Path | None:
    """The path without links and dots; None where no file can have that name."""
    try:
        return path.resolve()
    except (OSError, ValueError, RuntimeError):  # a zero byte, a ring of links
        return None


def _below(root: Path) -> list[Path]:
    """A root and the folders some levels below it; packages do not nest."""
    found, level = [root], [root]
    for _ in range(_DEPTH):
        level = [
            child
            for folder in level
            if folder == root or not (folder / "package.xml").is_file()
            for child in _folders(folder)
        ]
        found += level
    return found


def _folders(folder: Path) -> Sequence[Path]:
    try:
        return [child for child in sorted(folder.iterdir()) if child.is_dir() and not child.name.startswith(".")]
    except OSError:
        return []


def _is_package(folder: Path, name: str) -> bool:
    """Whether a folder is the ROS package of that name: by its package.xml, else by the folder's own name."""
    manifest = folder / "package.xml"
    if not manifest.is_file():
        return folder.name == name
    try:
        told = ElementTree.fromstring(manifest.read_bytes()).findtext("name")
    except (OSError, ElementTree.ParseError, ValueError, LookupError):
        told = None
    return (told or folder.name).strip() == name
