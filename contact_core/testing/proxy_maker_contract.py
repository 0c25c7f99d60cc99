"""The contract of proxy makers. Subclass it and give the fixture `maker`."""

from __future__ import annotations

import numpy as np
import pytest

from contact_core.errors import Cancelled, ContactError
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.report import report
from contact_core.plugins.slots import ProxyMaker
from contact_core.progress import NO_PROGRESS, CallbackProgress
from contact_core.testing import meshes
from contact_core.testing.broken_meshes import BROKEN
from contact_core.testing.contract import Contract, needs
from contact_core.testing.settings_checks import check_settings

NAMES = ("fin", "torn_knot", "shells")


def volume(mesh: TriangleMesh) -> float:
    a, b, c = (mesh.points[mesh.faces[:, k]] for k in range(3))
    return float(np.einsum("mi,mi->", a, np.cross(b, c))) / 6.0


class ProxyMakerContract(Contract):
    """Fixtures: `maker`, a ProxyMaker; `most_away`, how far from its proxy a mesh may lie, in shares of the
    diagonal of its box (5 % by default)."""

    about, letter = "proxy maker", "P"

    @pytest.fixture
    def most_away(self) -> float:
        return 0.05

    def test_p01_is_named(self, maker: ProxyMaker) -> None:
        """Has a name and says in a sentence what it does."""
        assert maker.name == maker.name.strip() != ""
        assert len(maker.summary.split()) >= 3, maker.summary

    @pytest.mark.parametrize("name", NAMES)
    def test_p02_is_a_closed_manifold(self, maker: ProxyMaker, name: str) -> None:
        """Of broken meshes it makes closed manifolds: each edge has two faces, and the outside is outside."""
        proxy = maker.make(BROKEN[name](), NO_PROGRESS)
        found = report(proxy)
        assert len(proxy.faces) > 0
        assert (len(found.non_manifold_edges), len(found.non_manifold_vertices), found.boundary_loops) == (0, 0, 0)
        assert volume(proxy) > 0.0, "a proxy is wound so that its faces look outwards"

    @pytest.mark.parametrize("name", NAMES)
    def test_p03_stays_near(self, maker: ProxyMaker, name: str, most_away: float) -> None:
        """Nine of ten points of the mesh lie no farther from its proxy than is promised (walls within it may), and
        none of the proxy leaves the mesh's box by more."""
        mesh = BROKEN[name]()
        proxy, most = maker.make(mesh, NO_PROGRESS), most_away * mesh.bounding_box_diagonal
        used = mesh.points[mesh.used_points]
        assert np.quantile(Locator.of(proxy).closest(used).distance, 0.9) <= most
        assert (proxy.points >= used.min(axis=0) - most).all() and (proxy.points <= used.max(axis=0) + most).all()

    def test_p04_gives_the_same_again(self, maker: ProxyMaker) -> None:
        """Equal meshes give equal proxies, to the bit: documents keep their digest alone."""
        one, other = BROKEN["fin"](), BROKEN["fin"]()
        assert maker.make(one, NO_PROGRESS).digest == maker.make(other, NO_PROGRESS).digest

    @pytest.mark.parametrize("scale", [1e-3, 250.0])
    def test_p05_knows_no_unit(self, maker: ProxyMaker, scale: float, most_away: float) -> None:
        """A mesh in other units gets its proxy in those units."""
        mesh = meshes.icosphere(3)
        here, there = (maker.make(mesh.with_points(s * mesh.points), NO_PROGRESS) for s in (1.0, scale))
        apart = Locator.of(here).closest(there.points / scale).distance.max()
        assert apart <= 0.2 * most_away * mesh.bounding_box_diagonal

    def test_p06_leaves_its_input_alone(self, maker: ProxyMaker) -> None:
        """The mesh is the same bits afterwards."""
        mesh = BROKEN["fin"]()
        before = mesh.points.tobytes(), mesh.faces.tobytes()
        maker.make(mesh, NO_PROGRESS)
        assert (mesh.points.tobytes(), mesh.faces.tobytes()) == before

    @needs("progress")
    def test_p07_can_be_stopped(self, maker: ProxyMaker) -> None:
        """Tells how far it is, and raises Cancelled where that does."""

        def stop(fraction: float | None, text: str) -> None:
            raise Cancelled("enough")

        with pytest.raises(Cancelled):
            maker.make(meshes.icosphere(3), CallbackProgress(stop))

    def test_p08_refuses_what_has_no_extent(self, maker: ProxyMaker) -> None:
        """A mesh without faces, and one that is a point, are refused in a sentence."""
        nothing = TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3), int))
        point = TriangleMesh(np.zeros((3, 3)), np.array([[0, 1, 2]]))
        for mesh in (nothing, point):
            with pytest.raises(ContactError) as refusal:
                maker.make(mesh, NO_PROGRESS)
            assert len(str(refusal.value).split()) >= 4, str(refusal.value)

    def test_p09_declares_its_settings(self, maker: ProxyMaker) -> None:
        """Its settings say unit, range and help; a value out of range and a name it does not know are refused."""
        check_settings(maker)
