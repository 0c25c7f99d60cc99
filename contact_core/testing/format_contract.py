"""The contract of file formats. Subclass it and give the fixture `file_format`; `example` too where it only reads.

`example` is the path of a sound file of the format; by default the suite writes one.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from contact_core.document.asset import Asset
from contact_core.errors import ContactError, FileRefused
from contact_core.plugins.slots import Format
from contact_core.rig.rig import JointFreedom, Pose, Rig
from contact_core.testing import meshes
from contact_core.testing.contract import Contract, needs


def bar() -> Asset:
    """A tube along +z, bound to two joints: the least manipulator."""
    tube = meshes.cylinder(12, 8)
    rest = np.tile(np.eye(4), (2, 1, 1))
    rest[1, 2, 3] = 1.0
    world = np.array([rest[0], rest[0] @ rest[1]])
    upper = np.clip(tube.points[:, 2] - 0.5, 0.0, 1.0)  # (n,) from one joint to the other over a unit of length
    rig = Rig(
        "bar",
        ("base", "bend"),
        np.array([-1, 0]),
        rest,
        world,
        tube.points,
        tube.faces,
        np.tile([0, 1], (len(tube.points), 1)),
        np.stack([1.0 - upper, upper], -1),
        (JointFreedom(), JointFreedom()),
    )
    return Asset("bar", tube, rig)


def bent() -> Pose:
    """The bar's pose with its upper joint turned by 40 degrees."""
    rig = bar().rig
    assert rig is not None
    c, s = np.cos(np.radians(40.0)), np.sin(np.radians(40.0))
    local = np.array(rig.rest_local)
    local[1, :3, :3] = [[1, 0, 0], [0, c, -s], [0, s, c]]
    return Pose(rig.joints, local)


def corners(asset: Asset) -> np.ndarray:
    """(m, 3, 3) corner positions of every face, faces sorted, so that vertices may be numbered in any way."""
    triangles = asset.mesh.points[asset.mesh.faces]
    start = np.lexsort(np.moveaxis(triangles, -1, 0)[::-1].round(5), axis=-1)[
        :, 0
    ]  # lowest corner first, same turn
    rolled = triangles[np.arange(len(triangles))[:, None], (start[:, None] + np.arange(3)) % 3]
    return np.asarray(rolled[np.lexsort(rolled.reshape(-1, 9).round(5).T[::-1])])


class FormatContract(Contract):
    """Fixtures: `file_format`, a Format; `example`, the path of a sound file (written by default)."""

    about, letter = "format", "F"

    @pytest.fixture
    def example(self, file_format: Format, tmp_path: Path) -> Path:
        path = tmp_path / f"example{file_format.suffixes[0]}"
        file_format.write(path, [Asset("sphere", meshes.icosphere(1))], {})
        return path

    def test_f01_is_named(self, file_format: Format) -> None:
        """Has a name and a summary, and endings in lower case that begin with a dot; reads or writes."""
        assert file_format.name == file_format.name.strip() != ""
        assert len(file_format.summary.split()) >= 3, file_format.summary
        assert file_format.suffixes
        for suffix in file_format.suffixes:
            assert suffix.startswith(".") and suffix == suffix.lower(), suffix
        assert file_format.can_read or file_format.can_write

    @needs("reading")
    def test_f02_reads_a_sound_file(self, file_format: Format, example: Path) -> None:
        """A sound file gives an asset with a mesh, and the file is the same bytes afterwards."""
        before = example.read_bytes()
        asset = file_format.read(example)
        assert len(asset.mesh.points) and len(asset.mesh.faces)
        assert example.read_bytes() == before

    @needs("reading", "writing")
    def test_f03_reads_what_it_wrote(self, file_format: Format, tmp_path: Path) -> None:
        """A mesh comes back: the same triangles, turned the same way, to single precision."""
        asset = Asset("torus", meshes.torus(12, 8))
        path = tmp_path / f"there{file_format.suffixes[0]}"
        file_format.write(path, [asset], {})
        back = file_format.read(path)
        assert len(back.mesh.points) == len(asset.mesh.points)
        assert np.abs(corners(back) - corners(asset)).max() < 1e-5

    @needs("reading", "writing", "rigs")
    def test_f04_keeps_the_rig(self, file_format: Format, tmp_path: Path) -> None:
        """A skinned manipulator comes back: joints, parents, rest pose, and the skin that they move."""
        path = tmp_path / f"rig{file_format.suffixes[0]}"
        file_format.write(path, [bar()], {})
        back, wanted = file_format.read(path).rig, bar().rig
        assert back is not None and wanted is not None
        assert back.joints == wanted.joints
        assert np.array_equal(back.parents, wanted.parents)
        assert np.abs(back.rest_world - wanted.rest_world).max() < 1e-5
        assert np.abs(back.surface.points - wanted.surface.points).max() < 1e-5

    @needs("reading", "writing", "rigs", "poses")
    def test_f05_writes_the_pose(self, file_format: Format, tmp_path: Path) -> None:
        """A rig written in a pose stands in that pose when it is read."""
        path = tmp_path / f"posed{file_format.suffixes[0]}"
        file_format.write(path, [bar()], {"bar": bent()})
        back = file_format.read(path).rig
        assert back is not None
        by_name = dict(zip(back.joints, back.rest_local, strict=True))
        for joint, local in zip(bent().joints, bent().local, strict=True):
            assert np.abs(by_name[joint] - local).max() < 1e-5, joint

    @needs("writing")
    def test_f06_writes_the_same_bytes_again(self, file_format: Format, tmp_path: Path) -> None:
        """The same assets give the same bytes."""
        first, second = (tmp_path / f"{k}{file_format.suffixes[0]}" for k in "ab")
        for path in (first, second):
            file_format.write(path, [Asset("sphere", meshes.icosphere(1))], {})
        assert first.read_bytes() == second.read_bytes()

    @needs("writing")
    def test_f07_writes_whole_or_not_at_all(self, file_format: Format, tmp_path: Path) -> None:
        """Where it cannot write, it says so in a sentence that names the file, and leaves nothing behind."""
        path = tmp_path / "no" / "such" / f"folder{file_format.suffixes[0]}"
        with pytest.raises(ContactError) as refusal:
            file_format.write(path, [Asset("sphere", meshes.icosphere(0))], {})
        assert path.name in str(refusal.value) or str(path.parent) in str(refusal.value), str(refusal.value)
        assert not list(tmp_path.iterdir())

    @needs("reading")
    def test_f08_refuses_what_is_not_there(self, file_format: Format, tmp_path: Path) -> None:
        """A missing file is refused in a sentence that names it."""
        path = tmp_path / f"missing{file_format.suffixes[0]}"
        with pytest.raises(FileRefused, match="missing"):
            file_format.read(path)

    @needs("reading")
    def test_f09_refuses_damage_in_words(self, file_format: Format, example: Path) -> None:
        """A file cut short or with bytes changed is read, if it still makes sense, or refused; no more."""
        for damaged in _damaged(example.read_bytes()):
            example.write_bytes(damaged)
            try:
                file_format.read(example)
            except FileRefused as error:
                assert len(str(error).split()) >= 4, str(error)

    @needs("reading")
    def test_f10_refuses_what_is_something_else(self, file_format: Format, tmp_path: Path) -> None:
        """An empty file, noise and a picture are refused."""
        path = tmp_path / f"other{file_format.suffixes[0]}"
        noise = np.random.default_rng(0).bytes(600)
        for content in (b"", noise, b"\x89PNG\r\n\x1a\n" + noise):
            path.write_bytes(content)
            with pytest.raises(FileRefused):
                file_format.read(path)


def _damaged(sound: bytes) -> Iterator[bytes]:
    """The bytes cut at nine places, and with one byte changed at forty."""
    for part in range(1, 10):
        yield sound[: len(sound) * part // 10]
    random = np.random.default_rng(1)
    for _ in range(40):
        damaged = bytearray(sound)
        damaged[int(random.integers(len(sound)))] ^= int(random.integers(1, 256))
        yield bytes(damaged)
