"""A prop that stands on a ground is what a hand takes hold of; and nothing else is taken for a ground."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from contact_core.cli import main
from contact_core.document.asset import Asset
from contact_core.geometry import solids
from contact_core.geometry.mesh import TriangleMesh
from contact_core.grasp_files.grasp import prepare
from contact_core.grasp_files.grounds import without_grounds
from contact_core.plugins.manager import PluginManager


def scene(*parts: solids.Solid) -> Asset:
    starts = np.cumsum([0, *(len(points) for points, _ in parts)])
    faces = np.concatenate([faces + start for (_, faces), start in zip(parts, starts, strict=False)])
    mesh = TriangleMesh(np.concatenate([points for points, _ in parts]), faces)
    return Asset("prop", mesh, source_faces=np.arange(len(faces)))


def ground(size: float, height: float = 0.0) -> solids.Solid:
    points, faces = solids.rectangle(size, size)
    points = points + 0.0
    points[0, 2] += height
    return points, faces


PROP = solids.sphere(0.015)


@pytest.mark.parametrize("size", [5.0, 50.0, 2e4])
@pytest.mark.parametrize("slope", [0.0, 0.02])
def test_a_ground_is_left_out_and_said(size: float, slope: float) -> None:
    rest, note = without_grounds(scene(PROP, ground(size, slope * size)), 0.19)
    assert note is not None and "ground" in note
    assert len(rest.mesh.faces) == len(PROP[1]) and np.isclose(
        rest.mesh.bounding_box_diagonal, 0.03 * np.sqrt(3), rtol=0.05
    )
    assert rest.source_faces is not None and rest.source_faces.tolist() == list(range(len(PROP[1])))


@pytest.mark.parametrize(
    "parts",
    [
        (PROP,),
        (ground(50.0),),  # alone it is what is touched
        (PROP, ground(1.5)),  # a table
        (PROP, solids.cone(0.02, 30.0, 0.02)),  # a pole
        (PROP, solids.box(5.0, 2.0, 1.5)),  # a car
    ],
)
def test_other_things_are_no_grounds(parts: tuple[solids.Solid, ...]) -> None:
    asset = scene(*parts)
    assert without_grounds(asset, 0.19) == (asset, None)


def test_what_lies_far_away_is_left_out_and_counted() -> None:
    points, faces = solids.box(0.01, 0.01, 0.01)
    near, far = (points + 1.0, faces), (points + 2000.0, faces)
    rest, note = without_grounds(scene(far, PROP, near), 0.19)
    assert (
        len(rest.mesh.faces) == len(PROP[1]) + len(faces) and np.ptp(rest.mesh.points[rest.mesh.used_points]) < 2.0
    )
    assert note is not None and note.startswith("1 parts")
    assert without_grounds(scene((points + 100.0, faces), PROP), 0.19)[1] is None  # within a grid of distances


def written(folder: Path, *parts: solids.Solid) -> Path:
    path, mesh = folder / "scene.obj", scene(*parts).mesh
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.points.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces.tolist()]
    path.write_text("\n".join(lines))
    return path


@pytest.mark.parametrize("scale", [1.0, 0.01])
def test_the_scale_of_the_object_counts(tmp_path: Path, scale: float) -> None:
    points, faces = PROP
    path = written(tmp_path, (points / scale, faces), ground(2e4 / scale))
    job = prepare("sample:human_hand", str(path), scale, PluginManager())
    assert np.isclose(job.object.mesh.bounding_box_diagonal, 0.03 * np.sqrt(3), rtol=0.05)
    assert any("ground" in note for note in job.notes)


def test_a_hand_that_touches_nothing_is_told_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A room: nowhere on its walls does a hand close round anything, whatever stands in it."""
    path = written(tmp_path, ground(40.0))
    assert main(["grasp", "sample:human_hand", str(path), "--count", "1", "--out", str(tmp_path / "out")]) == 2
    assert "found no place" in capsys.readouterr().err


def test_where_no_grasp_comes_of_any_place_that_is_told_with_what_to_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As with a part in millimetres read as metres, on which every closed hand is lost when it is solved."""
    monkeypatch.setattr("contact_core.grasping.suggest._finished", lambda *_: None)
    path = written(tmp_path, solids.box(60.0, 80.0, 100.0))
    assert main(["grasp", "sample:human_hand", str(path), "--count", "1", "--out", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err
    assert "found no place" in told and "is its scale right?" in told and "--scale" in told
