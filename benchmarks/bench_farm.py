"""The farm: what it costs beside the work, on 1 and 2 workers; what a second run costs; workers that are killed.

    python -m benchmarks.bench_farm [--quick] [--shots N] [--usd]

Shots are small documents: a finger on a ball, a tenth of a second of work each, most of it the picture, so that
what the farm adds is seen; with --usd, small stages of an arm and a ball, each with its contact layer. The kernels
are compiled before. What the farm adds is told in CPU seconds of all processes: those of a whole batch, without the
start of its workers, less those of the jobs themselves.
"""

from __future__ import annotations

import argparse
import os
import random
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import contact_core as contact
from benchmarks.harness import record
from contact_core.document.schema import dump_document
from contact_core.farm.batch import BatchResult, BatchSettings, run_batch
from contact_core.farm.task import RECEIPT
from contact_core.farm.workers import KILL, LocalWorkers
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import FORMATS
from contact_core.solve.warm_up import warm_up
from contact_core.testing import meshes
from contact_core.testing.format_contract import bar

SHOTS = 1000
KILLS = 20


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="60 shots")
    parser.add_argument("--shots", type=int, help=f"how many ({SHOTS})")
    parser.add_argument("--usd", action="store_true", help="USD shots in place of documents")
    parser.add_argument("--waiting", action="store_true", help="only jobs that wait: how they spread over workers")
    arguments, _ = parser.parse_known_args()
    if arguments.waiting:
        with tempfile.TemporaryDirectory() as name:
            record("Farm: jobs that wait", waiting(Path(name)))
        return
    count = arguments.shots or (60 if arguments.quick else SHOTS)
    warm_up()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (write_usd_shots if arguments.usd else write_shots)(folder / "shots", count)
        rows: dict[str, str] = {"shots": str(count)}
        runs: dict[int, Run] = {0: timed(folder, 1, "shot0000.contact.usda" if arguments.usd else "shot0000.json")}
        start = runs[0].spent - runs[0].work
        for workers in (1, 2):
            runs[workers] = timed(folder, workers)
            rows[f"{workers} worker{'s' * (workers > 1)}"] = runs[workers].spelled(start * workers)
        rows["start of a worker"] = f"{start:.1f} s of CPU, once"
        rows["2 workers against 1"] = f"{runs[1].batch.seconds / runs[2].batch.seconds:.2f} times as fast"
        again = run_batch([folder / "shots"], folder / "out 1 0")
        rows["again, nothing has changed"] = f"{again.seconds:.2f} s, {1e3 * again.seconds / count:.2f} ms a shot"
        rows[f"killed at random {KILLS} times"] = killed(folder)
    record("Farm: USD shots" if arguments.usd else "Farm", rows)


def write_shots(folder: Path, count: int) -> None:
    """Documents that differ in where the ball stands, and their two assets."""
    folder.mkdir()
    gltf = PluginManager().offers(FORMATS)["gltf"]
    ball = meshes.icosphere(2)
    gltf.write(folder / "finger.glb", [bar()], {})
    gltf.write(folder / "ball.glb", [contact.Asset("ball", ball.with_points(0.5 * ball.points))], {})
    with contact.new(finger=folder / "finger.glb", ball=folder / "ball.glb") as session:
        skin, thing = session.geometry.mesh("finger"), session.geometry.mesh("ball")
        tip = np.argsort(-skin.points[:, 2], kind="stable")[:5]
        points = contact.SurfacePoints.at_vertices(skin, tip)
        session.patches.paint("tip", points, surface="finger", axis=points[[0, 3]])
        root = contact.SurfacePoints.at_vertices(thing, [int(np.argmin(thing.points[:, 2]))])
        session.pairs.add("tip", session.patches.transfer("tip", "ball", root, heading=1.0 + 0.0j))
        place = np.eye(4)
        for number in range(count):
            place[:3, 3] = (0.4 + 0.3 * number / count, 0.2, 1.6)
            session.surfaces.place("ball", place)
            (folder / f"shot{number:04d}.json").write_bytes(dump_document(session.timed_document))


@dataclass(frozen=True)
class Run:
    """A batch and the CPU seconds that it took in all processes."""

    batch: BatchResult
    spent: float

    @property
    def work(self) -> float:
        """CPU seconds of the jobs themselves."""
        return sum(result.cpu for result in self.batch.results)

    def spelled(self, start: float) -> str:
        """Wall time, work, and what the farm adds to each shot. start: CPU seconds of the workers' start."""
        count, beside = len(self.batch.results), self.spent - start - self.work
        return (
            f"{self.batch.seconds:.1f} s; work {1e3 * self.work / count:.0f} ms a shot, beside it"
            f" {1e3 * beside / count:.1f} ms, {100 * beside / self.work:.1f} % of the work (wanted: under 5 %"
            f"{'' if beside < 0.05 * self.work else '; MISSED'})"
        )


def write_usd_shots(folder: Path, count: int) -> None:
    """An asset layer, and for each shot a layer in which the ball stands elsewhere, and its contacts over it."""
    from pxr import Gf, Sdf, Usd, UsdGeom

    from contact_core.testing.host_scenes import arm_rig
    from contact_usd.host import UsdHost

    folder.mkdir()
    rig, ball, made, place = arm_rig(), meshes.icosphere(2), UsdHost(), np.eye(4)
    place[:3, 3] = (1.2, 3.0, 0.0)
    made.add(contact.Asset("arm", rig.surface, rig, meters_per_unit=1.0))
    made.add(contact.Asset("ball", ball.with_points(0.5 * ball.points), meters_per_unit=1.0), place)
    made.layer.customLayerData = {}  # an asset like any other
    made.save(folder / "asset.usda")
    host = UsdHost(folder / "asset.usda")
    with contact.Session(host=host, discover=False) as session:
        for item in host.objects():
            asset = host.read_rig(item.id) if item.kind == "rig" else host.read_surface(item.id)
            where = host.placement(item.id)
            session.surfaces.add(item.name, asset.mesh, rig=asset.rig, world_from_surface=where)
        skin, thing = session.geometry.mesh("arm"), session.geometry.mesh("ball")
        near = np.argsort(np.linalg.norm(skin.points - [0.3, 2.8, 0.0], axis=1), kind="stable")[:6]
        points = contact.SurfacePoints.at_vertices(skin, near)
        session.patches.paint("tip", points, surface="arm", axis=points[[0, 3]])
        root = contact.SurfacePoints.at_vertices(thing, [int(np.argmin(thing.points[:, 0]))])
        session.pairs.add("tip", session.patches.transfer("tip", "ball", root, heading=1.0 + 0.0j))
        host.save(folder / "contacts.usda")
    contacts = (folder / "contacts.usda").read_text(encoding="utf-8")
    (folder / "contacts.usda").unlink()
    for number in range(count):
        name = f"shot{number:04d}"
        layer = Sdf.Layer.CreateNew(str(folder / f"{name}.usda"))
        layer.subLayerPaths = ["./asset.usda"]
        stage = Usd.Stage.Open(layer)
        UsdGeom.SetStageMetersPerUnit(stage, 1.0)
        move = UsdGeom.Xformable(stage.GetPrimAtPath("/ball")).GetOrderedXformOps()[0]
        move.Set(Gf.Matrix4d(1.0).SetTranslate((1.2, 3.0 + 0.4 * number / count, 0.0)))
        layer.Save()
        over = contacts.replace("./asset.usda", f"./{name}.usda")
        (folder / f"{name}.contact.usda").write_text(over, encoding="utf-8")


def timed(folder: Path, workers: int, shots: str = "") -> Run:
    """Shots on so many workers, into a folder of their own."""
    before = sum(os.times()[:4])
    batch = run_batch(
        [folder / "shots" / shots], folder / f"out {workers} {len(shots)}", workers=LocalWorkers(workers)
    )
    assert batch.is_done
    return Run(batch, sum(os.times()[:4]) - before)


def killed(folder: Path) -> str:
    """Workers are killed at random moments; every shot must have the results that it has without that."""
    workers, over, count = LocalWorkers(2), threading.Event(), 0

    def kill() -> None:
        nonlocal count
        rng = random.Random(1)
        while count < KILLS and not over.wait(rng.uniform(0.2, 1.0)):
            running = workers.processes()
            if running:
                os.kill(rng.choice(running), KILL)
                count += 1

    killer = threading.Thread(target=kill)
    began = time.perf_counter()
    killer.start()
    result = run_batch([folder / "shots"], folder / "out killed", BatchSettings(retries=100), workers=workers)
    over.set()
    killer.join()
    lost = sum(
        results_of(folder / "out 1 0", r.name) != results_of(folder / "out killed", r.name) for r in result.results
    )
    return (
        f"{count} kills, {lost} of {len(result.results)} results lost or other, {time.perf_counter() - began:.1f} s"
    )


WAITING = """
import time
from contact_core.atomic_file import write_atomic
from contact_core.plugins import hookimpl
from contact_core.plugins.slots import JobOutcome

class Wait:
    name, summary, suffixes = "wait", "a job that waits", (".wait",)
    def claims(self, path): return True
    def run(self, request, plugins, progress):
        time.sleep(1.0)
        write_atomic(request.folder / "done.txt", "done")
        return JobOutcome(("done.txt",))

@hookimpl
def contact_job_kinds(): return [Wait]
"""


def waiting(folder: Path) -> dict[str, str]:
    """How jobs spread over workers on a machine whose cores others use: each waits 1 s and needs no core."""
    (folder / "waiting_jobs.py").write_text(WAITING)
    os.environ |= {"CONTACT_PLUGINS": "waiting_jobs"}
    os.environ["PYTHONPATH"] = os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])
    sys.path.insert(0, str(folder))
    (folder / "jobs").mkdir()
    for number in range(41):
        (folder / "jobs" / f"{number:02d}.wait").touch()
    seconds = {}
    for count in (1, 2):
        batch = run_batch([folder / "jobs"], folder / f"out{count}", workers=LocalWorkers(count))
        assert batch.is_done
        one = run_batch([folder / "jobs" / "00.wait"], folder / f"one{count}", workers=LocalWorkers(count))
        seconds[count] = batch.seconds - one.seconds  # without the start of a worker
    told = {count: f"{each:.1f} s for 40 jobs of 1 s" for count, each in seconds.items()}
    return {"1 worker": told[1], "2 workers": f"{told[2]}, {seconds[1] / seconds[2]:.2f} times as fast"}


def results_of(out: Path, name: str) -> dict[str, bytes]:
    """The bytes of all results of a shot but its receipt."""
    return {path.name: path.read_bytes() for path in sorted((out / name).glob("*")) if path.name != RECEIPT}


if __name__ == "__main__":
    main()
