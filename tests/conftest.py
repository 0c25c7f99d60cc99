"""What every test may ask for."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
from hypothesis import settings

# A green commit stays green: the examples of a law are drawn by its own text, the same on every machine. New ones
# are sought by `make explore`; what it finds is mended, and kept by an example of its own. No example has a
# deadline: the first may compile a kernel, and speed is measured by benchmarks.
settings.register_profile("same", derandomize=True, deadline=None)
settings.register_profile("explore", derandomize=False, deadline=None, print_blob=True)
settings.load_profile("same")

pytest_plugins = ["pytester"]

REPOSITORY = Path(__file__).resolve().parents[1]
MOST_MEMORY = 8 * 2**30  # bytes of address space a process: what grows without bound fails its own test


def pytest_configure() -> None:
    """On Linux, a test that asks for too much memory gets a MemoryError, and the machine stays up."""
    if sys.platform == "linux":
        import resource

        soft, hard = resource.getrlimit(resource.RLIMIT_AS)
        if soft == resource.RLIM_INFINITY or soft > MOST_MEMORY:
            resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, hard))


@pytest.fixture(scope="session")
def repository() -> Path:
    """The root of the source tree."""
    return REPOSITORY


@pytest.fixture(scope="session")
def assets() -> Path:
    """The folder of real assets ($CONTACT_ASSETS, else ../shared/assets); skips where there is none."""
    places = [Path(os.environ["CONTACT_ASSETS"])] if os.environ.get("CONTACT_ASSETS") else []
    places.append(REPOSITORY.parent / "shared" / "assets")
    for place in places:
        if place.is_dir():
            return place
    pytest.skip("the real assets are not here: set CONTACT_ASSETS to their folder")
