"""A robot's hand of many shells and a chair of many parts, from painting to the pose, with the session's verbs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

import contact_core as contact
from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset
from contact_core.errors import ContactError
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.rig.rig import JointFreedom, Rig
from contact_core.session import Session
from contact_core.testing.broken_meshes import joined
from contact_core.testing.meshes import icosphere
from contact_core.testing.rigs import mean_gap

FINGERS, BONES, BALLS = 4, 3, 5  # 60 shells
LENGTH = 0.03  # of a bone, metres


def robot_hand() -> Rig:
    """Four fingers along x, side by side in y: each bone is five overlapping shells; ten of all have a hole."""
    ball = icosphere(2, radius=0.009)
    open_ball = TriangleMesh(ball.points, ball.faces[np.any(ball.points[ball.faces][:, :, 2] < 0.0085, axis=1)])
    names, parents, rest, world, parts, joints = ["palm"], [-1], [np.eye(4)], [np.eye(4)], [], []
    for finger in range(FINGERS):
        for bone in range(BONES):
            local = np.eye(4)
            local[:3, 3] = (LENGTH, 0.0, 0.0) if bone else (0.0, 0.022 * finger, 0.0)
            names.append(f"finger_{finger}_{bone}")
            parents.append(len(names) - 2 if bone else 0)
            rest.append(local)
            world.append(world[parents[-1]] @ local)
            for k in range(BALLS):
                shell = open_ball if len(parts) % 6 == 0 else ball
                middle = world[-1][:3, 3] + np.array([LENGTH * k / BALLS, 0.0, 0.0])
                parts.append(shell.with_points(shell.points + middle))
                joints.append(np.full(len(shell.points), len(names) - 1))
    mesh = joined(*parts)
    assert len(parts) == 60 and sum(len(part.faces) < len(ball.faces) for part in parts) == 10
    return Rig(
        "robot", tuple(names), np.array(parents), np.stack(rest), np.stack(world), mesh.points, mesh.faces,
        np.concatenate(joints)[:, None], np.ones((len(mesh.points), 1)),
        (JointFreedom("ball", translates=True), *(JointFreedom("ball") for _ in names[1:])),
    )  # fmt: skip


def rail() -> TriangleMesh:
    """A bar across the fingers, of shells that overlap, as chairs of parts are put together."""
    ball = icosphere(2, radius=0.012)
    return joined(*(ball.with_points(ball.points + np.array([0.0, 0.008 * k, 0.0])) for k in range(16)))


def posed(session: Session, pads: FloatArray, goals: FloatArray, across: FloatArray, radius: float) -> float:
    """Paint a strip, carry it over and pair it, for each of the pads (k, m, 3) over "hand" and goals (k, 3) on
    "thing"; solve. The mean gap afterwards as a share of the one before."""
    hand, thing = (Locator.of(session.geometry.mesh(name)) for name in ("hand", "thing"))
    for k, (pad, goal) in enumerate(zip(pads, goals, strict=True)):
        skin = hand.closest(pad).points
        session.patches.brush(
            "disk", f"pad {k}", surface="hand", at=skin, radius=radius, spacing=radius / 3, axis=skin
        )
        place = thing.closest(goal[None]).points
        copy = session.patches.transfer(f"pad {k}", "thing", place, direction=across)
        session.pairs.add(f"pad {k}", copy)
        for name in (f"pad {k}", copy):
            assert not session.geometry.reconstruction(name).ran_off.any(), name
    start = session.problem()
    before = mean_gap(start, start.start)
    session.accept(session.solve())
    after = session.problem()
    return mean_gap(after, after.start) / before


def shells_under(session: Session, name: str) -> int:
    """How many shells of the hand a patch lies on."""
    mesh = session.geometry.mesh("hand")
    ends = mesh.faces[:, [0, 1, 2]].ravel(), mesh.faces[:, [1, 2, 0]].ravel()
    shells = connected_components(coo_matrix((np.ones(len(ends[0])), ends), shape=(len(mesh.points),) * 2))[1]
    return len(np.unique(shells[mesh.faces[session.geometry.points(name).faces, 0]]))


def robot_and_rail() -> Session:
    rig = robot_hand()
    session = contact.new(
        hand=Asset("hand", rig.surface, rig, meters_per_unit=1.0),
        thing=Asset("thing", rail(), meters_per_unit=1.0),
    )
    session.surfaces.place("thing", np.array([[1, 0, 0, 0.05], [0, 1, 0, -0.03], [0, 0, 1, -0.05], [0, 0, 0, 1.0]]))
    return session


def take_the_rail(session: Session) -> float:
    rig = session.rigs["hand"]
    tips = rig.rest_world[[BONES * (finger + 1) for finger in range(FINGERS)], :3, 3]
    along = np.array([(x, 0.0, -0.009) for x in (0.002, 0.008, 0.014)])
    goals = np.array([(-0.006, 0.03 + 0.022 * k, 0.012) for k in range(FINGERS)])
    return posed(session, tips[:, None] + along, goals, np.array([1.0, 0.0, 0.0]), 0.004)


def test_a_hand_of_sixty_shells_takes_hold_of_a_rail_of_sixteen() -> None:
    with robot_and_rail() as session:
        for surface in ("hand", "thing"):
            session.surfaces.add_proxy(surface)
        ratio = take_the_rail(session)
        assert all(shells_under(session, f"pad {k}") >= 3 for k in range(FINGERS))
        assert ratio < 0.1


def test_without_proxies_it_does_not() -> None:
    with robot_and_rail() as session:
        session.makers.mends = False
        with pytest.raises(ContactError):
            take_the_rail(session)


def test_a_real_hand_takes_hold_of_a_chair_of_ten_parts(assets: Path) -> None:
    """The Allegro hand, 21 shells of which a finger's pad takes in more than one, and a kitchen chair."""
    hand = assets / "rigs" / "allegro_hand_right" / "allegro_hand_right.urdf"
    chair = assets / "objects" / "chair_kitchen_10_parts.glb"
    with contact.new(hand=str(hand), thing=str(chair)) as session:
        session.surfaces.add_proxy("hand")
        session.surfaces.add_proxy("thing")
        rig, solid = session.rigs["hand"], session.geometry.mesh("thing")
        ends = [
            (rig.rest_world[k], rig.rest_world[rig.parents[k]])
            for k, name in enumerate(rig.joints)
            if name.endswith("_tip")
        ]
        pads = np.array(
            [
                [tip[:3, 3] + share * (base[:3, 3] - tip[:3, 3]) + (0.03, 0, 0) for share in (0.9, 0.5, 0.1)]
                for tip, base in ends
            ]
        )
        top = solid.points[solid.points[:, 1].argmax()]
        goals = top + np.array([(0.025 * (k - 1.5), 0.0, 0.0) for k in range(len(pads))])
        ratio = posed(session, pads, goals, np.array([0.0, 0.0, 1.0]), 0.006)
        assert any(shells_under(session, f"pad {k}") > 1 for k in range(len(pads)))
        assert ratio < 0.2
