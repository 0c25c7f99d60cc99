"""Selections, display, picking, progress and writing: what only some hosts have."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from contact_core.document.asset import Asset
from contact_core.errors import InvalidInput
from contact_core.geometry.raycast import Locator
from contact_core.testing.contract import needs
from contact_core.testing.host_checks import ACCURACY, object_id, picture_of
from contact_core.testing.host_clauses.ground import HostGround
from contact_core.testing.host_scenes import arm_rig, contract_scene


class ExtraClauses(HostGround):
    """Selections, display, picking, progress and writing: what only some hosts have."""

    @needs("selection")
    def test_h30_a_selection_becomes_points(self, host: Any) -> None:
        """A named selection of vertices gives surface points at just those vertices."""
        mesh = contract_scene(self.spaces[0]).meshes[1]
        step = object_id(host, mesh.name)
        assert "grip" in host.selections(step)
        points = host.selected_points(step, "grip").positions(host.read_surface(step).mesh)
        chosen = mesh.points[list(mesh.selections["grip"])]
        np.testing.assert_allclose(points[np.lexsort(points.T)], chosen[np.lexsort(chosen.T)], atol=1e-6)
        with pytest.raises(InvalidInput, match="no_such_selection"):
            host.selected_points(step, "no_such_selection")

    @needs("display")
    def test_h31_showing_changes_nothing(self, host: Any) -> None:
        """Drawing over the scene and clearing it leave the scene and its undo stack as they were."""
        before = self.scene_state(host)
        host.show(picture_of(host, "step"))
        host.show(None)
        assert self.scene_state(host) == before
        assert "undo" in self.cannot or not host.undo()

    @needs("picking")
    def test_h32_rays_go_where_the_pixels_look(self, host: Any) -> None:
        """Rays are unit; those through the middle meet what is shown, those at the rim do not; y is down."""
        picture = picture_of(host, "plain")
        host.show(picture)
        width, height = host.viewport
        origins, directions = host.rays([[width / 2, height / 2], [0.5, 0.5], [width - 0.5, height / 2]])
        np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, atol=1e-6)
        place = host.placement(object_id(host, "plain"))
        local = np.linalg.inv(place)
        hits = Locator(host.read_surface(object_id(host, "plain")).mesh).cast(
            origins @ local[:3, :3].T + local[:3, 3], directions @ local[:3, :3].T
        )
        assert (hits.faces >= 0).tolist() == [True, False, False]
        _, (above, below) = host.rays([[width / 2, 0.0], [width / 2, float(height)]])
        assert above @ picture.up > below @ picture.up

    @needs("progress")
    def test_h33_progress_asks_to_go_on(self, host: Any) -> None:
        """Telling progress changes nothing in the scene and answers whether to go on."""
        before = self.scene_state(host)
        assert all(host.progress(fraction, "solving") is True for fraction in (0.0, 0.5, 1.0))
        assert self.scene_state(host) == before

    @needs("writing")
    def test_h34_reads_what_it_wrote(self, host: Any) -> None:
        """An asset that a host adds comes back as the same triangles, or the same rig, in the scene's units."""
        space = host.space()
        half = Asset("made", arm_rig().surface, None, meters_per_unit=space.meters_per_unit / 2, up_axis="Y")
        place = contract_scene(self.spaces[0]).world_of("moved")
        made = host.add(half, place)
        mesh = host.read_surface(made).mesh
        np.testing.assert_array_equal(mesh.faces, half.mesh.faces)
        np.testing.assert_allclose(mesh.points, half.mesh.points / 2, atol=1e-5)
        assert np.abs(host.placement(made) - place).max() < ACCURACY
        rig = arm_rig()
        again = host.read_rig(host.add(Asset("made_arm", rig.surface, rig, meters_per_unit=space.meters_per_unit)))
        order = [again.rig.joint_index(name) for name in rig.joints]
        np.testing.assert_allclose(again.rig.rest_world[order], rig.rest_world, atol=1e-5)
        np.testing.assert_allclose(again.mesh.points, rig.surface.points, atol=1e-5)
