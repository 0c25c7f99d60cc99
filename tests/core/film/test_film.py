"""`contact motion`: a scene's film solved, keyed, reported and drawn, and opened again."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

import contact_core as contact
from contact_core.cli import main
from contact_core.film.film import picture_at, pictures_of, write_strip
from contact_core.film.movie import going_round, write_movie

sys.path.insert(0, str(Path(__file__).parents[1] / "motion"))
from test_film import ARM, BALL, assets, film  # type: ignore[import-not-found]


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    host = contact.MemoryHost()
    for asset in assets().values():
        host.add(asset)
    path = tmp_path / "shot.contactscene"
    with contact.Session(host=host, objects=None) as session:
        film(session)
        session.save(path)
    return path


def test_a_film_is_solved_keyed_reported_and_drawn(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before, out = scene.read_bytes(), scene.parent / "out"
    assert main(["motion", str(scene), "--out", str(out), "--json", "--no-pictures"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert scene.read_bytes() == before  # the scene that came is untouched
    report = json.loads((out / "motion.json").read_text())
    assert told["report"] == report and report["status"] == "CONVERGED" and report["keys"][ARM] >= 2
    assert report["key_error"][ARM] <= 1.01e-3 and report["pairs"]["touch"]["frames"] == 13
    with contact.open(out / "shot.keyed.contactscene") as again:
        track = again.timeline.track("pose", ARM)
        assert track is not None and len(track.keys) == report["keys"][ARM] and again.timeline.stale(ARM) == ()
        assert again.host.pose_keys(ARM)[0] == 0.0 and again.host.pose_keys(ARM)[-1] == 24.0
        shown, keyed = again.host.read_pose(ARM, 12.0), again.timeline.at(12).poses[ARM]
        assert np.abs(shown.local - keyed.local).max() < 5e-3  # linear and cubic keys of one motion


def test_the_report_is_told_in_words_too(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["motion", str(scene), "--out", str(scene.parent / "told"), "--no-pictures"]) == 0
    said, report = capsys.readouterr().out, json.loads((scene.parent / "told" / "motion.json").read_text())
    pair = report["pairs"]["touch"]
    for value in ("error_mean", "error_p95", "error_worst", "skate_max_per_second", "skate_rms_per_second"):
        assert f"{1e3 * pair[value]:.2f}" in said
    assert f"at frame {pair['worst_frame']:g}" in said and f"jerk {1e3 * report['jerk_rms']:.0f} mm/s³ rms" in said
    assert f"{1e3 * report['penetration_transit']:.2f} mm in transit" in said
    assert f"{1e3 * report['largest_step']:.1f} mm to frame {report['largest_step_frame']:g}" in said
    assert f"{report['keys'][ARM]} for all frames" in said and ": a pop" not in said


def test_a_strip(scene: Path) -> None:
    image = pytest.importorskip("PIL.Image", reason="Pillow looks at it")
    with contact.open(scene) as session:
        write_strip(session, [0.0, 8.0, 20.0], scene.parent / "strip.png", count=2, panel=(48, 40))
    with image.open(scene.parent / "strip.png") as strip:
        assert strip.size == (96, 40)


@pytest.mark.parametrize("suffix", [".gif", ".webp", ".webm"])
def test_a_movie_lasts_as_long_as_the_film(scene: Path, suffix: str) -> None:
    image = pytest.importorskip("PIL.Image", reason="Pillow, which makes movies, is not installed")
    path, frames = scene.parent / f"film{suffix}", list(map(float, range(25)))
    if suffix == ".webm":
        av = pytest.importorskip("av", reason="PyAV, which makes WebM, is not installed")
    with contact.open(scene) as session:
        write_movie(session, frames, path, size=(49, 41), turn=90.0)
        with pytest.raises(contact.InvalidInput, match="a movie has"):
            write_movie(session, [], scene.parent / "none.gif")
        with pytest.raises(contact.InvalidInput, match="ends in"):
            write_movie(session, frames, scene.parent / "none.avi")
    if suffix == ".webm":
        with av.open(str(path)) as movie:
            shown = list(movie.decode(video=0))
        assert len(shown) == 25 and (shown[0].width, shown[0].height) == (48, 40)
        assert float(shown[-1].time) == pytest.approx(1.0, abs=0.01)
        return
    with image.open(path) as movie:
        lengths = []
        for k in range(movie.n_frames):
            movie.seek(k)
            movie.load()
            lengths.append(movie.info["duration"])
        assert movie.n_frames == 25 and movie.size == (49, 41) and movie.info["loop"] == 0
        assert sum(lengths) == pytest.approx(1000 * 25 / 24, abs=15 if suffix == ".gif" else 30)


def test_the_camera_goes_round_what_stays(scene: Path) -> None:
    with contact.open(scene) as session:
        still = going_round(pictures_of(session, [12.0] * 4), 360.0)
    eyes = np.array([picture.camera_from for picture in still])
    assert np.allclose(eyes[:, 1], eyes[0, 1]) and np.allclose(eyes[0] + eyes[2], [0.0, 2.0 * eyes[0, 1], 0.0])
    assert np.allclose(np.linalg.norm(eyes, axis=1), np.linalg.norm(eyes[0]))
    assert all(np.array_equal(picture.focus, still[0].focus) for picture in still)


def test_pictures_show_what_moves_through_one_camera(scene: Path) -> None:
    with contact.open(scene) as session:
        first, last = pictures_of(session, [0.0, 20.0])
        assert np.array_equal(first.focus, last.focus)
        assert not np.allclose(first.meshes[1].mesh.points, last.meshes[1].mesh.points)  # the ball
        assert not first.points and len(last.points) == 2  # the contact is on
        assert picture_at(session, 20.0).caption == "frame 20"
        assert session.document.surfaces[BALL].name == BALL


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--frames", "a"], "frames are like"),
        (["--frames", "5-1"], "frames are like"),
        (["--follow", "-1"], "follow"),
        (["--tolerance", "0"], "tolerance"),
        (["--movie", "film.avi"], "ends in"),
        (["--width", "3"], "pixels"),
    ],
)
def test_bad_arguments_are_refused_in_a_sentence(
    arguments: list[str], says: str, scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["motion", str(scene), "--out", str(scene.parent / "none"), *arguments]) == 2
    assert says in capsys.readouterr().err and not (scene.parent / "none").exists()


def test_a_still_has_no_film(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    host = contact.MemoryHost()
    for asset in assets().values():
        host.add(asset)
    host.save(tmp_path / "still.contactscene")
    assert main(["motion", str(tmp_path / "still.contactscene"), "--out", str(tmp_path / "out")]) == 2
    assert "no range of frames" in capsys.readouterr().err
    (tmp_path / "broken.contactscene").write_bytes(b"nonsense")
    assert main(["motion", str(tmp_path / "broken.contactscene"), "--out", str(tmp_path / "out")]) == 2
