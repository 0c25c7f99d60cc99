"""Pictures over the 3D view: drawn off-screen where Blender can without a window (5.2 and later)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from contact_core.geometry.mesh import TriangleMesh
from contact_core.scene.picture import Picture, PictureMesh

SIZE = 64


def drawn(picture: Picture) -> np.ndarray:
    """(SIZE, SIZE, 4) pixels of what the overlay draws of a picture in the square -1..1, seen down z."""
    import gpu
    from mathutils import Matrix

    from contact_blender.overlay import Overlay

    overlay = Overlay()
    overlay.show(picture)
    screen = gpu.types.GPUOffScreen(SIZE, SIZE)
    with screen.bind():
        frame = gpu.state.active_framebuffer_get()
        frame.clear(color=(0.0, 0.0, 0.0, 1.0), depth=1.0)
        gpu.matrix.load_matrix(Matrix.Identity(4))
        gpu.matrix.load_projection_matrix(Matrix.Identity(4))
        overlay.draw()
        pixels = frame.read_color(0, 0, SIZE, SIZE, 4, 0, "FLOAT")
    overlay.show(None)
    screen.free()
    return np.array(pixels.to_list())


@pytest.fixture
def gpu_ready(bpy: Any) -> None:
    import gpu  # there once bpy is

    if not hasattr(gpu, "init"):
        pytest.skip("this Blender cannot draw without a window; 5.2 and later can")
    gpu.init()


def test_meshes_points_and_lines_are_drawn_in_their_colours(gpu_ready: None) -> None:
    square = TriangleMesh(np.array([[-1, -1, 0], [0, -1, 0], [0, 0, 0], [-1, 0, 0]]), [[0, 1, 2], [0, 2, 3]])
    red_to_green = np.array([[1, 0, 0], [0, 1, 0], [0, 1, 0], [1, 0, 0]], float)
    image = drawn(
        Picture(
            meshes=(
                PictureMesh(square, (1.0, 0.0, 0.0)),
                PictureMesh(
                    square.with_points(np.add(square.points, [1, 0, 0])), (0.0, 0.0, 0.0), 1.0, red_to_green
                ),
            ),
            points=((np.array([[-0.5, 0.5, 0.0]]), (0.0, 0.0, 1.0)),),
            lines=((np.array([[[0.5, 0.1, 0.0], [0.5, 0.9, 0.0]]]), (1.0, 1.0, 0.0)),),
        )
    )
    quarter = SIZE // 4
    assert image[quarter, quarter, :3].tolist() == pytest.approx([1, 0, 0], abs=0.02)
    assert image[quarter, 3 * quarter, :3].tolist() == pytest.approx([0.5, 0.5, 0], abs=0.1)
    assert image[3 * quarter, quarter, :3].tolist() == pytest.approx([0, 0, 1], abs=0.02)
    assert image[3 * quarter, 3 * quarter, :3].max() > 0.5 and image[3 * quarter, 3 * quarter, 2] < 0.1
    assert image[SIZE - 2, 2, :3].tolist() == [0, 0, 0]


def test_showing_replaces_and_none_takes_away(bpy: Any, empty: Any) -> None:
    """One handler at most, whatever is shown, and none at the end; no window is needed."""
    from contact_blender import overlay

    made, removed = [], []
    view = bpy.types.SpaceView3D
    add, remove = view.draw_handler_add, view.draw_handler_remove

    class Counted:
        draw_handler_add = staticmethod(lambda *arguments: made.append(add(*arguments)) or made[-1])
        draw_handler_remove = staticmethod(lambda handle, region: removed.append(handle) or remove(handle, region))

    picture = Picture(meshes=())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(overlay, "bpy", _with_view(bpy, Counted))
        for shown in (picture, picture, None, None):
            empty.show(shown)
    assert len(made) == 2 and removed == made


def _with_view(bpy: Any, view: Any) -> Any:
    """bpy as the overlay sees it, with a counting SpaceView3D."""
    from types import SimpleNamespace

    return SimpleNamespace(types=SimpleNamespace(SpaceView3D=view), context=bpy.context)
