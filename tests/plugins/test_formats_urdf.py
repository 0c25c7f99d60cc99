"""URDF: one rig out of links, hinges with their limits, starts inside them."""

from pathlib import Path

import numpy as np
import pytest

from contact_builtins.formats.urdf import UrdfFiles
from contact_core.document.asset import Asset
from contact_core.errors import FileRefused
from contact_core.geometry.report import report
from contact_core.plugins.slots import Format
from contact_core.rig.rig import Rig, forward_kinematics, skin
from contact_core.testing.format_contract import FormatContract

BOX = '<visual><geometry><box size="0.2 0.2 0.2"/></geometry></visual>'
PARTS = f"""
  <link name="base">{BOX}</link><link name="a">{BOX}</link><link name="b">{BOX}</link><link name="c">{BOX}</link>
  <joint name="out" type="revolute"><parent link="base"/><child link="a"/><origin xyz="0 0 1" rpy="0 0.5 0"/>
    <axis xyz="0 3 0"/><limit lower="0.4" upper="1.4" effort="1" velocity="1"/></joint>
  <joint name="slide" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/></joint>
  <joint name="follow" type="revolute"><parent link="a"/><child link="c"/><origin xyz="0 1 0"/><axis xyz="0 0 1"/>
    <mimic joint="out" multiplier="2" offset="0.1"/><limit lower="-9" upper="9" effort="1" velocity="1"/></joint>
"""


def read(folder: Path, inside: str) -> Asset:
    path = folder / "r.urdf"
    path.write_text(f'<robot name="r">{inside}</robot>')
    return UrdfFiles().read(path)


def about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rotation by the quaternion formula: independent of the reader's."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_rotvec(np.asarray(axis) * angle).as_matrix()


def test_hinges_limits_mimics_and_slides(tmp_path: Path) -> None:
    asset = read(tmp_path, PARTS)
    rig = asset.rig
    assert rig is not None and rig.joints == ("base", "out", "slide", "follow") and rig.up_axis == "Z"
    kinds = [freedom.kind for freedom in rig.freedoms]
    assert kinds == ["ball", "hinge", "fixed", "hinge"]
    assert (rig.freedoms[3].follows, rig.freedoms[3].ratio) == ("out", 2.0)
    hinge = rig.freedoms[1]
    start = 0.4 + 0.1  # zero is outside: a tenth of the range inside the nearer limit
    assert np.allclose([hinge.lower, hinge.upper], [[0.4 - start], [1.4 - start]])
    assert np.allclose(hinge.frame[:, 0], [0, 1, 0]) and np.isclose(np.linalg.det(hinge.frame), 1)
    assert np.allclose(rig.rest_world[1, :3, :3], about([0, 1, 0], 0.5 + start))
    assert np.allclose(rig.rest_world[3, :3, :3], rig.rest_world[1, :3, :3] @ about([0, 0, 1], 2 * start + 0.1))
    said = " ".join(asset.notes)
    assert "out" in said and "slide" in said and "follow" in said
    assert asset.details["mimic"]["follow"] == {"joint": "out", "multiplier": 2.0, "offset": 0.1}
    assert report(asset.mesh).components == 4


def test_mimics_of_mimics_and_circles(tmp_path: Path) -> None:
    chain = (
        PARTS.replace('<link name="c">', '<link name="d"/><link name="c">')
        + """
      <joint name="last" type="revolute"><parent link="c"/><child link="d"/><axis xyz="0 0 1"/>
        <mimic joint="follow" multiplier="-0.5" offset="1"/><limit lower="-0.5" upper="9"/></joint>"""
    )
    rig = read(tmp_path, chain).rig
    assert rig is not None and (rig.freedoms[4].follows, rig.freedoms[4].ratio) == ("out", -1.0)
    start = 0.4 + 0.1 * (1.4 - 0.4)  # last = 0.95 - out may be -0.5: out up to 1.45, its own limit is nearer
    assert np.allclose(rig.rest_local[4, :3, :3], about([0, 0, 1], 0.95 - start))
    tight = read(tmp_path, chain.replace('lower="-0.5"', 'lower="-0.25"')).rig
    assert tight is not None and np.allclose(tight.freedoms[1].upper, 1.2 - (0.4 + 0.1 * 0.8))
    with pytest.raises(FileRefused, match="mimics itself"):
        read(tmp_path, chain.replace('<mimic joint="out"', '<mimic joint="last"'))
    none = read(tmp_path, chain.replace('upper="9"/>', 'upper="-0.49"/>'))
    assert any("not kept" in note for note in none.notes)


def test_a_sidecar_overrides_the_file(tmp_path: Path) -> None:
    (tmp_path / "r.rig.toml").write_text(
        "schema = 1\nmeters_per_unit = 0.001\n"
        '[[joint]]\nmatch = "out"\naxis = "z"\nlimits = [-10, 20]\nlock = true\n'
    )
    asset = read(tmp_path, PARTS)
    assert asset.rig is not None and asset.meters_per_unit == 0.001 and asset.up_axis == "Z"
    hinge = asset.rig.freedoms[1]
    assert np.allclose(np.degrees([hinge.lower[0], hinge.upper[0]]), [-10, 20]) and hinge.locked.all()
    assert np.allclose(hinge.frame[:, 0], [0, 0, 1])


def test_a_hinge_moves_its_links_rigidly(tmp_path: Path) -> None:
    rig = read(tmp_path, PARTS).rig
    assert rig is not None
    local = np.array(rig.rest_local)
    frame = rig.freedoms[1].frame
    local[1, :3, :3] @= frame @ about([1, 0, 0], 0.3) @ frame.T
    moved = skin(rig, forward_kinematics(rig.parents, local))
    still = rig.skin_joints[:, 0] == 0
    assert np.allclose(moved[still], rig.surface.points[still])
    pivot = np.array([0, 0, 1.0])
    expected = (rig.surface.points[~still] - pivot) @ about([0, 1, 0], 0.3).T + pivot
    assert np.allclose(moved[~still], expected)


@pytest.mark.parametrize(
    ("inside", "words"),
    [
        ('<link name="a"/>', "nothing to touch with"),
        (
            '<link name="a"><visual><geometry><mesh filename="../x.obj"/></geometry></visual></link>',
            "outside its folder",
        ),
        ('<link name="a"><visual><geometry><mesh filename="x.obj"/></geometry></visual></link>', "x.obj"),
        ("<link", "cannot be parsed"),
        ('<!DOCTYPE robot [<!ENTITY a SYSTEM "file:///etc/hostname">]><link name="a"/>', "document type"),
    ],
)
def test_bad_robots_are_refused(tmp_path: Path, inside: str, words: str) -> None:
    with pytest.raises(FileRefused, match=words):
        read(tmp_path, inside)


class TestUrdf(FormatContract):
    cannot = {"writing": "URDF holds no pose; a .glb is what is written", "rigs": "reads rigs, but writes none"}

    @pytest.fixture
    def file_format(self) -> Format:
        return UrdfFiles()

    @pytest.fixture
    def example(self, tmp_path: Path) -> Path:
        path = tmp_path / "two.urdf"
        path.write_text(f'<robot name="r">{PARTS}</robot>')
        return path


@pytest.mark.assets
def test_the_allegro_hand(assets: Path) -> None:
    """16 hinges; the thumb's zero lies outside its limit, so the rest pose does not stand there."""
    asset = UrdfFiles().read(assets / "rigs" / "allegro_hand_right" / "allegro_hand_right.urdf")
    rig = asset.rig
    assert isinstance(rig, Rig)
    hinges = [freedom for freedom in rig.freedoms if freedom.kind == "hinge"]
    assert len(hinges) == 16
    assert all(freedom.lower[0] < 0 < freedom.upper[0] for freedom in hinges)
    assert any("joint_12.0" in note for note in asset.notes)
    assert 0.2 < asset.mesh.bounding_box_diagonal < 0.5


@pytest.mark.parametrize("text", ["", "no XML at all", "\0" * 50, "<robot name='x'>"])
def test_what_is_no_xml_is_one_sentence_and_nothing_else_is_printed(
    text: str, tmp_path: Path, capfd: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "r.urdf").write_text(text)
    with pytest.raises(FileRefused, match=r"was to be a URDF file, but cannot be parsed: .* Check its XML"):
        UrdfFiles().read(tmp_path / "r.urdf")
    assert capfd.readouterr() == ("", "") and not caplog.records
