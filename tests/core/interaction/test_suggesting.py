"""Suggest: grasps looked for beside the window, shown as they come, stepped through, and one of them kept."""

from __future__ import annotations

import time

from contact_core.grasp_files.grasp import HAND, OBJECT, prepare
from contact_core.grasping.slots import GRASP_SAMPLERS
from contact_core.interaction.interaction import Interaction
from contact_core.interaction.view import Perspective
from contact_core.plugins.manager import PluginManager
from contact_core.testing.artist import Artist, ball_and_hand, shifted

VIEW = Perspective.looking_at((0.0, 0.08, 0.0), (0.0, 0.08, 1.0), viewport=(800, 600))


def looking() -> Artist:
    """An artist with the built-in hand and a ball, who has asked for two grasps and looks in few places."""
    session = prepare("sample:human_hand", "sample:baseball", 1.0, PluginManager()).session
    artist = Artist(session, Interaction(session), VIEW)
    artist.hands.set(suggestions=2)
    artist.hands.configure(GRASP_SAMPLERS, "around", places=30, most=160)
    assert artist.key("Shift+G") and artist.hands.worker.status is not None
    return artist


def wait_for(artist: Artist, count: int) -> None:
    """Frames go by until so many suggestions came, or the search is over."""
    end = time.monotonic() + 300.0
    while len(artist.hands.proposing.suggestions) < count and artist.hands.worker.status is not None:
        assert time.monotonic() < end
        artist.hands.worker.wait(0.02)
        artist.hands.advance()
    assert len(artist.hands.proposing.suggestions) >= count, artist.hands.status


def test_suggestions_are_shown_stepped_through_and_one_is_kept_as_one_step() -> None:
    artist = looking()
    hands, session, proposing = artist.hands, artist.session, artist.hands.proposing
    before, revision = session.document, session.revision
    wait_for(artist, 1)
    assert proposing.proposal is proposing.suggestions[0].proposal, "the first is shown when it comes"
    assert hands.desk.document is proposing.proposal.ghost and session.document is before
    assert hands.overlay().ghosts and "grasp 1 of" in hands.status.proposed
    wait_for(artist, 2)
    shown = []
    for key in ("Down", "Down", "Up"):
        artist.key(key)
        shown.append(proposing.proposal)
        assert hands.desk.document is proposing.proposal.ghost
    first, second = (one.proposal for one in proposing.suggestions)
    assert shown == [second, first, second] and session.document is before
    artist.key("Enter")
    assert session.revision == revision + 1 and session.document.pairs and HAND in session.document.poses
    assert session.document.poses[HAND] == second.ghost.poses[HAND]
    assert not proposing.suggestions and hands.worker.status is None and hands.status.proposed == ""
    artist.key("Ctrl+Z")
    assert session.document is before


def test_escape_ends_the_search_then_leaves_what_it_found() -> None:
    artist = looking()
    hands, session = artist.hands, artist.session
    before = session.document
    artist.key("Escape")
    assert hands.worker.status is None and not hands.status.refusal
    artist.key("Shift+G")
    wait_for(artist, 1)
    if hands.worker.status is not None:
        artist.key("Escape")
    assert hands.worker.status is None and len(hands.proposing.suggestions) >= 1, "what came stays"
    artist.key("Escape")
    assert hands.proposing.proposal is None and hands.desk.document is before and session.document is before
    artist.key("Down")
    assert "Suggest looks for some" in hands.status.refusal


def test_an_edit_meanwhile_ends_the_search() -> None:
    artist = looking()
    artist.session.surfaces.place(OBJECT, shifted(0.3, 0.0, 0.0))
    end = time.monotonic() + 300.0
    while artist.hands.worker.status is not None and time.monotonic() < end:
        artist.hands.worker.wait(0.02)
        artist.hands.advance()
    assert not artist.hands.proposing.suggestions and "has changed" in artist.hands.status.refusal


def test_what_cannot_be_meant_is_told() -> None:
    artist = ball_and_hand()
    artist.session.patches.remove("spot")
    artist.session.surfaces.remove("ball")
    artist.key("Shift+G")
    assert "no object" in artist.hands.status.refusal and artist.hands.worker.status is None
    artist = ball_and_hand()
    artist.session.surfaces.add("other", artist.session.geometry.mesh("ball"))
    artist.key("Shift+G")
    assert "select the object" in artist.hands.status.refusal
    artist.hands.select("spot")
    artist.key("Shift+G")
    assert not artist.hands.status.refusal and artist.hands.worker.status is not None
    artist.hands.close()
