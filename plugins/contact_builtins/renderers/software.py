"""The plain software picture: a depth buffer in numpy, for machines without OpenGL.

Triangles, points and lines all become fragments (pixel, depth, colour); the nearest fragment of a pixel
wins. Each pixel is drawn at twice the size and averaged, which is all the anti-aliasing a report needs.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from contact_builtins.renderers.font import CELL_HEIGHT, text_mask
from contact_builtins.renderers.png import write_png
from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.scene.camera import LEGEND_AT, ROW, WIDEST_NAME, Camera, camera_of, legend_rows
from contact_core.scene.picture import Picture, PictureMesh, sheet_rows

OVERSAMPLE = 2
_KEY_LIGHT = np.array([-0.45, 0.65, 0.75]) / np.linalg.norm([-0.45, 0.65, 0.75])  # camera axes
_TOP, _BOTTOM = np.array([0.97, 0.97, 0.98]), np.array([0.84, 0.86, 0.89])  # background
_INK, _ALARM = np.array([0.13, 0.15, 0.19]), np.array([0.78, 0.10, 0.10])
NEAR = 0.02  # of the distance from eye to centre: what is nearer is cut off
_CHUNK = 4_000_000  # fragments drawn at a time


class SoftwareRenderer:
    """Draws everywhere; the last resort of `contact pose`."""

    name = "software"
    summary = "plain pictures by numpy alone, where no graphics card is"
    priority = 0
    default_for = "thumbnail"

    def unavailable(self) -> str | None:
        return None

    def render(self, pictures: Sequence[Picture], path: Path, *, size: tuple[int, int] = (1280, 720)) -> None:
        """Draw pictures, those of a row side by side, into one PNG. Raises InvalidInput, FileRefused."""
        if not pictures or min(size) < 16 or max(size) > 8192:
            raise InvalidInput(f"a picture needs content and 16 to 8192 pixels a side, but got {size}.")
        rows = sheet_rows(pictures)
        bands = zip(rows, _parts(size[1], len(rows)), strict=True)
        write_png(np.concatenate([_band(row, size[0], height) for row, height in bands]), path)


def _parts(whole: int, count: int) -> list[int]:
    """A length in whole parts, as equal as may be."""
    return [whole * (place + 1) // count - whole * place // count for place in range(count)]


def _band(pictures: Sequence[Picture], width: int, height: int) -> npt.NDArray[np.uint8]:
    """Pictures side by side."""
    panels = [draw(p, (own, height)) for p, own in zip(pictures, _parts(width, len(pictures)), strict=True)]
    return np.concatenate(panels, axis=1)


def draw(picture: Picture, size: tuple[int, int]) -> npt.NDArray[np.uint8]:
    """One picture as (height, width, 3) uint8."""
    width, height = size[0] * OVERSAMPLE, size[1] * OVERSAMPLE
    canvas = _Canvas(width, height, camera_of(picture, width / height))
    for item in picture.meshes:
        canvas.mesh(item)
    for points, color in picture.points:
        canvas.discs(np.asarray(points, float), np.asarray(color), radius=height // 200)
    for segments, color in picture.lines:
        canvas.segments(np.asarray(segments, float), np.asarray(color), radius=max(1, height // 700))
    image = canvas.image.reshape(size[1], OVERSAMPLE, size[0], OVERSAMPLE, 3).mean(axis=(1, 3))
    _write_text(image, picture)
    return np.asarray(np.clip(image * 255 + 0.5, 0, 255), np.uint8)


class _Canvas:
    """A picture being drawn: image (height, width, 3) and depth along the camera's view."""

    def __init__(self, width: int, height: int, camera: Camera) -> None:
        self.width, self.height, self.camera = width, height, camera
        blend = np.linspace(0, 1, height)[:, None, None]  # (height, 1, 1)
        self.image: FloatArray = np.broadcast_to(_TOP * (1 - blend) + _BOTTOM * blend, (height, width, 3)).copy()
        self.depth: FloatArray = np.full(height * width, np.inf)
        self.focal = 0.5 * height / np.tan(camera.field_of_view / 2)

    def from_eye(self, points: FloatArray) -> FloatArray:
        """World points (n, 3) from the eye, along the camera's axes; it looks along -z."""
        return (points - self.camera.eye) @ self.camera.camera_from_world.T

    def on_screen(self, from_eye: FloatArray) -> FloatArray:
        """(..., 3) pixel x, pixel y and depth of points that `from_eye` gave."""
        depth = np.maximum(-from_eye[..., 2], 1e-9)
        x = 0.5 * self.width + self.focal * from_eye[..., 0] / depth
        y = 0.5 * self.height * (1.0 + self.camera.drop) - self.focal * from_eye[..., 1] / depth
        return np.stack([x, y, depth], axis=-1)

    def mesh(self, item: PictureMesh) -> None:
        """Shaded triangles; a transparent mesh is drawn on a checker of pixels (screen-door)."""
        from_eye = self.from_eye(item.mesh.points)
        shade = _shade(item.mesh.vertex_normals @ self.camera.camera_from_world.T)  # (n,)
        base = np.asarray(item.color) if item.vertex_colors is None else item.vertex_colors
        colors = np.clip(np.broadcast_to(base, from_eye.shape) * shade[:, None], 0, 1)  # (n, 3)
        frame = np.array([self.width, self.height])
        near = NEAR * float(np.linalg.norm(self.camera.eye - self.camera.centre))
        in_front, tints = _cut_in_front(from_eye[item.mesh.faces], colors[item.mesh.faces], near)
        corners = self.on_screen(in_front)  # (m, 3, 3)
        low = np.floor(np.clip(corners[:, :, :2].min(axis=1), 0, frame)).astype(np.int64)  # (m, 2), in the frame
        span = np.ceil(np.clip(corners[:, :, :2].max(axis=1), 0, frame)).astype(np.int64) - low  # (m, 2)
        seen = (span > 0).all(axis=1)
        tints, corners, low, span = tints[seen], corners[seen], low[seen], span[seen]
        side = 1 << np.ceil(np.log2(np.clip(span.max(axis=1), 1, 8192))).astype(np.int64)  # (m,)
        for extent in np.unique(side):  # triangles of one size class share one grid of pixel offsets
            members = np.flatnonzero(side == extent)
            for start in range(0, len(members), max(1, _CHUNK // int(extent) ** 2)):
                chosen = members[start : start + max(1, _CHUNK // int(extent) ** 2)]
                self._triangles(corners[chosen], tints[chosen], low[chosen], int(extent), item.opacity)

    def _triangles(
        self, corners: FloatArray, colors: FloatArray, low: IntArray, extent: int, opacity: float
    ) -> None:
        offset = np.stack(np.meshgrid(np.arange(extent), np.arange(extent), indexing="xy"), -1).reshape(-1, 2)
        pixels = low[:, None, :] + offset  # (m, extent^2, 2)
        a, b, c = (corners[:, None, k, :2] for k in range(3))
        area = _cross(b - a, c - a)  # (m, 1)
        at = pixels + 0.5
        with np.errstate(divide="ignore", invalid="ignore"):
            weights = (
                np.stack([_cross(b - at, c - at), _cross(c - at, a - at), _cross(a - at, b - at)], -1)
                / area[..., None]
            )
        covered = (weights >= 0).all(axis=-1)  # NaN of an edge-on triangle compares False
        if opacity < 1.0:
            covered &= ((pixels * (7, 13)).sum(axis=-1) % 16) < 16 * opacity
        which, where = np.nonzero(covered)
        weight = weights[which, where]  # (f, 3)
        weight = weight / corners[which, :, 2]  # 1 / depth is linear across the picture, depth is not
        depth = 1.0 / weight.sum(axis=1)
        seen = np.einsum("fc,fci->fi", weight * depth[:, None], colors[which])
        self.fragments(pixels[which, where], depth, seen)

    def discs(self, points: FloatArray, color: FloatArray, radius: int) -> None:
        """Round dots, pulled a little towards the eye so that they show on the surface that carries them."""
        if not len(points):
            return
        projected = self.on_screen(self.from_eye(points))
        reach = np.arange(-radius, radius + 1)
        offset = np.stack(np.meshgrid(reach, reach), -1).reshape(-1, 2)
        offset = offset[(offset**2).sum(axis=1) <= radius * radius]  # (o, 2)
        pixels = (projected[:, None, :2].astype(np.int64) + offset).reshape(-1, 2)
        depth = np.repeat(projected[:, 2], len(offset)) * 0.9985
        self.fragments(pixels, depth, np.broadcast_to(color, (len(pixels), 3)))

    def segments(self, segments: FloatArray, color: FloatArray, radius: int) -> None:
        """Lines (k, 2, 3) as rows of dots."""
        if not len(segments):
            return
        ends = self.on_screen(self.from_eye(segments.reshape(-1, 3))).reshape(-1, 2, 3)
        count = int(np.clip(np.abs(ends[:, 1, :2] - ends[:, 0, :2]).max(), 2, 4096))
        t = np.linspace(0, 1, count)[:, None]
        self.discs((segments[:, :1] * (1 - t) + segments[:, 1:] * t).reshape(-1, 3), color, radius)

    def fragments(self, pixels: IntArray, depth: FloatArray, colors: FloatArray) -> None:
        """Depth-tested writes: pixels (f, 2), depth (f,), colors (f, 3)."""
        inside = ((pixels >= 0) & (pixels < (self.width, self.height))).all(axis=1)
        index = pixels[inside, 1] * self.width + pixels[inside, 0]
        depth, colors = depth[inside], colors[inside]
        np.minimum.at(self.depth, index, depth)
        nearest = depth <= self.depth[index]
        self.image.reshape(-1, 3)[index[nearest]] = colors[nearest]


def _cut_in_front(corners: FloatArray, colors: FloatArray, near: float) -> tuple[FloatArray, FloatArray]:
    """Triangles (m, 3, 3) from the eye, and colours (m, 3, 3) at their corners, cut at the plane z = -near; what is
    nearer is gone. Sutherland and Hodgman 1974, for one plane."""
    whole = np.concatenate([corners, colors], axis=-1)  # (m, 3, 6)
    ahead = corners[:, :, 2] < -near
    kept = [whole[ahead.all(axis=1)]]
    for count in (1, 2):
        some = ahead.sum(axis=1) == count
        alone = np.argmax(ahead[some] == (count == 1), axis=1)  # the corner that is on its own side
        a, b, c = (np.take_along_axis(whole[some], (alone[:, None, None] + k) % 3, axis=1)[:, 0] for k in range(3))
        ab, ac = _where_cut(a, b, near), _where_cut(a, c, near)
        kept += [np.stack([a, ab, ac], 1)] if count == 1 else [np.stack([ab, b, c], 1), np.stack([ab, c, ac], 1)]
    cut = np.concatenate(kept)
    return cut[:, :, :3], cut[:, :, 3:]


def _where_cut(a: FloatArray, b: FloatArray, near: float) -> FloatArray:
    """(k, 6) where edges from a to b (k, 6) meet the plane z = -near."""
    t = (-near - a[:, 2]) / (b[:, 2] - a[:, 2])
    return a + t[:, None] * (b - a)


def _shade(normals: FloatArray) -> FloatArray:
    """(n,) brightness under a soft key light from upper left and a headlight; both sides are lit."""
    key = np.clip(0.5 + 0.5 * normals @ _KEY_LIGHT, 0, 1) ** 1.5
    head = np.abs(normals[:, 2])
    return np.asarray(0.28 + 0.5 * key + 0.3 * head)


def _cross(u: FloatArray, v: FloatArray) -> FloatArray:
    return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]


def _write_text(image: FloatArray, picture: Picture) -> None:
    """Table rows from the top left, the legend beside them, the caption along the bottom; red for what failed."""
    line = ROW * image.shape[0]
    scale = max(1, int(line) // (CELL_HEIGHT + 1))
    for place, (name, value, failed) in enumerate(picture.table):
        text, ink = f"{name:<{WIDEST_NAME}} {value}", _ALARM if failed else _INK
        _stamp(image, text, 8, 8 + int(place * line), scale, ink)
    left = int(LEGEND_AT * image.shape[1])
    for place, (name, color) in enumerate(legend_rows(picture)):
        y = 8 + int(place * line)
        if color is not None:
            image[y + scale : y + 7 * scale, left : left + 6 * scale] = color
        _stamp(image, name, left + 9 * scale, y, scale, _INK)
    larger = max(1, round(scale * picture.lettering))
    _stamp(image, picture.caption, 8, image.shape[0] - int(1.3 * line * larger / scale), larger, _INK)


def _stamp(image: FloatArray, text: str, x: int, y: int, scale: int, ink: FloatArray) -> None:
    mask = text_mask(text, scale)[: max(0, image.shape[0] - y), : max(0, image.shape[1] - x)]
    under = image[y : y + mask.shape[0], x : x + mask.shape[1]]
    under += 0.6 * (_TOP - under)  # a pole may stand behind it
    under[mask] = ink
