"""Numbers on the command line. Python's own `float` takes "nan" and "inf", which no option means."""

from __future__ import annotations

import argparse
import math


def finite(text: str) -> float:
    """A finite number, for argparse's `type`. Raises ArgumentTypeError with a sentence."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise argparse.ArgumentTypeError(f"a finite number was expected, but got {text[:40]!r}; type one like 0.5.")
    return number
