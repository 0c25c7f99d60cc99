"""The starter library: what is shipped is what the script makes, and each grasp in it is a grasp."""

from __future__ import annotations

import numpy as np
import pytest

from contact_core.grasp_files.grasp import HAND, OBJECT, prepare
from contact_core.grasp_files.starter import GraspType, starter_types
from contact_core.grasp_files.starter_making import made
from contact_core.library.starter import starter_library
from contact_core.library.verbs import apply_grasp
from contact_core.plugins.manager import PluginManager

TYPES = {one.name: one for one in starter_types()}
REMADE = ("lateral", "medium wrap", "tripod", "palmar pinch", "adduction grip")


def test_every_type_is_shipped_with_its_picture_and_no_other() -> None:
    library = starter_library()
    assert set(library.names()) == set(TYPES) and len(TYPES) >= 16
    assert len({one.number for one in TYPES.values()}) == len(TYPES)
    for entry in library.entries():
        assert entry.grasp is not None, entry.problem
        one = TYPES[entry.name]
        assert (entry.grasp.kind, entry.grasp.touching) == (one.kind, one.digits)
        assert f"type {one.number} " in entry.grasp.note and "starter" in entry.grasp.tags
        assert set(library.contacts(entry.name).patches) >= {pad.patch for pad in entry.grasp.pads}
        assert 5_000 < len(library.picture(entry.name) or b"") < 150_000


@pytest.mark.parametrize("one", [TYPES[name] for name in REMADE], ids=lambda t: t.name)
def test_what_is_shipped_is_what_the_script_makes(one: GraspType, plugins: PluginManager) -> None:
    shipped, again = starter_library().grasp(one.name), made(one, plugins)
    assert again.suggestion.is_grasp, again.suggestion.verdict.failures
    assert np.abs(again.grasp.placed - shipped.placed).max() < 1e-3
    assert np.abs(again.grasp.hand.pose.local - shipped.hand.pose.local).max() < 1e-2
    assert np.abs(again.grasp.seen - shipped.seen).max() < 1e-2
    assert [pad.patch for pad in again.grasp.pads] == [pad.patch for pad in shipped.pads]


def test_a_type_is_applied_to_what_it_was_not_made_with(plugins: PluginManager) -> None:
    session = prepare("sample:human_hand", "sample:baseball", 1.0, plugins).session
    (found,) = apply_grasp(session, starter_library(), "power sphere", HAND, OBJECT)
    assert found.suggestion.is_grasp, found.suggestion.verdict.failures
    assert found.unlike < 0.03
