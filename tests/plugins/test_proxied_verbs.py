"""Every verb on a hand and a thing whose faces hang together nowhere, each on a proxy, against the sound two.

The proxy of each is its own sound mesh, so that what walks there is the same to the last digits: edits, transfers
and distances have to be equal, and what is solved has to fit as well.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import contact_core as contact
from contact_core.contact.axis import draw_axis
from contact_core.contact.patch import parameterize_patch, reconstruct_patch
from contact_core.contact.shape import PatchShape
from contact_core.document.asset import Asset
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_map import SurfaceMap
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.interaction.heat import distances_to
from contact_core.interaction.seen import SeenSurface
from contact_core.proposals.sliding_targets import SlidingPatch, SlidingTargets
from contact_core.rig.rig import JointFreedom, Rig
from contact_core.session import Session
from contact_core.solve.black_box import Differentiable
from contact_core.testing.meshes import icosphere
from contact_core.testing.rigs import mean_gap


def apart(mesh: TriangleMesh) -> TriangleMesh:
    """The same faces, each with corners of its own."""
    return TriangleMesh(mesh.points[mesh.faces].reshape(-1, 3), np.arange(mesh.faces.size).reshape(-1, 3))


def finger() -> Rig:
    """A closed finger of two joints along x, six units long."""
    mesh = icosphere(3)
    mesh = mesh.with_points(mesh.points * [3.0, 0.6, 0.6])
    rest = np.tile(np.eye(4), (2, 1, 1))
    rest[0, 0, 3], rest[1, 0, 3] = -3.0, 3.0
    world = np.stack([rest[0], rest[0] @ rest[1]])
    share = np.clip(0.5 + mesh.points[:, 0], 0.0, 1.0)
    return Rig(
        "finger", ("root", "tip"), np.array([-1, 0]), rest, world, mesh.points, mesh.faces,
        np.tile([0, 1], (len(share), 1)), np.c_[1.0 - share, share],
        (JointFreedom("ball", translates=True), JointFreedom("ball")),
    )  # fmt: skip


def scene(*, broken: bool) -> Session:
    """A patch under the fingertip, a copy of it on the thing below, and the two paired."""
    rig, thing = finger(), icosphere(3)
    sound = {"hand": rig.surface, "thing": thing}
    if broken:
        loose, corners = apart(rig.surface), rig.faces.ravel()
        rig = replace(
            rig, bind_points=loose.points, faces=loose.faces,
            skin_joints=rig.skin_joints[corners], skin_weights=rig.skin_weights[corners],
        )  # fmt: skip
        thing = apart(thing)
    session = contact.new(
        hand=Asset("hand", rig.surface, rig, meters_per_unit=0.01),
        thing=Asset("thing", thing, meters_per_unit=0.01),
    )
    if broken:
        for name, mesh in sound.items():
            session.surfaces.add_proxy(name, mesh=mesh)
    session.surfaces.place("thing", np.array([[1.0, 0, 0, 0.02], [0, 1, 0, 0], [0, 0, 1, -0.03], [0, 0, 0, 1]]))
    session.patches.brush("disk", "tip", surface="hand", at=[[2.21, 0.07, -0.41]], radius=0.5)
    top = SurfacePoints([int(np.argmax(icosphere(3).face_normals[:, 2]))], [[0.3, 0.4, 0.3]])
    session.patches.transfer("tip", "thing", top, direction=[1.0, 0.1, 0.0], name="goal")
    session.pairs.add("tip", "goal")
    return session


EDITS: dict[str, Callable[[Session], None]] = {
    "drag": lambda s: s.patches.translate("goal", SurfacePoints([200], [[0.2, 0.3, 0.5]])),
    "turn": lambda s: s.patches.rotate("goal", 0.3),
    "bend": lambda s: s.patches.bend("goal", 1, 0.2),
    "scale": lambda s: s.patches.scale("goal", along=1.1, spread=0.9),
}


def test_edits_on_proxies_are_those_on_sound_meshes() -> None:
    with scene(broken=False) as sound, scene(broken=True) as loose:
        for act in (lambda s: None, *EDITS.values()):
            found = []
            for session in (sound, loose):
                act(session)
                points = [session.geometry.points(n).positions(session.geometry.mesh(s)) for n, s in
                          (("tip", "hand"), ("goal", "thing"))]  # fmt: skip
                found.append(np.concatenate(points))
            np.testing.assert_allclose(*found, atol=1e-9)
        gaps = [session.geometry.pairs()[0] for session in (sound, loose)]
        assert len(gaps[0].object_points) == len(gaps[1].object_points) > 10


def test_what_is_solved_on_proxies_fits_as_well() -> None:
    gaps: dict[bool, list[float]] = {}
    for broken in (False, True):
        with scene(broken=broken) as session:
            start, tip = session.problem(), session.geometry.points("tip")
            gaps[broken] = [mean_gap(start, start.start)]
            for verb in (session.solve, session.settle, session.slide):
                proposal = verb()
                assert not getattr(proposal, "left_out", {}), proposal.left_out
                session.accept(proposal)
                problem = session.problem()
                gaps[broken].append(mean_gap(problem, problem.start))
            goal = session.problem().contacts[0].object_points
            assert goal.same_as(session.geometry.points("goal"))  # the slide's targets are those of the document
            assert tip.same_as(session.geometry.points("tip"))
    assert gaps[True][0] == pytest.approx(gaps[False][0], rel=1e-3)
    assert max(gaps[True][1:]) < 0.5 * gaps[True][0]
    assert gaps[True][3] <= 1.2 * gaps[False][3] + 0.01 * gaps[True][0], gaps


def test_the_heat_map_of_a_broken_thing_is_that_of_the_sound_one() -> None:
    skin = finger().surface.points
    for_each = [
        distances_to(skin, (SeenSurface("thing", mesh, mesh, np.eye(4)),))
        for mesh in (icosphere(3), apart(icosphere(3)))
    ]
    np.testing.assert_allclose(*for_each, atol=1e-9)


def test_gradients_of_slides_on_a_proxy_are_exact() -> None:
    """Points walk on a finer ball a little outside; their feet on a coarse one move in faces and along edges."""
    coarse, ball = icosphere(2), icosphere(3)
    ball = ball.with_points(1.02 * ball.points)
    centre = Locator.of(ball).closest(np.array([[0.3, 0.5, 0.8], [0.5, 0.4, 0.75]])).points
    axis_shape, axis = draw_axis(ball, centre)
    near = axis.points[1].positions(ball) + np.random.default_rng(4).normal(0.0, 0.15, (30, 3))
    shape = PatchShape(
        axis_shape, parameterize_patch(ball, axis, Locator.of(ball).closest(near).points), np.ones(30)
    )
    between = SurfaceMap.of(coarse, ball)
    meant = between.to_source(reconstruct_patch(ball, shape, axis.root()).points)
    patch = SlidingPatch("c", shape, axis.root(), 0.2)
    evaluate = SlidingTargets(ball, [patch], np.diag([2.0, 2.0, 2.0, 1.0]), [meant], between).watch(meant)
    assert isinstance(evaluate, Differentiable)
    theta, step = np.array([0.31, -0.22, 0.17]), 1e-7
    for found in range(2):
        exact = evaluate.derivatives(theta)[found]  # (3, k, 3)
        for q, unit in enumerate(step * np.eye(3)):
            numeric = (evaluate(theta + unit)[found] - evaluate(theta - unit)[found]) / (2.0 * step)
            away = np.abs(exact[q] - numeric).max(axis=1)
            assert np.abs(numeric).max() > 0.01
            assert np.median(away) < 1e-6 and (away < 1e-6).mean() > 0.8, away
