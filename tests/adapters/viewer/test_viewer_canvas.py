"""The camera as a view, and what the canvas draws: pixels, not calls, are looked at."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.interaction.events import Pointer
from contact_core.interaction.overlay import AxisLine, Decal, Ghost, Handle, Label, Overlay, StrokeTint
from contact_core.interaction.view import View
from contact_core.testing.meshes import icosphere

pytest.importorskip("vtkmodules")

from contact_viewer.buffers import Normals
from contact_viewer.canvas import Canvas
from contact_viewer.eye import Eye
from contact_viewer.gl import off_screen_window
from contact_viewer.look import DARK, LIGHT, from_hex, hexed
from contact_viewer.navigation import Navigation

SIZE = (320, 200)
RED, GREEN, BLUE = (0.9, 0.1, 0.1), (0.1, 0.8, 0.1), (0.1, 0.2, 0.9)


@pytest.fixture(scope="module")
def canvas() -> Canvas:
    made = Canvas(off_screen_window(SIZE))
    ball = icosphere(3)
    surface = made.surface("ball")
    surface.set_shape(ball.points, ball.faces)
    surface.set_look((0.7, 0.7, 0.7))
    return made


@pytest.fixture
def eye(canvas: Canvas) -> Eye:
    canvas.show(Overlay())
    canvas.eye.pixel_ratio = 1.0
    canvas.eye.look_from("front")
    canvas.eye.fit(icosphere(3).points)
    return canvas.eye


def colored(image: np.ndarray, color: tuple[float, float, float]) -> np.ndarray:
    """(h, w) where an image has the hue of a colour, whatever the light does to it."""
    pixels = image.astype(float)
    strongest = int(np.argmax(color))
    others = [k for k in range(3) if k != strongest]
    return (pixels[..., strongest] > 60) & (pixels[..., strongest] > 1.6 * pixels[..., others].max(axis=-1))


def test_the_camera_is_a_view(eye: Eye) -> None:
    assert isinstance(eye, View)
    assert eye.viewport == SIZE


@settings(max_examples=60)
@given(
    x=st.floats(0, SIZE[0]), y=st.floats(0, SIZE[1]), far=st.floats(0.1, 50), dx=st.floats(-300, 300),
    dy=st.floats(-300, 300), side=st.sampled_from(["default", "front", "right", "top", "back", "left", "bottom"]),
)  # fmt: skip
def test_rays_and_projection_are_inverse(
    canvas: Canvas, x: float, y: float, far: float, dx: float, dy: float, side: str
) -> None:
    """From wherever the camera was orbited to, a point on the ray through a pixel is seen at that pixel."""
    eye = canvas.eye
    eye.look_from(side)
    eye.fit(icosphere(1).points)
    eye.orbit(dx, dy)
    origins, directions = eye.rays([[x, y]])
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, atol=1e-12)
    seen = eye.project(origins + far * directions)[0]
    np.testing.assert_allclose(seen[:2], [x, y], atol=1e-6)
    assert seen[2] > 0
    assert eye.project(origins - far * directions)[0, 2] < 0  # behind the eye


def test_vtk_draws_where_the_view_says(canvas: Canvas, eye: Eye) -> None:
    """The projection is VTK's own: a small dot is drawn at the pixel that `project` names."""
    eye.orbit(40, -25)
    for place in ([0.3, 0.2, 1.2], [-0.5, 0.6, 0.9], [0.0, -0.9, 0.8]):
        canvas.show(Overlay(handles=(Handle("a", "root", np.array(place), radius=5.0, color=GREEN),)))
        rows, columns = np.nonzero(colored(canvas.image(), GREEN))
        expected = eye.project([place])[0, :2]
        np.testing.assert_allclose([columns.mean() + 0.5, rows.mean() + 0.5], expected, atol=1.0)


def test_a_filled_contact_lies_on_its_surface_and_not_through_it(canvas: Canvas, eye: Eye) -> None:
    ball = icosphere(3)
    front = ball.faces[(ball.points[ball.faces][..., 2] > 0.85).all(axis=1)]
    decal = Decal("p", "ball", ball.points, front, RED, opacity=1.0)
    canvas.show(Overlay(decals=(decal,)))
    seen = colored(canvas.image(), RED)
    rows, columns = np.nonzero(seen)
    inside = seen[rows.min() : rows.max(), columns.min() : columns.max()]
    assert seen.sum() > 300 and inside.mean() > 0.6  # filled, without holes where the surface would win
    eye.look_from("back")
    assert not colored(canvas.image(), RED).any()


def test_a_ghost_in_the_place_of_its_surface_is_hidden_and_one_beside_it_is_seen(canvas: Canvas, eye: Eye) -> None:
    ball = icosphere(3)
    canvas.show(Overlay(ghosts=(Ghost(ball.points, ball.faces, GREEN, 1.0, "ball"),)))
    inside = np.zeros(SIZE[::-1], bool)
    inside[SIZE[1] // 2 - 40 : SIZE[1] // 2 + 40, SIZE[0] // 2 - 40 : SIZE[0] // 2 + 40] = True
    assert not colored(canvas.image(), GREEN)[inside].any()
    canvas.show(Overlay(ghosts=(Ghost(1.1 * ball.points, ball.faces, GREEN, 1.0, "ball"),)))
    assert colored(canvas.image(), GREEN)[inside].all()


def test_lines_show_faintly_through_what_hides_them(canvas: Canvas, eye: Eye) -> None:
    line = AxisLine(np.array([[-0.4, 0.0, 1.02], [0.4, 0.0, 1.02]]), BLUE, width=6.0)
    bare = canvas.image().astype(int)
    canvas.show(Overlay(axes=(line,)))
    before = np.abs(canvas.image().astype(int) - bare).max()
    eye.look_from("back")
    canvas.show(Overlay())
    bare = canvas.image().astype(int)
    canvas.show(Overlay(axes=(line,)))
    hidden = np.abs(canvas.image().astype(int) - bare).max()
    assert before > 100
    assert 15 < hidden < before


def test_a_stroke_is_tinted_up_to_its_radius(canvas: Canvas, eye: Eye) -> None:
    ball = icosphere(3)
    distances = np.linalg.norm(ball.points - [0, 0, 1], axis=1)
    tint = StrokeTint("ball", distances, np.arange(0), 0.35, RED)
    canvas.show(Overlay(tint=tint))
    _, columns = np.nonzero(colored(canvas.image(), RED))
    radius = 0.35 / eye.pixel_size([0, 0, 1])
    assert abs(np.ptp(columns) / 2 - radius) < 0.08 * radius + 1.5
    canvas.show(Overlay())
    assert not colored(canvas.image(), RED).any()


def test_sizes_grow_with_the_density_of_the_screen(canvas: Canvas, eye: Eye) -> None:
    """A handle is as large on a screen of twice as many pixels: it covers four times as many."""
    handle = Handle("a", "root", np.array([0.0, 0.0, 1.2]), radius=9.0, color=GREEN)
    canvas.show(Overlay(handles=(handle,)))
    plain = colored(canvas.image(), GREEN).sum()
    canvas.resize(2 * SIZE[0], 2 * SIZE[1])
    eye.pixel_ratio = 2.0
    canvas.show(Overlay(handles=(handle,)))
    dense = colored(canvas.image(), GREEN).sum()
    canvas.resize(*SIZE)
    eye.pixel_ratio = 1.0
    assert 3.3 < dense / plain < 4.7


def test_labels_and_texts_are_written(canvas: Canvas, eye: Eye) -> None:
    bare = canvas.image().astype(int)
    canvas.show(Overlay(labels=(Label("thumb", np.array([0.0, 0.0, 1.1]), GREEN),)))
    rows, _ = np.nonzero(np.abs(canvas.image().astype(int) - bare).max(axis=2) > 60)
    assert len(rows) > 20 and abs(rows.mean() - eye.project([[0.0, 0.0, 1.1]])[0, 1]) < 8
    canvas.show(Overlay())
    canvas.write("top", "", "")
    changed = np.abs(canvas.image().astype(int) - bare).max(axis=2) > 20
    assert changed[:60].any() and not changed[100:].any()
    canvas.write("", "", "")
    np.testing.assert_array_equal(canvas.image(), bare)


def test_what_is_uploaded_in_place_is_what_is_drawn(canvas: Canvas, eye: Eye) -> None:
    """Points moved in place give the image of a surface made anew at the new points."""
    ball = icosphere(3)
    moved = ball.points * [0.6, 0.9, 1.0]
    canvas.surface("ball").set_shape(moved, ball.faces)
    in_place = canvas.image()
    canvas.keep_surfaces(())
    canvas.surface("ball").set_shape(moved, ball.faces)
    canvas.surface("ball").set_look((0.7, 0.7, 0.7))
    np.testing.assert_array_equal(canvas.image(), in_place)
    canvas.surface("ball").set_shape(ball.points, ball.faces)


def test_normals_are_those_of_the_mesh() -> None:
    """Weighted by area they are, on a sphere, where a point is; no face, no normal."""
    ball = icosphere(3)
    turned = np.roll(ball.points, 1, axis=1) * 2.0
    np.testing.assert_allclose(Normals(ball.faces, len(turned)).at(turned), turned / 2.0, atol=0.02)
    alone = np.concatenate([turned, [[9.0, 9.0, 9.0]]])
    assert not Normals(ball.faces, len(alone)).at(alone)[-1].any()
    assert Normals(np.zeros((0, 3), int), 2).at(np.zeros((2, 3))).shape == (2, 3)


def test_the_camera_moves_as_the_pointer_does(eye: Eye) -> None:
    """A pan keeps the point under the pointer, a zoom as well, and an orbit the one that is looked at."""
    navigation = Navigation()
    focus = np.zeros(3)
    before = eye.project([focus])[0]
    for event in (
        Pointer("press", 100, 80, "right"),
        Pointer("move", 130, 95),
        Pointer("release", 130, 95, "right"),
    ):
        navigation.handle(event, eye)
    np.testing.assert_allclose(eye.project([focus])[0, :2], before[:2] + np.array([30, 15]), atol=0.5)
    corner = np.array([0.5, 0.5, 0.0])
    pixel = eye.project([corner])[0, :2]
    navigation.handle(Pointer("wheel", *pixel, wheel=3.0), eye)
    np.testing.assert_allclose(eye.project([corner])[0, :2], pixel, atol=1.0)
    assert eye.project([corner])[0, 2] < before[2]
    eye.fit(icosphere(2).points)
    middle = eye.project([focus])[0, :2]
    for event in (
        Pointer("press", 10, 10, "middle"),
        Pointer("move", 90, 60),
        Pointer("release", 90, 60, "middle"),
    ):
        navigation.handle(event, eye)
    np.testing.assert_allclose(eye.project([focus])[0, :2], middle, atol=0.5)
    assert not navigation.is_dragging


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_a_zoom_ends_before_the_scene_is_lost_and_leads_back(size: float) -> None:
    """However often the wheel turns: something of the scene is some pixels large, and the way back is as long."""
    canvas = Canvas(off_screen_window(SIZE))
    ball = icosphere(2)
    canvas.surface("ball").set_shape(size * ball.points, ball.faces)
    eye = canvas.eye
    eye.look_from("front")
    eye.fit(size * ball.points)
    fitted = np.linalg.norm(eye.eye)
    for _ in range(200):
        eye.zoom(-1.0)
    pixels = eye.project(size * ball.points)[:, :2]
    assert 8.0 < np.ptp(pixels[:, 1]) < 0.2 * SIZE[1]
    farthest = np.linalg.norm(eye.eye)
    eye.zoom(1.0)
    assert np.linalg.norm(eye.eye) == pytest.approx(farthest / 1.15)
    for _ in range(400):
        eye.zoom(1.0)
    nearest = np.linalg.norm(eye.eye)
    assert 1e-3 * size < nearest < 0.01 * fitted
    eye.zoom(-1.0)
    assert np.linalg.norm(eye.eye) == pytest.approx(1.15 * nearest)


def test_everything_that_is_fitted_is_seen(eye: Eye) -> None:
    rng = np.random.default_rng(0)
    for up in "XYZ":
        eye.up = up
        points = rng.normal(size=(50, 3)) * [3, 0.2, 1] + [100, 5, -20]
        for side in ("default", "top", "right"):
            eye.look_from(side)
            eye.fit(points)
            seen = eye.project(points)
            assert (seen[:, 2] > 0).all() and (seen[:, :2] >= 0).all() and (seen[:, :2] <= SIZE).all()
    eye.up = "Y"


@pytest.mark.parametrize("theme", [DARK, LIGHT], ids=lambda theme: theme.name)
def test_words_stand_out_from_what_is_behind_them(theme: object) -> None:
    """Contrast by WCAG 2.1: 4.5 for text that is read."""
    assert isinstance(theme, type(DARK))
    for behind in (theme.top, theme.bottom):
        light, dark = sorted((luminance(theme.ink), luminance(behind)), reverse=True)
        assert (light + 0.05) / (dark + 0.05) > 4.5


def luminance(color: tuple[float, float, float]) -> float:
    linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in color]
    return float(np.dot(linear, [0.2126, 0.7152, 0.0722]))


def test_colours_are_spelt_and_read() -> None:
    assert from_hex(hexed((1.0, 0.0, 0.2))) == (1.0, 0.0, 0.2)
    with pytest.raises(ValueError, match="#rrggbb"):
        from_hex("#12")
