"""Playing a film: which frame is due now."""

from __future__ import annotations

import math

from contact_core.document.timeline import Timeline


class Playback:
    """Plays a range at its rate; frames that come too late are left out, so that the film keeps its time."""

    def __init__(self) -> None:
        self.loop = True
        self._since: tuple[float, float] | None = None

    @property
    def is_playing(self) -> bool:
        """Whether a film runs."""
        return self._since is not None

    def start(self, now: float, frame: float) -> None:
        """Play from a frame. now: seconds of any clock that runs evenly."""
        self._since = now, frame

    def stop(self) -> None:
        """Stay where it is."""
        self._since = None

    def frame(self, now: float, film: Timeline) -> float | None:
        """The whole frame that is due; None where nothing plays. Without the loop it ends with the film."""
        if self._since is None:
            return None
        began, first = self._since
        due = first + math.floor((now - began) * film.frames_per_second + 1e-9)
        if due <= film.last:
            return max(due, film.first)
        if not self.loop or film.last == film.first:
            self.stop()
            return film.last
        length = film.last - film.first + 1.0
        return min(film.first + (due - film.first) % length, film.last)
