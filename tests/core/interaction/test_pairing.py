"""Pairing without a drag: two selected patches, by a key."""

from __future__ import annotations

from contact_core.testing.artist import ball_and_hand
from tests.core.interaction.test_laws import by, on_spot


def test_two_selected_patches_are_paired_by_a_key() -> None:
    """What the tool does by a drag; whichever was selected first, the hand's comes first."""
    artist = ball_and_hand()
    artist.session.patches.transfer(
        "pad",
        "ball",
        artist.point("ball", on_spot(artist) + by(40.0, 30.0)),
        direction=(0.0, 1.0, 0.0),
        name="copy",
    )
    document = artist.session.document
    for wrong, words in ((("pad",), "but got 1"), (("spot", "copy"), "both are on one")):
        artist.hands.select(*wrong)
        artist.key("Ctrl+P")
        assert words in artist.hands.status.refusal and artist.session.document is document
    artist.hands.select("copy", "pad")
    artist.key("Ctrl+P")
    (pair,) = artist.session.document.pairs.values()
    assert (pair.manipulator, pair.object) == ("pad", "copy") and artist.hands.selection.patches == ("copy", "pad")
    artist.key("Ctrl+P")
    assert "paired already" in artist.hands.status.refusal
    artist.key("Ctrl+Z")
    assert artist.session.document is document
