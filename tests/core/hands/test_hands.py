"""What a hand tells about itself, whatever its joints are called, however it stands, left or right."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_builtins.axes.along_bone import AlongBone
from contact_builtins.formats.gltf import GltfFiles
from contact_builtins.formats.inspection import hands_of
from contact_builtins.formats.urdf import UrdfFiles
from contact_builtins.samples.catalogue import ALIEN_HAND, HUMAN_BODY, HUMAN_HAND, TENTACLE, WITCH_HAND
from contact_core.cli import main
from contact_core.contact.axis_generator import AxisRequest
from contact_core.errors import FileRefused, InvalidInput
from contact_core.geometry import SurfacePoints
from contact_core.hands.describe import describe_hand, describe_hands
from contact_core.hands.description import Digit, HandDescription, HandWords
from contact_core.hands.freedoms import guess_freedoms
from contact_core.hands.names import digit_joints
from contact_core.rig.bones import bones_of
from contact_core.rig.rig import JointFreedom, Rig, forward_kinematics
from contact_core.testing import meshes

HANDS = (HUMAN_HAND, WITCH_HAND, ALIEN_HAND)
REAL = ("webxr_generic_hand_left.glb", "alien_three_fingered.glb", "makehuman_body_53_joints.glb")


def bare(rig: Rig, *, nameless: bool = False) -> Rig:
    """The rig without its freedoms, and without its names when asked for."""
    names = tuple(f"b{k}" for k in range(len(rig.joints))) if nameless else rig.joints
    return replace(rig, joints=names, freedoms=tuple(JointFreedom() for _ in names))


def built(sample: object) -> Rig:
    rig = sample.build().rig  # type: ignore[attr-defined]
    assert rig is not None
    return rig


def moved(rig: Rig, transform: np.ndarray) -> Rig:
    """The rig under a rigid motion, or in a mirror: joint frames stay right-handed, faces stay outward."""
    mirrored = np.linalg.det(transform[:3, :3]) < 0
    flip = np.diag([1.0, 1.0, -1.0, 1.0]) if mirrored else np.eye(4)
    world, bind = transform @ rig.rest_world @ flip, transform @ rig.bind_world @ flip
    local = np.stack(
        [np.linalg.inv(world[p]) @ w if p >= 0 else w for p, w in zip(rig.parents, world, strict=True)]
    )
    points = rig.bind_points @ transform[:3, :3].T + transform[:3, 3]
    faces = rig.faces[:, ::-1] if mirrored else rig.faces
    return replace(rig, rest_local=local, bind_world=bind, bind_points=points, faces=faces)


def flexed_tip(rig: Rig, digit: Digit, degrees: float) -> np.ndarray:
    """(3,) a digit's tip after a turn of every flexing joint about its flexion axis."""
    local = np.array(rig.rest_local)
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    for bone in digit.bones:
        if bone.flexes:
            local[bone.joint, :3, :3] @= bone.frame @ turn @ bone.frame.T
    last = digit.bones[-1].joint
    world = forward_kinematics(rig.parents, local)[last] @ np.linalg.inv(rig.rest_world[last])
    return np.asarray((world @ np.append(digit.tip, 1.0))[:3])


def assert_closes(rig: Rig, hand: HandDescription) -> None:
    """Positive flexion brings a finger's tip nearer to the thumb's than negative; the thumb's to bent fingers."""
    thumb = hand.thumb
    if thumb is None:
        bases = np.mean([rig.rest_world[d.bones[0].joint, :3, 3] for d in hand.digits], axis=0)
        for digit in hand.digits:
            off = [
                np.linalg.norm(np.cross(flexed_tip(rig, digit, a) - bases, hand.palm.normal)) for a in (0, 4, -4)
            ]
            assert off[1] < off[0] < off[2], digit.role
        return
    bent = np.mean([flexed_tip(rig, finger, 40.0) for finger in hand.fingers], axis=0)
    for digit in hand.digits:
        target = bent if digit.is_thumb else thumb.tip
        near, far = (np.linalg.norm(flexed_tip(rig, digit, angle) - target) for angle in (40.0, -40.0))
        assert near < far, digit.role


@pytest.mark.parametrize("sample", HANDS, ids=lambda sample: sample.name)
@pytest.mark.parametrize("nameless", [False, True])
def test_built_in_hands_give_back_their_design(sample: object, nameless: bool) -> None:
    """Frames to 1e-6, segments, thumb, order and palm, from geometry alone."""
    rig = built(sample)
    hand = describe_hand(bare(rig, nameless=nameless))
    assert hand.side == "right" and rig.joints[hand.hub] == "wrist"
    assert hand.palm.normal[2] > np.cos(np.radians(10)) and hand.palm.fingers[1] > np.cos(np.radians(10))
    for digit in hand.digits:
        for bone in digit.bones:
            assert rig.joints[bone.joint] == f"{digit.role}_{bone.segment}"
            if rig.freedoms[bone.joint].kind == "euler":
                assert np.allclose(bone.frame, rig.freedoms[bone.joint].frame, atol=1e-6)
    assert [digit.role for digit in hand.digits] == ["thumb", "index", "middle", "ring", "little"][
        : len(hand.digits)
    ]
    assert_closes(rig, hand)
    guessed, _ = guess_freedoms(bare(rig, nameless=nameless))
    for mine, design in zip(guessed, rig.freedoms, strict=True):
        assert mine.kind == design.kind
        assert np.allclose(mine.upper, design.upper) and np.allclose(mine.lower, design.lower)


@given(
    seed=st.integers(0, 2**32 - 1), mirrored=st.booleans(), sample=st.sampled_from(HANDS), nameless=st.booleans()
)
@settings(max_examples=25)
def test_a_hand_that_is_moved_or_mirrored_is_the_same_hand(
    seed: int, mirrored: bool, sample: object, nameless: bool
) -> None:
    """Everything moves with it; in the mirror the side changes and nothing else. It still closes."""
    rig = bare(built(sample), nameless=nameless)
    random = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn)) * (-1.0 if mirrored else 1.0)
    transform = np.eye(4)
    transform[:3, :3], transform[:3, 3] = turn, random.normal(size=3)
    other = moved(rig, transform)
    first, second = describe_hand(rig), describe_hand(other)
    assert second.side == ("left" if mirrored else "right")
    assert np.allclose(second.palm.normal, turn @ first.palm.normal, atol=1e-6)
    assert np.allclose(second.palm.point, turn @ first.palm.point + transform[:3, 3], atol=1e-6)
    assert [d.role for d in second.digits] == [d.role for d in first.digits]
    assert [p.name for p in second.pads] == [p.name for p in first.pads]
    assert_closes(other, second)
    for one, two in zip(first.pads, second.pads, strict=True):
        place = one.centre.positions(rig.surface)[0] @ turn.T + transform[:3, 3]
        assert np.allclose(two.centre.positions(other.surface)[0], place, atol=1e-6)


@pytest.mark.parametrize(("sample", "pads"), [(HUMAN_HAND, 10), (WITCH_HAND, 10), (ALIEN_HAND, 6)])
def test_pads_face_where_the_digits_close_and_their_axes_are_the_default_ones(sample: object, pads: int) -> None:
    """The default generator takes the bone of a round patch."""
    rig = built(sample)
    hand = describe_hand(rig)
    assert len(hand.pads) == pads and hand.pads[-1].name == "palm"
    mesh = rig.surface
    for pad in hand.pads[:-1]:
        bone = next(b for d in hand.digits for b in d.bones if b.joint == pad.joint)
        palmar = rig.rest_world[pad.joint, :3, :3] @ bone.frame[:, 1]
        assert pad.normal @ palmar > 0.7
        near = np.linalg.norm(mesh.points - pad.centre.positions(mesh)[0], axis=1) < pad.radius
        dab = SurfacePoints.at_vertices(mesh, np.flatnonzero(near & (mesh.vertex_normals @ pad.normal > 0)))
        bones, owner = bones_of(rig, dab)
        drawn = AlongBone().generate(AxisRequest(mesh, dab, bones, owner)).positions(mesh)
        mine = pad.axis.positions(mesh)
        way, other = drawn[-1] - drawn[0], mine[1] - mine[0]
        assert way @ other / np.linalg.norm(way) / np.linalg.norm(other) > np.cos(np.radians(30)), pad.name


def claw(count: int, lean: float) -> Rig:
    """Digits of three joints evenly round +z; a knob of skin at the middle of each bone."""
    world, parents, names = [np.eye(4)], [-1], ["base"]
    for k in range(count):
        angle = 2 * np.pi * k / count
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        place, parent = 0.5 * out, 0
        for part in range(3):
            frame = np.eye(4)
            frame[:3, 3] = place
            world.append(frame)
            names.append(f"k{k}_{part}")
            parents.append(parent)
            parent = len(world) - 1
            place = place + (lean * out + np.array([0, 0, 1.0])) / np.hypot(lean, 1)
    frames = np.array(world)
    ball = meshes.icosphere(1)
    points, faces, owners = [], [], []
    for joint, frame in enumerate(frames):
        faces.append(ball.faces + sum(map(len, points)))
        points.append(0.3 * ball.points + frame[:3, 3] + [0, 0, 0.5 if joint else 0])
        owners.append(np.full(len(ball.points), joint))
    local = np.stack([np.linalg.inv(frames[p]) @ w if p >= 0 else w for p, w in zip(parents, frames, strict=True)])
    joints = np.concatenate(owners)[:, None]
    return Rig(
        "claw", tuple(names), np.array(parents), local, frames, np.concatenate(points), np.concatenate(faces),
        joints, np.ones(joints.shape), tuple(JointFreedom() for _ in names),
    )  # fmt: skip


@pytest.mark.parametrize("count", [2, 3, 4, 5])
@pytest.mark.parametrize("lean", [0.0, 0.4])
def test_a_radial_claw_closes_towards_its_axis(count: int, lean: float) -> None:
    """Without a thumb: each digit turns to the axis, the palm is said to be none, and pads look inwards."""
    rig = claw(count, lean)
    hand = describe_hand(rig)
    assert not hand.palm.is_plane and hand.thumb is None and hand.palm.normal[2] > 0.999
    assert len(hand.digits) == count and any("round an axis" in note for note in hand.notes)
    assert_closes(rig, hand)
    for pad in hand.pads:
        centre = pad.centre.positions(rig.surface)[0]
        assert pad.normal[:2] @ centre[:2] < 0


def test_what_has_no_hand_says_so_and_a_mitten_has_a_thumb() -> None:
    with pytest.raises(InvalidInput, match="hub"):
        describe_hand(built(TENTACLE))
    body = built(HUMAN_BODY)
    hands = describe_hands(body)
    assert [(body.joints[h.hub], h.side) for h in hands] == [("hand_l", "left"), ("hand_r", "right")]
    assert all(h.thumb is not None and len(h.digits) == 2 for h in hands)


def test_what_its_author_says_overrides() -> None:
    rig = bare(built(HUMAN_HAND))
    words = HandWords("wrist", thumb="little_proximal", palm=(0.0, 0.0, -1.0), side="left")
    hand = describe_hand(rig, [words])
    assert hand.side == "left" and hand.palm.normal[2] < -0.9
    assert hand.thumb is not None and rig.joints[hand.thumb.bones[1].joint] == "little_proximal"
    with pytest.raises(InvalidInput, match="no joint"):
        describe_hand(rig, [HandWords("nobody")])
    with pytest.raises(InvalidInput, match="no hub"):
        describe_hand(rig, [HandWords("index_distal")])


CONVENTIONS = {
    "mixamo": ("mixamorig:RightHand{}{}", ("Thumb", "Index", "Middle", "Ring", "Pinky"), 1),
    "rigify": ("f_{}.0{}.L", ("thumb", "index", "middle", "ring", "pinky"), 1),
    "vrm": ("J_Bip_L_{}{}", ("Thumb", "Index", "Middle", "Ring", "Little"), 1),
    "unreal": ("{}_0{}_r", ("thumb", "index", "middle", "ring", "pinky"), 1),
    "daz": ("l{}{}", ("Thumb", "Index", "Mid", "Ring", "Pinky"), 1),
    "reallusion": ("CC_Base_L_{}{}", ("Thumb", "Index", "Mid", "Ring", "Pinky"), 1),
    "makehuman": ("finger{}-{}.L", ("1", "2", "3", "4", "5"), 1),
    "mmd": ("左{}{}", ("親指", "人指", "中指", "薬指", "小指"), 1),
    "mmd wide": ("右{}\uff11", ("親指", "人指", "中指", "薬指", "小指"), 1),
    "smplx": ("left_{}{}", ("thumb", "index", "middle", "ring", "pinky"), 1),
    "arkit": ("left_hand{}_{}_joint", ("Thumb", "Index", "Mid", "Ring", "Pinky"), 1),
    "webxr": ("{}-finger-phalanx-proximal", ("thumb", "index", "middle", "ring", "pinky"), 1),
}


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_the_conventions_of_other_tools_are_read(convention: str) -> None:
    pattern, words, first = CONVENTIONS[convention]
    said = digit_joints([pattern.format(word, first) for word in words])
    assert [joint and joint.digit for joint in said] == ["thumb", "index", "middle", "ring", "little"]


@pytest.mark.parametrize("prefix", ["ValveBiped.Bip01_L_", "Bip01 R "])
def test_biped_counts_its_thumb_as_zero(prefix: str) -> None:
    names = [f"{prefix}Finger{digit}{part}" for digit in range(5) for part in ("", "1", "2")]
    said = digit_joints(names)
    assert [joint and (joint.digit, joint.number) for joint in said[:6]] == [
        ("thumb", 0), ("thumb", 1), ("thumb", 2), ("index", 0), ("index", 1), ("index", 2),
    ]  # fmt: skip
    assert said[-1] is not None and said[-1].digit == "little"


@pytest.mark.parametrize("name", ["LittleToe1", "spine_mid", "hair_middle_01", "ForeArm.L", "left_forearm_joint"])
def test_other_parts_of_a_body_are_no_digits(name: str) -> None:
    assert digit_joints([name]) == [None]


def test_the_last_of_four_that_are_counted_from_one_is_a_tip() -> None:
    """Mixamo's fourth joints: with skin or without, the knuckle bends and nothing is taken for a metacarpal."""
    rig = built(HUMAN_HAND)
    keep = [k for k, name in enumerate(rig.joints) if "metacarpal" not in name or name.startswith("thumb")]
    place = {old: new for new, old in enumerate(keep)}
    parents = np.array([place.get(int(rig.parents[k]), 0) if rig.parents[k] >= 0 else -1 for k in keep])
    count = {"metacarpal": 1, "proximal": 1, "intermediate": 2, "distal": 3, "tip": 4}
    names = []
    for k in keep:
        digit, _, part = rig.joints[k].partition("_")
        number = count.get(part, 0) + (digit == "thumb" and part == "proximal") + (0)
        names.append(f"Hand{digit.title()}{number}" if part else "Hand")
    world = rig.rest_world[keep]
    local = np.stack([np.linalg.inv(world[p]) @ w if p >= 0 else w for p, w in zip(parents, world, strict=True)])
    joints = np.vectorize(lambda j: place.get(int(j), 0))(rig.skin_joints)
    mixamo = replace(
        rig, joints=tuple(names), parents=parents, rest_local=local, bind_world=rig.bind_world[keep],
        skin_joints=joints, freedoms=tuple(JointFreedom() for _ in keep),
    )  # fmt: skip
    freedoms, _ = guess_freedoms(mixamo)
    kinds = dict(zip(names, (freedom.kind for freedom in freedoms), strict=True))
    assert all(kinds[f"HandIndex{n}"] == "euler" for n in (1, 2, 3)) and kinds["HandIndex4"] == "fixed"
    assert sum({"ball": 6, "euler": 3, "fixed": 0}[kind] for kind in kinds.values()) == 51


@pytest.mark.assets
@pytest.mark.parametrize("file", REAL)
@pytest.mark.parametrize("nameless", [False, True])
def test_real_hands_close_and_know_their_thumb(assets: Path, file: str, nameless: bool) -> None:
    rig = GltfFiles().read(assets / "rigs" / file).rig
    assert rig is not None
    hands = describe_hands(bare(rig, nameless=nameless))
    assert len(hands) == (1 if file.startswith("webxr") else 2)
    for hand in hands:
        assert hand.thumb is not None and "humb" in rig.joints[hand.thumb.bones[0].joint]
        assert len(hand.pads) == (8 if file.startswith("alien") else 10)
        side = "left" if file.startswith("webxr") or rig.joints[hand.hub][-1] in "lL" else "right"
        assert hand.side == side
        assert_closes(rig, hand)


@pytest.mark.assets
def test_the_allegro_hand_flexes_about_its_hinges(assets: Path) -> None:
    rig = UrdfFiles().read(assets / "rigs" / "allegro_hand_right" / "allegro_hand_right.urdf").rig
    assert rig is not None
    hand = describe_hand(rig)
    assert hand.palm.normal[0] > 0.99 and hand.side == "right"
    assert hand.thumb is not None and rig.joints[hand.thumb.bones[0].joint] == "joint_12.0"
    assert [bone.flexes for bone in hand.fingers[0].bones] == [False, True, True, True]
    for digit in hand.digits:
        for bone in digit.bones:
            if bone.flexes:
                assert abs(bone.frame[:, 2] @ rig.freedoms[bone.joint].frame[:, 0]) > 0.999
    assert_closes(rig, hand)


def test_a_sidecar_says_what_the_shape_does_not(tmp_path: Path) -> None:
    """[[hand]] reaches the description and the guessed limits of the file that it lies beside."""
    asset = HUMAN_HAND.build()
    GltfFiles().write(tmp_path / "h.glb", [asset], {})
    (tmp_path / "h.rig.toml").write_text(
        'schema = 1\n[[hand]]\nhub = "wrist"\npalm = "-z"\nthumb = "thumb_proximal"\n'
        'digits = { claw = "index_distal" }\n'
    )
    read = GltfFiles().read(tmp_path / "h.glb")
    (hand,) = hands_of(read)
    assert hand.palm.normal[2] < -0.9 and [d.role for d in hand.digits] == [
        "thumb",
        "claw",
        "middle",
        "ring",
        "little",
    ]
    rig = read.rig
    assert rig is not None
    knuckle = rig.joint_index("index_proximal")
    palmar = rig.rest_world[knuckle, :3, :3] @ rig.freedoms[knuckle].frame[:, 1]
    assert palmar[2] < -0.9
    for text, words in (
        ("hub = 3", "hub"),
        ('hub = "wrist"\nside = "up"', "side"),
        ('hub = "wrist"\npalm = 1', "palm"),
    ):
        (tmp_path / "h.rig.toml").write_text(f"schema = 1\n[[hand]]\n{text}\n")
        with pytest.raises(FileRefused, match=words):
            GltfFiles().read(tmp_path / "h.glb")


def test_inspect_prints_a_hand_and_draws_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asset = ALIEN_HAND.build()
    GltfFiles().write(tmp_path / "a.glb", [asset], {})
    assert main(["inspect", str(tmp_path / "a.glb"), "--picture", str(tmp_path / "a.png")]) == 0
    text = capsys.readouterr().out
    assert "right hand at wrist" in text and "thumb: thumb_metacarpal" in text and "6 pads" in text
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    "fingers",
    [
        ("Daumen", "Zeigefinger", "Mittelfinger", "Ringfinger", "KleinerFinger"),
        ("pouce", "index", "majeur", "annulaire", "auriculaire"),
        ("Pulgar", "Indice", "Corazon", "Anular", "Menique"),
        ("Pollice", "Indice", "Medio", "Anulare", "Mignolo"),
    ],
)
def test_fingers_have_names_in_other_languages(fingers: tuple[str, ...]) -> None:
    """And the number beside a "KleinerFinger" counts its segments, not the fingers."""
    asset = HUMAN_HAND.build()
    assert asset.rig is not None
    names, plain = list(asset.rig.joints), describe_hand(asset.rig)
    for word, digit in zip(fingers, plain.digits, strict=True):
        for number, joint in enumerate(digit.joints):
            names[joint] = f"{word}{number}.L"
    told = describe_hand(replace(asset.rig, joints=tuple(names)))
    assert [(d.role, d.joints) for d in told.digits] == [(d.role, d.joints) for d in plain.digits]


@pytest.mark.parametrize("sample", HANDS, ids=lambda sample: sample.name)
def test_pads_and_their_axes_lie_on_one_link_where_links_are_not_connected(sample: object) -> None:
    rig = built(sample)
    owner = rig.skin_joints[np.arange(len(rig.bind_points)), rig.skin_weights.argmax(axis=1)]
    links = owner[rig.faces[:, 0]]  # (m,) each face is a part of the link that holds its first corner
    kept, place = np.unique(np.stack([rig.faces.ravel(), np.repeat(links, 3)], axis=1), axis=0, return_inverse=True)
    apart = replace(
        rig,
        bind_points=rig.bind_points[kept[:, 0]],
        faces=place.reshape(-1, 3),
        skin_joints=rig.skin_joints[kept[:, 0]],
        skin_weights=rig.skin_weights[kept[:, 0]],
    )
    pads = describe_hand(apart).pads
    assert len(pads) >= 4
    for pad in pads:
        assert (links[pad.axis.faces] == links[pad.centre.faces]).all(), pad.name
