"""The built-in samples: closed, even, sound to bend, and the same every time."""

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import contact_builtins
from contact_builtins.formats.gltf import GltfFiles
from contact_builtins.samples import __main__ as making
from contact_builtins.samples import catalogue
from contact_builtins.samples.__main__ import versions
from contact_builtins.samples.catalogue import ALL, GeneratedSample
from contact_builtins.samples.packing import pack, unpack
from contact_core.document.asset import Asset
from contact_core.geometry.raycast import Locator
from contact_core.geometry.report import report
from contact_core.plugins.slot import resolve
from contact_core.plugins.slots import Sample
from contact_core.rig.rig import Rig, forward_kinematics, skin

BY_NAME = {sample.name: sample for sample in ALL}
GENUS = {"mug": 1, "scissors": 2, "chair": 7}  # all others: 0
EXTENT = {  # longest side in metres, from and to
    "human_hand": (0.18, 0.22), "witch_hand": (0.24, 0.32), "alien_hand": (0.2, 0.26), "tentacle": (0.55, 0.65),
    "human_body": (1.7, 1.8), "mug": (0.1, 0.13), "baseball": (0.072, 0.076), "scissors": (0.17, 0.21),
    "pole": (1.1, 1.3), "rabbit": (0.2, 0.24), "chair": (0.8, 1.0), "floor": (2.9, 3.1),
}  # fmt: skip
HANDS = ("human_hand", "witch_hand", "alien_hand")
MANIPULATORS = tuple(sample.name for sample in ALL if sample.kind == "manipulator")


@cache
def built(name: str) -> Asset:
    return BY_NAME[name].build()


def rig_of(name: str) -> Rig:
    rig = built(name).rig
    assert rig is not None
    return rig


def bent(rig: Rig, angles: dict[str, tuple[float, float, float]]) -> np.ndarray:
    """(n, 3) skin with joints turned by twist, spread, flexion (degrees, intrinsic) in their own frames."""
    local = np.array(rig.rest_local)
    for name, degrees in angles.items():
        index = rig.joint_index(name)
        frame = rig.freedoms[index].frame
        turn = np.eye(3)
        for axis, angle in enumerate(np.radians(degrees)):
            i, j = (axis + 1) % 3, (axis + 2) % 3
            one = np.eye(3)
            one[[i, j], [i, j]] = np.cos(angle)
            one[i, j], one[j, i] = -np.sin(angle), np.sin(angle)
            turn = turn @ one
        local[index, :3, :3] @= frame @ turn @ frame.T
    return skin(rig, forward_kinematics(rig.parents, local))


def stretch_p99(rig: Rig, points: np.ndarray, where: np.ndarray | None = None) -> float:
    """99th percentile of posed / rest edge length, over edges that touch `where`."""
    edges = np.unique(np.sort(rig.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    if where is not None:
        edges = edges[where[edges].any(axis=1)]
    rest, posed = (np.linalg.norm(p[edges[:, 0]] - p[edges[:, 1]], axis=1) for p in (rig.surface.points, points))
    return float(np.percentile(posed / rest, 99))


def volume(points: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (points[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def smallest_angles(asset: Asset) -> np.ndarray:
    """(m,) smallest angle of each face, degrees."""
    p = asset.mesh.points[asset.mesh.faces]
    sides = np.stack([np.linalg.norm(p[:, (k + 1) % 3] - p[:, (k + 2) % 3], axis=1) for k in range(3)])
    a, b, c = np.sort(sides, axis=0)
    return np.degrees(np.arccos(np.clip((b**2 + c**2 - a**2) / (2 * b * c), -1, 1)))


def test_every_sample_is_offered_once() -> None:
    offered = [resolve(str(reference)) for reference in contact_builtins.contact_samples()]
    assert offered == list(ALL)
    assert all(isinstance(sample, Sample) for sample in offered)
    assert len({sample.name for sample in offered}) == len(offered) == len(EXTENT)


@pytest.mark.parametrize("name", BY_NAME)
def test_is_a_watertight_manifold_of_even_triangles(name: str) -> None:
    asset = built(name)
    facts = report(asset.mesh)
    assert facts.is_watertight and facts.components == 1
    assert facts.genus == GENUS.get(name, 0)
    assert facts.volume is not None and facts.volume > 0
    assert not facts.degenerate_faces and not facts.unused_vertices
    assert 1500 < facts.vertices < 12000
    assert EXTENT[name][0] < max(facts.extent) < EXTENT[name][1]
    angles = smallest_angles(asset)
    assert angles.min() > 20 and np.percentile(angles, 1) > 30
    assert asset.meters_per_unit == 1.0 and asset.name == name


@pytest.mark.parametrize("name", MANIPULATORS)
def test_bends_by_80_degrees_without_tearing(name: str) -> None:
    """Each joint that may: the skin stretches below 1.6 at the 99th percentile, its volume stays within 15%."""
    rig = rig_of(name)
    whole = volume(rig.surface.points, rig.faces)
    for joint, freedom in zip(rig.joints, rig.freedoms, strict=True):
        if freedom.kind != "euler":
            continue
        angle = min(80.0, np.degrees(freedom.upper[2]))
        points = bent(rig, {joint: (0, 0, angle)})
        assert stretch_p99(rig, points) < 1.6, joint
        moved = np.linalg.norm(points - rig.surface.points, axis=1) > 1e-6
        assert stretch_p99(rig, points, moved) < 2.0, joint
        assert abs(volume(points, rig.faces) / whole - 1) < 0.15, joint


@pytest.mark.parametrize("name", HANDS)
def test_a_fist_keeps_its_skin(name: str) -> None:
    rig = rig_of(name)
    fist = {
        joint: (0.0, 0.0, 0.6 * float(np.degrees(freedom.upper[2])))
        for joint, freedom in zip(rig.joints, rig.freedoms, strict=True)
        if freedom.kind == "euler"
    }
    points = bent(rig, fist)
    assert stretch_p99(rig, points) < 1.6
    assert abs(volume(points, rig.faces) / volume(rig.surface.points, rig.faces) - 1) < 0.15


@pytest.mark.parametrize("name", MANIPULATORS)
def test_weights_are_smooth_and_local(name: str) -> None:
    """No weight jumps along an edge; every joint below the root that may move does move skin."""
    rig = rig_of(name)
    dense = np.zeros((len(rig.bind_points), len(rig.joints)))
    np.add.at(dense, (np.arange(len(dense))[:, None], rig.skin_joints), rig.skin_weights)
    assert np.abs(dense.sum(axis=1) - 1).max() < 1e-9
    edges = rig.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    jumps = np.abs(dense[edges[:, 0]] - dense[edges[:, 1]]).sum(axis=1)
    assert np.percentile(jumps, 99) < 0.7 and jumps.max() < 1.2
    for index, freedom in enumerate(rig.freedoms):
        assert freedom.kind == "fixed" or dense[:, index].max() > 0.3, rig.joints[index]


@pytest.mark.parametrize("name", HANDS)
def test_a_finger_leaves_its_neighbours_alone(name: str) -> None:
    """Bending one digit moves no skin of the outer halves of the others by more than 1% of the hand."""
    rig = rig_of(name)
    digits = sorted({joint.split("_")[0] for joint in rig.joints if joint.endswith("_distal")})
    owner = rig.skin_joints[np.arange(len(rig.bind_points)), rig.skin_weights.argmax(axis=1)]
    for digit in digits:
        points = bent(rig, {f"{digit}_proximal": (0, 0, 60)})
        others = [rig.joint_index(f"{d}_distal") for d in digits if d != digit]
        away = np.linalg.norm(points - rig.surface.points, axis=1)[np.isin(owner, others)]
        assert away.max() < 0.01 * rig.surface.bounding_box_diagonal


@pytest.mark.parametrize("name", MANIPULATORS)
def test_frames_run_along_bones_and_rest_lies_within_limits(name: str) -> None:
    rig = rig_of(name)
    assert np.array_equal(rig.rest_world, rig.bind_world) or np.allclose(rig.rest_world, rig.bind_world, atol=1e-12)
    roots = [freedom for freedom in rig.freedoms if freedom.translates]
    assert len(roots) == 1 and rig.freedoms[0].translates and rig.freedoms[0].kind == "ball"
    for index, freedom in enumerate(rig.freedoms):
        frame = rig.rest_world[index, :3, :3]
        assert np.allclose(frame.T @ frame, np.eye(3), atol=1e-9) and np.linalg.det(frame) > 0
        assert (freedom.lower <= 0).all() and (freedom.upper >= 0).all()
    for index, parent in enumerate(rig.parents):
        siblings = np.count_nonzero(rig.parents == parent)
        if parent > 0 and siblings == 1:
            bone = rig.rest_world[index, :3, 3] - rig.rest_world[parent, :3, 3]
            assert bone @ rig.rest_world[parent, :3, 0] > 0.95 * np.linalg.norm(bone), rig.joints[index]


@pytest.mark.parametrize("name", HANDS)
def test_flexion_goes_to_the_palm_and_a_reader_would_guess_it(name: str, tmp_path: Path) -> None:
    """Fingers flex towards +z, and the frames and limits are those that the glTF reader guesses from the names."""
    asset, rig = built(name), rig_of(name)
    tips = [rig.joint_index(joint) for joint in rig.joints if joint.endswith("_tip") and "thumb" not in joint]
    for index in tips:
        joint = rig.joints[index].replace("_tip", "_proximal")
        posed = np.array(rig.rest_local)
        c, s = np.cos(1.0), np.sin(1.0)
        posed[rig.joint_index(joint), :3, :3] @= np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        ahead = forward_kinematics(rig.parents, posed)[index, :3, 3] - rig.rest_world[index, :3, 3]
        assert ahead[2] > 0.3 * np.linalg.norm(ahead)
    path = tmp_path / "hand.glb"
    GltfFiles().write(path, [asset], {})
    back = GltfFiles().read(path).rig
    assert back is not None and back.joints == rig.joints
    for joint, own, guessed in zip(rig.joints, rig.freedoms, back.freedoms, strict=True):
        if own.kind != "ball":
            assert guessed.kind == own.kind, joint
            assert np.allclose(guessed.frame, own.frame, atol=1e-6), joint
            assert np.allclose(guessed.upper, own.upper) and np.allclose(guessed.lower, own.lower), joint


def test_the_body_mirrors_and_sits() -> None:
    """Left and right are mirror images at rest and in a sitting pose; thighs level, skin sound."""
    rig = rig_of("human_body")
    for index, joint in enumerate(rig.joints):
        if joint.endswith("_l"):
            other = rig.rest_world[rig.joint_index(joint[:-2] + "_r"), :3, 3]
            assert np.allclose(rig.rest_world[index, :3, 3] * [-1, 1, 1], other)
    sitting = {f"thigh_{s}": (0, 0, 88) for s in "lr"} | {f"calf_{s}": (0, 0, 85) for s in "lr"}
    points = bent(rig, sitting)
    assert stretch_p99(rig, points) < 1.6
    assert np.isclose(points[:, 0].min(), -points[:, 0].max(), atol=0.01)
    knees = points[np.isin(rig.skin_joints[:, 0], [rig.joint_index("calf_l"), rig.joint_index("calf_r")])]
    assert knees[:, 2].max() > 0.35  # knees in front


@pytest.mark.parametrize("sample", ALL, ids=lambda sample: sample.name)
def test_the_model_that_comes_with_the_package_is_of_these_sources(sample: GeneratedSample) -> None:
    assert versions()[sample.name] == sample.version(), "run python -m contact_builtins.samples"


@pytest.mark.parametrize("name", ["human_hand", "mug", "pole"])
def test_modelled_anew_it_is_the_same_surface(name: str) -> None:
    """Which edges collapse may differ by last bits, where the surface runs may not; nor may joints."""
    kept, anew = built(name), BY_NAME[name].generate()
    size = kept.mesh.bounding_box_diagonal
    for one, other in ((kept.mesh, anew.mesh), (anew.mesh, kept.mesh)):
        assert Locator.of(one).closest(other.points).distance.max() < 2e-3 * size
        assert len(one.points) == pytest.approx(len(other.points), rel=0.02)
    if kept.rig is not None:
        assert anew.rig is not None and anew.rig.joints == kept.rig.joints
        assert np.allclose(anew.rig.rest_world, kept.rig.rest_world, atol=1e-9)


def test_a_sample_is_modelled_and_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(making, "FOLDER", tmp_path / "models")
    monkeypatch.setattr(making, "VERSIONS", tmp_path / "models" / "versions.txt")
    assert making.main(["floor"]) == 0
    assert making.versions() == {"floor": BY_NAME["floor"].version()}
    with np.load(tmp_path / "models" / "floor.npz") as arrays:
        assert unpack(arrays).mesh.digest == BY_NAME["floor"].generate().mesh.digest


def test_a_rig_comes_back_from_the_archive_whole() -> None:
    asset = built("alien_hand")
    back = unpack(pack(asset))
    assert asset.rig is not None and back.rig is not None
    assert back.rig.joints == asset.rig.joints and back.name == asset.name and back.up_axis == asset.up_axis
    for field in ("rest_local", "bind_world", "bind_points", "skin_joints", "skin_weights", "parents", "faces"):
        assert np.array_equal(getattr(back.rig, field), getattr(asset.rig, field)), field
    for own, other in zip(asset.rig.freedoms, back.rig.freedoms, strict=True):
        assert (own.kind, own.order, own.translates) == (other.kind, other.order, other.translates)
        for field in ("frame", "lower", "upper", "prior_weight", "locked"):
            assert np.array_equal(getattr(own, field), getattr(other, field)), field


def test_a_changed_generator_is_another_version(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its own module and shared ones count; another sample's module does not."""
    for module in ("mug", "baseball", "fields"):
        (tmp_path / f"{module}.py").write_text("a = 1")
    monkeypatch.setattr(catalogue, "files", lambda package: tmp_path)
    versions = []
    for module in ("", "baseball", "fields", "mug"):
        if module:
            (tmp_path / f"{module}.py").write_text("a = 2")
        versions.append(BY_NAME["mug"].version())
    assert versions[0] == versions[1] != versions[2] != versions[3]


def test_the_page_of_samples_lists_them_all(repository: Path) -> None:
    """Name and number of joints of each, as docs/samples.md and the summaries say."""
    page = (repository / "docs" / "samples.md").read_text()
    for sample in ALL:
        row = next(line for line in page.splitlines() if line.startswith(f"| `{sample.name}` |"))
        rig = built(sample.name).rig
        joints = row.split("|")[3].strip()
        assert joints.startswith(f"{len(rig.joints)}" if rig else "") and bool(joints) == (rig is not None)
        said = re.search(r"(\d+) joints", sample.summary)
        assert said is None or (rig is not None and int(said[1]) == len(rig.joints))
