"""Windows to draw in: one of VTK's without a screen where none is wanted, and what draws in it."""

from __future__ import annotations

import os
import sys
from typing import Any


def off_screen_window(size: tuple[int, int]) -> Any:
    """A vtkRenderWindow of so many pixels that no screen shows. On Linux it is drawn by EGL, so that neither a
    display nor its lack matters."""
    import vtkmodules.vtkRenderingFreeType
    import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  (both register what the factories make)

    window: Any = None
    if sys.platform.startswith("linux"):
        from vtkmodules import vtkRenderingOpenGL2

        egl = getattr(vtkRenderingOpenGL2, "vtkEGLRenderWindow", None)
        window = egl() if egl is not None else None
    if window is None:
        from vtkmodules.vtkRenderingCore import vtkRenderWindow

        window = vtkRenderWindow()
        window.SetOffScreenRendering(1)
    window.ShowWindowOff()
    window.SetSize(*size)
    window.SetMultiSamples(0)
    return window


def screen_window(size: tuple[int, int], title: str) -> Any:
    """A vtkRenderWindow on the screen. Where there is none, VTK would end the process: ask `has_screen` first."""
    import vtkmodules.vtkRenderingFreeType
    import vtkmodules.vtkRenderingOpenGL2
    import vtkmodules.vtkRenderingUI  # noqa: F401  (registers what the factories make)
    from vtkmodules.vtkRenderingCore import vtkRenderWindow

    window = vtkRenderWindow()
    window.SetWindowName(title)
    window.SetSize(*size)
    window.SetMultiSamples(0)
    return window


def has_screen() -> bool:
    """Whether this process can open a window."""
    return not sys.platform.startswith("linux") or bool(os.environ.get("DISPLAY"))


def is_software(window: Any) -> bool:
    """Whether a window that has drawn once is drawn by the processor: what costs pixels is then left out."""
    told = (window.ReportCapabilities() or "").lower()
    return any(name in told for name in ("llvmpipe", "softpipe", "swiftshader", "software"))
