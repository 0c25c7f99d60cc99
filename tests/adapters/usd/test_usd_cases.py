"""What a stage draws is what a file is read as; the rest is named. Primitives are solids."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pxr", reason="usd-core is not installed")

from pxr import Usd, UsdGeom

from contact_core.document.asset import Asset
from contact_core.errors import FileRefused
from contact_core.testing.host_checks import volume
from contact_usd.files import UsdFiles

CASES = Path(__file__).parents[2] / "data" / "cases"


def read(path: Path) -> Asset:
    return UsdFiles().read(path)


def test_what_is_drawn_is_the_surface_and_the_rest_is_named() -> None:
    asset = read(CASES / "d20_purposes.usda")
    assert len(asset.mesh.points) == 110 and asset.mesh.points[:, 0].max() < 1  # render stands at the origin
    assert all(any(path in note for note in asset.notes) for path in ("/W/proxy", "/W/guide", "/W/hidden"))


def test_a_stage_of_proxies_alone_is_read(tmp_path: Path) -> None:
    text = (CASES / "d20_purposes.usda").read_text().replace('purpose = "render"', 'purpose = "guide"')
    (tmp_path / "s.usda").write_text(text)
    assert read(tmp_path / "s.usda").mesh.points[:, 0].min() > 4
    (tmp_path / "s.usda").write_text(text.replace('purpose = "proxy"', 'purpose = "guide"'))
    with pytest.raises(FileRefused, match="draws nothing"):
        read(tmp_path / "s.usda")


def test_a_skin_without_a_skel_root_and_point_instances_are_named() -> None:
    assert any("no SkelRoot" in note for note in read(CASES / "d01_no_skelroot.usda").notes)
    with pytest.raises(FileRefused, match="/W/pi scatters 2 copies"):
        read(CASES / "d22_pointinstancer.usda")


def test_the_fallback_sizes_of_primitives() -> None:
    asset = read(CASES / "d24_gprims.usda")  # a sphere of radius 1 and a cylinder of radius 1 and height 2
    assert np.isclose(volume(asset.mesh), 4 / 3 * np.pi + 2 * np.pi, rtol=0.01)


@pytest.mark.parametrize("axis", ["X", "Y", "Z"])
@pytest.mark.parametrize(
    ("kind", "sizes", "wanted", "reach"),
    [
        ("Cylinder", {"radius": 0.5, "height": 3.0}, np.pi * 0.75, (0.5, 1.5)),
        ("Cone", {"radius": 0.5, "height": 3.0}, np.pi * 0.25, (0.5, 1.5)),
        ("Capsule", {"radius": 0.5, "height": 3.0}, np.pi * 0.75 + np.pi / 6, (0.5, 2.0)),
        ("Cube", {"size": 3.0}, 27.0, (1.5, 1.5)),
        ("Sphere", {"radius": 0.5}, np.pi / 6, (0.5, 0.5)),
    ],
)
def test_primitives_have_their_size_and_axis(
    tmp_path: Path, kind: str, sizes: dict[str, float], wanted: float, reach: tuple[float, float], axis: str
) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "s.usda"))
    prim = stage.DefinePrim("/solid", kind)
    for name, value in sizes.items():
        prim.GetAttribute(name).Set(value)
    if prim.HasAttribute("axis"):
        prim.GetAttribute("axis").Set(axis)
    UsdGeom.SetStageUpAxis(stage, "Z")
    stage.Save()
    mesh = read(tmp_path / "s.usda").mesh
    extent = np.full(3, reach[0])
    extent["XYZ".index(axis)] = reach[1]
    assert np.allclose(np.abs(mesh.points).max(0), extent, atol=1e-6)
    assert 0.985 * wanted < volume(mesh) < wanted * (1 + 1e-6)
