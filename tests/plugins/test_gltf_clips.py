"""Animations in glTF: what is written a viewer shows, and what is read moves the same skin."""

from __future__ import annotations

import json
import struct
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contact_core as contact
from contact_builtins.formats.gltf import GltfFiles
from contact_core.arrays import FloatArray
from contact_core.errors import FileRefused, InvalidInput
from contact_core.geometry.raycast import Locator
from contact_core.geometry.transform import transform_points
from contact_core.rig.clip import Clip
from contact_core.rig.pose_keys import PoseKeys
from contact_core.rig.rig import Pose, Rig, forward_kinematics, skin
from contact_core.testing import meshes
from contact_core.testing.host_scenes import arm_rig
from contact_core.testing.rigs import tentacle

sys.path.insert(0, str(Path(__file__).parent))
from gltf_player import Player  # type: ignore[import-not-found]

RATE = 25.0


def turned(rig: Rig, angles: FloatArray, shift: float = 0.0) -> Pose:
    local = rig.rest_local.copy()
    for joint, angle in enumerate(angles):
        c, s = np.cos(angle), np.sin(angle)
        local[joint, :3, :3] = local[joint, :3, :3] @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    local[0, :3, 3] += shift
    return Pose(rig.joints, local)


def keys_of(rig: Rig, frames: tuple[float, ...], *, cubic: bool, seed: int = 3) -> PoseKeys:
    random = np.random.default_rng(seed)
    poses = tuple(turned(rig, random.uniform(-1.0, 1.0, len(rig.joints)), random.uniform()) for _ in frames)
    speeds = tuple(random.normal(size=(len(rig.joints), 6)) * 0.05 for _ in frames) if cubic else ()
    return PoseKeys(rig.name, frames, poses, speeds)


def shown(rig: Rig, keys: PoseKeys, frame: float) -> FloatArray:
    return skin(rig, forward_kinematics(rig.parents, keys.at(rig, frame).local))


def written(rig: Rig, keys: PoseKeys, path: Path) -> Path:
    asset = contact.Asset(rig.name, rig.surface, rig, meters_per_unit=1.0, up_axis="Y")
    GltfFiles().write_clip(path, [asset], {}, Clip("film", RATE, (keys,)))
    return path


@pytest.fixture
def rig() -> Rig:
    return arm_rig()


@pytest.mark.parametrize("cubic", [True, False])
def test_a_player_shows_the_keys_and_what_lies_between(rig: Rig, tmp_path: Path, cubic: bool) -> None:
    keys = keys_of(rig, (0.0, 7.0, 12.5, 30.0), cubic=cubic)
    player = Player(written(rig, keys, tmp_path / "film.glb"))
    assert {kind for _, _, kind, _, _ in player.channels()} == {"CUBICSPLINE" if cubic else "LINEAR"}
    for frame in np.linspace(-2.0, 33.0, 36):
        np.testing.assert_allclose(player.skin(frame / RATE), shown(rig, keys, frame), atol=2e-5)


@pytest.mark.parametrize("cubic", [True, False])
@pytest.mark.parametrize("make", [arm_rig, lambda: tentacle(4)])
def test_what_was_written_is_read_as_the_same_keys(make: Any, tmp_path: Path, cubic: bool) -> None:
    rig = make()
    keys = keys_of(rig, (-3.0, 4.0, 9.0), cubic=cubic)
    path = written(rig, keys, tmp_path / "film.glb")
    again = GltfFiles().read(path).rig
    (clip,) = GltfFiles().read_clips(path)
    assert again is not None and clip.rate == RATE and clip.keys[0].frames == keys.frames
    assert clip.keys[0].is_cubic is cubic
    for frame in np.linspace(-3.0, 9.0, 13):
        seen, wanted = shown(again, clip.keys[0], float(frame)), shown(rig, keys, float(frame))
        off = Locator.of(rig.surface.with_points(wanted)).closest(seen).distance  # vertices in another order
        assert off.max() < 2e-5 * np.ptp(rig.surface.points)


def changed(path: Path, change: Any) -> Path:
    """The file with its JSON changed."""
    data = path.read_bytes()
    size = struct.unpack_from("<I", data, 12)[0]
    document = json.loads(data[20 : 20 + size])
    change(document)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + size :]
    path.write_bytes(struct.pack("<III", 0x46546C67, 2, 20 + len(text) + len(rest)) +
                     struct.pack("<II", len(text), 0x4E4F534A) + text + rest)  # fmt: skip
    return path


def test_steps_and_nodes_above_are_sampled_at_whole_frames(rig: Rig, tmp_path: Path) -> None:
    path = written(rig, keys_of(rig, (0.0, 4.0, 9.0), cubic=False), tmp_path / "film.glb")

    def step(document: dict[str, Any]) -> None:
        for sampler in document["animations"][0]["samplers"]:
            sampler["interpolation"] = "STEP"
        node = document["animations"][0]["channels"][0]["target"]["node"]
        document["animations"][0]["channels"][1]["target"] = {"node": node, "path": "rotation"}

    def carried(document: dict[str, Any]) -> None:
        holder = document["nodes"][0]
        holder.pop("matrix")
        first = document["animations"][0]["channels"][0]
        assert first["target"]["path"] == "translation"
        target = {"node": 0, "path": "translation"}
        document["animations"][0]["channels"].append({"sampler": first["sampler"], "target": target})

    for change in (step, carried):
        again = changed(path, change)
        (clip,) = GltfFiles().read_clips(again, rate=RATE)
        read = GltfFiles().read(again).rig
        assert read is not None and clip.keys[0].frames == tuple(map(float, range(10)))
        player = Player(again)
        for frame in range(10):
            wanted = player.skin((frame + 1e-4) / RATE)
            seen = skin(read, forward_kinematics(read.parents, clip.keys[0].poses[frame].local))
            assert Locator.of(rig.surface.with_points(wanted)).closest(seen).distance.max() < 1e-3


def test_a_joint_that_is_scaled_to_nothing_for_a_while_is_read(rig: Rig, tmp_path: Path) -> None:
    """How files hide a part: it and all that it carries are drawn nowhere, and the clip is there."""

    def hidden(document: dict[str, Any]) -> None:
        animation = document["animations"][0]
        root = next(k for k, node in enumerate(document["nodes"]) if node.get("name") == rig.joints[0])
        times = animation["samplers"][0]["input"]
        count = document["accessors"][times]["count"]
        document["accessors"].append({"componentType": 5126, "count": count, "type": "VEC3"})  # all zero
        animation["samplers"].append({"input": times, "output": len(document["accessors"]) - 1})
        target = {"node": root, "path": "scale"}
        animation["channels"].append({"sampler": len(animation["samplers"]) - 1, "target": target})

    path = changed(written(rig, keys_of(rig, (0.0, 5.0), cubic=False), tmp_path / "film.glb"), hidden)
    (clip,) = GltfFiles().read_clips(path, rate=RATE)
    read = GltfFiles().read(path).rig
    assert read is not None
    seen = skin(read, forward_kinematics(read.parents, clip.keys[0].poses[0].local))
    assert np.isfinite(seen).all() and np.ptp(seen, axis=0).max() < 1e-5


def test_of_keys_at_one_time_the_last_holds(rig: Rig, tmp_path: Path) -> None:
    path = written(rig, keys_of(rig, (0.0, 5.0, 9.0), cubic=False), tmp_path / "film.glb")
    data = bytearray(path.read_bytes())
    times = np.array([0.0, 5.0, 9.0], "<f4") / np.float32(RATE)
    at = data.index(times.tobytes())
    data[at + 8 : at + 12] = times[1:2].tobytes()
    (wanted,) = GltfFiles().read_clips(path, rate=RATE)
    path.write_bytes(bytes(data))
    (clip,) = GltfFiles().read_clips(path, rate=RATE)
    assert clip.keys[0].frames == (0.0, 5.0)
    assert np.allclose(clip.keys[0].poses[1].local, wanted.keys[0].poses[2].local, atol=1e-6)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda d: d["animations"][0]["samplers"][0].update(input=10_000), "accessors"),
        (lambda d: d["animations"][0]["samplers"][0].update(output=0), "times and values"),
        (lambda d: d["animations"][0]["samplers"][0].update(interpolation="WAVY"), "WAVY"),
        (lambda d: d["animations"][0]["channels"][0]["target"].update(node=-1), "nodes"),
        (lambda d: d["animations"][0].pop("samplers"), "is missing"),
        (lambda d: d.update(animations={"a": 1}), "list of objects"),
    ],
)
def test_what_is_damaged_is_refused_in_a_sentence(rig: Rig, tmp_path: Path, change: Any, words: str) -> None:
    path = changed(written(rig, keys_of(rig, (0.0, 5.0), cubic=True), tmp_path / "film.glb"), change)
    with pytest.raises(FileRefused, match=words):
        GltfFiles().read_clips(path)


def test_what_no_node_can_do_is_refused(rig: Rig, tmp_path: Path) -> None:
    keys = keys_of(rig, (0.0, 5.0), cubic=False)
    local = keys.poses[1].local.copy()
    local[1, 0, 1] += 0.5
    sheared = PoseKeys(rig.name, keys.frames, (keys.poses[0], Pose(rig.joints, local)))
    with pytest.raises(InvalidInput, match="shear"):
        written(rig, sheared, tmp_path / "film.glb")
    stranger = PoseKeys("nobody", keys.frames, keys.poses)
    with pytest.raises(InvalidInput, match="nobody"):
        written(rig, stranger, tmp_path / "film.glb")
    assert not (tmp_path / "film.glb").exists()


def flight(name: str, frames: tuple[float, ...], *, turning: bool) -> PoseKeys:
    """An object that flies, and turns."""
    places = []
    for frame in frames:
        place = np.eye(4)
        c, s = np.cos(0.1 * frame * turning), np.sin(0.1 * frame * turning)
        place[:3, :3] = [[c, -s, 0], [s, c, 0], [0, 0, 1]]
        place[:3, 3] = [0.3 + 0.05 * frame, 0.2, 0.01 * frame]
        places.append(contact.Pose((name,), place[None]))
    return PoseKeys(name, frames, tuple(places))


@pytest.mark.parametrize("turning", [False, True])
def test_an_object_comes_back_moving_as_it_was_written(tmp_path: Path, turning: bool) -> None:
    keys, ball = flight("ball", (2.0, 5.0, 9.0), turning=turning), contact.Asset("ball", meshes.icosphere(1))
    path = tmp_path / "flying ball.glb"
    GltfFiles().write_clip(path, [ball], {"ball": keys.poses[0]}, Clip("film", RATE, (keys,)))
    read = GltfFiles().read(path)
    (clip,) = GltfFiles().read_clips(path)
    assert clip.keys[0].rig == read.name == path.stem
    assert clip.keys[0].frames == (tuple(map(float, range(2, 10))) if turning else keys.frames)
    player = Player(path)
    node = next(k for k, each in enumerate(player.json["nodes"]) if each.get("name") == "ball mesh")
    for frame, pose in zip(clip.keys[0].frames, clip.keys[0].poses, strict=True):
        wanted = transform_points(player.nodes_at(frame / RATE)[node], ball.mesh.points)
        seen = transform_points(pose.local[0], read.mesh.points)
        assert Locator.of(ball.mesh.with_points(wanted)).closest(seen).distance.max() < 1e-5


def test_objects_beside_a_rig_move_by_their_names(rig: Rig, tmp_path: Path) -> None:
    moving = keys_of(rig, (0.0, 7.0), cubic=True), flight("ball", (0.0, 7.0), turning=False)
    assets = [
        contact.Asset(rig.name, rig.surface, rig, meters_per_unit=1.0, up_axis="Y"),
        contact.Asset("ball", meshes.icosphere(1)),
        contact.Asset("still", meshes.icosphere(1)),
    ]
    path = tmp_path / "film.glb"
    GltfFiles().write_clip(path, assets, {"ball": moving[1].poses[0]}, Clip("film", RATE, moving))
    (clip,) = GltfFiles().read_clips(path)
    assert [keys.rig for keys in clip.keys] == ["film", "ball"]
    np.testing.assert_allclose(clip.keys[1].poses[1].local[0][:3, 3], [0.35, 0.0, 0.07], atol=1e-6)


def test_an_object_that_stands_still_has_no_clips(tmp_path: Path) -> None:
    path = tmp_path / "ball.glb"
    GltfFiles().write(path, [contact.Asset("ball", meshes.icosphere(1))], {})
    assert GltfFiles().read_clips(path) == ()
