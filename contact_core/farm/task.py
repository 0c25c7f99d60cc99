"""One job as a worker does it: run, then leave a receipt. A receipt is the last thing that is written.

So a job that was killed at any moment has none and is done again, and one that has a receipt for what its files
hold now is not. Receipts are JSON in the job's own folder; nothing else remembers anything.
"""

from __future__ import annotations

import base64
import hashlib
import io
import json
import os
import socket
import time
import traceback
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from contact_core._version import __version__
from contact_core.atomic_file import read_bounded, write_atomic
from contact_core.errors import Cancelled, ContactError, FileRefused, InvalidInput, MissingExtra
from contact_core.farm.inputs import GONE, Clock, Digests, Stamp, as_read, first_change, noting_files, stamp_of
from contact_core.plugins.registry import JOB_KINDS
from contact_core.plugins.slots import JobOutcome, JobRequest
from contact_core.progress import Progress
from contact_core.sealed import DIGEST, sealed, unsealed

if TYPE_CHECKING:
    from contact_core.plugins.manager import PluginManager

RECEIPT = "job.json"
SCHEMA, VERSION = "contact.job", 1
MAX_BYTES = 16_000_000  # of a receipt
THUMBNAIL_SIZE = (480, 360)  # pixels, at most
MOST_INLINE = 60_000  # bytes of a picture that goes into the report as it is, where nothing can make it smaller


@dataclass(frozen=True)
class Task:
    """What a worker needs to know, in plain values. kind, path, folder, frames, solver, assets: as in JobRequest.

    key: of all that decides the result but the content of files: kind, options, versions. limit: seconds, or None.
    """

    name: str
    kind: str
    path: str
    folder: str
    key: str
    frames: tuple[float, ...] | None = None
    solver: str | None = None
    assets: str | None = None
    limit: float | None = None
    version: str = __version__


@dataclass(frozen=True)
class Result:
    """How a job ended. state: "done" (now), "same" (earlier, and nothing has changed), "failed" or "stopped".

    sentence: why it failed. details: a traceback, where the failure is a fault of the program. again: whether
    another attempt may go better. thumbnail: a data URI. seconds, cpu: of the work itself, by the clock and of a
    core.
    """

    name: str
    state: str
    sentence: str = ""
    details: str = ""
    again: bool = False
    badness: float = 0.0
    failures: tuple[str, ...] = ()
    rows: tuple[tuple[str, str, bool], ...] = ()
    notes: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    thumbnail: str = ""
    seconds: float = 0.0
    cpu: float = 0.0
    worker: str = ""
    attempts: int = 1

    @property
    def is_good(self) -> bool:
        """Whether it ended with a result that is accepted."""
        return self.state in ("done", "same") and not self.failures


def key_of(kind: str, options: Mapping[str, Any], plugins: PluginManager) -> str:
    """The identity of a way to do jobs: SHA-256 of kind, options, and the versions of all that takes part."""
    parts = sorted((record.name, record.source) for record in plugins.records())
    facts = {"kind": kind, "options": dict(options), "contact_core": __version__, "plugins": parts}
    return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()


def earlier(task: Task, digests: Digests) -> Result | None:
    """The result that lies there from an earlier run, if it is that of the files as they are now."""
    receipt = read_receipt(Path(task.folder))
    if receipt is None or receipt["key"] != task.key:
        return None
    folder = Path(task.folder)
    result = receipt["result"]
    if not all((folder / name).is_file() for name in result["files"]):
        return None
    if first_change(receipt["inputs"], Path(task.path), digests) is not None:
        return None
    return result_of({**result, "name": task.name, "state": "same"})


def read_receipt(folder: Path) -> Mapping[str, Any] | None:
    """The receipt in a folder; None where there is none, or a damaged one: then the job is done again."""
    try:
        written = json.loads(read_bounded(folder / RECEIPT, MAX_BYTES))
        receipt = unsealed(written, RECEIPT)
        well = isinstance(written[DIGEST], str) and isinstance(receipt["key"], str)
        well = well and receipt["schema"] == SCHEMA and receipt["version"] == VERSION
        for known in receipt["inputs"]:
            well = well and isinstance(known["file"], str) and {"sha256", "size", "changed"} <= known.keys()
        result_of(receipt["result"])
    except (FileRefused, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return None
    return receipt if well else None


def sealed_receipt(key: str, kind: str, inputs: Sequence[Mapping[str, Any]], result: Mapping[str, Any]) -> str:
    """The text of a receipt."""
    receipt = {"schema": SCHEMA, "version": VERSION, "key": key, "kind": kind, "contact_core": __version__,
               "inputs": inputs, "result": result}  # fmt: skip
    return json.dumps(sealed(json.loads(json.dumps(receipt, allow_nan=False))), indent=1) + "\n"


def result_of(data: Mapping[str, Any]) -> Result:
    """A result from plain data. Raises KeyError, TypeError or ValueError for what is none."""
    texts = ("name", "state", "sentence", "details", "thumbnail", "worker")
    return Result(
        **{key: str(data[key]) for key in texts},
        again=bool(data["again"]),
        badness=float(data["badness"]),
        failures=tuple(map(str, data["failures"])),
        rows=tuple((str(name), str(value), bool(failed)) for name, value, failed in data["rows"]),
        notes=tuple(map(str, data["notes"])),
        files=tuple(map(str, data["files"])),
        seconds=float(data["seconds"]),
        cpu=float(data["cpu"]),
        attempts=int(data["attempts"]),
    )


def perform(task: Task) -> Result:
    """Do a job and leave its receipt; what goes wrong is in the result, so nothing is raised across processes."""
    began = time.perf_counter()
    where = f"{socket.gethostname()}, process {os.getpid()}"

    def failed(sentence: str, *, again: bool = False, details: str = "") -> Result:
        took = time.perf_counter() - began
        return Result(task.name, "failed", sentence, details, again, seconds=took, worker=where)

    limit = _Limit(task.limit)
    try:
        outcome, inputs, took, cpu = _run(task, limit)
        thumbnail = "" if outcome.picture is None else thumbnail_of(Path(task.folder) / outcome.picture)
        result = Result(
            task.name, "done", badness=outcome.badness, failures=outcome.failures, rows=outcome.rows,
            notes=outcome.notes, files=outcome.files, thumbnail=thumbnail, seconds=took, cpu=cpu, worker=where,
        )  # fmt: skip
        write_atomic(Path(task.folder) / RECEIPT, sealed_receipt(task.key, task.kind, inputs, asdict(result)))
    except Cancelled as error:
        return failed(too_long(task.limit) if task.limit is not None and limit.is_over else str(error))
    except ContactError as error:
        return failed(str(error), again=_is_of_the_disk(error))
    except MemoryError:
        return failed("the memory of the worker did not suffice; try fewer workers on this machine.", again=True)
    except OSError as error:
        return failed(f"{error.filename or 'the system'}: {error.strerror or error}.", again=True)
    except Exception as error:
        said = f"{type(error).__name__}: {error}".rstrip(": ")
        return failed(f"a fault in the program or a plugin ({said}); please report it.",
                      details=traceback.format_exc())  # fmt: skip
    return result


def _run(task: Task, progress: Progress) -> tuple[JobOutcome, list[Any], float, float]:
    """The job itself, the files that it read, and its seconds by the clock and of a core.

    The old receipt goes first: the results are about to change.
    """
    if task.version != __version__:
        raise InvalidInput(
            f"this worker has contact-core {__version__}, and the batch was started with {task.version}. Install"
            " the same version on all machines."
        )
    path, folder = Path(task.path), Path(task.folder)
    try:
        (folder / RECEIPT).unlink(missing_ok=True)
    except OSError as error:
        raise FileRefused(f"cannot write into {folder}: {error.strerror or error}.") from error
    kind = plugins_of_this_process().get(JOB_KINDS, task.kind)
    request = JobRequest(path, folder, task.frames, task.solver, None if task.assets is None else Path(task.assets))
    clock, opened = Clock(folder), {os.path.realpath(path): stamp_of(task.path)}
    start = time.monotonic_ns()
    began, cpu = time.perf_counter(), time.process_time()
    with noting_files() as found:
        outcome = kind.run(request, plugins_of_this_process(), progress)
    took, cpu = time.perf_counter() - began, time.process_time() - cpu
    inside = os.path.realpath(folder) + os.sep
    paths = {*found, *map(os.path.realpath, outcome.inputs), os.path.realpath(path)}
    paths = {path for path in paths if not path.startswith(inside)}
    held = _held(paths, time.monotonic_ns() - start, clock)
    return outcome, as_read(paths, path, Digests(), held | found | opened, clock), took, cpu


def _held(paths: Iterable[str], ago: int, clock: Clock) -> dict[str, Stamp]:
    """For files that a library opened itself, and that were written since the job began (`ago`, in ns): that they
    were not what they are now."""
    return {path: GONE for path in paths if max(stamp_of(path)[1:]) >= clock.now(path) - ago}


@cache
def plugins_of_this_process() -> PluginManager:
    """The plugins that a worker finds, once: installed ones, and those of CONTACT_PLUGINS."""
    from contact_core.plugins.manager import PluginManager

    return PluginManager()


class _Limit(Progress):
    """The progress of a job in a worker: it tells nobody, and stops work that takes too long."""

    def __init__(self, seconds: float | None) -> None:
        self._end = None if seconds is None else time.monotonic() + seconds

    @property
    def is_over(self) -> bool:
        """Whether the time is up."""
        return self._end is not None and time.monotonic() > self._end

    def tell(self, fraction: float | None, text: str) -> None:
        if self.is_over:
            raise Cancelled("the time is up.")


def _is_of_the_disk(error: BaseException | None) -> bool:
    """Whether a disk or a network is behind an error, so that another attempt may go better."""
    while error is not None and not isinstance(error, OSError):
        error = error.__cause__
    return error is not None


def too_long(seconds: float) -> str:
    """The sentence for a job that was ended for the time it took."""
    return f"it took longer than {seconds:g} s and was ended (--limit)."


def thumbnail_of(path: Path) -> str:
    """A picture as a small data URI; as it is where nothing can make it smaller and it is small; else nothing."""
    try:
        data = read_bounded(path, 64_000_000)
        mime, data = _shrunk(data)
    except (FileRefused, MissingExtra, OSError, ValueError):
        return ""
    return f"data:{mime};base64,{base64.b64encode(data).decode()}" if len(data) <= MOST_INLINE else ""


def _shrunk(data: bytes) -> tuple[str, bytes]:
    """The bytes of a smaller picture and their type, by Pillow where it is installed."""
    try:
        from PIL import Image
    except ImportError:
        return "image/png", data
    with Image.open(io.BytesIO(data), formats=["PNG"]) as picture:
        small = picture.convert("RGB")
        small.thumbnail(THUMBNAIL_SIZE)
        written = io.BytesIO()
        small.save(written, "JPEG", quality=80)
    return "image/jpeg", written.getvalue()
