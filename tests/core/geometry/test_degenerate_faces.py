"""Faces without area (collapsed edges, three corners on a line): a sentence or a right answer, never a lie."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.errors import ContactError
from contact_core.geometry.exact_geodesics import log_map
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.tracing import trace_chains, trace_geodesic
from contact_core.testing.strategies import cached_family, family_names, surface_points


def rounded(name: str, steps: int) -> TriangleMesh:
    """A family with its positions rounded to a coarse lattice: many faces collapse, none repeats a corner."""
    mesh = cached_family(name)
    return mesh.with_points(np.round(mesh.points * steps) / steps)


@given(data=st.data(), name=family_names(), steps=st.integers(2, 8))
@settings(max_examples=40, deadline=None)
def test_log_then_exp_on_collapsed_meshes(data: st.DataObject, name: str, steps: int) -> None:
    mesh = rounded(name, steps)
    sources, targets = data.draw(surface_points(mesh, 2)), data.draw(surface_points(mesh, 4))
    try:
        log = log_map(mesh, sources, targets)
        assert np.isfinite(log.coordinates).all() and np.isfinite(log.headings).all()
        there = log.anchor >= 0
        if there.all():
            end = trace_chains(
                mesh, sources[log.anchor], log.first_leg, log.offsets, log.turning_angles, log.lengths
            ).points.positions(mesh)
            miss = np.linalg.norm(end - targets.positions(mesh), axis=1).max()
            assert miss <= 1e-7 * mesh.bounding_box_diagonal
    except ContactError as refusal:
        assert "face" in str(refusal) or "edge" in str(refusal) or "vertex" in str(refusal)


@given(data=st.data(), name=family_names(), steps=st.integers(2, 8), seed=st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_traces_on_collapsed_meshes_are_finite(data: st.DataObject, name: str, steps: int, seed: int) -> None:
    mesh = rounded(name, steps)
    starts = data.draw(surface_points(mesh, 3))
    random = np.random.default_rng(seed)
    vectors = (random.standard_normal(3) + 1j * random.standard_normal(3)) * mesh.bounding_box_diagonal
    try:
        trace = trace_geodesic(mesh, starts, vectors)
    except ContactError as refusal:
        assert "face" in str(refusal) or "edge" in str(refusal) or "vertex" in str(refusal)
        return
    assert np.isfinite(trace.points.barycentric).all()
    np.testing.assert_allclose(np.abs(trace.headings), 1.0, atol=1e-9)
