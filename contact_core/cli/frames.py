"""Frames on the command line: 1,5,10-20."""

from __future__ import annotations

import math

from contact_core.errors import InvalidInput

MOST_FRAMES = 100_000  # in one range: an hour at 24 frames a second


def frames_of(text: str) -> tuple[float, ...]:
    """1,5,10-20 as numbers, rising, each once. Raises InvalidInput."""
    frames: set[float] = set()
    try:
        for part in text.split(","):
            first, dash, last = part.strip().partition("-")
            several = range(int(first), int(last) + 1) if dash and first else None
            if several is not None and not 0 < len(several) <= MOST_FRAMES:
                raise ValueError
            frames |= {float(part)} if several is None else set(map(float, several))
        if not all(map(math.isfinite, frames)):
            raise ValueError
    except (ValueError, OverflowError) as error:
        raise InvalidInput(
            f"frames are like 1,5,10-20, rising and at most {MOST_FRAMES} in a range, but got {text!r}."
        ) from error
    return tuple(sorted(frames))
