"""Where workers come from: processes of this machine, or a Dask cluster. Both take a task and return a future.

On this machine a worker is a `concurrent.futures` pool of one process, so that when a process dies it is known
which task it had: a pool of several breaks as a whole and does not say (ADR 0056).
"""

from __future__ import annotations

import asyncio
import contextlib
import multiprocessing
import os
import signal
import sys
import threading
import time
from abc import abstractmethod
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Any, Protocol

from contact_core.errors import FileRefused, InvalidInput, MissingExtra
from contact_core.farm.task import Result, Task, perform

_PATIENCE_S = 30.0  # that a scheduler may be silent while jobs run
_MOST_WORKERS = 1000  # each is a process that holds some hundred megabytes
KILL = getattr(signal, "SIGKILL", signal.SIGTERM)


class Workers(Protocol):
    """Somewhere that tasks are done. A future ends with the result, or with an error when its worker died."""

    @property
    @abstractmethod
    def free(self) -> int:
        """How many tasks may be handed over now."""
        ...

    @property
    @abstractmethod
    def words(self) -> str:
        """What they are, for people."""
        ...

    @abstractmethod
    def submit(self, task: Task) -> Future[Result]:
        """Hand over a task."""
        ...

    @abstractmethod
    def done(self, future: Future[Result]) -> None:
        """Take note that a future has ended: its worker is free, or made anew where it died."""
        ...

    @abstractmethod
    def kill(self, future: Future[Result]) -> bool:
        """End the worker that has this task; False where that cannot be done."""
        ...

    def check(self) -> None:
        """Raises FileRefused where there will be no workers any more."""
        return

    @abstractmethod
    def stop(self) -> None:
        """End all workers at once, busy or not, and wait for their end."""
        ...


class NoWorkers(Workers):
    """Every job in this process, one after the other: for a debugger, and within a DCC, whose Python is no program
    that workers could be started of."""

    def __init__(self) -> None:
        self._busy = False

    @property
    def free(self) -> int:
        return int(not self._busy)

    @property
    def words(self) -> str:
        return "in this process"

    def submit(self, task: Task) -> Future[Result]:
        future: Future[Result] = Future()
        future.set_result(perform(task))
        self._busy = True  # so that progress is told after each job
        return future

    def done(self, future: Future[Result]) -> None:
        self._busy = False

    def kill(self, future: Future[Result]) -> bool:
        return False

    def stop(self) -> None:
        """There is nobody to stop."""


class LocalWorkers(Workers):
    """count: processes; by default as many as this process may use cores. None starts before it has work."""

    def __init__(self, count: int | None = None) -> None:
        if count is not None and not 1 <= count <= _MOST_WORKERS:
            raise InvalidInput(f"from 1 to {_MOST_WORKERS} workers can be asked for, but {count} were.")
        self._slots = [_Slot() for _ in range(count or usable_cores())]
        self._busy: dict[Future[Result], _Slot] = {}
        self._warm = False

    @property
    def free(self) -> int:
        # The first worker compiles the kernels, or loads them, for all: two at once would do the same work twice.
        if not self._warm and any(slot.is_running for slot in self._slots):
            self._warm = any(slot.is_ready for slot in self._slots)
            if not self._warm:
                return 0
        return len(self._slots) - len(self._busy)

    @property
    def words(self) -> str:
        return f"{len(self._slots)} worker{'s' if len(self._slots) > 1 else ''} on this machine"

    def submit(self, task: Task) -> Future[Result]:
        slot = next(slot for slot in self._slots if slot not in self._busy.values())
        future = slot.submit(task)
        self._busy[future] = slot
        return future

    def done(self, future: Future[Result]) -> None:
        slot = self._busy.pop(future)
        if isinstance(future.exception(), BrokenProcessPool):
            slot.end()

    def kill(self, future: Future[Result]) -> bool:
        self._busy[future].kill()
        return True

    def stop(self) -> None:
        for slot in self._slots:
            slot.kill()
        for slot in self._slots:
            slot.end()

    def processes(self) -> list[int]:
        """The ids of the processes that are ready or at work."""
        return [slot.process for slot in self._slots if slot.process is not None]


class _Spawning(SpawnContext):
    """Spawns, not forks: a fork of a process that has threads, as numpy and hosts have, may hang. It keeps what it
    started, so that a process can be ended before it has said its id."""

    def __init__(self) -> None:
        super().__init__()
        self.started: list[SpawnProcess] = []
        self.Process = self._start  # type: ignore[misc, assignment]  # pools make theirs by it

    def _start(self, *arguments: Any, **more: Any) -> SpawnProcess:
        self.started.append(SpawnProcess(*arguments, **more))
        return self.started[-1]


class _Slot:
    """One worker: a pool of one process, made when there is work, and made again after it died."""

    def __init__(self) -> None:
        self._context = _Spawning()
        self._pool: ProcessPoolExecutor | None = None
        self._hello: Future[int] | None = None

    @property
    def is_running(self) -> bool:
        return self._pool is not None

    @property
    def is_ready(self) -> bool:
        return self.process is not None

    @property
    def process(self) -> int | None:
        """Its process id, once it has started."""
        hello = self._hello
        if hello is None or not hello.done() or hello.cancelled() or hello.exception() is not None:
            return None
        return hello.result()

    def submit(self, task: Task) -> Future[Result]:
        try:
            return self._open().submit(perform, task)
        except BrokenProcessPool:  # it died between two tasks
            self.end()
            return self._open().submit(perform, task)

    def _open(self) -> ProcessPoolExecutor:
        if self._pool is None:
            self._context = _Spawning()
            self._pool = ProcessPoolExecutor(1, self._context, initializer=_begin)
            self._hello = self._pool.submit(_warm)
        return self._pool

    def kill(self) -> None:
        for process in self._context.started:
            with contextlib.suppress(ValueError):  # it was closed: it has ended
                process.kill()

    def end(self) -> None:
        if self._pool is not None:
            self._pool.shutdown(wait=True, cancel_futures=True)
        self._pool = self._hello = None


def _begin() -> None:
    """In a new worker: Ctrl+C is the parent's; the end of the parent, however it comes, is ours; no own threads."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.dup2(2, 1)  # what a library prints must not stand within the JSON of the parent
    sys.stdout = sys.stderr
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    from threadpoolctl import threadpool_limits

    threadpool_limits(1)  # one worker for each core is enough


def _end_with(parent: Any) -> None:
    parent.join()
    os._exit(1)


def _warm() -> int:
    """Compile the kernels, or load them; the process id."""
    from contact_core.solve.warm_up import warm_up

    warm_up()
    return os.getpid()


class DaskWorkers(Workers):
    """The workers of a Dask scheduler (extra `farm`). address: "tcp://host:8786", or a name that Dask knows.

    Files are read and written by the workers, so that job files and results must lie where all of them find them.
    Raises FileRefused where no scheduler answers.
    """

    def __init__(self, address: str, *, seconds: float = 10.0) -> None:
        try:
            from distributed import Client
        except ImportError as error:
            raise MissingExtra("contact batch --scheduler", "farm") from error
        try:
            _knock(address, seconds)
            self._client: Any = Client(address, timeout=seconds, set_as_default=False)
        except (OSError, TimeoutError, ValueError, TypeError, RuntimeError) as error:
            raise FileRefused(
                f"no Dask scheduler answers at {address} ({' '.join(str(error).split())}). Start one with"
                " `dask scheduler`, and workers with `dask worker ADDRESS --nthreads 1`."
            ) from error
        self._address, self._seen = address, time.monotonic()
        self._executor = self._client.get_executor(pure=False)

    @property
    def free(self) -> int:
        return sys.maxsize  # the scheduler queues them

    @property
    def words(self) -> str:
        if not self._is_connected:
            return f"{self._address}, which does not answer"
        info = self._client.scheduler_info()
        count = info.get("n_workers", len(info["workers"]))  # newer ones list the first few alone
        return f"{count or 'no'} worker{'s' if count != 1 else ''} of {self._address}"

    def submit(self, task: Task) -> Future[Result]:
        future: Future[Result] = self._executor.submit(perform, task)
        return future

    def done(self, future: Future[Result]) -> None:
        """The scheduler sees to its workers."""

    def check(self) -> None:
        if self._is_connected:
            self._seen = time.monotonic()
        elif time.monotonic() - self._seen > _PATIENCE_S:
            raise FileRefused(
                f"the Dask scheduler at {self._address} has not answered for {_PATIENCE_S:g} s. Start it and run"
                " the batch again: what is done is left out."
            )

    @property
    def _is_connected(self) -> bool:
        return bool(self._client.status == "running")

    def kill(self, future: Future[Result]) -> bool:
        return False

    def stop(self) -> None:
        if self._is_connected:
            self._executor.shutdown(wait=False)  # of Dask's executor: cancels what runs and what waits
        self._client.close(timeout=5)


def _knock(address: str, seconds: float) -> None:
    """Connect and hang up: a Client that fails over its address alone leaves a loop that is waited for at exit, and
    a traceback. In a thread of its own, for a notebook has a running loop. Raises what Dask raises."""
    from distributed.core import connect
    from distributed.security import Security

    async def knock() -> None:
        more = Security().get_connection_args("client")
        comm = await connect(address, timeout=seconds, **more)
        await comm.close()

    with ThreadPoolExecutor(1) as thread:
        thread.submit(lambda: asyncio.run(knock())).result()


def usable_cores() -> int:
    """How many cores this process may use: a container or a queue may allow fewer than the machine has."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
