"""The contract of proxy makers on the one that we ship."""

from __future__ import annotations

import pytest

from contact_builtins.proxies.level_set import LevelSetProxy
from contact_core.testing.proxy_maker_contract import ProxyMakerContract


class TestLevelSet(ProxyMakerContract):
    @pytest.fixture
    def maker(self) -> LevelSetProxy:
        pytest.importorskip("manifold3d", reason="proxies need the extra `samples`")
        return LevelSetProxy(offset=0.03)
