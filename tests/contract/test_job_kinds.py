"""The contract of kinds of jobs on every kind that we ship."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import contact_core as contact
from contact_core.document.asset import Asset
from contact_core.document.schema import dump_document
from contact_core.farm.kinds import DocumentJob, RecipeJob
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import FORMATS
from contact_core.plugins.slots import JobKind
from contact_core.testing import meshes
from contact_core.testing.format_contract import bar
from contact_core.testing.job_kind_contract import JobKindContract

RECIPE = """
schema = 1
name = "finger"
[manipulator]
file = "finger.glb"
[object]
file = "ball.glb"
center = [0.5, 0.2, 1.6]
[solve]
penetration = 0
options = { max_iterations = 3 }
[view]
size = [200, 120]
[[patch]]
name = "tip"
positions = [[0.3, 0.0, 2.0], [0.2, 0.2, 2.0], [0.0, 0.3, 2.0]]
axis = { through = [{ position = [0.3, 0.0, 2.0] }, { position = [0.0, 0.3, 2.0] }] }
place = { root = { position = [0.5, 0.2, 1.1] }, direction = [1, 0, 0] }
"""


def assets_in(folder: Path) -> list[Path]:
    gltf = PluginManager().offers(FORMATS)["gltf"]
    ball = meshes.icosphere(2)
    gltf.write(folder / "finger.glb", [bar()], {})
    gltf.write(folder / "ball.glb", [Asset("ball", ball.with_points(0.5 * ball.points))], {})
    return [folder / "finger.glb", folder / "ball.glb"]


@pytest.fixture(scope="module")
def finger_on_ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a document and its two assets."""
    folder = tmp_path_factory.mktemp("document")
    finger, ball = assets_in(folder)
    with contact.new(finger=finger, ball=ball) as session:
        skin, thing = session.geometry.mesh("finger"), session.geometry.mesh("ball")
        points = contact.SurfacePoints.at_vertices(skin, np.argsort(-skin.points[:, 2], kind="stable")[:5])
        session.patches.paint("tip", points, surface="finger", axis=points[[0, 3]])
        root = contact.SurfacePoints.at_vertices(thing, [int(np.argmin(thing.points[:, 2]))])
        session.pairs.add("tip", session.patches.transfer("tip", "ball", root, heading=1.0 + 0.0j))
        place = np.eye(4)
        place[:3, 3] = (0.4, 0.2, 1.6)
        session.surfaces.place("ball", place)
        (folder / "job.json").write_bytes(dump_document(session.timed_document))
    return folder


class TestRecipeJob(JobKindContract):
    @pytest.fixture
    def kind(self) -> JobKind:
        return RecipeJob()

    @pytest.fixture
    def example(self, tmp_path: Path) -> Path:
        (tmp_path / "finger.toml").write_text(RECIPE)
        assets_in(tmp_path)
        return tmp_path / "finger.toml"

    @pytest.fixture
    def reads(self, example: Path) -> list[Path]:
        return [example.with_name("finger.glb"), example.with_name("ball.glb")]

    def comparable(self, name: str, data: bytes) -> bytes:
        """The report tells how long each stage took."""
        if name != "report.json":
            return data
        return json.dumps({key: value for key, value in json.loads(data).items() if key != "seconds"}).encode()


class TestDocumentJob(JobKindContract):
    @pytest.fixture
    def kind(self) -> JobKind:
        return DocumentJob()

    @pytest.fixture
    def example(self, tmp_path: Path, finger_on_ball: Path) -> Path:
        return Path(shutil.copytree(finger_on_ball, tmp_path / "jobs")) / "job.json"

    @pytest.fixture
    def reads(self, example: Path) -> list[Path]:
        return [example.with_name("finger.glb"), example.with_name("ball.glb")]
