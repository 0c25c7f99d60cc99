"""A rigid body costs its contacts: its rig is kept with the mesh, and normals are computed where contacts lie."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import JointFreedom, Pose, Rig
from contact_core.solve.body import Body, PairedPoints
from contact_core.solve.penetration import PenetrationTerm
from contact_core.solve.problem import PoseProblem
from contact_core.solve.terms import paper_terms
from contact_core.testing import meshes, rigs
from contact_core.testing.strategies import cached_family, family_names


@given(family_names(), st.integers(0, 2**32 - 1), st.integers(0, 40))
def test_normals_at_vertices_are_the_normals_of_the_mesh(name: str, seed: int, count: int) -> None:
    """Whatever vertices, also some twice; also after the mesh has computed them all."""
    whole = cached_family(name)
    mesh = TriangleMesh(whole.points, whole.faces)
    vertices = np.random.default_rng(seed).integers(len(mesh.points), size=count)
    np.testing.assert_allclose(mesh.normals_at(vertices), whole.vertex_normals[vertices], rtol=0, atol=1e-15)
    assert "vertex_normals" not in vars(mesh)
    np.testing.assert_array_equal(whole.normals_at(vertices), whole.vertex_normals[vertices])


def test_a_vertex_without_faces_has_no_normal() -> None:
    mesh = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]], [[0, 1, 2]])
    np.testing.assert_array_equal(mesh.normals_at(np.array([3, 0])), [[0, 0, 0], [0, 0, 1]])
    np.testing.assert_array_equal(mesh.normals_at(np.array([3])), [[0, 0, 0]])


def written_out(name: str, mesh: TriangleMesh, *, movable: bool) -> Rig:
    """A rig of one joint, by the constructor, that knows nothing of the mesh: every normal and point is its own."""
    n, centre = len(mesh.points), np.eye(4)
    centre[:3, 3] = mesh.points.mean(axis=0)
    return Rig(
        name,
        (name,),
        np.array([-1]),
        centre[None],
        centre[None],
        mesh.points.copy(),
        mesh.faces.copy(),
        np.zeros((n, 1), np.int64),
        np.ones((n, 1)),
        (JointFreedom("ball" if movable else "fixed", translates=movable),),
    )


def problem(mesh: TriangleMesh, *, movable: bool, kept: bool) -> PoseProblem:
    """A hand with 60 contacts on an object, all terms."""
    hand, random = rigs.hand_like(), np.random.default_rng(5)
    ends = [
        SurfacePoints(random.integers(len(faces), size=60), random.dirichlet(np.ones(3), 60))
        for faces in (hand.faces, mesh.faces)
    ]
    placed = np.eye(4)
    placed[:3, 3] = [0.3, -0.2, 0.1]
    body = Body.rigid("object", mesh, world_from_surface=placed, movable=movable)
    if not kept:
        rig = written_out("object", mesh, movable=movable)
        body = Body("object", rig, Pose.rest(rig), placed)
    contact = PairedPoints("all", hand.name, ends[0], "object", ends[1])
    terms = (*paper_terms(), PenetrationTerm(resolution=16))
    return PoseProblem((Body.skinned(hand), body), (contact,), terms=terms)


@pytest.mark.parametrize("name", ["noisy", "torus", "saddle"])
@pytest.mark.parametrize("movable", [False, True])
def test_a_kept_body_gives_the_value_and_gradient_of_one_written_out(name: str, movable: bool) -> None:
    mesh = meshes.family(name)
    one, other = (problem(mesh, movable=movable, kept=kept) for kept in (True, False))
    theta = one.start + np.random.default_rng(2).normal(0.0, 0.2, len(one.start))
    states = [each.state(theta) for each in (one, other)]
    assert one.value(states[0]) == pytest.approx(other.value(states[1]), rel=1e-12)
    gradients = [each.gradient(state) for each, state in zip((one, other), states, strict=True)]
    np.testing.assert_allclose(*gradients, rtol=0, atol=1e-12 * np.abs(gradients[1]).max())


def test_a_second_solve_computes_nothing_of_the_whole_object() -> None:
    """Counted, not timed: the same rig, the mesh itself as its surface, and never all normals."""
    mesh = meshes.icosphere(3)
    first, second = (problem(mesh, movable=False, kept=True).bodies[1] for _ in range(2))
    assert first.rig is second.rig and first.rig.surface is mesh
    assert Body.rigid("object", mesh, movable=True).rig is not first.rig
    contacts_only = replace(problem(mesh, movable=False, kept=True), terms=paper_terms())
    contacts_only.value(contacts_only.start_state)
    assert "vertex_normals" not in vars(mesh)
