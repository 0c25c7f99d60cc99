"""The library in the application: found by words, proposed and refused or kept, saved with a picture."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("vtkmodules")

from contact_core.errors import InvalidInput
from tests.adapters.viewer.test_viewer_application import painted, transferred
from tests.adapters.viewer.viewer_scenes import Hand, application


@pytest.fixture
def hand(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Hand]:
    monkeypatch.delenv("CONTACT_LIBRARY", raising=False)
    app = application(["sample:human_hand", "sample:mug"], tmp_path / "state")
    yield Hand(app)
    app.close()


def typed(hand: Hand, text: str) -> None:
    """Write into the prompt."""
    for letter in text:
        hand.event("KeyPressEvent", symbol=letter)


@pytest.mark.slow
def test_a_grasp_is_saved_found_refused_and_kept(hand: Hand) -> None:
    """From the keys of the plain window; the panel of the page calls the same."""
    app = hand.app
    painted(hand)
    transferred(hand)
    held = app.session.document
    hand.key("Ctrl+G")
    typed(hand, "+tea")
    hand.event("KeyPressEvent", symbol="comma")
    hand.key("Escape")
    app.shelves.save("tea", "kitchen, warm")
    hand.wait()
    assert "saved the grasp 'tea'" in app.line(), app.refusal()
    (row,) = app.shelves.find("KITCHEN tea")
    picture = app.shelves.picture(row["shelf"], row["name"])
    assert row["shelf"] == "own" and picture is not None and picture.startswith(b"\x89PNG")
    app.do("selection.clear")
    hand.key("Shift+R")
    hand.key("Ctrl+G")
    typed(hand, "te")
    assert hand.front.prompt is not None and "tea" in hand.front.prompt.shown()
    hand.key("Tab")
    assert hand.front.prompt.text == "tea"
    hand.key("Enter")
    for key, kept in (("Escape", False), ("Enter", True)):
        hand.wait()
        assert app.interaction.status.proposed and not app.session.document.pairs, app.refusal()
        hand.key(key)
        assert bool(app.session.document.pairs) == kept
        if not kept:
            app.shelves.apply("own", "tea")
    poses = [document.poses["human_hand"].local for document in (app.session.document, held)]
    np.testing.assert_allclose(*poses, atol=1e-9)  # on its own hand and object it is the same pose
    again, (hand_pad, _) = app.session.document, held.patches
    assert hand_pad in again.patches and len(again.pairs) == len(held.pairs)


def test_what_cannot_be_applied_or_saved_is_a_sentence(hand: Hand, tmp_path: Path) -> None:
    app = hand.app
    with pytest.raises(InvalidInput, match="fits none"):
        app.shelves.apply_best("no such grasp at all")
    with pytest.raises(InvalidInput, match="one grasp of the library, but fits"):
        app.shelves.apply_best("sphere")
    with pytest.raises(InvalidInput, match="no library"):
        app.shelves.apply("theirs", "tea")
    app.shelves.save("tea", "")
    hand.wait()
    assert "are paired, so there is no grasp to save" in app.refusal()
    (tmp_path / "state").mkdir(exist_ok=True)
    (tmp_path / "state" / "grasps").write_text("a file where the folder should be")
    assert len(app.shelves.rows()) >= 16  # the starter library all the same
    app.open(["sample:mug"])
    app.attempt(lambda: app.shelves.apply("starter", "power sphere"))
    assert "there is no hand here" in app.line()
