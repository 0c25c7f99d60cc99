"""The zip: what is in it, what its manifest says, and that a Blender installs, enables and removes it."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path
from typing import Any

import pytest

USE = """
import os, sys, bpy
zip_path, = sys.argv[1:]
done = bpy.ops.extensions.package_install_files(filepath=zip_path, repo="user_default", enable_on_install=True)
assert done == {"FINISHED"}, done
import contact_core, contact_builtins, contact_blender
for module in (contact_core, contact_builtins, contact_blender):
    assert "vendor" in list(module.__path__)[0], module.__path__
bpy.ops.mesh.primitive_torus_add(major_segments=24, minor_segments=12)
assert bpy.ops.contact.add_surfaces() == {"FINISHED"}
assert not [record for record in contact_blender.extension.shared.session().plugins.records() if record.problems]
names = [key for key in bpy.context.preferences.addons.keys() if key.endswith("contact_core")]
assert bpy.ops.preferences.addon_disable(module=names[0]) == {"FINISHED"}
assert not [name for name in dir(bpy.types) if "CONTACT_" in name] and not any("vendor" in p for p in sys.path)
assert bpy.ops.preferences.addon_enable(module=names[0]) == {"FINISHED"}
assert list(contact_blender.extension.shared.session().document.surfaces) == ["Torus"]
print("used", flush=True)
os._exit(0)
"""


@pytest.fixture(scope="module")
def builder(repository: Path) -> Any:
    script = repository / "adapters" / "blender" / "build_extension.py"
    spec = importlib.util.spec_from_file_location("build_extension", script)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def wheel(tmp_path: Path) -> Path:
    """A wheel as far as the build looks at it: it only copies and lists them."""
    path = tmp_path / "some_library-1.0-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("some_library.py", "answer = 42\n")
    return path


def test_what_is_in_it(builder: Any, wheel: Path, tmp_path: Path) -> None:
    target = builder.build(tmp_path / "out" / "contact.zip", [wheel], "3.11")
    with zipfile.ZipFile(target) as archive:
        names = set(archive.namelist())
        said = tomllib.loads(archive.read("blender_manifest.toml").decode())
        sums = archive.read("wheels/SHA256SUMS").decode().split()
        assert archive.read(f"wheels/{wheel.name}") == wheel.read_bytes()
        points = archive.read(next(n for n in names if n.endswith("entry_points.txt"))).decode()
    assert sums == [hashlib.sha256(wheel.read_bytes()).hexdigest(), wheel.name]
    assert {"__init__.py", "LICENSE", "NOTICE", "vendor/contact_blender/extension/__init__.py"} <= names
    assert not [name for name in names if "__pycache__" in name or "contact_usd" in name or "numpy-" in name]
    assert "contact_blender.plugin" in points and "contact_usd" not in points
    assert said["blender_version_min"] == "4.2.0" and said["license"] == ["SPDX:GPL-3.0-or-later"]
    assert list(said["permissions"]) == ["files"] and said["wheels"] == [f"./wheels/{wheel.name}"]
    again = builder.build(tmp_path / "again.zip", [wheel], "3.11")
    assert again.read_bytes() == target.read_bytes()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"wheels": ["./wheels/numpy-1.26.4-cp311.whl"]}, "numpy is never bundled"),
        ({"wheels": ["./wheels/absent.whl"]}, "is not in the zip"),
        ({"wheels": ["../absent.whl"]}, "is not in the zip"),
        ({"version": "1.0"}, "three numbers"),
        ({"id": "contact-core"}, "name of Python"),
        ({"license": ["SPDX:Apache-2.0"]}, "GPL-3.0-or-later"),
        ({"tagline": "It ends with a full stop."}, "no full stop"),
        ({"permissions": {"telepathy": "Read minds"}}, "no permission 'telepathy'"),
        ({"maintainer": ""}, "maintainer is a text"),
    ],
)
def test_mistakes_of_a_manifest_are_told(builder: Any, change: dict[str, Any], words: str) -> None:
    said = builder.manifest([], "3.11")
    assert builder.mistakes(said, []) == []
    assert words in " ".join(builder.mistakes({**said, **change}, ["wheels/numpy-1.26.4-cp311.whl"]))


def test_every_released_zip_says_its_platform_and_its_blenders(builder: Any) -> None:
    assert set(builder.TAGS) == set(builder.PLATFORMS.values()) and len(builder.RELEASED) == 7
    for python, system in builder.RELEASED:
        said = builder.manifest([], python, system)
        assert said["platforms"] == [system] and builder.mistakes(said, []) == []
        assert said["blender_version_min"] == {"3.11": "4.2.0", "3.13": "5.1.0"}[python]
        assert said.get("blender_version_max") == {"3.11": "5.1.0", "3.13": None}[python]


def test_a_numpy_wheel_is_refused(builder: Any, wheel: Path, tmp_path: Path) -> None:
    numpy = wheel.rename(tmp_path / "numpy-1.26.4-py3-none-any.whl")
    with pytest.raises(builder.NotBuilt, match="numpy is never bundled"):
        builder.build(tmp_path / "contact.zip", [numpy], "3.11")
    assert not (tmp_path / "contact.zip").exists()


def test_blender_installs_uses_and_disables_it(builder: Any, tmp_path: Path) -> None:
    target = builder.build(tmp_path / "contact.zip", [], "3.11")
    environment = {"BLENDER_USER_RESOURCES": str(tmp_path / "user")}
    said = subprocess.run(
        [sys.executable, "-c", USE, str(target)],
        capture_output=True, text=True, timeout=300, env={**os.environ, **environment},
    )  # fmt: skip
    assert "used" in said.stdout, said.stdout + said.stderr
