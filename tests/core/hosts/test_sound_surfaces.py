"""What a host gives is made sound as what a file gives is: outwards however it is wound, placed or mirrored."""

from __future__ import annotations

import numpy as np
import pytest

from contact_core.geometry.polar import split_world_from_local
from contact_core.geometry.report import report
from contact_core.scene.host import SceneSpace
from contact_core.scene.reading import surface_of_polygons
from contact_core.testing import meshes


@pytest.mark.parametrize("mirror", [False, True])
@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("inwards", [False, True])
def test_closed_objects_face_outwards(mirror: bool, clockwise: bool, inwards: bool) -> None:
    mesh = meshes.torus(12, 8)
    faces = mesh.faces[:, ::-1] if inwards != clockwise else mesh.faces
    world = np.diag([-2.0 if mirror else 2.0, 1.0, 1.0, 1.0])
    asset = surface_of_polygons(
        "ring",
        np.concatenate([mesh.points, [[9.0, 9, 9]]]),
        np.full(len(faces), 3),
        faces.ravel(),
        split_world_from_local(world),
        SceneSpace(1.0, "Y"),
        clockwise=clockwise,
    )
    assert np.isclose(report(asset.mesh).volume or 0.0, 2.0 * (report(mesh).volume or 0.0))
    assert any("turned round" in note for note in asset.notes) is inwards
    assert len(asset.mesh.points) == len(mesh.points) + 1  # loose points of the object keep their place
