"""A film in pictures and figures: a strip of some frames, a movie of all, the report of a solved motion as data."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from contact_core.atomic_file import write_atomic
from contact_core.edit.document_geometry import DocumentGeometry
from contact_core.errors import InvalidInput
from contact_core.geometry.transform import transform_points
from contact_core.plugins.registry import RENDERERS
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.scene.picture import Picture, PictureMesh
from contact_core.scene.problem import world_from_surface

if TYPE_CHECKING:
    from contact_core.proposals.motion import MotionProposal
    from contact_core.session import Session

SKIN, THING = (0.84, 0.64, 0.53), (0.66, 0.69, 0.74)
STRIP = 6  # pictures of a strip
PANEL, MOVIE = (300, 300), (480, 360)  # pixels
MOST_PICTURES = 2_000  # of a movie


def picture_at(session: Session, frame: float) -> Picture:
    """The scene at a frame, in world space: everything where it stands and posed as it is keyed, contacts that are
    on as points in the colours of their patches."""
    still = session.scene_at(frame)
    geometry = DocumentGeometry(lambda: still, session.derived, session.rigs)
    loaded = [name for name in still.surfaces if name in session.derived.meshes(still)]
    if not loaded:
        raise InvalidInput("there is nothing to draw: no surface of the document has its mesh loaded.")
    unit = still.surfaces[loaded[0]].meters_per_unit
    posed = {}
    for name in loaded:
        mesh = geometry.posed_mesh(name)
        posed[name] = mesh.with_points(transform_points(world_from_surface(still, name, unit), mesh.points))
    points = []
    for pair in geometry.pairs():
        if pair.pair.gain > 0.0:
            color = still.patch(pair.pair.manipulator).color
            points.append((pair.manipulator_points.positions(posed[pair.manipulator_surface]), color))
            points.append((pair.object_points.positions(posed[pair.object_surface]), color))
    meshes = tuple(PictureMesh(mesh, SKIN if name in session.rigs else THING) for name, mesh in posed.items())
    return Picture(meshes, tuple(points), caption=f"frame {frame:g}")


def pictures_of(session: Session, frames: Sequence[float], progress: Progress = NO_PROGRESS) -> list[Picture]:
    """The scene at frames, all through one camera that has everything in view that moves into it."""
    pictures = []
    for row, frame in enumerate(frames):
        progress.tell(row / len(frames), f"frame {frame:g}")
        pictures.append(picture_at(session, frame))
    corners = []
    for picture in pictures:
        skins = [item.mesh.points for item in picture.meshes if item.color == SKIN] or [
            item.mesh.points for item in picture.meshes
        ]
        corners += [np.stack([points.min(axis=0), points.max(axis=0)]) for points in skins]
    focus = np.concatenate(corners)
    return [replace(picture, focus=focus) for picture in pictures]


def write_strip(
    session: Session, frames: Sequence[float], path: Path, *, count: int = STRIP, panel: tuple[int, int] = PANEL
) -> Path:
    """A film strip, one PNG: some of the frames side by side, evenly spread. Raises InvalidInput, FileRefused."""
    chosen = [frames[k] for k in np.unique(np.linspace(0, len(frames) - 1, count).round().astype(int))]
    pictures = pictures_of(session, chosen)
    size = (panel[0] * len(pictures), panel[1])
    _renderer(session).render(pictures, path, size=size)
    return path


def write_movie(
    session: Session,
    frames: Sequence[float],
    path: Path,
    *,
    size: tuple[int, int] = MOVIE,
    progress: Progress = NO_PROGRESS,
) -> Path:
    """A GIF that plays frames at the rate of the film, over and over.

    Raises InvalidInput where Pillow, which makes GIFs, is not there, Cancelled, FileRefused.
    """
    try:
        from PIL import Image
    except ImportError:
        raise InvalidInput("a movie needs Pillow: pip install 'contact-core[app]'.") from None
    if not 0 < len(frames) <= MOST_PICTURES:
        raise InvalidInput(f"a movie has 1 to {MOST_PICTURES} pictures, but got {len(frames)} frames.")
    rate, renderer = session.timeline.settings.frames_per_second, _renderer(session)
    pictures = pictures_of(session, frames, progress.part(0.0, 0.3))
    images = []
    with tempfile.TemporaryDirectory() as folder:
        for row, picture in enumerate(pictures):
            progress.part(0.3, 1.0).tell(row / len(pictures), picture.caption)
            still = Path(folder) / "frame.png"
            renderer.render([picture], still, size=size)
            with Image.open(still) as drawn:
                images.append(drawn.convert("P", palette=Image.Palette.ADAPTIVE))
        made = Path(folder) / "film.gif"
        images[0].save(
            made, save_all=True, append_images=images[1:], duration=max(round(1000.0 / rate), 20), loop=0
        )
        write_atomic(path, made.read_bytes())
    return path


def figures_of(proposal: MotionProposal, *, depth: bool = True) -> dict[str, Any]:
    """The report of a motion as JSON-able data: lengths in metres, angles in degrees, times in seconds."""
    solution = proposal.motion
    assert solution is not None
    report, motion = proposal.report(depth=depth), solution.motion
    unit = _metres(proposal)
    pairs = {
        name: {
            "frames": pair.frames,
            "error_mean": unit * pair.mean,
            "error_p95": unit * pair.p95,
            "error_worst": unit * pair.worst,
            "worst_frame": pair.worst_frame,
            "skate_max_per_second": unit * pair.skate_max,
            "skate_rms_per_second": unit * pair.skate_rms,
        }
        for name, pair in report.pairs.items()
    }
    return {
        "frames": [motion.frames[0], motion.frames[-1]],
        "rate": motion.rate,
        "status": solution.status.name,
        "iterations": solution.iterations,
        "seconds": solution.seconds,
        "pairs": pairs,
        "joint_acceleration_max": float(np.degrees(report.joint_acceleration)),
        "pad_acceleration_max": unit * report.pad_acceleration,
        "jerk_rms": unit * report.jerk_rms,
        "penetration_held": unit * report.penetration_held if depth else None,
        "penetration_transit": unit * report.penetration_transit if depth else None,
        "largest_step": unit * report.largest_step,
        "largest_step_frame": report.step_frame,
        "pop": report.pop if np.isfinite(report.pop) else None,
        "speed_excess": solution.speed_excess,
        "acceleration_excess": solution.acceleration_excess,
        "keys": dict(report.keys),
        "key_error": {
            name: error * proposal.ghost.surfaces[name].meters_per_unit for name, error in report.key_error.items()
        },
    }


def _metres(proposal: MotionProposal) -> float:
    """Of a unit of the problem's world: that of the first surface of the first pair."""
    assert proposal.motion is not None
    first = proposal.motion.motion.problems[0].bodies[0].name
    return proposal.ghost.surfaces[first].meters_per_unit


def _renderer(session: Session) -> Any:
    """The best renderer that draws here."""
    name = session.plugins.name_for(RENDERERS, "thumbnail")
    return session.plugins.get(RENDERERS, name)
