"""Every stored format: a file that was flipped, cut or holed is the same or refused, never another one."""

from __future__ import annotations

import os
import random
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contact_core as contact
from contact_core.arrays import digest
from contact_core.atomic_file import write_atomic
from contact_core.cache import cached_arrays
from contact_core.document.library import load_contact_set, save_contact_set
from contact_core.errors import ContactError, FileRefused
from contact_core.farm.task import RECEIPT, Result, read_receipt, sealed_receipt
from contact_core.rig.pose_files import load_pose, save_pose
from contact_core.scene.memory_host import MemoryHost
from contact_core.scene.memory_scene import load_scene, save_scene
from contact_core.sealed import sealed, unsealed
from contact_core.testing import meshes
from contact_core.testing.format_contract import bent

FLIPS = int(os.environ.get("CONTACT_FLIPS", "60"))  # of each format; more of them by `make explore`
Stored = tuple[Path, Callable[[], Any]]


def contact_set(folder: Path) -> Stored:
    ball = meshes.icosphere(2)
    with contact.new(ball=ball) as session:
        points = contact.SurfacePoints.at_vertices(ball, [0, 5, 9, 12])
        session.patches.paint("a", points, surface="ball", axis=points[[0, 2]])
        save_contact_set(session.sets.of("set", ["a"]), folder / "set.json")
    return folder / "set.json", lambda: repr(load_contact_set(folder / "set.json").patches)


def pose(folder: Path) -> Stored:
    save_pose(folder / "pose.json", bent(), rig="bar")

    def read() -> Any:
        found = load_pose(folder / "pose.json")
        return found.joints, digest(found.local)

    return folder / "pose.json", read


def scene(folder: Path) -> Stored:
    host = MemoryHost()
    host.add(contact.Asset("ball", meshes.icosphere(1)))
    save_scene(host.scene, folder / "a.contactscene")

    def read() -> Any:
        (found,) = load_scene(folder / "a.contactscene").objects.values()
        return found.name, found.world.tobytes()

    return folder / "a.contactscene", read


def receipt(folder: Path) -> Stored:
    result = Result("job", "done", files=("a.txt",), rows=(("gap", "1.2", False),), seconds=0.25)
    inputs = [{"file": "job.json", "sha256": "0" * 64, "size": 12, "changed": 345}]
    write_atomic(folder / RECEIPT, sealed_receipt("key", "document", inputs, asdict(result)))

    def read() -> Any:
        found = read_receipt(folder)
        if found is None:
            raise FileRefused("there is none.")
        return found

    return folder / RECEIPT, read


def cache(folder: Path) -> Stored:
    points = meshes.icosphere(1).points
    cached_arrays("proxies", "key", lambda: {"points": points})

    def gone() -> Any:
        raise FileRefused("it is made anew.")

    (path,) = folder.rglob("key.npz")
    return path, lambda: cached_arrays("proxies", "key", gone)["points"].tobytes()


@pytest.mark.parametrize("stored", [contact_set, pose, scene, receipt, cache], ids=lambda each: each.__name__)
def test_damage_is_never_another_content(
    stored: Callable[[Path], Stored], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CONTACT_CACHE", str(tmp_path))
    path, read = stored(tmp_path)
    whole, right, rng = path.read_bytes(), read(), random.Random(FLIPS)
    for _ in range(FLIPS):
        data, at = bytearray(whole), rng.randrange(len(whole))
        kind = rng.random()
        if kind < 0.7:
            data[at] ^= 1 << rng.randrange(8)
        elif kind < 0.85:
            del data[at:]
        else:
            data[at : at + 40] = bytes(len(data[at : at + 40]))
        path.write_bytes(data)
        try:
            found = read()
        except ContactError:
            continue
        assert found == right, f"byte {at} of {len(whole)}"


def test_a_seal_is_of_the_content_and_not_of_its_layout() -> None:
    data = {"b": [1, 2.5, None], "a": {"x": "ä"}}
    assert unsealed(sealed(data), "it") == data == unsealed(data, "it") == unsealed({**data, "digest": None}, "it")
    for change in ({"a": {}}, {"c": 1}, {"digest": "0" * 64}, {"digest": 7}):
        with pytest.raises(FileRefused, match='set its "digest" to null'):
            unsealed({**sealed(data), **change}, "it")
    assert np.isclose(unsealed(sealed({"x": 0.1}), "it")["x"], 0.1)
