"""Selections, display, picking, progress and writing: what only some hosts have."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from contact_core.document.asset import Asset
from contact_core.errors import Cancelled, InvalidInput
from contact_core.geometry.raycast import Locator
from contact_core.geometry.transform import transform_points
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.solver import SolveStatus
from contact_core.testing import rigs
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
            transform_points(local, origins), directions @ local[:3, :3].T
        )
        assert hits.found.tolist() == [True, False, False]
        _, (above, below) = host.rays([[width / 2, 0.0], [width / 2, float(height)]])
        assert above @ picture.up > below @ picture.up

    @needs("progress")
    def test_h33_telling_changes_nothing(self, host: Any) -> None:
        """Telling progress, a fraction or none, changes nothing: neither the scene nor a solve that tells it."""
        before = self.scene_state(host)
        for fraction in (0.0, None, 0.5, 1.0):
            host.tell(fraction, "solving")
        problem = rigs.planted(rigs.tentacle(3), 0, contacts=30)[0]
        told = LevenbergMarquardt().solve(problem, None, host)
        untold = LevenbergMarquardt().solve(problem)
        assert (told.status, told.trace) == (untold.status, untold.trace)
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

    @needs("progress")
    def test_h35_cancel_stops_what_runs(self, host: Any) -> None:
        """After `cancel` the next thing told raises Cancelled, once; a solve ends with its best pose."""
        problem = rigs.planted(rigs.tentacle(3), 0, contacts=30)[0]
        host.cancel()
        stopped = LevenbergMarquardt().solve(problem, None, host)
        assert stopped.status is SolveStatus.CANCELLED and len(stopped.trace) == 1
        assert stopped.value <= stopped.start_value
        host.tell(0.5, "the next work")
        host.cancel()
        with pytest.raises(Cancelled):
            host.part(0.2, 0.6, "a part").tell(None, "solving")
