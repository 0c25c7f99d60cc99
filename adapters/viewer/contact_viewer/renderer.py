"""The PyVista renderer as the core sees it: it draws in a child process.

Without EGL and OSMesa VTK ends its process by a segmentation fault, which no `try` can catch; and a host
that has its own OpenGL context should not get a second one. So the parent writes the scene to a file,
`contact_viewer.draw` draws it in a child, and the child's end is turned into a sentence.
"""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from contact_core.atomic_file import replacing
from contact_core.errors import FileRefused, MissingExtra
from contact_core.scene.picture import Picture
from contact_viewer.scene_file import write_scene

_SECONDS = 180  # a picture takes 2 to 4 seconds; a hung driver must not hang the job
_CURE = (
    "PyVista cannot draw on this machine: neither EGL nor OSMesa works. Install the system package libegl1 with"
    " libgl1-mesa-dri (Debian, Ubuntu) or mesa-libEGL with mesa-dri-drivers (Fedora, RHEL)."
)


class PyVistaRenderer:
    """Lit, soft-shaded pictures, off-screen (extra `viewer`)."""

    name = "pyvista"
    summary = "pictures by VTK, shaded and smooth"
    priority = 100

    def unavailable(self) -> str | None:
        """Asks a child process to draw one triangle; the answer is kept for the life of this process."""
        if importlib.util.find_spec("pyvista") is None:
            return str(MissingExtra("The PyVista renderer", "viewer"))
        return _probe(sys.executable)

    def render(self, pictures: Sequence[Picture], path: Path, *, size: tuple[int, int] = (1280, 720)) -> None:
        """Draw pictures side by side into one PNG. Raises MissingExtra, FileRefused with the cure."""
        if importlib.util.find_spec("pyvista") is None:
            raise MissingExtra("The PyVista renderer", "viewer")
        with tempfile.TemporaryDirectory(prefix="contact-picture-") as folder:
            scene = Path(folder) / "scene.npz"
            write_scene(scene, pictures, size)
            with replacing(path) as temporary:
                failure = _run("contact_viewer.draw", str(scene), str(temporary))
                if failure is None and not temporary.stat().st_size:
                    failure = "it wrote an empty picture"
                if failure is not None:
                    raise FileRefused(f"{path.name} was not drawn by PyVista ({failure}). {_CURE}")


@cache
def _probe(_python: str) -> str | None:
    """None, or why a child process cannot draw."""
    failure = _run("contact_viewer.draw", "--probe")
    return None if failure is None else f"{_CURE} (The trial ended so: {failure}.)"


def _run(module: str, *arguments: str) -> str | None:
    """Run a module of this distribution in a child; None, or how it failed, in words."""
    # The child finds our packages where this process found them, also when a DCC set sys.path by hand.
    program = f"import runpy, sys; sys.path[:] = {sys.path!r}; runpy.run_module({module!r}, run_name='__main__')"
    try:
        child = subprocess.run(
            [sys.executable, "-c", program, *arguments],
            capture_output=True,
            text=True,
            timeout=_SECONDS,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return str(error)
    if child.returncode == 0:
        return None
    if child.returncode < 0:
        return f"the child process died of signal {-child.returncode}"
    lines = [line for line in child.stderr.strip().splitlines() if line]
    return lines[-1] if lines else f"the child process ended with code {child.returncode}"
