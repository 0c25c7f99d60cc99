"""One grasp for all tests of the library: the built-in hand on the baseball, as it was suggested and accepted."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from contact_core.document.library import ContactSet
from contact_core.grasp_files.grasp import HAND, OBJECT, prepare
from contact_core.grasping.searching import GraspSettings
from contact_core.library.capture import captured
from contact_core.library.record import Grasp
from contact_core.library.verbs import library_scene
from contact_core.plugins.manager import PluginManager
from contact_core.session import Session

SETTINGS = GraspSettings(count=1, kinds=("power",), sampler_settings={"places": 60, "most": 320})


@pytest.fixture(scope="package")
def plugins() -> PluginManager:
    return PluginManager()


@pytest.fixture(scope="package")
def held(plugins: PluginManager) -> Iterator[Session]:
    """A session whose document holds a grasp; nothing edits it."""
    session = prepare("sample:human_hand", "sample:baseball", 1.0, plugins).session
    found = next(iter(session.suggest(HAND, OBJECT, settings=SETTINGS)))
    session.accept(found.proposal)
    yield session
    session.close()


@pytest.fixture(scope="package")
def saved(held: Session) -> tuple[Grasp, ContactSet]:
    return captured(library_scene(held, HAND, OBJECT), tags=("ball", "test"), note="a note")
