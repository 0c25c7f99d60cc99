"""Build the wheel, install it in a clean environment outside the repository, and use it there.

An editable install puts the repository on the path and so hides a file that the wheel forgot.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import venv
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = {  # import name -> folder in the repository
    "contact_core": ROOT / "contact_core",
    "contact_builtins": ROOT / "plugins" / "contact_builtins",
    "contact_gallery": ROOT / "plugins" / "contact_gallery",
    "contact_usd": ROOT / "adapters" / "usd" / "contact_usd",
    "contact_viewer": ROOT / "adapters" / "viewer" / "contact_viewer",
    "contact_blender": ROOT / "adapters" / "blender" / "contact_blender",
}

USE = """
import sys, contact_core, contact_builtins, contact_gallery, contact_usd, contact_viewer, contact_blender
for name in {packages!r}:
    place = sys.modules[name].__file__ or list(sys.modules[name].__path__)[0]
    assert "site-packages" in place, f"{{name}} comes from {{place}}"
from contact_core.geometry import SurfacePoints, TriangleMesh, log_map
mesh = TriangleMesh([[0, 0, 0], [3, 0, 0], [0, 4, 0]], [[0, 1, 2]])
ends = SurfacePoints.at_vertices(mesh, [1, 2])
assert abs(log_map(mesh, ends[0], ends[1]).distance[0] - 5.0) < 1e-12
from contact_core.plugins.manager import PluginManager
(ours,) = [record for record in PluginManager().records() if record.name == "builtins"]
assert not ours.problems, ours.problems
print("the wheel works:", contact_core.__version__, contact_core.__file__)
"""


def run(*command: str | Path, cwd: Path) -> None:
    subprocess.run([str(part) for part in command], cwd=cwd, check=True, env={**os.environ, "PYTHONPATH": ""})


def forgotten(wheel: Path) -> list[str]:
    """Files of the packages that are not in the wheel."""
    held = set(zipfile.ZipFile(wheel).namelist())
    wanted = (
        f"{name}/{path.relative_to(folder).as_posix()}"
        for name, folder in PACKAGES.items()
        for path in folder.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts and path.suffix not in (".nbi", ".nbc")
    )
    return sorted(name for name in wanted if name not in held)


def main() -> None:
    with tempfile.TemporaryDirectory(prefix="contact-wheel-") as name:
        scratch = Path(name)
        run(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", scratch, ROOT, cwd=ROOT)
        (wheel,) = scratch.glob("*.whl")
        missing = forgotten(wheel)
        if missing:
            sys.exit(f"the wheel forgot {len(missing)} files: {', '.join(missing[:10])}")
        venv.create(scratch / "venv", with_pip=True)
        scripts = scratch / "venv" / ("Scripts" if os.name == "nt" else "bin")
        run(scripts / "python", "-m", "pip", "install", "--quiet", wheel, cwd=scratch)
        run(scripts / "python", "-c", USE.format(packages=list(PACKAGES)), cwd=scratch)
        run(scripts / "contact", "plugins", "--check", cwd=scratch)


if __name__ == "__main__":
    main()
