"""Faces without area: a sentence or a right answer, never NaN, never a hang.

Edges of no length are merged by the topology, faces with three corners on a line get a height where it matters
(docs/adr/0012), and every law goes on.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.errors import ContactError
from contact_core.geometry.exact_geodesics import log_map
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tracing import trace_chains, trace_geodesic
from contact_core.testing.strategies import cached_family, family_names, surface_points


def rounded(name: str, steps: int) -> TriangleMesh:
    """A family with its positions rounded to a coarse lattice: many faces collapse, none repeats a corner."""
    mesh = cached_family(name)
    return mesh.with_points(np.round(mesh.points * steps) / steps)


def with_collapsed_edges(name: str, seed: int, count: int = 6) -> TriangleMesh:
    """A family in which some edges have no length: two vertices each at one place, their faces without area."""
    mesh = cached_family(name)
    points = mesh.points.copy()
    random = np.random.default_rng(seed)
    free = np.ones(len(points), bool)
    for face in random.permutation(len(mesh.faces))[: 20 * count]:
        a, b, _ = mesh.faces[face]
        around = np.unique(mesh.faces[np.isin(mesh.faces, (a, b)).any(axis=1)])
        if free[around].all() and count:
            points[b] = points[a]
            free[around] = False
            count -= 1
    return mesh.with_points(points)


def with_corners_slid_onto_edges(name: str, seed: int, count: int = 20) -> TriangleMesh:
    """A family in which some vertices lie on the opposite edge of a face of theirs, or straight beyond its end."""
    mesh = cached_family(name)
    points = mesh.points.copy()
    random = np.random.default_rng(seed)
    free = np.ones(len(points), bool)
    for face in random.permutation(len(mesh.faces))[: 3 * count]:
        a, b, c = np.roll(mesh.faces[face], random.integers(3))
        if free[[a, b, c]].all():
            t = random.choice([0.5, 0.25, random.random(), 1.0 + random.random()])
            points[a] = (1.0 - t) * points[b] + t * points[c]
            free[mesh.faces[(mesh.faces == a).any(axis=1)]] = False
    return mesh.with_points(points)


def miss_of_exp_after_log(mesh: TriangleMesh, sources: SurfacePoints, targets: SurfacePoints) -> float:
    """The largest distance between a target and the end of the walk along its log, in diagonals."""
    log = log_map(mesh, sources, targets)
    end = trace_chains(mesh, sources[log.anchor], log.first_leg, log.offsets, log.turning_angles, log.lengths)
    miss = np.linalg.norm(end.points.positions(mesh) - targets.positions(mesh), axis=1)[log.anchor >= 0]
    return float(miss.max(initial=0.0)) / mesh.bounding_box_diagonal


def names_a_place(refusal: ContactError) -> bool:
    return any(word in str(refusal) for word in ("face", "edge", "vertex"))


@given(data=st.data(), name=family_names(without=("sliver",)), seed=st.integers(0, 2**32 - 1))
@settings(max_examples=60)
def test_log_then_exp_across_edges_without_length(data: st.DataObject, name: str, seed: int) -> None:
    mesh = with_collapsed_edges(name, seed)
    sources, targets = data.draw(surface_points(mesh, 2)), data.draw(surface_points(mesh, 4))
    try:
        log = log_map(mesh, sources, targets)
        end = trace_chains(mesh, sources[log.anchor], log.first_leg, log.offsets, log.turning_angles, log.lengths)
    except ContactError as refusal:
        assert names_a_place(refusal)
        return
    assert log.pops <= 60 * len(mesh.faces), (
        "the same light by several ways of one length goes on once, not doubling"
    )
    miss = np.linalg.norm(end.points.positions(mesh) - targets.positions(mesh), axis=1).max()
    assert miss <= 1e-7 * mesh.bounding_box_diagonal


@pytest.mark.parametrize("weights", [[0.2, 0.4, 0.4], [0.3, 0.3, 0.4], [0.4, 0.4, 0.2], [0.0, 0.8, 0.2]])
def test_a_walk_along_a_face_without_area_meets_the_vertex_ahead(weights: list[float]) -> None:
    """Found by `make explore`: the corners of face 4 lie on a line, and the way runs along it."""
    mesh = with_collapsed_edges("blocks", 820508)
    corners = mesh.points[mesh.faces[4]]
    assert np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0])) == 0.0
    inside, ends = SurfacePoints([4], [weights]), SurfacePoints([4, 4, 4, 0], [*np.eye(3), [1.0, 0.0, 0.0]])
    assert miss_of_exp_after_log(mesh, inside, ends) <= 1e-13


@given(data=st.data(), name=family_names(without=("sliver",)), seed=st.integers(0, 2**32 - 1))
@settings(max_examples=80)
def test_log_then_exp_across_faces_whose_corners_lie_on_a_line(data: st.DataObject, name: str, seed: int) -> None:
    mesh = with_corners_slid_onto_edges(name, seed)
    assert (
        miss_of_exp_after_log(mesh, data.draw(surface_points(mesh, 2)), data.draw(surface_points(mesh, 8))) <= 1e-7
    )


@given(data=st.data(), name=family_names(), steps=st.integers(2, 8), seed=st.integers(0, 2**32 - 1))
@settings(max_examples=60)
def test_laws_hold_on_collapsed_meshes_or_a_sentence_says_why_not(
    data: st.DataObject, name: str, steps: int, seed: int
) -> None:
    mesh = rounded(name, steps)
    starts, targets = data.draw(surface_points(mesh, 3)), data.draw(surface_points(mesh, 3))
    random = np.random.default_rng(seed)
    vectors = (random.standard_normal(3) + 1j * random.standard_normal(3)) * mesh.bounding_box_diagonal
    try:
        trace = trace_geodesic(mesh, starts, vectors)
        log = log_map(mesh, starts, targets)
    except ContactError as refusal:
        assert names_a_place(refusal)
        return
    assert miss_of_exp_after_log(mesh, starts, targets) <= 1e-7
    assert np.isfinite(trace.points.barycentric).all()
    np.testing.assert_allclose(np.abs(trace.headings), 1.0, atol=1e-9)
    assert np.isfinite(log.coordinates).all() and np.isfinite(log.headings).all()
    positions = starts.positions(mesh)
    reached = log.anchor >= 0
    chord = np.linalg.norm(targets.positions(mesh)[reached] - positions[log.anchor[reached]], axis=1)
    assert (chord <= log.distance[reached] + 1e-9 * mesh.bounding_box_diagonal).all()
