"""One undo stack with the host."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from contact_core.testing.contract import needs
from contact_core.testing.host_checks import revision_of, surfaces_of
from contact_core.testing.host_clauses.ground import HostGround


class UndoClauses(HostGround):
    """One undo stack with the host."""

    @needs("undo")
    def test_h24_one_step_is_one_undo(self, host: Any) -> None:
        """All that a step wrote goes with one undo and comes back with one redo."""
        states = [self.scene_state(host)]
        for revision in (1, 2):
            self.write_step(host, revision)
            states.append(self.scene_state(host))
        for expected in (states[1], states[0]):
            assert host.undo()
            assert self.scene_state(host) == expected
        for expected in states[1:]:
            assert host.redo()
            assert self.scene_state(host) == expected

    @needs("undo")
    def test_h25_the_revision_goes_with_undo(self, host: Any) -> None:
        """Listeners hear of every undo and redo after it happened, and find the stored revision of that moment."""
        heard: list[int | None] = []
        stop = host.on_undo(lambda: heard.append(revision_of(host)))
        for revision in (1, 2, 3):
            self.write_step(host, revision)
        host.undo(), host.undo(), host.redo()
        assert heard == [2, 1, 2]
        stop()
        host.undo()
        assert heard == [2, 1, 2]

    @needs("undo")
    def test_h26_a_failed_step_leaves_nothing(self, host: Any) -> None:
        """After an exception inside a step nothing of it stays, in the scene or on the undo stack."""
        self.write_step(host, 1)
        before = self.scene_state(host)
        with pytest.raises(ZeroDivisionError), host.step("fails"):
            self.furnish(host)
            raise ZeroDivisionError
        assert self.scene_state(host) == before
        host.undo()
        assert revision_of(host) is None

    @needs("undo")
    def test_h27_the_stack_has_two_ends(self, host: Any) -> None:
        """Opening and reading leave nothing to undo; a new step leaves nothing to redo."""
        surfaces_of(host)
        assert not host.undo() and not host.redo()
        self.write_step(host, 1)
        host.undo()
        self.write_step(host, 2)
        assert not host.redo() and revision_of(host) == 2

    @needs("undo", "foreign_edits")
    def test_h28_foreign_edits_share_the_stack(self, host: Any) -> None:
        """Edits that the user makes with the host's own tools are steps between ours, and touch no document."""
        self.write_step(host, 1)
        ours = self.scene_state(host)
        self.foreign_edit(host)
        theirs = self.scene_state(host)
        assert theirs != ours and revision_of(host) == 1
        self.write_step(host, 2)
        host.undo()
        assert self.scene_state(host) == theirs
        host.undo()
        assert self.scene_state(host) == ours
        host.redo(), host.redo()
        assert revision_of(host) == 2

    @needs("undo")
    def test_h29_any_walk_through_undo_agrees(self, host: Any) -> None:
        """Random steps, undos, redos and foreign edits agree with a list of states after each."""
        rng = np.random.default_rng(20261122)
        foreign_too = not {"foreign_edits", "H28"} & set(self.cannot)
        states, at, before = [self.scene_state(host)], 0, ""
        for revision in range(1, 41):
            what = rng.choice(["step", "undo", "redo", "foreign"], p=[0.35, 0.3, 0.2, 0.15])
            if what == "undo":
                assert host.undo() == (at > 0)
                at = max(at - 1, 0)
            elif what == "redo":
                assert host.redo() == (at + 1 < len(states))
                at = min(at + 1, len(states) - 1)
            else:
                foreign = foreign_too and what == "foreign" != before  # two in a row may be one step
                what = "foreign" if foreign else "step"
                self.foreign_edit(host) if foreign else self.write_step(host, revision)
                states[at + 1 :] = [self.scene_state(host)]
                at += 1
            before = what
            assert self.scene_state(host) == states[at], (revision, what)
        assert [host.undo() for _ in range(at + 1)] == [True] * at + [False]
        assert self.scene_state(host) == states[0]
