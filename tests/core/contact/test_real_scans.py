"""The identity of transfer on real scans."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.session import Session

SCANS = ["stanford_bunny_35k", "stanford_bunny_7k_closed", "spot_cow", "ycb_baseball", "ycb_mug", "ycb_scissors"]


def read_obj(path: Path) -> TriangleMesh:
    """Triangles of an OBJ, polygons as fans."""
    points, faces = [], []
    for line in path.read_text().splitlines():
        if line.startswith("v "):
            points.append([float(x) for x in line.split()[1:4]])
        elif line.startswith("f "):
            corners = [int(part.split("/")[0]) - 1 for part in line.split()[1:]]
            faces += [[corners[0], corners[k], corners[k + 1]] for k in range(1, len(corners) - 1)]
    return TriangleMesh(points, faces)


@pytest.mark.assets
@pytest.mark.parametrize("name", SCANS)
def test_transfer_onto_the_same_scan_is_the_identity(assets: Path, name: str) -> None:
    """1e-9 of the bounding box, points bound round saddle vertices included."""
    mesh = read_obj(assets / "objects" / f"{name}.obj")
    centres = mesh.points[mesh.faces].mean(axis=1)
    random = np.random.default_rng(1)
    session = Session(discover=False)
    session.surfaces.add("scan", mesh)
    for number in range(3):
        centre = centres[random.integers(len(centres))]
        near = np.flatnonzero(np.linalg.norm(centres - centre, axis=1) < 0.06 * mesh.bounding_box_diagonal)
        points = SurfacePoints(random.choice(near, 150), random.dirichlet(np.ones(3), 150))
        patch = f"p{number}"
        try:
            session.patches.paint(patch, points, surface="scan", axis=points[[0, 50, 100]])
        except Exception as error:  # near a place that is not manifold a sentence is the right answer
            assert "manifold" in str(error) or "connected" in str(error) or "reach" in str(error), error
            continue
        root = session.geometry.root(patch)
        session.patches.transfer(
            patch, "scan", root.point(), heading=root.heading, name=f"{patch} again", mirrored=False
        )
        for copy in (patch, f"{patch} again"):
            moved = np.linalg.norm(session.geometry.points(copy).positions(mesh) - points.positions(mesh), axis=1)
            assert moved.max() <= 1e-9 * mesh.bounding_box_diagonal
    assert session.document.patches, "no patch of three could be painted"
