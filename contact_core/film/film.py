"""A film in pictures and figures: a strip of some frames, a movie of all, the report of a solved motion as data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from contact_core.edit.document_geometry import DocumentGeometry
from contact_core.errors import InvalidInput
from contact_core.geometry.transform import transform_points
from contact_core.plugins.registry import RENDERERS
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.scene.camera import DEFAULT_FROM
from contact_core.scene.picture import Picture, PictureMesh
from contact_core.scene.problem import world_from_surface

if TYPE_CHECKING:
    from contact_core.proposals.motion import MotionProposal
    from contact_core.session import Session

SKIN, THING = (0.84, 0.64, 0.53), (0.66, 0.69, 0.74)
STRIP = 6  # pictures of a strip
PANEL = (300, 300)  # pixels


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
    eye, up = seen_from(still.surfaces[loaded[0]].up_axis)
    return Picture(meshes, tuple(points), camera_from=eye, up=up, caption=f"frame {frame:g}")


def seen_from(up_axis: str) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """From where a scene with that axis up is seen by default, and up."""
    x, y, z = DEFAULT_FROM
    eyes = {"X": (y, -x, z), "Y": (x, y, z), "Z": (x, -z, y)}
    ups = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}
    return eyes[up_axis], ups[up_axis]


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
    renderer_of(session).render(pictures, path, size=size)
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


def words_of(figures: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The report of `figures_of` in words: what it is about, and a sentence on it."""
    first, last = figures["frames"]
    rows = [("frames", f"{first:g} to {last:g} at {figures['rate']:g} per second, {figures['status'].lower()}")]
    for name, pair in figures["pairs"].items():
        rows += [(name, _error_words(pair)), ("", _skate_words(pair))]
    rows.append(("joints", f"accelerate by at most {figures['joint_acceleration_max']:.0f} degrees/s²"))
    pads = f"accelerate by at most {1e3 * figures['pad_acceleration_max']:.0f} mm/s²"
    rows.append(("pads", f"{pads}, jerk {1e3 * figures['jerk_rms']:.0f} mm/s³ rms"))
    if figures["penetration_held"] is not None:
        held, between = (1e3 * figures[f"penetration_{when}"] for when in ("held", "transit"))
        rows.append(("penetration", f"{held:.2f} mm while held, {between:.2f} mm in transit"))
    step = f"{1e3 * figures['largest_step']:.1f} mm to frame {figures['largest_step_frame']:g}"
    pop = figures["pop"]
    beside = "out of rest: a pop" if pop is None else f"{pop:.2f} times the larger of those beside it"
    rows.append(("largest step", f"{step}, {beside}{'' if pop is None or pop < 2.0 else ': a pop'}"))
    for name, excess in (("speed", figures["speed_excess"]), ("acceleration", figures["acceleration_excess"])):
        if excess > 0.0:
            rows.append(("bounds", f"on {name} are exceeded by up to {100.0 * excess:.1f} %"))
    for name, count in figures["keys"].items():
        off = 1e3 * figures["key_error"][name]
        rows.append((f"keys of {name}", f"{count} for all frames, the skin within {off:.2f} mm"))
    return rows


def _error_words(pair: Mapping[str, Any]) -> str:
    mean, p95, worst = (1e3 * pair[f"error_{what}"] for what in ("mean", "p95", "worst"))
    return (
        f"on for {pair['frames']} frames; {mean:.2f} mm apart in the mean, {p95:.2f} for 95 % of its points, worst"
        f" {worst:.2f} at frame {pair['worst_frame']:g}"
    )


def _skate_words(pair: Mapping[str, Any]) -> str:
    most, rms = (1e3 * pair[f"skate_{what}_per_second"] for what in ("max", "rms"))
    return f"slips by at most {most:.2f} mm/s, {rms:.2f} rms"


def _metres(proposal: MotionProposal) -> float:
    """Of a unit of the problem's world: that of the first surface of the first pair."""
    assert proposal.motion is not None
    first = proposal.motion.motion.problems[0].bodies[0].name
    return proposal.ghost.surfaces[first].meters_per_unit


def renderer_of(session: Session) -> Any:
    """The best renderer that draws here."""
    name = session.plugins.name_for(RENDERERS, "thumbnail")
    return session.plugins.get(RENDERERS, name)
