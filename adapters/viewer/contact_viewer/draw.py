"""`python -m contact_viewer.draw SCENE PNG`: draws in a process of its own (see renderer.py).

In software OpenGL the cost is in multi-sampling and in the number of lights (measured: 1.2 s against 0.1 s a
frame at 100k triangles), so there are none of the first and two of the second; smooth edges come from
drawing at twice the size.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

from contact_core.scene.camera import LEGEND_AT, ROW, WIDEST_NAME, camera_of, legend_rows
from contact_core.scene.picture import Picture, sheet_rows
from contact_viewer.scene_file import read_scene

OVERSAMPLE = 2
_TOP, _BOTTOM = (0.97, 0.97, 0.98), (0.83, 0.85, 0.89)
_INK, _ALARM = (0.13, 0.15, 0.19), (0.78, 0.10, 0.10)


def main(arguments: list[str]) -> int:
    if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    import pyvista

    if arguments == ["--probe"]:
        plotter = pyvista.Plotter(off_screen=True, window_size=(16, 16))
        plotter.add_mesh(pyvista.Triangle())
        image = plotter.screenshot(return_img=True)
        return 0 if np.ptp(image) > 0 else 1
    pictures, size = read_scene(Path(arguments[0]))
    draw(pictures, size, Path(arguments[1]))
    return 0


def draw(pictures: list[Picture], size: tuple[int, int], path: Path) -> None:
    """Draw pictures, those of a row side by side; size in pixels of the PNG."""
    import pyvista

    large = (size[0] * OVERSAMPLE, size[1] * OVERSAMPLE)
    rows = sheet_rows(pictures)
    columns = max(map(len, rows))
    width, height = large[0] // columns, large[1] // len(rows)
    plotter = pyvista.Plotter(
        off_screen=True, window_size=large, shape=(len(rows), columns), border=False, lighting="none"
    )
    plotter.render_window.SetMultiSamples(0)
    places = [(row, column, p) for row, line in enumerate(rows) for column, p in enumerate(line)]
    for row, column, picture in places:
        plotter.subplot(row, column)
        plotter.set_background(_BOTTOM, top=_TOP)
        _fill(plotter, pyvista, picture, aspect=width / height, pixels=height)
    image = np.array(plotter.screenshot(return_img=True))  # (height, width, 3)
    for row, column, picture in places:
        own = image[row * height : (row + 1) * height, column * width : (column + 1) * width]
        _colour_legend(own, picture)
    _save(image, path)


def _fill(plotter: Any, pyvista: Any, picture: Picture, *, aspect: float, pixels: int) -> None:
    camera = camera_of(picture, aspect)
    for item in picture.meshes:
        surface = pyvista.PolyData.from_regular_faces(item.mesh.points, item.mesh.faces)
        surface.point_data["Normals"] = item.mesh.vertex_normals
        look: dict[str, Any] = {"color": item.color}
        if item.vertex_colors is not None:
            surface.point_data["color"] = np.asarray(np.clip(item.vertex_colors, 0, 1) * 255, np.uint8)
            look = {"scalars": "color", "rgb": True}
        surface.point_data.active_normals_name = "Normals"
        plotter.add_mesh(
            surface, **look, opacity=item.opacity, smooth_shading=True, ambient=0.26, diffuse=0.85, specular=0.03,
            specular_power=18,
        )  # fmt: skip
    towards_eye = camera.eye - camera.centre
    lift = 0.0015 * towards_eye  # dots show on the surface that carries them
    for points, color in picture.points:
        if len(points):
            plotter.add_points(
                points + lift, color=color, point_size=max(4.0, pixels / 130), render_points_as_spheres=True,
                lighting=False,
            )  # fmt: skip
    for segments, color in picture.lines:
        if len(segments):
            ends = np.asarray(segments).reshape(-1, 3) + lift
            plotter.add_lines(ends, color=color, width=max(2.0, pixels / 500))
    _light(plotter, pyvista, camera.camera_from_world, camera.centre, float(np.linalg.norm(towards_eye)))
    plotter.camera.position = camera.eye
    plotter.camera.focal_point = camera.centre
    plotter.camera.up = camera.camera_from_world[1]
    plotter.camera.SetWindowCenter(0.0, camera.drop)
    plotter.camera.view_angle = np.degrees(camera.field_of_view)
    plotter.reset_camera_clipping_range()
    _write(plotter, picture, pixels, width=int(aspect * pixels))


def _light(plotter: Any, pyvista: Any, axes: Any, centre: Any, distance: float) -> None:
    """A key light from the upper left and a weaker one from the eye."""
    for direction, strength in ((np.array([-0.45, 0.65, 0.75]), 0.78), (np.array([0.15, 0.0, 1.0]), 0.52)):
        light = pyvista.Light(
            position=centre + distance * (direction @ axes),
            focal_point=centre,
            intensity=strength,
            light_type="scene light",
        )
        plotter.add_light(light, only_active=True)  # or every picture beside it is lit again


def _write(plotter: Any, picture: Picture, pixels: int, width: int) -> None:
    """The table from the top left, the legend to its right, the caption along the bottom."""
    size, line = _type(pixels)

    def say(text: str, x: float, y: float, ink: Any, larger: float = 1.0) -> None:
        said = plotter.add_text(text, position=(x, y), font_size=larger * size / 2, color=ink, font="arial")
        said.prop.background_color, said.prop.background_opacity = _TOP, 0.6  # a pole may stand behind it

    for place, (name, value, failed) in enumerate(picture.table):
        ink, y = _ALARM if failed else _INK, pixels - (place + 1.4) * line
        if len(name) > WIDEST_NAME:
            say(f"{name}: {value}", size, y, ink)
        else:
            say(name, size, y, ink)
            say(value, size * 16, y, ink)
    left = LEGEND_AT * width
    for place, (name, _) in enumerate(legend_rows(picture)):
        y = pixels - (place + 1.4) * line
        say(name, left + 1.6 * size, y, _INK)
    if picture.caption:
        say(picture.caption, size, 0.5 * line, _INK, picture.lettering)


def _type(pixels: int) -> tuple[float, float]:
    """Height of letters and of rows in a frame of so many pixels in height."""
    size = max(20.0, 0.6 * ROW * pixels)  # smaller letters cannot be read once the picture is half as large
    return size, max(ROW * pixels, 1.6 * size)


def _colour_legend(frame: Any, picture: Picture) -> None:
    """A square of its colour before each name of the legend, in the frame (height, width, 3) of this picture."""
    size, line = _type(frame.shape[0])
    left = int(LEGEND_AT * frame.shape[1])
    for place, (_, color) in enumerate(legend_rows(picture)):
        top = int((place + 1.4) * line - size)
        if color is not None:
            frame[top : top + int(size), left : left + int(size)] = np.asarray(color) * 255


def _save(image: Any, path: Path) -> None:
    """Average OVERSAMPLE x OVERSAMPLE pixels into one and write the PNG."""
    from PIL import Image

    height, width = image.shape[0] // OVERSAMPLE, image.shape[1] // OVERSAMPLE
    blocks = image[: height * OVERSAMPLE, : width * OVERSAMPLE].reshape(height, OVERSAMPLE, width, OVERSAMPLE, -1)
    Image.fromarray(np.asarray(blocks.mean(axis=(1, 3)) + 0.5, np.uint8)).save(path, format="PNG")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
