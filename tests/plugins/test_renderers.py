"""The software renderer against geometry: what is in front is seen, at its pixel, in its colour."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from contact_builtins.renderers.font import CELL_HEIGHT, CELL_WIDTH, text_mask
from contact_builtins.renderers.png import encode_png
from contact_builtins.renderers.software import OVERSAMPLE, SoftwareRenderer, draw
from contact_core.errors import FileRefused, InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.plugins.drawing import draw as draw_with_plugins
from contact_core.plugins.manager import PluginManager
from contact_core.scene.camera import LEGEND_AT, LEGEND_ROWS, ROW, camera_of, legend_rows, rows_above
from contact_core.scene.picture import Picture, PictureMesh
from contact_core.testing.meshes import icosphere, torus

SIZE = (96, 72)
RED, BLUE = (0.9, 0.1, 0.1), (0.1, 0.1, 0.9)


def decoded(data: bytes) -> npt.NDArray[np.uint8]:
    """(h, w, 3) of a PNG as `encode_png` writes it, by the specification."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    chunks, at = {}, 8
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        kind, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        assert struct.unpack(">I", data[at + 8 + length : at + 12 + length])[0] == zlib.crc32(kind + body)
        chunks[kind] = body
        at += 12 + length
    width, height = struct.unpack(">II", chunks[b"IHDR"][:8])
    rows = np.frombuffer(zlib.decompress(chunks[b"IDAT"]), np.uint8).reshape(height, 1 + 3 * width)
    assert not rows[:, 0].any()
    return rows[:, 1:].reshape(height, width, 3)


def test_png_round_trip() -> None:
    image = np.random.default_rng(0).integers(0, 256, (7, 5, 3)).astype(np.uint8)
    np.testing.assert_array_equal(decoded(encode_png(image)), image)


@pytest.mark.parametrize("turn", [20.0, 40.0, 60.0, 75.0])
def test_what_stands_behind_a_large_triangle_is_hidden(turn: float) -> None:
    """A triangle, seen aslant, runs from near the eye to far away: it hides a ball behind it, not one before it."""
    angle = np.radians(turn)
    along, out = np.array([np.cos(angle), 0.0, np.sin(angle)]), np.array([-np.sin(angle), 0.0, np.cos(angle)])
    ball = icosphere()
    ball = TriangleMesh(0.1 * ball.points / np.abs(ball.points).max(), ball.faces)
    corners = np.stack([1.2 * along, -9 * along + [0, 9, 0], -9 * along - [0, 9, 0]])
    wall = TriangleMesh(corners, np.array([[0, 1, 2]]))
    for side, shows in ((-0.2, False), (0.2, True)):
        placed = TriangleMesh(ball.points + side * out, ball.faces)
        focus = np.array([[-1.0, -1, 0], [1, 1, 0]])
        picture = Picture((PictureMesh(wall, BLUE), PictureMesh(placed, RED)), camera_from=(0, 0, 1), focus=focus)
        image = draw(picture, SIZE).astype(int)
        assert (image[..., 0] > image[..., 2] + 60).any() == shows


def covered(image: npt.NDArray[np.uint8]) -> npt.NDArray[np.bool_]:
    """Pixels whose colour is strong; the background is nearly grey."""
    return np.ptp(image.astype(int), axis=2) > 60


@pytest.mark.parametrize("direction", [(0.0, 0.0, 1.0), (1.0, 0.4, 0.2), (0.3, -1.0, 0.1), (0.0, 1.0, 0.0)])
@pytest.mark.parametrize("table", [(), (("a", "b", False),)])
def test_a_pixel_is_covered_where_its_ray_hits(
    direction: tuple[float, float, float], table: tuple[tuple[str, str, bool], ...]
) -> None:
    """The rasteriser agrees with the ray caster at pixel centres, up to the outline."""
    mesh = torus()
    picture = Picture((PictureMesh(mesh, RED),), camera_from=direction, table=table)
    image = draw(picture, SIZE)
    camera = camera_of(picture, SIZE[0] / SIZE[1])
    x, y = np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1]) + 0.5)
    focal = 0.5 * SIZE[1] / np.tan(camera.field_of_view / 2)
    seen = np.stack(
        [(x - SIZE[0] / 2) / focal, -(y - SIZE[1] / 2 * (1 + camera.drop)) / focal, -np.ones_like(x)], -1
    )
    rays = seen.reshape(-1, 3) @ camera.camera_from_world
    hit = Locator.of(mesh).cast(np.tile(camera.eye, (len(rays), 1)), rays).found.reshape(SIZE[::-1])
    rows = slice(24, SIZE[1])  # below the table
    assert (covered(image)[rows] != hit[rows]).mean() < 0.04
    assert hit.mean() > 0.1


def test_the_nearer_mesh_hides_the_farther_whatever_the_order() -> None:
    near = PictureMesh(TriangleMesh(icosphere(2, 0.5).points + np.array([0, 0, 2.0]), icosphere(2).faces), RED)
    far = PictureMesh(icosphere(2, 0.6), BLUE)
    images = [draw(Picture(order, camera_from=(0, 0, 1)), SIZE) for order in ((near, far), (far, near))]
    np.testing.assert_array_equal(images[0], images[1])
    middle = images[0][SIZE[1] // 2, SIZE[0] // 2].astype(int)
    assert middle[0] > 2 * middle[2]


def test_points_and_lines_show_on_the_surface_and_hide_behind_it() -> None:
    ball = PictureMesh(icosphere(3), (0.7, 0.7, 0.7))
    front, back = np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 0.0, -1.0]])

    def greens(image: npt.NDArray[np.uint8]) -> int:
        return int((image[..., 1].astype(int) > image[..., 0].astype(int) + 60).sum())

    green = (0.0, 0.9, 0.0)
    assert greens(draw(Picture((ball,), points=((front, green),), camera_from=(0, 0, 1)), (200, 200))) > 0
    assert greens(draw(Picture((ball,), points=((back, green),), camera_from=(0, 0, 1)), (200, 200))) == 0
    line = np.array([[[-1.2, 0.0, 1.2], [1.2, 0.0, 1.2]]])
    assert greens(draw(Picture((ball,), lines=((line, green),), camera_from=(0, 0, 1)), (200, 200))) > 100


def test_focus_fills_the_frame() -> None:
    ball = PictureMesh(icosphere(2), RED)
    whole = covered(draw(Picture((ball,)), SIZE)).mean()
    corner = covered(draw(Picture((ball,), focus=icosphere(1, 0.2).points), SIZE)).mean()
    assert corner > 0.95 > whole


def test_failed_rows_are_red_and_letters_differ() -> None:
    ball = PictureMesh(icosphere(1), (0.5, 0.5, 0.5))
    plain = draw(Picture((ball,), table=(("gap", "1 %", False),)), (400, 300))[:24, :100].astype(int)
    failed = draw(Picture((ball,), table=(("gap", "1 %", True),)), (400, 300))[:24, :100].astype(int)
    assert (failed[..., 0] - failed[..., 1]).max() > 100 > (plain[..., 0] - plain[..., 1]).max()
    masks = {text_mask(chr(code)).tobytes() for code in range(32, 127)}
    assert len(masks) == 95
    assert text_mask("ab", 2).shape == (2 * CELL_HEIGHT, 4 * CELL_WIDTH)


@pytest.mark.parametrize("direction", [(0.0, 0.0, 1.0), (1.0, 0.4, 0.2), (0.3, -1.0, 0.1)])
@pytest.mark.parametrize("size", [(500, 600), (900, 500)])
def test_nothing_of_the_scene_lies_under_its_texts(
    direction: tuple[float, float, float], size: tuple[int, int]
) -> None:
    """Whatever the view and the frame: the focus stays below table and legend, and above the caption."""
    grey = (0.5, 0.5, 0.5)
    for table, legend in ((15, 3), (2, 9), (0, 30)):
        picture = Picture(
            (PictureMesh(torus(), RED),),
            camera_from=direction,
            table=(("a", "b", False),) * table,
            legend=(("palm", grey),) * legend,
            caption="a torus",
        )
        seen = np.flatnonzero(covered(draw(picture, size)).any(axis=1))
        row = ROW * size[1]
        assert seen[0] >= 8 + rows_above(picture) * row and seen[-1] <= size[1] - 1.3 * row
        assert legend <= LEGEND_ROWS or legend_rows(picture)[-1] == ("and 20 more", None)


def test_the_legend_shows_each_colour_beside_its_name() -> None:
    ball = PictureMesh(icosphere(1), (0.5, 0.5, 0.5))
    image = draw(Picture((ball,), legend=(("thumb", RED), ("palm", BLUE))), (400, 360)).astype(int)
    left = int(LEGEND_AT * 400)
    for place, color in enumerate((RED, BLUE)):
        square = image[8 + int(place * ROW * 360) + 3, left + 3]
        np.testing.assert_allclose(square, np.array(color) * 255, atol=1)


def test_pictures_stand_side_by_side(tmp_path: Path) -> None:
    ball = PictureMesh(icosphere(2), RED)
    SoftwareRenderer().render([Picture((ball,)), Picture((ball,))], tmp_path / "two.png", size=(160, 80))
    image = decoded((tmp_path / "two.png").read_bytes())
    assert image.shape == (80, 160, 3)
    np.testing.assert_array_equal(image[:, :80], image[:, 80:])
    assert OVERSAMPLE == 2
    SoftwareRenderer().render([Picture((ball,))] * 3, tmp_path / "three.png", size=(160, 80))
    assert decoded((tmp_path / "three.png").read_bytes()).shape == (80, 160, 3)


@pytest.mark.parametrize(
    ("name", "says"), [("x.txt", "is a PNG file"), ("x", "is a PNG file"), ("a\0b.png", "null character"),
                       ("file/x.png", "is not a folder"), ("folder.png", "it is a folder")],
)  # fmt: skip
def test_a_path_that_takes_no_picture_is_refused_once_and_not_by_each_renderer(
    name: str, says: str, tmp_path: Path
) -> None:
    (tmp_path / "file").write_bytes(b"")
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(FileRefused, match=says) as refusal:
        draw_with_plugins([], tmp_path / name, PluginManager())
    assert "renderer" not in str(refusal.value)
    assert {entry.name for entry in tmp_path.iterdir()} == {"file", "folder.png"}


def test_refusals(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="needs content"):
        SoftwareRenderer().render([], tmp_path / "none.png")
    (tmp_path / "taken").write_text("")
    with pytest.raises(FileRefused):
        SoftwareRenderer().render(
            [Picture((PictureMesh(icosphere(1), RED),))], tmp_path / "taken" / "p.png", size=(32, 32)
        )


@pytest.mark.parametrize("turn", range(3))
def test_a_triangle_that_reaches_behind_the_eye_is_drawn_like_its_small_parts(turn: int) -> None:
    """A ground of two triangles, and the same in small squares, most of which lie before or behind the eye."""

    def ground(parts: int) -> PictureMesh:
        u, v = np.meshgrid(np.linspace(-1, 1, parts + 1), np.linspace(-1, 1, parts + 1), indexing="ij")
        points = np.stack([40 * u.ravel(), np.full(u.size, -1.0), 40 * v.ravel()], axis=1)
        corner = np.arange(u.size).reshape(u.shape)[:-1, :-1].ravel()
        squares = np.c_[corner, corner + 1, corner + parts + 2, corner, corner + parts + 2, corner + parts + 1]
        colors = 0.5 + 0.5 * np.stack([u.ravel(), v.ravel(), 0 * u.ravel()], axis=1)
        faces = np.roll(squares.reshape(-1, 3), turn, axis=1)
        return PictureMesh(TriangleMesh(points, faces), (1.0, 1.0, 1.0), vertex_colors=colors)

    images = [
        draw(Picture((ground(parts),), camera_from=(0.3, 0.6, 1.0), focus=icosphere(1).points), SIZE).astype(float)
        for parts in (1, 64)
    ]
    apart = np.abs(images[0] - images[1]).max(axis=2)
    assert (apart <= 2).mean() > 0.98
    assert (apart[-1] <= 2).all()  # the row that is nearest to the eye shows the ground
