"""Ctrl+C and SIGTERM: who raised a KeyboardInterrupt, and an end that cleans up."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def noticing_interrupts() -> Iterator[Callable[[], bool]]:
    """Yields a function that tells whether a KeyboardInterrupt inside may come from the user.

    Code that raises one by itself is not the user. Where that cannot be known (outside the main thread, under the
    signal handler of a host program) the answer is yes. Signals go on to the handler that is installed.
    """
    previous = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or previous is None:
        yield lambda: True
        return
    came = False

    def notice(number: int, frame: FrameType | None) -> None:
        nonlocal came
        came = True
        if callable(previous):
            previous(number, frame)

    if callable(previous):
        signal.signal(signal.SIGINT, notice)
    try:
        yield lambda: came
    finally:
        if signal.getsignal(signal.SIGINT) is notice:
            signal.signal(signal.SIGINT, previous)


@contextmanager
def sigterm_as_interrupt() -> Iterator[Callable[[], bool]]:
    """SIGTERM inside does what Ctrl+C does, so that temporary files are removed.

    Yields a function that tells whether it came. For programs only: a library leaves the signals to its host.
    Nothing happens outside the main thread.
    """
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    came = False

    def terminate(number: int, frame: FrameType | None) -> None:
        nonlocal came
        came = True
        handler = signal.getsignal(signal.SIGINT)
        if callable(handler):
            handler(signal.SIGINT, frame)
        raise KeyboardInterrupt

    previous = signal.signal(signal.SIGTERM, terminate)
    try:
        yield lambda: came
    finally:
        signal.signal(signal.SIGTERM, previous if previous is not None else signal.SIG_DFL)
