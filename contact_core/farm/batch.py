"""A batch: find the jobs, leave out what is done, run the rest, and report. `contact batch` and scripts call it."""

from __future__ import annotations

import errno
import json
import os
import tempfile
import time
from collections import Counter, deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from contact_core._version import __version__
from contact_core.atomic_file import write_atomic
from contact_core.atomic_set import check_writable, replacing_set
from contact_core.document.lock import DocumentLock
from contact_core.errors import FileRefused, InvalidInput
from contact_core.farm.inputs import Digests
from contact_core.farm.jobs import SUMMARY, FoundJob, find_jobs
from contact_core.farm.page import page_of
from contact_core.farm.task import RECEIPT, Result, Task, earlier, key_of, read_receipt, too_long
from contact_core.farm.workers import LocalWorkers, Workers
from contact_core.plugins.registry import JOB_KINDS, POSE_SOLVERS
from contact_core.progress import NO_PROGRESS, Progress

if TYPE_CHECKING:
    from contact_core.plugins.manager import PluginManager

PAGE = "report.html"
SCHEMA, VERSION = "contact.batch", 1
RETRIES = 2
SEARCHED = ("CONTACT_ASSETS", "PXR_AR_DEFAULT_SEARCH_PATH")  # variables that say where assets are sought
_GRACE_S = 10.0  # after its limit, a job that does not look at its progress is ended with its worker
_LOOK_S = 0.5  # how often progress is told while nothing ends
_PAUSE_S = 1.0  # after a disk failed: longer than mounts believe what they know of a folder
_AWAY_S = 900.0  # that a server may be away
_AWAY = {
    errno.EIO, errno.ESTALE, errno.ENOTCONN, errno.ECONNREFUSED, errno.ECONNABORTED, errno.ECONNRESET,
    errno.EHOSTUNREACH, errno.ENETDOWN, errno.ENETUNREACH, errno.ETIMEDOUT, getattr(errno, "EHOSTDOWN", errno.EIO),
}  # fmt: skip


@dataclass(frozen=True)
class BatchSettings:
    """How to run a batch. frames, solver, assets: as in JobRequest.

    retries: further attempts after a worker died, or a disk failed. limit: seconds for one job. again: whether jobs
    that are done are done again.
    """

    frames: tuple[float, ...] | None = None
    solver: str | None = None
    assets: Path | None = None
    retries: int = RETRIES
    limit: float | None = None
    again: bool = False

    def __post_init__(self) -> None:
        if not 0 <= self.retries <= 1000:
            raise InvalidInput(f"retries are from 0 to 1000, but got {self.retries}.")
        if self.limit is not None and not 0.0 < self.limit < 1e9:
            raise InvalidInput(f"a limit is a number of seconds above 0, but got {self.limit}.")


@dataclass(frozen=True)
class BatchResult:
    """What a batch came to: the results worst first, the seconds it took, and its two files."""

    results: tuple[Result, ...]
    seconds: float
    page: Path
    summary: Path
    facts: Mapping[str, Any] = field(repr=False)

    def count(self, *states: str) -> int:
        """How many results are in one of these states."""
        return sum(result.state in states for result in self.results)

    @property
    def is_done(self) -> bool:
        """Whether every job has a result, good or bad."""
        return self.count("failed", "stopped") == 0


def run_batch(
    sources: Iterable[Path | str],
    out: Path | str,
    settings: BatchSettings | None = None,
    *,
    plugins: PluginManager | None = None,
    workers: Workers | None = None,
    progress: Progress = NO_PROGRESS,
) -> BatchResult:
    """Run jobs (see `jobs.find_jobs`) and write results and report into `out`; the workers are stopped at the end.

    A job whose receipt in `out` fits its files and settings is not run. workers: those of this machine by default,
    which find plugins that are installed or in CONTACT_PLUGINS. Where progress raises Cancelled, or at Ctrl+C,
    workers are ended and the report is written of what there is. Raises FileRefused, InvalidInput, Cancelled. A
    program that calls it needs `if __name__ == "__main__":`, because worker processes import it.
    """
    from contact_core.plugins.manager import PluginManager

    began, settings, out = time.monotonic(), settings or BatchSettings(), Path(out)
    workers, plugins = workers or LocalWorkers(), plugins or PluginManager()
    run = _Run(settings, workers, progress, out)
    try:
        progress.tell(None, "Looking for jobs")
        if settings.solver is not None:
            plugins.get(POSE_SOLVERS, settings.solver)
        jobs = find_jobs(sources, plugins.offers(JOB_KINDS), out)
        tasks = _tasks(jobs, out, settings, plugins)
        with _alone(out):  # from here on the folder exists; a batch without jobs leaves none
            run.leave_out(tasks)
            try:
                run.work()
            finally:
                workers.stop()
                result = _written(run, tasks, out, time.monotonic() - began)
    finally:
        workers.stop()
    return result


def _tasks(jobs: Sequence[FoundJob], out: Path, settings: BatchSettings, plugins: PluginManager) -> list[Task]:
    assets = None if settings.assets is None else str(settings.assets.absolute())
    roots = [os.environ.get(name) for name in SEARCHED]  # another folder may hold another version of every asset
    options = {"frames": settings.frames, "solver": settings.solver, "assets": assets, "roots": roots}
    keys = {kind: key_of(kind, options, plugins) for kind in {job.kind for job in jobs}}
    return [
        Task(
            job.name, job.kind, str(job.path), str(out.absolute() / job.name), keys[job.kind], settings.frames,
            settings.solver, assets, settings.limit,
        )
        for job in jobs
    ]  # fmt: skip


@contextmanager
def _alone(out: Path) -> Iterator[None]:
    """One batch in a folder at a time. Raises FileRefused that names the other."""
    check_writable(out, (SUMMARY, PAGE))
    lock = DocumentLock.take(out / SUMMARY)
    if isinstance(lock, str):
        raise FileRefused(f"no batch can run in {out}: {lock}. Wait for the other to end, or name another folder.")
    try:
        yield
    finally:
        lock.release()


class _Run:
    """A batch while it runs."""

    def __init__(self, settings: BatchSettings, workers: Workers, progress: Progress, out: Path) -> None:
        self.settings, self.workers, self.progress, self.out = settings, workers, progress, out
        self.results: dict[str, Result] = {}
        self._waiting: deque[Task] = deque()
        self._running: dict[Future[Result], Task] = {}
        self._ends: dict[Future[Result], float] = {}
        self._killed: set[Future[Result]] = set()
        self._attempts: Counter[str] = Counter()
        self._total = 0
        self._look_again: float | None = None  # when, after a disk failed
        self._away_since: float | None = None
        self.words = workers.words

    def leave_out(self, tasks: Sequence[Task]) -> None:
        """Take the results that are there already; the rest waits to be run."""
        digests = Digests()
        self._total = len(tasks)
        for task in tasks:
            self.progress.tell(None, f"Looking at {task.name}")
            known = None if self.settings.again else earlier(task, digests)
            if known is None:
                self._waiting.append(task)
            else:
                self.results[task.name] = known

    def work(self) -> None:
        """Run what waits, until everything has ended. Raises Cancelled, FileRefused."""
        while self._waiting or self._running:
            if self._waiting and self._may_start():
                while self._waiting and self.workers.free > 0:
                    self._start(self._waiting.popleft())
            elif not self._running:
                time.sleep(_LOOK_S)
            ended, _ = wait(self._running, timeout=_LOOK_S, return_when=FIRST_COMPLETED)
            for future in ended:
                self._end(future)
            self._end_overdue()
            self.workers.check()
            self._tell()

    def _may_start(self) -> bool:
        """Whether there is somewhere to write results. Raises FileRefused where a server is away for too long."""
        now = time.monotonic()
        if self._look_again is None or now < self._look_again:
            return self._look_again is None
        trouble = _trouble_with(self.out)
        if trouble is None:
            self._look_again = self._away_since = None
            return True
        self._look_again = now + _PAUSE_S
        self._away_since = now if self._away_since is None else self._away_since
        if now - self._away_since > _AWAY_S:
            raise FileRefused(f"{self.out} did not answer for {_AWAY_S / 60:g} minutes: {trouble}.")
        return False

    def _start(self, task: Task) -> None:
        self._attempts[task.name] += 1
        future = self.workers.submit(task)
        self._running[future] = task
        if task.limit is not None:
            self._ends[future] = time.monotonic() + task.limit + _GRACE_S

    def _end(self, future: Future[Result]) -> None:
        task = self._running.pop(future)
        self._ends.pop(future, None)
        self.workers.done(future)
        attempts = self._attempts[task.name]
        result = replace(self._result_of(future, task), attempts=attempts)
        if result.again and result.worker:  # which lived to say what failed: a disk, or its memory
            self._look_again = time.monotonic() + _PAUSE_S
            if _trouble_with(self.out) is not None:  # no fault of the job
                self._attempts[task.name] -= 1
                self._waiting.append(task)
                return
        if result.again and attempts <= self.settings.retries:
            self._waiting.append(task)
        else:
            self.results[task.name] = result

    def _result_of(self, future: Future[Result], task: Task) -> Result:
        if future in self._killed:
            return Result(task.name, "failed", too_long(task.limit or 0.0))
        died = None if not future.cancelled() else "the scheduler let go of it"
        if died is None and (error := future.exception()) is not None:
            died = f"its worker died ({type(error).__name__}): killed, or out of memory"
        if died is not None:
            times = self._attempts[task.name]
            return Result(task.name, "failed", f"{died}, {times} time{'s' * (times > 1)}.", again=True)
        result = future.result()
        if result.state == "done" and read_receipt(Path(task.folder)) is None:
            lost = (
                f"{result.worker} wrote its results into {task.folder}, but this machine does not see them there:"
                " the folder must lie on storage that all workers share."
            )
            return Result(task.name, "failed", lost)
        return result

    def _end_overdue(self) -> None:
        """A limit of Dask's is what the job's own progress keeps."""
        now = time.monotonic()
        for future in [future for future, end in self._ends.items() if now > end]:
            del self._ends[future]
            if self.workers.kill(future):
                self._killed.add(future)

    def _tell(self) -> None:
        ended, failed = len(self.results), sum(r.state == "failed" for r in self.results.values())
        self.words = self.workers.words
        text = f"{ended} of {self._total} jobs" + (f", {failed} failed" if failed else "")
        at_work = ", ".join(task.name for _, task in zip(range(3), self._running.values(), strict=False))
        doing = f"{self.words}: {at_work or 'idle'}"
        if self._away_since is not None and not self._running:
            doing = f"waiting for {self.out}, which does not answer"
        self.progress.tell(ended / max(self._total, 1), f"{text}; {doing}")


def _trouble_with(folder: Path) -> str | None:
    """What the system says of a folder whose server does not answer, None where it does.

    Looking at it is not enough: what is remembered of a folder may be older than the end of its server.
    """
    try:
        with tempfile.NamedTemporaryFile(prefix=".contact-probe-", dir=folder):
            return None
    except OSError as error:  # where it is full, write-protected or gone, waiting helps nobody
        return (error.strerror or str(error)) if error.errno in _AWAY else None


def _written(run: _Run, tasks: Sequence[Task], out: Path, seconds: float) -> BatchResult:
    """Write report and summary together, of all that is known."""
    digests = Digests()  # where it was stopped, a job may have ended that nobody has heard of
    results = [run.results.get(task.name) or earlier(task, digests) or _not_run(task) for task in tasks]
    ranked = tuple(sorted(results, key=_rank))
    facts = _facts(ranked, {task.name: task for task in tasks}, seconds, run.words)
    with replacing_set(out, (SUMMARY, PAGE)) as stage:
        write_atomic(stage / SUMMARY, json.dumps(facts, indent=1, allow_nan=False) + "\n")
        write_atomic(stage / PAGE, page_of(ranked, facts))
    return BatchResult(ranked, seconds, out / PAGE, out / SUMMARY, facts)


def _not_run(task: Task) -> Result:
    return Result(task.name, "stopped", "it was not run.")


def _rank(result: Result) -> tuple[int, float, str]:
    """Failed first, then what was not run, then the worst grasps."""
    return {"failed": 0, "stopped": 1}.get(result.state, 2), -result.badness, result.name


def _facts(results: Sequence[Result], tasks: Mapping[str, Task], seconds: float, workers: str) -> dict[str, Any]:
    counts = Counter(result.state for result in results)
    jobs = [
        {
            "name": result.name, "kind": tasks[result.name].kind, "path": tasks[result.name].path,
            "folder": tasks[result.name].folder, "state": result.state, "good": result.is_good,
            "badness": result.badness, "sentence": result.sentence, "details": result.details,
            "failures": list(result.failures), "notes": list(result.notes), "files": list(result.files),
            "seconds": round(result.seconds, 3), "cpu_seconds": round(result.cpu, 3),
            "attempts": result.attempts, "worker": result.worker,
        }
        for result in results
    ]  # fmt: skip
    return {
        "schema": SCHEMA,
        "version": VERSION,
        "contact_core": __version__,
        "finished": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
        "seconds": round(seconds, 3),
        "workers": workers,
        "counts": {state: counts[state] for state in ("done", "same", "failed", "stopped")}
        | {"good": sum(result.is_good for result in results)},
        "receipts": RECEIPT,
        "jobs": jobs,
    }
