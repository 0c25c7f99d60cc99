"""What a host promises. The numbered clauses stand in `adapters/README.md`; a subject gives one fixture.

class TestMyHost(HostContract):
    cannot = {"undo": "a renderer has none"}

    @pytest.fixture
    def build(self, tmp_path): return lambda scene: MyHost.on(native_scene_of(scene))
"""

from __future__ import annotations

from contact_core.testing.contract import Contract
from contact_core.testing.host_clauses.animation import AnimationClauses
from contact_core.testing.host_clauses.documents import DocumentClauses
from contact_core.testing.host_clauses.extras import ExtraClauses
from contact_core.testing.host_clauses.ground import Build
from contact_core.testing.host_clauses.orders import OrderClauses
from contact_core.testing.host_clauses.rigs import RigClauses
from contact_core.testing.host_clauses.scenes import SceneClauses
from contact_core.testing.host_clauses.sessions import SessionClauses
from contact_core.testing.host_clauses.undo import UndoClauses

__all__ = ["Build", "HostContract"]


# pytest collects the bases from the last to the first, so this is the order of the clauses' numbers.
class HostContract(
    AnimationClauses,
    OrderClauses,
    SessionClauses,
    ExtraClauses,
    UndoClauses,
    DocumentClauses,
    RigClauses,
    SceneClauses,
    Contract,
):
    """Fixture `build(scene)`: a host on a natively made scene. spaces: units and axes that the host can have."""

    about, letter = "host", "H"
