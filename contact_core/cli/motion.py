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
        parser.add_argument(
            "--movie", type=Path, metavar="FILE", help="the movie: .gif, .webp or .webm (DIR/film.gif)"
        )
        parser.add_argument(
            "--turn",
            type=finite,
            default=0.0,
            metavar="DEGREES",
            help="the camera goes round; 360: a turntable (0)",
        )
        parser.add_argument("--width", type=int, default=480, metavar="PIXELS", help="of the movie (480)")
        parser.add_argument("--no-pictures", action="store_true", help="no film strip and no movie")

    def run(self, arguments: argparse.Namespace) -> int:
        from contact_core.atomic_file import write_atomic
        from contact_core.errors import InvalidInput
        from contact_core.film.clip import write_clip
        from contact_core.film.film import figures_of, words_of, write_strip
        from contact_core.film.movie import check_movie, write_movie
        from contact_core.opening import open as open_scene

        out, progress = arguments.out, arguments.output
        movie = arguments.movie or out / "film.gif"
        if arguments.movie is not None:
            check_movie(movie)
        if not 16 <= arguments.width <= 4096:
            raise InvalidInput(f"a movie is 16 to 4096 pixels wide, but got {arguments.width}.")
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
                size = (arguments.width, round(0.75 * arguments.width))
                files["movie"] = write_movie(
                    session, frames, movie, size=size, turn=arguments.turn, progress=progress
                )
        lines = [columns([(" ", name, value) for name, value in words_of(figures)])]
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
