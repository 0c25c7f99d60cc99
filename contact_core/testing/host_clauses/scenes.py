"""Units, objects, surfaces and where they are."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from contact_core.errors import InvalidInput
from contact_core.testing.contract import needs
from contact_core.testing.host_checks import (
    ACCURACY,
    object_id,
    placement_error,
    same_triangles,
    surfaces_of,
    volume,
    world_error,
)
from contact_core.testing.host_clauses.ground import Build, HostGround
from contact_core.testing.host_scenes import STEP_AREA, STEP_VOLUME, contract_scene


class SceneClauses(HostGround):
    """Units, objects, surfaces and where they are."""

    def test_h01_says_its_units_and_axes(self, build: Build) -> None:
        """A host tells what it is, the scene's metres per unit and up axis, and its surfaces carry them."""
        for space in self.spaces:
            host = build(contract_scene(space))
            assert len(host.summary.split()) >= 3, host.summary
            said = host.space()
            assert (said.meters_per_unit, said.up_axis) == (pytest.approx(space.meters_per_unit), space.up_axis)
            asset = host.read_surface(object_id(host, "plain"))
            assert (asset.meters_per_unit, asset.up_axis) == (said.meters_per_unit, said.up_axis)

    def test_h02_lists_each_object_once(self, host: Any) -> None:
        """Every surface and rig is listed once under its name and a unique id; a rig's skin is not listed again."""
        scene = contract_scene(self.spaces[0])
        wanted = [(mesh.name, "surface") for mesh in scene.meshes] + [(rig.name, "rig") for rig in scene.rigs]
        listed = host.objects()
        assert sorted((item.name, item.kind) for item in listed) == sorted(wanted)
        assert len({item.id for item in listed}) == len(listed)
        assert host.objects() == listed

    def test_h03_reads_triangles(self, host: Any) -> None:
        """A triangle mesh comes with its own points, triangles and order, and maps that say so."""
        mesh = contract_scene(self.spaces[0]).meshes[0]
        asset = host.read_surface(object_id(host, mesh.name))
        np.testing.assert_allclose(asset.mesh.points, mesh.points, atol=1e-6)
        assert same_triangles(asset.mesh.faces, mesh.face_indices.reshape(-1, 3))
        np.testing.assert_array_equal(asset.source_vertices, np.arange(len(mesh.points)))
        np.testing.assert_array_equal(asset.source_faces, np.arange(len(mesh.face_sizes)))

    @needs("polygons")
    def test_h04_cuts_polygons_right(self, host: Any) -> None:
        """Concave polygons keep their area and sense, and each triangle names the polygon that it came from."""
        asset = host.read_surface(object_id(host, "step"))
        mesh = asset.mesh
        assert mesh.face_areas.sum() == pytest.approx(STEP_AREA, rel=ACCURACY)
        assert volume(mesh) == pytest.approx(STEP_VOLUME, rel=ACCURACY)
        assert np.bincount(asset.source_faces).tolist() == [4, 4, 2, 2, 2, 2, 2, 2]
        assert mesh.face_normals[asset.source_faces == 1][:, 2] == pytest.approx(1.0)

    def test_h05_leaves_motion_out_of_the_surface(self, host: Any) -> None:
        """Moving or turning an object changes its placement, which is rigid, and not its surface."""
        still, moved = object_id(host, "step"), object_id(host, "moved")
        assert host.read_surface(moved).mesh.digest == host.read_surface(still).mesh.digest
        assert placement_error(host, moved, contract_scene(self.spaces[0]).world_of("moved")) < ACCURACY

    def test_h06_applies_scale_to_the_surface(self, host: Any) -> None:
        """Scale and shear are in the surface, so that its lengths are the scene's."""
        mesh = host.read_surface(object_id(host, "scaled")).mesh
        assert volume(mesh) == pytest.approx(STEP_VOLUME * 2.0 * 3.0 * 0.5, rel=1e-4)
        assert world_error(host, "scaled", contract_scene(self.spaces[0])) < ACCURACY

    def test_h07_keeps_mirrored_surfaces_outward(self, host: Any) -> None:
        """A mirrored object is mirrored, and its triangles are counter-clockwise seen from outside all the same."""
        assert world_error(host, "mirrored", contract_scene(self.spaces[0])) < ACCURACY
        mesh = host.read_surface(object_id(host, "mirrored")).mesh
        assert volume(mesh) == pytest.approx(STEP_VOLUME * 1.5**3, rel=1e-4)

    @needs("parents")
    def test_h08_inherits_from_parents(self, host: Any) -> None:
        """What a parent does to an object is in its placement and surface."""
        assert world_error(host, "child", contract_scene(self.spaces[0])) < ACCURACY

    def test_h09_reads_the_same_again(self, build: Build) -> None:
        """Ids, point order and triangles are the same at each read and each opening of one scene."""
        first, second = (build(contract_scene(self.spaces[0])) for _ in range(2))
        assert [item.id for item in first.objects()] == [item.id for item in second.objects()]
        assert surfaces_of(first) == surfaces_of(second) == surfaces_of(second)

    def test_h10_refuses_unknown_ids_in_words(self, host: Any) -> None:
        """An id that does not exist is refused with a sentence that names it."""
        with pytest.raises(InvalidInput, match="no_such_object"):
            host.read_surface("no_such_object")

    def test_h11_needs_no_display(self, build: Build, monkeypatch: pytest.MonkeyPatch) -> None:
        """Everything works without a screen."""
        for variable in ("DISPLAY", "WAYLAND_DISPLAY"):
            monkeypatch.delenv(variable, raising=False)
        assert surfaces_of(build(contract_scene(self.spaces[0])))
