"""The engine contract on every engine that we ship."""

from __future__ import annotations

import pytest

from contact_core.geometry.engine import ExactEngine, GeodesicEngine
from contact_core.testing.engine_contract import EngineContract


class TestExactEngine(EngineContract):
    @pytest.fixture
    def engine(self) -> GeodesicEngine:
        return ExactEngine()


class TestVectorHeatEngine(EngineContract):
    cannot = {
        "never_shorter_than_the_chord": "beyond the cut locus its logarithm blends both sides and comes out short",
    }

    @pytest.fixture
    def engine(self) -> GeodesicEngine:
        pytest.importorskip("potpourri3d", reason="the vector-heat engine needs the extra `engines`")
        from contact_builtins.engines.vector_heat import VectorHeatEngine

        return VectorHeatEngine()
