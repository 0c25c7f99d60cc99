"""Patches traced together are bitwise those that are reconstructed one by one, in fewer walks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from contact_core.contact import tracer
from contact_core.contact.axis import draw_axis
from contact_core.contact.patch import parameterize_patch, reconstruct_patch
from contact_core.contact.placement import Root
from contact_core.contact.shape import PatchShape
from contact_core.contact.tracer import PatchTracer, ShapedPatch
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.testing import meshes

MESHES: dict[str, Callable[[], TriangleMesh]] = {
    "sphere": meshes.icosphere, "saddle": meshes.saddle, "torus": meshes.torus, "with holes": meshes.with_holes,
}  # fmt: skip


def points_on(mesh: TriangleMesh, count: int, seed: int) -> SurfacePoints:
    random = np.random.default_rng(seed)
    return SurfacePoints(random.integers(0, len(mesh.faces), count), random.dirichlet(np.ones(3), count))


def shaped(mesh: TriangleMesh, picks: int, seed: int, count: int = 40) -> ShapedPatch:
    """A patch round an axis through random picks; one pick has a heading instead."""
    heading = np.exp(0.7j) if picks == 1 else None
    shape, axis = draw_axis(mesh, points_on(mesh, picks, seed), heading)
    points = SurfacePoints.concatenate([points_on(mesh, count, seed + 100), axis.points[:2]])
    return ShapedPatch(PatchShape(shape, parameterize_patch(mesh, axis, points), np.ones(len(points))))


@pytest.mark.parametrize("name", list(MESHES))
def test_together_as_one_by_one(name: str) -> None:
    """Axes of one point and of many, mirrored, scaled, other units; points on the axis, bent paths, boundaries."""
    mesh = MESHES[name]()
    patches = [shaped(mesh, 1, 0), shaped(mesh, 3, 1), shaped(mesh, 2, 2), shaped(mesh, 2, 3, count=0)]
    patches[1] = replace(patches[1], axis=patches[1].shape.axis.transformed(mirrored=True, unit=0.6))
    patches[2] = replace(patches[2], axis=replace(patches[2].shape.axis, along=1.3, spread=0.7, mirrored=True))
    roots, headings = points_on(mesh, len(patches), 9), np.exp(1j * np.arange(len(patches)))
    together = PatchTracer(mesh, patches)
    found = together.trace(roots, headings)
    for i, patch in enumerate(patches):
        alone = reconstruct_patch(mesh, patch.shape, Root.at(roots[i], complex(headings[i])), patch.axis)
        rows = together.patch_of_point == i
        assert found.points[rows].same_as(alone.points)
        anchors = patch.shape.coordinates.anchors
        walked = patch.shape.coordinates.legs != 0.0
        assert np.array_equal(found.headings[rows], np.where(walked, alone.headings, alone.axis.tangents[anchors]))


def test_the_number_of_batches_does_not_grow_with_the_patches(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh, calls = meshes.icosphere(), []
    trace = tracer.trace_chains

    def counted(*given: Any, **more: Any) -> Any:
        calls.append(len(given[1]))
        return trace(*given, **more)

    monkeypatch.setattr(tracer, "trace_chains", counted)
    for count in (1, 6):
        patches = [shaped(mesh, 2, seed) for seed in range(count)]
        PatchTracer(mesh, patches).trace(points_on(mesh, count, 9), np.ones(count, complex))
    assert len(calls) == 4
