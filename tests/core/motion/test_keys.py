"""Keys: cubic curves between poses, and their reduction to few by the distance of the skin."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from contact_core.arrays import FloatArray
from contact_core.errors import Cancelled, InvalidInput
from contact_core.motion.reduction import reduce_poses, skin_errors
from contact_core.progress import CallbackProgress
from contact_core.rig.chart import Chart
from contact_core.rig.pose_keys import PoseCurves, PoseKeys, quaternion_slopes, turning_of
from contact_core.rig.poses import blend
from contact_core.rig.rig import Pose, Rig, forward_kinematics, skin
from contact_core.testing import rigs

RIG = rigs.tentacle(5)


def swimming(rig: Rig, frames: FloatArray, *, turns: float = 1.5, bend: float = 0.5) -> list[Pose]:
    """A smooth motion: joints swing, the root swims along and turns round more than once."""
    chart = Chart(rig)
    random = np.random.default_rng(4)
    phase, size = random.uniform(0.0, 6.0, chart.size), bend * random.uniform(0.2, 1.0, chart.size)
    size[chart.is_root] = 0.0
    poses = []
    for share in (frames - frames[0]) / (frames[-1] - frames[0]):
        theta = size * (np.sin(4.0 * share + phase) - np.sin(phase))
        theta[chart.rotation_slices[0]] = 2.0 * np.pi * turns * share * np.array([0.0, 0.6, 0.8])
        theta[chart.translation_slices[0]] = 8.0 * share * np.array([1.0, share, 0.0])
        poses.append(Pose(rig.joints, chart.local(theta)))
    return poses


FRAMES = np.arange(1.0, 61.0)
POSES = swimming(RIG, FRAMES)


def cubic() -> PoseKeys:
    return reduce_poses(RIG, FRAMES, POSES, tolerance=0.02).keys


def test_a_cubic_curve_passes_its_keys_at_their_speeds() -> None:
    keys = cubic()
    assert keys.is_cubic
    h = 1e-4
    for row, frame in enumerate(keys.frames[1:-1], start=1):
        assert keys.at(RIG, frame) is keys.poses[row]
        before, after = (keys.at(RIG, frame + s * h).local for s in (-1.0, 1.0))
        moved = (after[:, :3, 3] - before[:, :3, 3]) / (2.0 * h)
        turned = keys.poses[row].local[:, :3, :3].swapaxes(1, 2) @ (after - before)[:, :3, :3] / (2.0 * h)
        turning = np.stack([turned[:, 2, 1], turned[:, 0, 2], turned[:, 1, 0]], axis=1)
        assert np.allclose(moved, keys.speeds[row][:, :3], atol=1e-5)
        assert np.allclose(turning, keys.speeds[row][:, 3:], atol=1e-5)


@given(st.lists(st.integers(1, 3), min_size=2, max_size=6), st.integers(0, 1000))
def test_curves_are_those_of_gltf(gaps: list[int], seed: int) -> None:
    """The formula of the specification (CUBICSPLINE, appendix C), written out for one channel."""
    random = np.random.default_rng(seed)
    frames = np.cumsum([0, *gaps]).astype(float)
    poses = swimming(RIG, np.linspace(0.0, 1.0, len(frames)), turns=0.2 * len(gaps))
    speeds = tuple(random.normal(0.0, 0.2, (len(RIG.joints), 6)) for _ in frames)
    keys = PoseKeys(RIG.name, tuple(frames), tuple(poses), speeds)
    curves = PoseCurves.of(RIG, keys)
    k, t = int(random.integers(len(gaps))), float(random.uniform(0.01, 0.99))
    d = frames[k + 1] - frames[k]
    weights = (2 * t**3 - 3 * t**2 + 1, d * (t**3 - 2 * t**2 + t), -2 * t**3 + 3 * t**2, d * (t**3 - t**2))
    q, b = curves.quaternions, curves.quaternion_slopes
    assert b is not None
    expected = weights[0] * q[k] + weights[1] * b[k] + weights[2] * q[k + 1] + weights[3] * b[k + 1]
    turn = Rotation.from_quat(np.roll(expected, -1, axis=1)).as_matrix()
    assert np.allclose(keys.at(RIG, frames[k] + t * d).local[:, :3, :3], turn, atol=1e-9)
    assert (np.einsum("kji,kji->kj", q[1:], q[:-1]) >= 0.0).all()  # neighbours' signs agree


def test_turning_and_slopes_are_inverse() -> None:
    random = np.random.default_rng(1)
    q = random.normal(size=(20, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    turning = random.normal(size=(20, 3))
    slopes = quaternion_slopes(q, turning)
    assert np.allclose(turning_of(q, slopes), turning)
    assert np.allclose((q * slopes).sum(axis=1), 0.0)
    assert np.allclose(turning_of(q, slopes + 0.3 * q), turning)


def test_linear_keys_blend_as_two_poses_do() -> None:
    keys = reduce_poses(RIG, FRAMES, POSES, tolerance=0.3, interpolation="linear").keys
    assert not keys.is_cubic
    a, b = keys.frames[:2]
    for share in (0.25, 0.6):
        both = keys.at(RIG, a + share * (b - a)), blend(RIG, *keys.poses[:2], share)
        assert np.allclose(both[0].local, both[1].local, atol=1e-12)


@pytest.mark.parametrize("interpolation", ["cubic", "linear"])
@pytest.mark.parametrize("tolerance", [1.0, 0.1, 0.02])
def test_no_vertex_is_farther_off_than_the_tolerance(interpolation: str, tolerance: float) -> None:
    done = reduce_poses(RIG, FRAMES, POSES, tolerance=tolerance, interpolation=interpolation)  # type: ignore[arg-type]
    off = 0.0
    for frame, pose in zip(FRAMES, POSES, strict=True):
        one, two = (
            skin(RIG, forward_kinematics(RIG.parents, p.local)) for p in (pose, done.keys.at(RIG, float(frame)))
        )
        off = max(off, float(np.linalg.norm(one - two, axis=1).max()))
    assert off == pytest.approx(done.error, abs=1e-9)
    assert off <= tolerance
    assert len(done.keys.frames) < len(FRAMES)
    assert np.allclose(skin_errors(RIG, FRAMES, POSES, done.keys), done.errors, atol=1e-9)


def test_cubic_keys_are_fewer_and_none_is_idle() -> None:
    counts = [
        len(reduce_poses(RIG, FRAMES, POSES, tolerance=0.05, interpolation=kind).keys.frames)  # type: ignore[arg-type]
        for kind in ("cubic", "linear")
    ]
    assert counts[0] < 0.6 * counts[1]
    still = reduce_poses(RIG, FRAMES, [POSES[0]] * len(POSES))
    assert still.keys.frames == (1.0, 60.0)
    assert still.error < 1e-12


def test_frames_to_keep_get_a_key_and_one_frame_is_one_key() -> None:
    assert 17.0 in reduce_poses(RIG, FRAMES, POSES, tolerance=1.0, keep=[17.0]).keys.frames
    alone = reduce_poses(RIG, [3.0], POSES[:1])
    assert alone.keys.frames == (3.0,)
    assert alone.keys.at(RIG, 8.0) is alone.keys.poses[0]


def test_noise_below_every_tolerance_keys_every_frame() -> None:
    done = reduce_poses(RIG, FRAMES, POSES, tolerance=1e-12, interpolation="linear")
    assert len(done.keys.frames) == len(FRAMES)
    assert done.error < 1e-9


def test_editing_cubic_keys_keeps_them_cubic_and_the_far_ones_in_place() -> None:
    keys = cubic()
    frame = 0.5 * (keys.frames[3] + keys.frames[4])
    edited = keys.with_key(frame, keys.at(RIG, frame))
    assert edited.is_cubic
    assert np.allclose(edited.at(RIG, keys.frames[1] + 0.3).local, keys.at(RIG, keys.frames[1] + 0.3).local)
    between = 0.5 * (keys.frames[3] + frame)
    assert np.abs(edited.at(RIG, between).local - keys.at(RIG, between).local).max() < 0.05
    back = edited.without_key(frame)
    assert back.frames == keys.frames
    assert np.allclose(back.at(RIG, between).local, keys.at(RIG, between).local)
    ends = keys.with_key(200.0, keys.poses[0])
    assert not ends.speeds[-1].any()


def test_what_does_not_fit_is_refused_in_words() -> None:
    cases = [
        (lambda: reduce_poses(RIG, [1.0, 1.0], POSES[:2]), "rising frames"),
        (lambda: reduce_poses(RIG, [1.0], POSES[:2]), "one pose per frame"),
        (lambda: reduce_poses(RIG, FRAMES, POSES, tolerance=0.0), "tolerance above 0"),
        (lambda: reduce_poses(RIG, FRAMES, POSES, keep=[0.5]), "frame 0.5"),
        (lambda: PoseKeys("a", (1.0, 2.0), tuple(POSES[:2]), (np.zeros((5, 6)),)), "speeds at every key"),
        (lambda: PoseKeys("a", (1.0,), tuple(POSES[:1]), (np.zeros((2, 6)),)), "speeds at frame 1"),
        (lambda: PoseKeys("a").sampled(RIG, [1.0]), "no keys yet"),
    ]
    for make, words in cases:
        with pytest.raises(InvalidInput, match=words):
            make()

    def cancel(*_: object) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        reduce_poses(RIG, FRAMES, POSES, tolerance=0.02, progress=CallbackProgress(cancel))


def test_what_holds_is_held_closer() -> None:
    """Vertices that hold something are within a tenth of the tolerance while they do, others within all of it."""
    tip = np.argsort(RIG.surface.points[:, 1])[-4:]
    none = np.zeros(0, np.int64)
    held = [tip if 20.0 <= frame <= 40.0 else none for frame in FRAMES]
    free, close = (reduce_poses(RIG, FRAMES, POSES, tolerance=0.05, held=each) for each in (None, held))
    assert close.error <= 0.05 and len(free.keys.frames) < len(close.keys.frames) < len(FRAMES)

    def off(keys: PoseKeys, rows: FloatArray) -> float:
        worst = 0.0
        for row in rows.astype(int):
            one, two = (
                skin(RIG, forward_kinematics(RIG.parents, pose.local))[tip]
                for pose in (keys.at(RIG, FRAMES[row]), POSES[row])
            )
            worst = max(worst, float(np.linalg.norm(one - two, axis=1).max()))
        return worst

    rows = np.flatnonzero((FRAMES >= 20.0) & (FRAMES <= 40.0))
    assert off(close.keys, rows) <= 0.005 * (1 + 1e-9) < off(free.keys, rows)
    with pytest.raises(InvalidInput, match="per frame"):
        reduce_poses(RIG, FRAMES, POSES, held=held[:-1])
