"""One BLAS thread during a solve.

A solve is thousands of products of matrices of about a hundred rows. BLAS wakes a thread per core for each of
them, and on a machine that is doing something else they wait for one another: three to thirty times slower as
measured (docs/adr/0031).
"""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from functools import lru_cache
from typing import Any


@lru_cache(maxsize=1)
def _controller() -> Any:
    """What holds the BLAS libraries of this process; found once, in 20 ms. None without threadpoolctl."""
    try:
        from threadpoolctl import ThreadpoolController
    except ImportError:
        return None
    return ThreadpoolController()


def one_blas_thread() -> AbstractContextManager[Any]:
    """A context in which BLAS uses one thread; restores the number afterwards."""
    controller = _controller()
    return nullcontext() if controller is None else controller.limit(limits=1, user_api="blas")
