"""What the outside names refuse: a wrong argument is a sentence, never a traceback or an endless search."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from contact_core.errors import InvalidInput
from contact_core.geometry import SurfacePoints, TriangleMesh, log_map, trace_geodesic
from contact_core.testing import meshes

P = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]
BALL = meshes.icosphere(1)
HERE = SurfacePoints([0], [[0.2, 0.3, 0.5]])
NOWHERE = SurfacePoints([len(BALL.faces)], [[0.2, 0.3, 0.5]])

MISTAKES: dict[str, tuple[Callable[[], object], str]] = {
    "complex positions": (lambda: TriangleMesh(np.array(P) * 1j, [[0, 1, 2]]), "points must hold real numbers"),
    "complex faces": (lambda: TriangleMesh(P, np.array([[0, 1, 2]]) * 1j), "faces must hold real numbers"),
    "fractions of faces": (lambda: TriangleMesh(P, [[0.5, 1, 2]]), "whole numbers"),
    "a face too far": (lambda: TriangleMesh(P, [[0, 1, 3]]), "face 0 is"),
    "no numbers": (lambda: TriangleMesh("abc", [[0, 1, 2]]), "array of numbers"),
    "a mesh that vanishes when squared": (lambda: TriangleMesh(np.array(P) * 1e-150, [[0, 1, 2]]), "another unit"),
    "a mesh that overflows when squared": (lambda: TriangleMesh(np.array(P) * 1e160, [[0, 1, 2]]), "another unit"),
    "barycentrics that do not sum to one": (lambda: SurfacePoints([0], [[0.2, 0.3, 0.4]]), "sum to 1"),
    "nothing as a mesh": (lambda: log_map(None, HERE, HERE), "must be a TriangleMesh"),  # type: ignore[arg-type]
    "points as a mesh": (lambda: trace_geodesic([[0.0]], HERE, [1.0]), "must be a TriangleMesh"),  # type: ignore[arg-type]
    "a tuple as sources": (lambda: log_map(BALL, ([0], [[0.2, 0.3, 0.5]]), HERE), "sources must be SurfacePoints"),  # type: ignore[arg-type]
    "a number as targets": (lambda: log_map(BALL, HERE, 3), "targets must be SurfacePoints"),  # type: ignore[arg-type]
    "a source outside": (lambda: log_map(BALL, NOWHERE, HERE), "sources must lie in faces"),
    "a distance in words": (lambda: log_map(BALL, HERE, HERE, max_distance="far"), "but is 'far'"),  # type: ignore[arg-type]
    "distances": (lambda: log_map(BALL, HERE, HERE, max_distance=[1.0]), r"but is \[1.0\]"),  # type: ignore[arg-type]
    "a number as a start": (lambda: trace_geodesic(BALL, 3, [1.0]), "starts must be SurfacePoints"),  # type: ignore[arg-type]
    "a vector in words": (lambda: trace_geodesic(BALL, HERE, ["north"]), "vectors must be"),
    "no vector": (lambda: trace_geodesic(BALL, HERE, None), "vectors must be"),
    "ragged vectors": (lambda: trace_geodesic(BALL, HERE, [[1, 2], [3]]), "vectors must be"),
    "a vector without end": (lambda: trace_geodesic(BALL, HERE, [1e300]), "far too great"),
}  # fmt: skip


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_wrong_argument_is_a_sentence(mistake: str) -> None:
    make, says = MISTAKES[mistake]
    with pytest.raises(InvalidInput, match=says):
        make()


@pytest.mark.parametrize("scale", [1e-50, 1e-9, 1e9, 1e50])
def test_geodesics_scale_with_the_unit(scale: float) -> None:
    """From atoms to galaxies: the same distances and the same ends, in the other unit."""
    there = SurfacePoints([7, 30], [[0.2, 0.3, 0.5], [1.0, 0.0, 0.0]])
    scaled = TriangleMesh(BALL.points * scale, BALL.faces)
    np.testing.assert_allclose(
        log_map(scaled, HERE, there).distance / scale, log_map(BALL, HERE, there).distance, rtol=1e-9
    )
    ends = [trace_geodesic(mesh, HERE, [unit * (1 + 2j)]).points for mesh, unit in ((scaled, scale), (BALL, 1.0))]
    np.testing.assert_allclose(ends[0].positions(BALL), ends[1].positions(BALL), atol=1e-9)
