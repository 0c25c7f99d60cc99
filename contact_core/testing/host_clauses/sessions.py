"""Sessions in the host: one step for document and scene, and nothing overwritten unseen."""

from __future__ import annotations

from typing import Any

import pytest

from contact_core.document.document import ContactDocument
from contact_core.edit.commands import SetPose
from contact_core.errors import CommandRejected, FileRefused
from contact_core.session import Session
from contact_core.testing.contract import needs
from contact_core.testing.host_checks import ACCURACY, object_id, pose_error
from contact_core.testing.host_clauses.ground import HostGround
from contact_core.testing.host_scenes import bent


class SessionClauses(HostGround):
    """Sessions in the host."""

    @needs("undo", "poses", "keys", "document")
    def test_h36_a_solve_is_one_undo(self, host: Any) -> None:
        """What a session accepts changes document, pose and keys in one step, which one undo takes back."""
        with Session(host=host, objects=["arm"], discover=False) as session:
            arm = object_id(host, "arm")
            rig, pose = session.rigs["arm"], bent(session.rigs["arm"], 6)
            before = self.scene_state(host), session.document, host.pose_keys(arm)
            session.do(SetPose("arm", pose, "Solve"), keys={4.0: {"arm": bent(rig, 7)}})
            after = self.scene_state(host), session.document
            assert host.pose_keys(arm) == (*before[2], 4.0)
            assert pose_error(host.read_pose(arm, 4.0), bent(rig, 7)) < ACCURACY
            assert host.undo()
            assert (self.scene_state(host), session.document) == before[:2]
            assert host.pose_keys(arm) == before[2]
            assert host.redo()
            assert (self.scene_state(host), session.document) == after

    @needs("document", "undo")
    def test_h37_two_sessions_lose_nothing(self, host: Any) -> None:
        """Two sessions in one scene: what one stored is never overwritten unseen, and both follow undo."""
        first, second = (Session(host=host, discover=False) for _ in range(2))
        first.set_extra("first", 1)
        with pytest.raises(CommandRejected, match="another session"):
            second.set_extra("second", 2)  # made on a document that is no longer there
        assert dict(second.document.extras) == {"first": 1}
        second.set_extra("second", 2)
        assert set(second.document.extras) == {"first", "second"}
        host.undo()
        assert set(first.document.extras) == set(second.document.extras) == {"first"}
        host.undo()
        assert set(first.document.extras) == set(second.document.extras) == set()
        host.redo()
        with pytest.raises(FileRefused, match="contacts of its own"):
            Session(ContactDocument(), host=host, discover=False)
        first.close()
        second.close()
