"""The zip in a real Blender and a clean profile: valid, installed, used, removed without a trace; a bad wheel."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import blender_runner as runner
import pytest

TRACES = (
    "contact",
    "numba",
    "llvmlite",
    "scipy",
    "pluggy",
    "threadpoolctl",
    "rich",
    "mdurl",
    "pygments",
    "markdown",
)
USE = """
import bpy
assert bpy.ops.preferences.addon_enable(module="bl_ext.user_default.contact_core") == {"FINISHED"}
from contact_blender.extension import preferences
try:
    bpy.ops.mesh.primitive_torus_add()
    bpy.ops.contact.add_surfaces()
    import numba, scipy
    bundled = [module.__file__ for module in (numba, scipy) if "extensions" in module.__file__]
    print("used, bundled", len(bundled), flush=True)
except RuntimeError as error:
    print("refused:", error, flush=True)
print("words:", preferences.words(), flush=True)
"""


@pytest.fixture(scope="module")
def blender() -> Any:
    try:
        return runner.blender()
    except runner.Unavailable as reason:
        pytest.skip(str(reason))


@pytest.fixture(scope="module")
def zipped(blender: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return runner.zipped(tmp_path_factory.mktemp("zip") / "contact.zip", blender[2])


def commanded(blender: Any, profile: Path, *arguments: str) -> str:
    done = runner.run_blender(blender[0], "-b", *arguments, BLENDER_USER_RESOURCES=str(profile))
    said: str = done.stdout + done.stderr
    assert done.returncode == 0 and "Traceback" not in said, said
    return said


def test_it_is_valid_and_leaves_no_trace(blender: Any, zipped: Path, tmp_path: Path) -> None:
    profile = tmp_path / "user"
    commanded(blender, profile, "--command", "extension", "validate", str(zipped))
    commanded(
        blender, profile, "--command", "extension", "install-file", "-r", "user_default", "--enable", str(zipped)
    )
    script = tmp_path / "use.py"
    script.write_text(USE)
    said = commanded(blender, profile, "--factory-startup", "--python-exit-code", "1", "--python", str(script))
    assert "used, bundled 2" in said and "All libraries are here" in said, said
    commanded(blender, profile, "--command", "extension", "remove", "contact_core")
    left = [str(path.relative_to(profile)) for path in profile.rglob("*") if path.is_file()]
    assert not [name for name in left if any(trace in name.lower() for trace in TRACES)], left


def test_a_broken_wheel_is_a_sentence(blender: Any, tmp_path: Path) -> None:
    profile = tmp_path / "user"
    shutil.copytree(runner.profile(blender[0], blender[2]), profile, symlinks=True)
    libraries = [path for path in profile.rglob("*llvmlite*") if path.suffix in (".so", ".dll", ".dylib")]
    assert libraries
    for path in libraries:
        path.write_bytes(b"not a library of this platform")
    script = tmp_path / "use.py"
    script.write_text(USE)
    said = commanded(blender, profile, "--factory-startup", "--python-exit-code", "1", "--python", str(script))
    assert "refused: Error: Contact cannot work: llvmlite is here and cannot be loaded" in said, said
    assert "words: Contact cannot work: llvmlite" in said, said
