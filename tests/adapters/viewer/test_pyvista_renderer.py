"""The PyVista renderer: draws in a child, and turns the child's death into a sentence."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from contact_core.errors import FileRefused
from contact_core.scene.picture import Picture, PictureMesh
from contact_core.testing.meshes import icosphere
from contact_viewer import renderer as renderer_module
from contact_viewer.renderer import PyVistaRenderer
from contact_viewer.scene_file import read_scene, write_scene

pytest.importorskip("pyvista")


def scene() -> Picture:
    ball = icosphere(3)
    return Picture(
        meshes=(PictureMesh(ball, (0.9, 0.1, 0.1)),),
        points=((np.array([[0.0, 0.0, 1.0]]), (0.0, 0.9, 0.0)),),
        lines=((np.array([[[-1.2, 0.0, 1.1], [1.2, 0.0, 1.1]]]), (0.0, 0.0, 0.9)),),
        camera_from=(0.0, 0.0, 1.0),
        caption="a ball",
        table=(("gap", "2 %", True),),
        legend=(("palm", (0.9, 0.8, 0.1)),),
        focus=ball.points,
    )


def test_a_scene_survives_the_way_to_the_child(tmp_path: Path) -> None:
    picture = scene()
    write_scene(tmp_path / "scene.npz", [picture, picture], (640, 360))
    pictures, size = read_scene(tmp_path / "scene.npz")
    assert size == (640, 360) and len(pictures) == 2
    back = pictures[1]
    np.testing.assert_array_equal(back.meshes[0].mesh.points, picture.meshes[0].mesh.points)
    np.testing.assert_array_equal(back.lines[0][0], picture.lines[0][0])
    assert back.focus is not None
    np.testing.assert_array_equal(back.focus, picture.focus)
    assert (back.table, back.legend, back.caption, back.up, back.camera_from) == (
        picture.table, picture.legend, picture.caption, picture.up, picture.camera_from,
    )  # fmt: skip


@pytest.mark.slow
def test_it_draws_what_it_was_given(tmp_path: Path) -> None:
    reason = PyVistaRenderer().unavailable()
    if reason is not None:
        pytest.skip(reason)
    from PIL import Image

    path = tmp_path / "new" / "ball.png"
    PyVistaRenderer().render([scene(), scene()], path, size=(320, 160))
    image = np.asarray(Image.open(path)).astype(int)
    assert image.shape == (160, 320, 3)
    left, right = image[:, :160], image[:, 160:]
    for panel in (left, right):
        red = (panel[..., 0] > 1.5 * panel[..., 1]) & (panel[..., 0] > 1.5 * panel[..., 2])
        assert 0.1 < red.mean() < 0.8
        assert (panel[..., 1] > panel[..., 0] + 60).any()  # the point
        assert (panel[..., 2] > panel[..., 0] + 60).any()  # the line
        yellow = np.abs(panel - np.array([0.9, 0.8, 0.1]) * 255).max(axis=2) < 12
        assert yellow.any() and np.nonzero(yellow)[0].max() < 30  # the legend, at the top


DEATHS = {
    "a segmentation fault": ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "signal 11"),
    "an exception": ("raise RuntimeError('no display')", "RuntimeError: no display"),
    "an exit code": ("import sys; sys.exit(3)", "code 3"),
    "no picture at all": ("pass", "empty picture"),
}


@pytest.mark.parametrize("death", DEATHS)
def test_however_the_child_ends_it_is_a_sentence(
    death: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A drawing module that dies in the child, as VTK does without EGL and OSMesa."""
    program, says = DEATHS[death]
    (tmp_path / "dying_draw.py").write_text(program)
    monkeypatch.syspath_prepend(str(tmp_path))
    run = renderer_module._run
    monkeypatch.setattr(renderer_module, "_run", lambda _, *arguments: run("dying_draw", *arguments))
    with pytest.raises(FileRefused, match=says) as caught:
        PyVistaRenderer().render([scene()], tmp_path / "picture.png")
    assert "libegl1" in str(caught.value)
    assert not (tmp_path / "picture.png").exists()
    renderer_module._probe.cache_clear()
    if death != "no picture at all":
        assert says in str(PyVistaRenderer().unavailable())
    renderer_module._probe.cache_clear()


@pytest.mark.slow
@pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="EGL and OSMesa are how Linux draws without a screen"
)
def test_without_egl_and_osmesa_the_job_still_draws(tmp_path: Path) -> None:
    """Both libraries are hidden from VTK for real: the process lives, the cure is named, a picture is drawn."""
    hidden = tmp_path / "hidden"
    hidden.mkdir()
    for name in ("libEGL.so.1", "libEGL.so", "libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"):
        (hidden / name).write_bytes(b"not a library")
    program = f"""
import os
os.environ["LD_LIBRARY_PATH"] = {str(hidden)!r}
os.environ.pop("DISPLAY", None)
from pathlib import Path
from contact_builtins.renderers.software import SoftwareRenderer
from contact_core.scene.picture import Picture, PictureMesh
from contact_core.testing.meshes import icosphere
from contact_core.errors import FileRefused
from contact_viewer.renderer import PyVistaRenderer
picture, path = Picture((PictureMesh(icosphere(2), (0.9, 0.1, 0.1)),)), Path({str(tmp_path)!r}) / "picture.png"
print(PyVistaRenderer().unavailable())
try:
    PyVistaRenderer().render([picture], path, size=(64, 64))
except FileRefused as error:
    print(error)
    SoftwareRenderer().render([picture], path, size=(64, 64))
"""
    child = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=300, check=False
    )
    assert child.returncode == 0, child.stderr
    assert child.stdout.count("libegl1") == 2, child.stdout
    assert (tmp_path / "picture.png").stat().st_size > 0
