"""`contact warm-up`: compile the kernels ahead of time, so that the first edit does not wait."""

from __future__ import annotations

import argparse


class WarmUp:
    name = "warm-up"
    summary = "compile the geodesic kernels now; they are kept for this machine"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        """No options of its own."""

    def run(self, arguments: argparse.Namespace) -> int:
        from contact_core.geometry.warm_up import warm_up

        seconds = warm_up()
        arguments.output.answer({"seconds": seconds}, f"the kernels are ready ({seconds:.1f} s)")
        return 0
