"""A test that grows without bound fails by itself and leaves the machine alone."""

from __future__ import annotations

import sys

import numpy as np
import pytest


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits the address space of a process")
def test_more_memory_than_a_test_may_have_is_refused() -> None:
    with pytest.raises(MemoryError):
        np.empty(8 * 2**30, np.uint8)  # never touched: where there is no limit this costs nothing
