"""The viewer as a host: a memory host with a camera of VTK keeps every clause of the host contract."""

from __future__ import annotations

import pytest

from contact_core.testing.host_contract import Build, HostContract
from contact_core.testing.host_scenes import HostScene
from tests.contract.test_memory_host import NO_ANIMATION, build_in_memory

pytest.importorskip("vtkmodules")

from contact_viewer.host import ViewerHost


class TestViewerHost(HostContract):
    subject = "viewer"
    cannot = NO_ANIMATION

    @pytest.fixture
    def build(self) -> Build:
        def made(scene: HostScene) -> ViewerHost:
            host = build_in_memory(scene, ViewerHost)
            assert isinstance(host, ViewerHost)
            return host

        return made

    def foreign_edit(self, host: ViewerHost) -> None:
        farther = host.placement("plain").copy()
        farther[0, 3] += 1.0
        host.move("plain", farther)
