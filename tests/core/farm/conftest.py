"""Small real jobs: documents with one finger on a ball, and the two assets beside them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import contact_core as contact
from contact_core.geometry.mesh import TriangleMesh
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import FORMATS
from contact_core.testing import meshes
from contact_core.testing.format_contract import bar


def write_assets(folder: Path, radius: float = 0.5) -> None:
    """finger.glb and ball.glb; a ball of another radius has the same triangles in another shape."""
    folder.mkdir(parents=True, exist_ok=True)
    gltf = PluginManager().offers(FORMATS)["gltf"]
    ball = meshes.icosphere(2)
    gltf.write(folder / "finger.glb", [bar()], {})
    gltf.write(folder / "ball.glb", [contact.Asset("ball", TriangleMesh(radius * ball.points, ball.faces))], {})


def write_jobs(folder: Path, count: int) -> list[Path]:
    """Documents job000.json ..., which differ in where the ball stands."""
    write_assets(folder)
    paths = []
    for number in range(count):
        with contact.new(finger=folder / "finger.glb", ball=folder / "ball.glb") as session:
            skin, ball = session.geometry.mesh("finger"), session.geometry.mesh("ball")
            tip = np.argsort(-skin.points[:, 2], kind="stable")[:5]
            points = contact.SurfacePoints.at_vertices(skin, tip)
            session.patches.paint("tip", points, surface="finger", axis=points[[0, 3]])
            root = contact.SurfacePoints.at_vertices(ball, [int(np.argmin(ball.points[:, 2]))])
            session.pairs.add("tip", session.patches.transfer("tip", "ball", root, heading=1.0 + 0.0j))
            place = np.eye(4)
            place[:3, 3] = (0.4 + 0.01 * number, 0.2, 1.6)
            session.surfaces.place("ball", place)
            paths.append(folder / f"job{number:03d}.json")
            session.save(paths[-1])
    for litter in [*folder.glob("*.journal*"), *folder.glob("*.lock")]:
        litter.unlink()
    return paths


@pytest.fixture
def jobs(tmp_path: Path) -> Path:
    """A folder with four jobs."""
    write_jobs(tmp_path / "jobs", 4)
    return tmp_path / "jobs"
