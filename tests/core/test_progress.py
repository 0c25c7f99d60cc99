"""Progress: what is told of a part is told of the whole, what cancels passes, and nobody misreads anybody."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from contact_core.errors import Cancelled
from contact_core.progress import NO_PROGRESS, CallbackProgress, Progress
from contact_core.scene.memory_host import MemoryHost
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.solver import SolveStatus
from contact_core.testing.solver_contract import small

SHARES = st.floats(0.0, 1.0)


class Told(Progress):
    def __init__(self) -> None:
        self.all: list[tuple[float | None, str]] = []

    def tell(self, fraction: float | None, text: str) -> None:
        self.all.append((fraction, text))


@given(st.lists(st.tuples(SHARES, SHARES), min_size=1, max_size=4), st.floats(-1.0, 2.0))
def test_parts_of_parts_stay_within_their_part(ranges: list[tuple[float, float]], fraction: float) -> None:
    told = Told()
    part: Progress = told
    low, high = 0.0, 1.0
    for start, end in ranges:
        part = part.part(min(start, end), max(start, end))
        low, high = low + (high - low) * min(start, end), low + (high - low) * max(start, end)
    part.tell(fraction, "so far")
    part.tell(None, "so far")
    (seen, _), (unknown, _) = told.all
    assert seen is not None and low - 1e-12 <= seen <= high + 1e-12
    assert unknown is None


def test_a_part_begins_and_ends_where_it_says_and_carries_its_label() -> None:
    told = Told()
    part = told.part(0.2, 0.6, "frame 3")
    part.tell(0.0, "iteration 1")
    part.part(0.5, 1.0, "again").tell(1.0, "")
    assert told.all == [(0.2, "frame 3: iteration 1"), (pytest.approx(0.6), "frame 3: again")]


def test_what_a_callback_returns_is_no_answer() -> None:
    for value in (True, False, None):
        CallbackProgress(lambda fraction, text, value=value: value).part(0.0, 0.5).tell(0.5, "solving")
    assert NO_PROGRESS.part(0.0, 1.0) is NO_PROGRESS


def test_a_hosts_progress_follows_a_solve_to_its_end_and_its_cancel_keeps_the_best() -> None:
    """Before, a host returned True to go on and a solver took it for a wish to stop, after one iteration."""
    host = MemoryHost()
    solution = LevenbergMarquardt().solve(small(), None, host.part(0.2, 0.6, "Solving"))
    assert solution.status is SolveStatus.CONVERGED and len(host.told) == len(solution.trace) > 5
    assert all(fraction is not None and 0.2 < fraction <= 0.6 for fraction, _ in host.told)
    host.cancel()
    stopped = LevenbergMarquardt().solve(small(), None, host)
    assert stopped.status is SolveStatus.CANCELLED and stopped.value <= stopped.start_value
    host.cancel()
    with pytest.raises(Cancelled, match="host"):
        host.tell(0.5, "solving")
