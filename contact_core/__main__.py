"""The program `contact` from its first line on: Ctrl+C during the imports ends it without a traceback."""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType


def main() -> int:
    """Run `contact` with the arguments of the process; returns the exit code."""
    previous = signal.signal(signal.SIGINT, _leave)  # SIG_IGN where a shell script runs it in the background
    if previous is signal.SIG_IGN:
        signal.signal(signal.SIGINT, previous)
    sys.unraisablehook = _interrupt_again
    from contact_core.cli import main as run

    signal.signal(signal.SIGINT, previous)
    return run()


def _leave(number: int, frame: FrameType | None) -> None:
    """End at once: nothing has begun that would need an orderly end, and libraries are half imported."""
    os.write(2, b"contact: interrupted.\n")
    os._exit(130)


def _interrupt_again(unraisable: sys.UnraisableHookArgs) -> None:
    """Python drops an interrupt that falls into a weak reference's callback: it comes again a moment later."""
    if unraisable.exc_type is not KeyboardInterrupt:
        sys.__unraisablehook__(unraisable)
        return
    from threading import Timer

    again = Timer(0.02, _interrupt_main)
    again.daemon = True  # a program that ends meanwhile needs no interrupt
    again.start()


def _interrupt_main() -> None:
    """Interrupt the main thread, also where it sleeps or reads: a flag that is set wakes nobody."""
    from _thread import interrupt_main
    from threading import main_thread

    thread = main_thread().ident
    if sys.platform != "win32" and thread is not None:
        signal.pthread_kill(thread, signal.SIGINT)
    else:
        interrupt_main()


if __name__ == "__main__":
    sys.exit(main())
