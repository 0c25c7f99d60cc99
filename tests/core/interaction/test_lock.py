"""Locked patches by events: no tool, no edit and no proposal changes them; unlocked they are as free as before."""

from __future__ import annotations

from typing import Any

import pytest

from contact_core.errors import CommandRejected
from contact_core.interaction.lock import Locks
from contact_core.testing.artist import Artist, ball_and_hand, paired
from tests.core.interaction.test_laws import EDITING, by, on_spot, path

_PLACES = ("place", "joint", "pair", "weigh")  # what they change is no patch


def patches(artist: Artist) -> Any:
    """The patches of the ball, and their shapes: the very objects."""
    document = artist.session.document
    return [(p, document.shapes[p.shape]) for p in document.patches.values() if p.surface == "ball"]


@pytest.mark.parametrize("tool", EDITING)
@pytest.mark.parametrize("kind", ["patch", "surface"])
def test_no_tool_changes_what_is_locked(tool: str, kind: Any) -> None:
    artist = ball_and_hand()
    pixels = path(artist, tool)
    artist.hands.take_up(tool)
    artist.hands.select("spot", surface="hand" if tool == "joint" else "ball")
    artist.hands.turn_lock(kind, "spot" if kind == "patch" else "ball")
    before, document = patches(artist), artist.session.document
    if artist.press(pixels[0]):
        for pixel in pixels[1:]:
            artist.move(pixel)
            artist.hands.advance()
        artist.release(pixels[-1])
    for was, now in zip(before, patches(artist), strict=False):
        assert was[0] is now[0] and was[1] is now[1]
    if tool not in _PLACES and not (kind == "patch" and tool == "transfer"):
        assert "locked" in artist.hands.status.refusal and artist.session.document is document
    elif tool == "transfer":
        assert len(patches(artist)) == len(before) + 1  # a copy leaves its source alone


def test_unlocked_it_moves_again_and_the_document_knows_of_no_lock() -> None:
    artist = ball_and_hand()
    artist.hands.take_up("move")
    artist.hands.select("spot")
    document = artist.session.document
    artist.key("Shift+L")
    assert artist.hands.desk.locks == Locks(patches=frozenset({"spot"})) and artist.session.document is document
    start = on_spot(artist)
    artist.drag(start, start + by(10.0, 5.0))
    assert artist.session.document is document
    artist.key("Shift+L")
    artist.drag(start, start + by(10.0, 5.0))
    assert artist.session.document is not document and not artist.hands.status.refusal


@pytest.mark.parametrize("key", ["Delete", "Ctrl+Delete", "M", "Shift+D", "Shift+W"])
def test_no_edit_changes_what_is_locked(key: str) -> None:
    artist = ball_and_hand()
    artist.hands.select("spot")
    artist.hands.turn_lock("patch", "spot")
    document = artist.session.document
    artist.key(key)
    assert "spot is locked" in artist.hands.status.refusal and artist.session.document is document


def test_a_partner_and_a_parent_do_not_change_it_either() -> None:
    artist = ball_and_hand()
    there = artist.point("ball", on_spot(artist) + by(60.0, 50.0))
    artist.session.patches.transfer("spot", "ball", there, direction=(0.0, 1.0, 0.0), name="near", mirrored=False)
    artist.session.patches.link("near", "spot")
    artist.hands.turn_lock("patch", "near")
    artist.hands.take_up("move")
    artist.hands.select("spot", surface="ball")
    document, start = artist.session.document, on_spot(artist)
    artist.drag(start, start + by(10.0, 5.0))
    assert artist.session.document is document and "near is locked" in artist.hands.status.refusal
    artist.key("Shift+W")
    assert artist.session.document is document and "near is locked" in artist.hands.status.refusal


def test_a_proposal_that_moves_it_is_not_shown() -> None:
    artist = paired()
    artist.hands.turn_lock("surface", "ball")
    document = artist.session.document
    artist.hands.do("pose.settle")
    while artist.hands.worker.status is not None:
        artist.hands.advance()
    moved = artist.hands.proposing.proposal is None
    assert artist.session.document is document
    assert moved == ("locked" in artist.hands.status.refusal)
    artist.hands.do("pose.solve")  # moves no contact
    while artist.hands.worker.status is not None:
        artist.hands.advance()
    artist.hands.do("edit.accept")
    assert artist.session.document.poses


def test_the_surface_by_the_key_and_names_that_are_not_there() -> None:
    artist = ball_and_hand()
    artist.hands.select(surface="hand")
    artist.key("Shift+L")
    assert artist.hands.desk.locks.surfaces == {"hand"}
    assert artist.hands.changes().parts >= {"visibility"}  # the tree is made again
    with pytest.raises(CommandRejected, match="nothing"):
        artist.hands.turn_lock("patch", "nothing")
    assert Locks(patches=frozenset({"a"})).renamed("a", "b").patches == {"b"}
