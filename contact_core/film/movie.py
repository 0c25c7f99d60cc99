"""A film as a movie: GIF and WebP by Pillow, WebM by PyAV, as a shot or with the camera going round."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from contact_core.atomic_file import write_atomic
from contact_core.errors import FileRefused, InvalidInput
from contact_core.film.film import pictures_of, renderer_of
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.rig.rotations import exponential
from contact_core.scene.camera import DEFAULT_FROM
from contact_core.scene.picture import Picture

if TYPE_CHECKING:
    from contact_core.session import Session

MOVIE = (480, 360)  # pixels
MOST_PICTURES = 2_000  # of a movie
MOST_COLOURS = 128  # of a GIF: skin and a ball need no more, and the file is half as large


def write_movie(
    session: Session,
    frames: Sequence[float],
    path: Path,
    *,
    size: tuple[int, int] = MOVIE,
    turn: float = 0.0,
    progress: Progress = NO_PROGRESS,
) -> Path:
    """A movie that plays frames at the rate of the film: .gif, .webp or .webm, as the path ends.

    turn: degrees by which the camera goes round while it plays; 360 is a turntable. One frame, many times
    (`[12.0] * 48`), is a turntable of a pose. Raises InvalidInput where what makes such movies is not installed,
    Cancelled, FileRefused.
    """
    check_movie(Path(path))
    writer = _WRITERS[Path(path).suffix.lower()]
    if not 0 < len(frames) <= MOST_PICTURES:
        raise InvalidInput(f"a movie has 1 to {MOST_PICTURES} pictures, but got {len(frames)} frames.")
    if not np.isfinite(turn):
        raise InvalidInput(f"the camera turns by a number of degrees, but got {turn}.")
    pictures = going_round(pictures_of(session, frames, progress.part(0.0, 0.3)), turn)
    rate = Fraction(*session.timeline.settings.rate)
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / f"film{Path(path).suffix.lower()}"
        try:
            writer(_drawn(session, pictures, Path(folder), size, progress.part(0.3, 1.0)), made, rate)
        except OSError as error:  # Pillow and PyAV say a full disk as the system does
            raise FileRefused(f"cannot write a movie into {folder}: {error.strerror or error}.") from error
        write_atomic(Path(path), made.read_bytes())
    return Path(path)


def going_round(pictures: Sequence[Picture], turn: float) -> list[Picture]:
    """The pictures with their camera turned about up, evenly, by so many degrees from the first round to the last.

    A whole turn ends one step before where it began, so that a movie that plays over and over does not stand still.
    """
    if not turn:
        return list(pictures)
    found = []
    for row, picture in enumerate(pictures):
        angle = np.radians(turn) * row / len(pictures)
        about = exponential((angle * np.asarray(picture.up, float))[None])[0][0]
        x, y, z = about @ np.asarray(picture.camera_from or DEFAULT_FROM, float)
        found.append(replace(picture, camera_from=(float(x), float(y), float(z))))
    return found


def _drawn(
    session: Session, pictures: Sequence[Picture], folder: Path, size: tuple[int, int], progress: Progress
) -> Iterator[Any]:
    """Each picture, drawn, as a Pillow image in RGB."""
    from PIL import Image

    renderer, still = renderer_of(session), folder / "frame.png"
    for row, picture in enumerate(pictures):
        progress.tell(row / len(pictures), picture.caption)
        renderer.render([picture], still, size=size)
        with Image.open(still) as drawn:
            yield drawn.convert("RGB")


def check_movie(path: Path) -> None:
    """Raises InvalidInput where no such movie can be made here."""
    suffix = path.suffix.lower()
    if suffix not in _WRITERS:
        raise InvalidInput(f"a movie ends in {', '.join(_WRITERS)}, but got {path.name!r}.")
    try:
        import PIL.Image  # noqa: F401  (whether it is there)

        if suffix == ".webm":
            import av  # noqa: F401  (whether it is there)
    except ImportError as missing:
        what = "Pillow" if "PIL" in str(missing) else "PyAV"
        raise InvalidInput(f"a movie {suffix} needs {what}: pip install 'contact-core[movies]'.") from None


def _write_gif(images: Iterator[Any], path: Path, rate: Fraction) -> None:
    """Hundredths of a second each, rounded so that the whole keeps its length."""
    from PIL import Image

    shown = [image.convert("P", palette=Image.Palette.ADAPTIVE, colors=MOST_COLOURS) for image in images]
    ends = [round(100 * (k + 1) / rate) for k in range(len(shown))]
    lengths = [10 * max(end - begin, 2) for begin, end in zip([0, *ends[:-1]], ends, strict=True)]
    shown[0].save(path, save_all=True, append_images=shown[1:], duration=lengths, loop=0)


def _write_webp(images: Iterator[Any], path: Path, rate: Fraction) -> None:
    first, *others = images
    first.save(path, save_all=True, append_images=others, duration=round(1000 / rate), loop=0, quality=85)


def _write_webm(images: Iterator[Any], path: Path, rate: Fraction) -> None:
    """VP9, of even width and height, as the codec wants them."""
    import av

    with av.open(str(path), "w") as container:
        stream: Any = None
        for image in images:
            width, height = (side - side % 2 for side in image.size)
            if stream is None:
                stream = container.add_stream("libvpx-vp9", rate=rate, options={"crf": "24", "b:v": "0"})
                stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
            shown = np.asarray(image.crop((0, 0, width, height)))
            frame = av.VideoFrame.from_ndarray(shown, format="rgb24")
            for packet in stream.encode(frame):
                container.mux(packet)
        for packet in stream.encode():
            container.mux(packet)


_WRITERS: dict[str, Callable[[Iterator[Any], Path, Fraction], None]] = {
    ".gif": _write_gif,
    ".webp": _write_webp,
    ".webm": _write_webm,
}
