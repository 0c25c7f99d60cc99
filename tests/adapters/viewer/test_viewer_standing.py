"""What stands still is drawn once: frames over its image are those that a full drawing gives."""

from __future__ import annotations

import numpy as np
import pytest

from contact_core.arrays import FloatArray
from contact_core.interaction.overlay import AxisLine, Decal, Overlay
from contact_core.testing.meshes import icosphere

pytest.importorskip("vtkmodules")

from contact_viewer.canvas import GHOST, Canvas
from contact_viewer.gl import off_screen_window
from contact_viewer.look import LIGHT

BALL = icosphere(3)
SIZE = (240, 160)


def placed(x: float, z: float, size: float = 1.0) -> FloatArray:
    place = np.diag([size, size, size, 1.0])
    place[:3, 3] = x, 0.0, z
    return place


def scene() -> Canvas:
    """A ball that stands, with a contact on it and a line through it, and a smaller one that may move."""
    canvas = Canvas(off_screen_window(SIZE))
    for name, color, place in (
        ("large", (0.6, 0.6, 0.7), placed(0.0, 0.0)),
        ("small", (0.8, 0.7, 0.6), placed(-1.2, 0.0, 0.4)),
    ):
        surface = canvas.surface(name)
        surface.set_shape(BALL.points, BALL.faces)
        surface.set_look(color)
        surface.set_place(place)
    canvas.eye.look_from("front")
    canvas.eye.fit(2.0 * BALL.points)
    cap = BALL.faces[(BALL.points[BALL.faces][..., 2] > 0.8).all(axis=1)]
    line = AxisLine(np.array([[-1.6, -0.4, 0.3], [1.6, 0.5, -0.3]]))
    canvas.show(Overlay(decals=(Decal("spot", "large", BALL.points, cap, (0.9, 0.5, 0.1)),), axes=(line,)))
    canvas.rgba()  # a window knows what draws it once it has drawn
    if not canvas._software:
        pytest.skip("a graphics card draws here, which needs no image of what stands")
    canvas._quick_detail = lambda: 1.0  # type: ignore[method-assign]  # all pixels, however busy the machine
    return canvas


def quick(canvas: Canvas, frames: int = 1) -> FloatArray:
    for _ in range(frames):
        image = canvas.rgba(quick=True)[..., :3]
    return np.asarray(image, float)


def test_what_moves_goes_before_and_behind_what_stands() -> None:
    canvas, images = scene(), []
    quick(canvas, 4)
    assert canvas._standing.is_used and canvas._standing.images == 1
    for opacity in (1.0, GHOST):
        canvas.surface("small").set_look((0.8, 0.7, 0.6), opacity=opacity)
        for x, z in ((-0.7, 0.9), (-0.3, 0.0), (0.2, -0.9), (0.8, 0.6)):
            canvas.surface("small").set_place(placed(x, z, 0.4))
            images.append(quick(canvas))
            off = np.abs(images[-1] - canvas.image()).max(axis=2)
            assert np.mean(off > 2.0) < 2e-3, (x, z, opacity)
    assert np.abs(images[0] - images[2]).max() > 30.0  # it was seen to move
    assert canvas._standing.images == 2  # with both of them, and without the one that moved


def test_a_frame_that_stands_is_drawn_whole() -> None:
    canvas, untouched = scene(), scene()
    quick(canvas, 4)
    for x in (-0.7, 0.3):
        canvas.surface("small").set_place(placed(x, 0.8, 0.4))
        quick(canvas)
    untouched.surface("small").set_place(placed(0.3, 0.8, 0.4))
    assert np.array_equal(canvas.image(still=True), untouched.image(still=True))
    assert not canvas._standing.is_used
    images = canvas._standing.images
    quick(canvas)
    assert canvas._standing.is_used and canvas._standing.images == images  # it was kept meanwhile


def test_whatever_changes_makes_the_image_anew() -> None:
    """The eye, the colours behind, a shape, a colour, tints, what is hidden, the size of the window."""
    canvas = scene()
    large = canvas.surface("large")
    changes = (
        lambda: canvas.eye.orbit(20.0, 5.0),
        lambda: canvas.set_theme(LIGHT),
        lambda: large.set_shape(0.9 * BALL.points, BALL.faces),
        lambda: large.set_look((0.2, 0.5, 0.3)),
        lambda: large.set_colors(0.5 + 0.5 * BALL.points),
        lambda: large.set_values(None),
        lambda: canvas.resize(200, 120),
        lambda: large.set_look((0.2, 0.5, 0.3), opacity=0.0, visible=False),
    )
    for change in changes:
        quick(canvas, 4)
        images = canvas._standing.images
        change()
        assert np.mean(np.abs(quick(canvas) - canvas.image()).max(axis=2) > 2.0) < 2e-3
        again = quick(canvas, 4)
        assert images < canvas._standing.images <= images + 2 and canvas._standing.is_used
        assert np.mean(np.abs(again - canvas.image()).max(axis=2) > 2.0) < 2e-3


def test_what_comes_near_is_not_cut_off() -> None:
    canvas = scene()
    quick(canvas, 4)
    canvas.surface("small").set_place(placed(-0.5, 3.5, 0.4))  # far before what was there
    quick(canvas, 2)
    assert np.mean(np.abs(quick(canvas) - canvas.image()).max(axis=2) > 2.0) < 2e-3


def test_each_half_of_a_split_view_has_its_own() -> None:
    canvas = scene()
    other = canvas.beside = Canvas(canvas.window, sized=False)
    for pane in (canvas, other):
        for name in ("large", "small"):
            pane.surface(name).set_shape(BALL.points, BALL.faces)
    canvas.set_share(0.0, 0.5, SIZE)
    other.set_share(0.5, 1.0, SIZE)
    for pane in (canvas, other):
        pane.eye.fit(2.0 * BALL.points)
    before = quick(canvas, 4)
    assert canvas._standing.is_used and other._standing.is_used
    other.surface("small").set_place(placed(0.5, 1.0, 0.4))
    over = quick(canvas)
    changed = np.abs(over - before).max(axis=2) > 8.0
    assert changed[:, SIZE[0] // 2 :].any() and not changed[:, : SIZE[0] // 2].any()
    assert np.mean(np.abs(over - canvas.image()).max(axis=2) > 2.0) < 2e-3
