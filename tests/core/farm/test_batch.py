"""`contact batch`: what is done is left out, what has changed is done again, and no death loses anything."""

from __future__ import annotations

import html.parser
import json
import os
import random
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from contact_core.cli import main
from contact_core.errors import Cancelled, FileRefused, InvalidInput
from contact_core.farm import kinds
from contact_core.farm.batch import BatchSettings, run_batch
from contact_core.farm.inputs import Digests, as_read, first_change, noting_files
from contact_core.farm.jobs import find_jobs
from contact_core.farm.page import page_of
from contact_core.farm.task import RECEIPT, Result, Task, perform, read_receipt
from contact_core.farm.workers import KILL, LocalWorkers, NoWorkers
from contact_core.progress import CallbackProgress

KILLS = int(os.environ.get("CONTACT_BATCH_KILLS", "4"))  # more of them by `make explore`
REPEATED = Path(__file__).with_name("conftest.py")


def told(capsys: pytest.CaptureFixture[str], *arguments: Any) -> tuple[int, Any]:
    """Exit code and JSON answer of `contact batch`, in this process."""
    code = main(["batch", "--json", *map(str, arguments), "--workers", "0"])
    return code, json.loads(capsys.readouterr().out)


def states(facts: Any) -> dict[str, str]:
    """State by job."""
    return {job["name"]: job["state"] for job in facts["jobs"]}


def results_in(out: Path) -> dict[str, bytes]:
    """The bytes of all results: what the same inputs must give again."""
    return {
        f"{p.parent.name}/{p.name}": p.read_bytes() for p in sorted(out.glob("job*/*.json")) if p.name != RECEIPT
    }


def test_what_is_done_is_left_out_and_what_changed_is_done_again(
    jobs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = jobs / "out"
    (jobs / "job003.json").write_bytes(b"{}")  # named as a job, and none
    listed = jobs / "list.txt"
    listed.write_text("# two ways to name jobs\njob00[0-2].json\njob003.json\n")
    code, facts = told(capsys, listed, "--out", out)
    assert code == 1 and states(facts) == {
        "job003": "failed",
        **dict.fromkeys(("job000", "job001", "job002"), "done"),
    }
    assert facts["jobs"][0]["name"] == "job003" and "schema" in facts["jobs"][0]["sentence"]  # the worst is first
    assert facts == {**json.loads((out / "batch.json").read_text()), "report": facts["report"],
                     "summary": facts["summary"]}  # fmt: skip
    first = results_in(out)

    os.utime(jobs / "ball.glb")  # touched is not changed
    code, facts = told(capsys, jobs / "job00[0-2].json", "--out", out)
    assert code == 0 and set(states(facts).values()) == {"same"} and results_in(out) == first

    document = (jobs / "job001.json").read_text().replace("0.41", "0.47")
    (jobs / "job001.json").write_text(_undigested(document))
    (out / "job002" / "pose.json").unlink()  # a result that is gone is made again
    code, facts = told(capsys, jobs / "job00[0-2].json", "--out", out)
    assert code == 0 and states(facts) == {"job000": "same", "job001": "done", "job002": "done"}
    again = results_in(out)
    assert (
        again["job000/pose.json"] == first["job000/pose.json"]
        and again["job002/pose.json"] == first["job002/pose.json"]
    )
    assert again["job001/pose.json"] != first["job001/pose.json"]

    write_assets(jobs, radius=0.45)
    code, facts = told(capsys, jobs / "job00[0-2].json", "--out", out)
    assert code == 0 and set(states(facts).values()) == {"done"}
    assert "another shape" in facts["jobs"][0]["notes"][0]
    code, facts = told(capsys, jobs / "job00[0-2].json", "--out", out, "--solver", "nlopt")
    assert "same" not in states(facts).values()


def _undigested(text: str) -> str:
    lines = text.splitlines(keepends=True)
    return "".join(' "digest": null,\n' if line.startswith(' "digest"') else line for line in lines)


def write_assets(folder: Path, radius: float) -> None:
    _parts()["write_assets"](folder, radius)


def write_jobs(folder: Path, count: int) -> None:
    _parts()["write_jobs"](folder, count)


def _parts() -> dict[str, Any]:
    """The makers of conftest.py; test folders are no packages."""
    import runpy

    return runpy.run_path(str(REPEATED))


def test_workers_that_are_killed_lose_nothing(tmp_path: Path) -> None:
    """Killed at random moments: every job has its result, the one that it has without a death."""
    write_jobs(tmp_path / "jobs", 2 + KILLS)
    calm = run_batch([tmp_path / "jobs"], tmp_path / "calm", workers=NoWorkers())
    assert calm.is_done and len(calm.results) == 2 + KILLS
    workers, over, killed = LocalWorkers(2), threading.Event(), []

    def kill() -> None:
        rng = random.Random(7)
        while not over.wait(rng.uniform(0.1, 0.6)) and len(killed) < KILLS:
            for process in rng.sample(workers.processes(), min(1, len(workers.processes()))):
                os.kill(process, KILL)
                killed.append(process)

    killer = threading.Thread(target=kill)
    killer.start()
    try:
        result = run_batch([tmp_path / "jobs"], tmp_path / "out", BatchSettings(retries=1000), workers=workers)
    finally:
        over.set()
        killer.join()
    assert result.is_done and killed
    assert results_in(tmp_path / "out") == results_in(tmp_path / "calm")


def test_a_batch_that_is_killed_goes_on_where_it_was(jobs: Path) -> None:
    """kill -9 of the batch itself: its workers end with it, and the next one runs only what has no receipt."""
    out = jobs / "out"
    command = [
        sys.executable,
        "-m",
        "contact_core",
        "batch",
        str(jobs),
        "--out",
        str(out),
        "--workers",
        "1",
        "--json",
    ]
    first = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    deadline = time.monotonic() + 300  # compiling, on a busy machine
    while not list(out.glob(f"*/{RECEIPT}")) and time.monotonic() < deadline:
        time.sleep(0.02)
    first.kill()
    first.communicate(timeout=20)  # the pipes close: no worker lives on that holds them
    ready = len(list(out.glob(f"*/{RECEIPT}")))
    assert ready > 0
    second = subprocess.run(command, capture_output=True, timeout=120)
    counts = json.loads(second.stdout)["counts"]
    assert second.returncode == 0 and counts["same"] >= ready and counts["same"] + counts["done"] == 4


def test_a_task_that_kills_its_worker_is_given_up_and_stops_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_jobs(tmp_path / "jobs", 2)
    (tmp_path / "deadly.py").write_text(
        "import os, signal\n"
        "from contact_core.plugins import hookimpl\n"
        "class Deadly:\n"
        "    name, summary, suffixes = 'deadly', 'a job that ends its process', ('.deadly',)\n"
        "    def claims(self, path): return True\n"
        "    def run(self, request, plugins, progress): os._exit(3)\n"
        "@hookimpl\n"
        "def contact_job_kinds(): return [Deadly()]\n"
    )
    (tmp_path / "jobs" / "job001.deadly").touch()
    (tmp_path / "jobs" / "job001.json").unlink()
    monkeypatch.setenv("CONTACT_PLUGINS", "deadly")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]))
    monkeypatch.syspath_prepend(str(tmp_path))
    result = run_batch([tmp_path / "jobs"], tmp_path / "out", BatchSettings(retries=1), workers=LocalWorkers(1))
    assert [(each.name, each.state, each.attempts) for each in result.results] == [
        ("job001", "failed", 2), ("job000", "done", 1),
    ]  # fmt: skip
    assert "its worker died" in result.results[0].sentence and not result.is_done


def test_cancelling_ends_the_workers_and_reports_what_there_is(jobs: Path) -> None:
    def stop(fraction: float | None, text: str) -> None:
        if fraction:
            raise Cancelled("enough")

    workers = LocalWorkers(1)
    with pytest.raises(Cancelled):
        run_batch([jobs], jobs / "out", workers=workers, progress=CallbackProgress(stop))
    assert workers.processes() == []
    facts = json.loads((jobs / "out" / "batch.json").read_text())
    assert facts["counts"]["done"] >= 1 and facts["counts"]["stopped"] >= 1
    assert sum(facts["counts"][state] for state in ("done", "same", "failed", "stopped")) == 4


def test_a_worker_is_stopped_before_it_has_begun(jobs: Path) -> None:
    workers = LocalWorkers(1)
    future = workers.submit(_task(jobs / "job000.json", jobs / "out"))
    workers.stop()
    assert future.cancelled() or future.exception() is not None
    assert read_receipt(jobs / "out") is None and workers.processes() == []


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_ctrl_c_leaves_a_report_and_the_code_of_an_interrupt(jobs: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "contact_core",
        "batch",
        str(jobs),
        "--out",
        str(jobs / "out"),
        "--workers",
        "1",
    ]
    running = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, preexec_fn=_heed_interrupts)
    deadline = time.monotonic() + 60
    while not list(jobs.glob(f"out/*/{RECEIPT}")) and time.monotonic() < deadline:
        time.sleep(0.02)
    running.send_signal(signal.SIGINT)
    _, said = running.communicate(timeout=60)
    assert running.returncode == 130 and "Traceback" not in said and "interrupted" in said
    counts = json.loads((jobs / "out" / "batch.json").read_text())["counts"]
    assert counts["done"] + counts["same"] >= 1


def _heed_interrupts() -> None:
    """Shells have what they run in the background ignore SIGINT, and children inherit that."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def test_a_job_is_ended_at_its_limit(jobs: Path) -> None:
    task = _task(jobs / "job000.json", jobs / "out", limit=1e-6)
    assert perform(task).sentence.startswith("it took longer than")
    assert read_receipt(jobs / "out") is None and list((jobs / "out").glob("*.json")) == []


def _task(path: Path, folder: Path, **more: Any) -> Task:
    return Task(path.stem, "document", str(path), str(folder), "key", **more)


def test_another_version_of_the_program_is_refused_in_words(jobs: Path) -> None:
    result = perform(_task(jobs / "job000.json", jobs / "out", version="0.0.1"))
    assert result.state == "failed" and "0.0.1" in result.sentence and not result.again


def test_a_damaged_receipt_is_none(jobs: Path) -> None:
    """Cut or flipped anywhere, a receipt is none or still a receipt: reading one never raises."""
    assert perform(_task(jobs / "job000.json", jobs / "out")).state == "done"
    receipt = jobs / "out" / RECEIPT
    whole, rng = receipt.read_bytes(), random.Random(3)
    assert read_receipt(jobs / "out") is not None
    for _ in range(200):
        damaged = bytearray(whole[: rng.randrange(1, len(whole) + 1)])
        damaged[rng.randrange(len(damaged))] ^= 1 << rng.randrange(8)
        receipt.write_bytes(damaged)
        read_receipt(jobs / "out")
    receipt.write_bytes(whole[:-20])
    assert read_receipt(jobs / "out") is None


def test_two_batches_in_one_folder_are_refused(jobs: Path) -> None:
    def second(fraction: float | None, text: str) -> None:
        if text == "Looking for jobs":  # nothing of the folder is touched yet
            return
        with pytest.raises(FileRefused, match=r"no batch can run in .*batch\.json is open in"):
            run_batch([jobs], jobs / "out")
        raise Cancelled("seen")

    with pytest.raises(Cancelled, match="seen"):
        run_batch([jobs], jobs / "out", progress=CallbackProgress(second))


def test_finding_jobs(tmp_path: Path) -> None:
    for name in ("a.toml", "sub/b.toml", "sub/hand.rig.toml", "other.toml", ".hidden/c.toml", "done/d.toml"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("schema = 1\n" + ("" if name == "other.toml" else "[manipulator]\n"))
    (tmp_path / "done" / "batch.json").write_text("{}")
    (tmp_path / "notes.json").write_text("{}")

    def found(*sources: str) -> list[str]:
        return [job.name for job in find_jobs([tmp_path / s for s in sources], kinds.OWN, tmp_path / "out")]

    assert found("") == ["a", "sub/b"]
    assert found("sub/b.toml", "sub") == ["b"]  # each once; names begin where the jobs' folders part
    assert found("**/*.toml") == [".hidden/c", "a", "done/d", "other", "sub/b", "sub/hand.rig"]
    for sources, words in (
        (["nothing*.toml"], "no file is called"),
        (["picture.png"], "is no job"),
        (["a.toml", "a.json"], "would both write"),
        (["done"], "no jobs were found"),
    ):
        with pytest.raises((FileRefused, InvalidInput), match=words):
            found(*sources)


def test_files_are_noted_where_they_change(tmp_path: Path) -> None:
    """What was read is an input, what was written is not, and only other bytes are a change."""
    job, asset, own = tmp_path / "job.json", tmp_path / "asset.obj", tmp_path / "own.tmp"
    for path in (job, asset):
        path.write_text(path.name)
    with noting_files() as found:
        asset.read_text()
        own.write_text("mine")
        own.read_text()
        Path(os.__file__).read_text()
    assert set(found) == {os.path.realpath(asset)}
    inputs = as_read(found, job, Digests())
    assert first_change(inputs, job, Digests()) is None
    os.utime(asset, ns=(1, 1))
    assert first_change(inputs, job, Digests()) is None
    asset.write_text("asset.OBJ")  # as long as before
    assert first_change(inputs, job, Digests()) == os.path.realpath(asset)
    asset.unlink()
    assert first_change(inputs, job, Digests()) == os.path.realpath(asset)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows keeps no time that nobody can set")
def test_a_clock_that_goes_backwards_hides_no_change(tmp_path: Path) -> None:
    """A file of the same size and time, as a copy that keeps times or a clock that was set back leaves it."""
    job, asset = tmp_path / "job.json", tmp_path / "asset.obj"
    asset.write_text("before")
    for at in (1, 10**18, 4 * 10**18):  # 1970, 2001, 2096
        os.utime(asset, ns=(at, at))
        inputs = as_read([asset], job, Digests())
        assert first_change(inputs, job, Digests()) is None
        asset.write_text("after!" if asset.read_text() == "before" else "before")
        os.utime(asset, ns=(at, at))
        assert first_change(inputs, job, Digests()) == os.path.realpath(asset)


def test_a_file_that_changes_while_the_job_runs_is_no_base_of_its_result(tmp_path: Path) -> None:
    """Nobody knows which of the two the job has read, so the next batch does it again."""
    job, asset, late = tmp_path / "job.json", tmp_path / "asset.obj", tmp_path / "late.obj"
    for path in (job, asset, late):
        path.write_text("old")
    with noting_files() as found:
        asset.read_text()
        late.write_text("new")
        late.replace(asset)  # by somebody else
    inputs = as_read(found, job, Digests(), found)
    assert first_change(inputs, job, Digests()) == os.path.realpath(asset)
    assert first_change(as_read(found, job, Digests()), job, Digests()) is None


class _Tags(html.parser.HTMLParser):
    """The tags of a page, and the addresses that it names."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.addresses: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.addresses += [value or "" for name, value in attrs if name in ("src", "href")]


def test_the_report_is_alone_and_escapes_everything() -> None:
    evil = "<script src=http://evil>&\"'</script>"
    counts = {"done": 1, "same": 0, "failed": 1, "stopped": 0, "good": 0}
    facts = {"counts": counts, "finished": evil, "seconds": 1.0, "workers": evil, "contact_core": evil}
    results = (
        Result(evil, "failed", evil, evil, worker=evil, thumbnail="http://evil/a.png"),
        Result(evil, "done", failures=(evil,), rows=((evil, evil, True),), notes=(evil,), files=(evil,),
               thumbnail='data:image/png;base64,"><script>', badness=1e9),
    )  # fmt: skip
    page = page_of(results, facts)
    seen = _Tags(page)
    assert "script" not in seen.tags and "link" not in seen.tags and "iframe" not in seen.tags
    assert all(address.startswith("data:") or "://" not in address for address in seen.addresses)
    assert evil not in page and page.count("<article") == 2
    assert page.index("failed") < page.index("solved")


def test_refusals_are_sentences(jobs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, words in (
        (["no_such_folder_at_all"], "is no job"),
        ([jobs, "--workers", "-1"], "from 1 to 1000 workers"),
        ([jobs, "--workers", "100000000"], "from 1 to 1000 workers"),
        ([jobs, "--workers", "1", "--scheduler", "tcp://127.0.0.1:1"], "Leave one of the two out"),
        ([jobs, "--frames", "9-2"], "frames are like"),
        ([jobs, "--solver", "nobody"], "there is no pose solver 'nobody'"),
        ([jobs, "--retries", "-1"], "retries are"),
        ([jobs, "--limit", "0"], "a limit is"),
    ):
        assert main(["batch", *map(str, arguments), "--out", str(jobs / "never")]) == 2
        assert words in capsys.readouterr().err
    assert not (jobs / "never").exists()  # not even the lock of a batch that had nothing to do


def test_dask_does_the_same(jobs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    distributed = pytest.importorskip("distributed", reason="the extra `farm` is not installed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        address = cluster.scheduler_address
        code = main(["batch", "--json", str(jobs), "--out", str(jobs / "far"), "--scheduler", address])
        facts = json.loads(capsys.readouterr().out)
        assert code == 0 and set(states(facts).values()) == {"done"} and len(facts["jobs"]) == 4
        code = main(["batch", "--json", str(jobs), "--out", str(jobs / "far"), "--scheduler", address])
        assert set(states(json.loads(capsys.readouterr().out)).values()) == {"same"}
    near = run_batch([jobs], jobs / "near", workers=NoWorkers())
    assert near.is_done and results_in(jobs / "near") == results_in(jobs / "far")


def test_a_silent_scheduler_is_named(jobs: Path) -> None:
    pytest.importorskip("distributed", reason="the extra `farm` is not installed")
    from contact_core.farm.workers import DaskWorkers

    with pytest.raises(FileRefused, match="no Dask scheduler answers at tcp:"):
        DaskWorkers("tcp://127.0.0.1:9", seconds=0.5)


@pytest.mark.parametrize("address", ["nobody", "no_scheme://here:1", "tls://127.0.0.1:1"])
def test_an_address_that_is_none_is_a_sentence_and_nothing_else(address: str, jobs: Path) -> None:
    """Also at the end of the process, where Dask's clients are closed."""
    pytest.importorskip("distributed", reason="the extra `farm` is not installed")
    command = [sys.executable, "-m", "contact_core", "batch", str(jobs), "--out", str(jobs / "never")]
    run = subprocess.run([*command, "--scheduler", address], capture_output=True, text=True, check=False)
    assert run.returncode == 2 and "Traceback" not in run.stderr
    assert run.stderr.startswith(f"contact: no Dask scheduler answers at {address}")
    assert len(run.stderr.strip().splitlines()) == 1
