"""A grasp from nothing: somebody who has read docs/app.md, with a pointer and keys, an open hand and a mug."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contact_core as contact
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.transform import transform_points
from contact_core.grasping.filled import KeepOutOfHollowsTerm
from contact_core.grasping.metrics import Contact, PosedScene, measure
from contact_core.grasping.verdict import Verdict, judge
from contact_core.interaction.interaction import Interaction
from contact_core.interaction.view import Perspective
from contact_core.plugins.registry import TOOLS
from contact_core.rig.bones import bone_segments
from contact_core.rig.rig import forward_kinematics, skin
from contact_core.session import Session
from contact_core.solve.body import manipulator_length
from contact_core.testing.artist import Artist, ball_and_hand, block, shifted

MUG = np.array([0.148, 0.0, 0.0])  # where it stands, beside the hand
EDIT = np.array([6.0, 0.0])  # pixels
MOST = 25  # gestures and keys
FRONT = Perspective.looking_at((0.08, 0.08, 0.0), (0.08, 0.08, 0.75), viewport=(1280, 720))
BEHIND = Perspective.looking_at((0.1, 0.08, 0.0), (-0.52, 0.08, -0.42), viewport=(1280, 720))


def by(x: float, y: float) -> Any:
    """(2,) pixels to the right and down."""
    return np.array([x, y], float)


@dataclass
class Newcomer(Artist):
    """Counts what it does: a press with all that is dragged, a key, a turn of the camera."""

    count: int = 0

    def drag(self, *pixels: Any, held: Any = ()) -> None:
        self.count += 1
        super().drag(*pixels, held=held)
        assert not self.hands.status.refusal, self.hands.status.refusal

    def key(self, chord: str) -> bool:
        self.count += 1
        taken = super().key(chord)
        while self.hands.worker.status is not None:
            self.hands.worker.wait(0.05)
            self.hands.advance()
        assert taken and not self.hands.status.refusal, self.hands.status.refusal
        return taken

    def orbit(self, view: Perspective) -> None:
        self.count += 1
        self.view = view

    def along(self, *joints: str, start: float = 0.1, beside: float = 0.0) -> list[Any]:
        """Pixels along the bones between joints of the hand, `beside` pixels to the right of them."""
        rig = self.session.rigs["hand"]
        places = [rig.rest_world[rig.joint_index(joint), :3, 3] for joint in joints]
        path = [places[0] + start * (places[1] - places[0]), *places[1:-1]]
        path += [places[-2] + share * (places[-1] - places[-2]) for share in (0.1, 0.5, 0.9)]
        return [self.at(place) + by(beside, 0.0) for place in path]

    def on_mug(self, angle: float, height: float) -> Any:
        """The pixel of a place on the mug's wall: degrees from its handle toward the front, metres."""
        turn = np.radians(angle)
        return self.at(np.add(MUG, (0.041 * np.cos(turn), height, 0.041 * np.sin(turn))))


@pytest.fixture
def newcomer() -> Iterator[Newcomer]:
    with contact.new(hand="sample:human_hand", mug="sample:mug") as session:
        session.surfaces.place("mug", shifted(*MUG))
        yield Newcomer(session, Interaction(session), FRONT)


def finger(name: str) -> tuple[str, str, str]:
    return f"{name}_intermediate", f"{name}_distal", f"{name}_tip"


def verdict(session: Session) -> Verdict:
    """On the hand as it is posed, by the usual limits."""
    rig, mug, pose = session.rigs["hand"], session.geometry.mesh("mug"), session.document.poses["hand"]
    local = np.asarray(pose.local[[pose.joints.index(name) for name in rig.joints]])
    own = forward_kinematics(rig.parents, local)
    there = np.linalg.inv(session.document.surfaces["mug"].world_from_surface)
    posed = TriangleMesh(transform_points(there, skin(rig, own)), rig.faces)
    contacts = {p.pair.name: Contact(p.manipulator_points, p.object_points) for p in session.geometry.pairs()}
    metrics = measure(
        PosedScene(
            rest=rig.surface, skin=posed, bones=bone_segments(rig.parents, there @ own), rest_local=rig.rest_local,
            local=local, moving=rig.parents >= 0, object_mesh=mug, solids=(mug,), contacts=contacts,
            length=manipulator_length(rig),
        )
    )  # fmt: skip
    return judge(metrics, {}, {})


def test_a_grasp_from_nothing(newcomer: Newcomer, repository: Path) -> None:
    session, hands = newcomer.session, newcomer.hands
    newcomer.key("B")
    for _ in range(3):
        newcomer.key("[")
    for name in ("middle", "ring"):
        newcomer.drag(*newcomer.along(*finger(name), start=0.4), held=("shift",))
    newcomer.drag(*newcomer.along("thumb_distal", "thumb_tip", beside=-8.0), held=("shift",))
    newcomer.drag(*newcomer.along(*finger("index"), start=0.4), held=("shift",))
    assert len(session.document.patches) == 4
    newcomer.key("W")
    newcomer.drag(*newcomer.along(*finger("index"), start=0.4))
    newcomer.key("T")
    while hands.selection.surface != "mug":
        newcomer.key("Tab")
    for angle, height in ((92.0, 0.085), (84.0, 0.054), (90.0, 0.033)):  # index, middle, ring: one after the other
        newcomer.drag(newcomer.on_mug(angle, height), newcomer.on_mug(angle - 20.0, height))
    newcomer.orbit(BEHIND)
    newcomer.drag(newcomer.on_mug(254.0, 0.09), newcomer.on_mug(270.0, 0.09))
    assert len(session.document.pairs) == 4, "a transfer pairs, and takes up the next patch"
    newcomer.key("Shift+Space")
    newcomer.key("Enter")
    solved, first = verdict(session), newcomer.count
    newcomer.key("G")
    grabbed = newcomer.pixel("mug", session.geometry.points(session.document.partners("contact.3")[0]))[0]
    newcomer.drag(grabbed, grabbed + by(*(0.5 * EDIT)), grabbed + by(*EDIT))
    newcomer.key("Shift+Space")
    newcomer.key("Enter")
    edited = verdict(session)
    print(f"a grasp from nothing: {newcomer.count} gestures and keys, {first} until it is solved")  # noqa: T201
    assert solved.is_grasp, solved.failures
    assert edited.is_grasp, edited.failures
    assert newcomer.count <= MOST
    page = (repository / "docs" / "app.md").read_text(encoding="utf-8")
    assert f"takes {newcomer.count} gestures and keys" in page and f"{first} of them" in page


def test_a_transfer_takes_up_the_next_patch_without_a_pair() -> None:
    artist = ball_and_hand()
    session, hands = artist.session, artist.hands
    mesh = session.geometry.mesh("hand")
    session.patches.paint("second", block(mesh, (5.0, 0.0, 0.5), 0.3), surface="hand")
    session.patches.paint("third", block(mesh, (3.0, 0.0, 0.5), 0.3), surface="hand")
    hands.take_up("transfer")
    hands.select("second", surface="ball")
    before = session.document
    spot = artist.pixel("ball", session.geometry.points("spot"))[18]
    artist.press(spot)
    artist.key("Escape")
    assert hands.selection.patches == ("second",) and session.document is before
    for following in ("third", "pad", "pad"):  # round and round, as long as there is one
        artist.drag(spot, spot + by(20.0, 3.0))
        assert hands.selection.patches == (following,), hands.status
    hands.configure(TOOLS, "transfer", onward=False)
    hands.select("spot")
    artist.drag(spot + by(30.0, 30.0), spot + by(40.0, 30.0))
    assert hands.selection.patches == ("spot",)


def test_a_hollow_is_solid_unless_a_contact_lies_in_it(newcomer: Newcomer) -> None:
    session, term = newcomer.session, KeepOutOfHollowsTerm()
    rig, mug = session.rigs["hand"], session.geometry.mesh("mug")
    tip = rig.rest_world[rig.joint_index("index_distal"), :3, 3] + [0.0, 0.01, 0.02]
    session.patches.brush("disk", "pad", surface="hand", at=tip, radius=0.006)
    inside = np.array([[0.0, 0.05, 0.0]])
    for place, filled in (
        ((0.0, 0.05, 0.2), True),
        ((0.0, 0.012, 0.0), False),
    ):  # on the wall; on the bottom inside
        root = contact_point(mug, place)
        copy = session.patches.transfer("pad", "mug", root, direction=(1.0, 0.0, 0.0))
        session.pairs.add("pad", copy)
        solid = term.solids_in(session.problem())["mug"]
        assert (solid.distances(inside)[0] < 0.0) == filled
        session.undo()
        session.undo()
    with pytest.raises(InvalidInput):
        newcomer.hands.set(hollows="some")


def contact_point(mesh: TriangleMesh, place: Any) -> SurfacePoints:
    from contact_core.geometry.raycast import Locator

    return Locator.of(mesh).closest(np.array([place])).points
