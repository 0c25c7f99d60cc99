"""`contact motion SCENE --out DIR`: solve the film of a scene, key it, say in figures and pictures what came."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from contact_core.cli.frames import frames_of
from contact_core.cli.numbers import finite
from contact_core.cli.output import columns

if TYPE_CHECKING:
    from contact_core.proposals.motion import MotionProposal
    from contact_core.session import Session


class Motion:
    name = "motion"
    summary = "solve the contacts of a scene over time; writes the keyed scene, a report, a film strip and a movie"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument("scene", type=Path, metavar="SCENE", help="a scene with contacts: .usda, .contactscene")
        parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="the folder for the results")
        parser.add_argument("--frames", type=str, metavar="1,5,10-20", help="the film's own range by default")
        parser.add_argument("--detect", action="store_true", help="first find the contacts that the animation has")
        parser.add_argument(
            "--follow", type=finite, default=0.0, metavar="WEIGHT", help="keep to the animation that is there (0)"
        )
        parser.add_argument(
            "--ground", action="store_true", help="what is followed is first moved as a whole to its contacts"
        )
        parser.add_argument("--skate", type=finite, metavar="WEIGHT", help="cost of contacts that slip (0.05)")
        parser.add_argument("--tolerance", type=finite, default=1.0, metavar="MM", help="of the keys (1 mm)")
        parser.add_argument("--no-pictures", action="store_true", help="no film strip and no movie")

    def run(self, arguments: argparse.Namespace) -> int:
        from contact_core.atomic_file import write_atomic
        from contact_core.job.clip import write_clip
        from contact_core.job.film import figures_of, write_movie, write_strip
        from contact_core.opening import open as open_scene

        out, progress = arguments.out, arguments.output
        with open_scene(arguments.scene, plugins=arguments.plugins) as session:
            frames = _frames(session, arguments.frames)
            if arguments.detect:
                session.accept(session.detect(frames, progress=progress))
            found = _solved(session, frames, arguments, progress)
            figures = figures_of(found)
            session.accept(found)
            out.mkdir(parents=True, exist_ok=True)
            files: dict[str, Path] = {"scene": out / _keyed_name(arguments.scene), "report": out / "motion.json"}
            session.save(files["scene"])
            write_atomic(files["report"], json.dumps(figures, indent=1, allow_nan=False) + "\n")
            files["clip"] = write_clip(session, frames, out / "film.glb")
            if not arguments.no_pictures:
                files["strip"] = write_strip(session, frames, out / "strip.png")
                files["movie"] = write_movie(session, frames, out / "film.gif", progress=progress)
        lines = [columns([(" ", name, value) for name, value in _table(figures)])]
        lines += [f"{role}: {path}" for role, path in files.items()]
        answer = {"report": figures, "files": {role: str(path) for role, path in files.items()}}
        progress.answer(answer, "\n".join(lines))
        return 0


def _frames(session: Session, text: str | None) -> tuple[float, ...]:
    from contact_core.errors import InvalidInput

    if text is not None:
        return frames_of(text)
    settings = session.timeline.settings
    if settings.first == settings.last:
        raise InvalidInput(
            "the document has no range of frames: give --frames, or set one with session.timeline.set."
        )
    return settings.frames()


def _solved(
    session: Session, frames: tuple[float, ...], arguments: argparse.Namespace, progress: Any
) -> MotionProposal:
    from contact_core.errors import Cancelled
    from contact_core.motion.problem import MotionWeights
    from contact_core.proposals.motion import MotionProposal, MotionSettings
    from contact_core.solve.solver import SolveStatus

    given = {"follow": arguments.follow} | ({} if arguments.skate is None else {"skate": arguments.skate})
    settings = MotionSettings(
        MotionWeights(**given), tolerance=1e-3 * arguments.tolerance, grounded=arguments.ground
    )
    prior: Literal["current", "rest"] = "current" if arguments.follow > 0.0 else "rest"
    found = session.solve(frames=frames, motion=settings, prior=prior, progress=progress)
    if found.after.status is SolveStatus.CANCELLED:
        raise Cancelled("it was cancelled; nothing was written.")
    assert isinstance(found, MotionProposal)
    return found


def _keyed_name(scene: Path) -> str:
    return f"{scene.name.partition('.')[0]}.keyed{''.join(scene.suffixes[-1:])}"


def _table(figures: dict[str, Any]) -> list[tuple[str, str]]:
    rows = [("frames", f"{figures['frames'][0]:g} to {figures['frames'][1]:g} at {figures['rate']:g} per second")]
    for name, pair in figures["pairs"].items():
        rows.append(
            (
                name,
                f"{1e3 * pair['error_mean']:.2f} mm apart in the mean, {1e3 * pair['error_worst']:.2f} at frame"
                f" {pair['worst_frame']:g}; slips at most {1e3 * pair['skate_max_per_second']:.2f} mm/s",
            )
        )
    deep = [1e3 * figures[f"penetration_{when}"] for when in ("held", "transit")]
    rows.append(("penetration", f"{deep[0]:.2f} mm while held, {deep[1]:.2f} mm between"))
    step = f"{1e3 * figures['largest_step']:.1f} mm to frame {figures['largest_step_frame']:g}"
    rows.append(("largest step", step))
    for name, count in figures["keys"].items():
        rows.append((f"keys of {name}", f"{count}, the skin within {1e3 * figures['key_error'][name]:.2f} mm"))
    return rows
