"""A document goes from a USD stage, or a scene of the application, into Blender and back with the same poses."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from contact_core.document.asset import Asset
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import Pose
from contact_core.session import Session
from contact_core.testing import meshes
from contact_core.testing.host_scenes import affine, arm_rig

RADIANS = 1e-4
# OpenUSD and Blender each bring their own USD library, so the stage is in a process of its own.
ON_A_STAGE = """
import sys
from pathlib import Path
sys.path.insert(0, {here!r})
from test_blender_handover import furnished, painted_and_solved, posed_as_written
from contact_core.session import Session
from contact_usd.host import UsdHost
way, stage, document = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
if way == "out":
    host = UsdHost()
    furnished(host)
    with Session(host=host, objects=None, discover=False) as session:
        painted_and_solved(session)
        session.save(stage)
        session.save(document)
else:
    host = UsdHost()
    furnished(host)
    with posed_as_written(document, host) as session:
        session.save(stage)
        session.save(Path(sys.argv[4]))
"""


def furnished(host: Any) -> None:
    """An arm and a ball, the same in every program."""
    rig, ball = arm_rig(), meshes.icosphere(1)
    host.add(Asset("arm", rig.surface, rig, meters_per_unit=1.0))
    near = ball.with_points(0.2 * ball.points)
    host.add(Asset("ball", near, meters_per_unit=1.0), affine((0.6, 0.5, 0.1), (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)))


def painted_and_solved(session: Session) -> None:
    skin, ball = session.geometry.mesh("arm"), session.geometry.mesh("ball")
    tip = int(np.argmax(skin.points[:, 1] + skin.points[:, 0]))
    near = np.argsort(np.linalg.norm(skin.points - skin.points[tip], axis=1))[:6]
    points = SurfacePoints.at_vertices(skin, near)
    session.patches.paint("tip", points, surface="arm", axis=points[[0]], heading=1.0)
    side = SurfacePoints.at_vertices(ball, [int(np.argmin(ball.points[:, 0]))])
    session.pairs.add("tip", session.patches.transfer("tip", "ball", side, heading=1.0))
    session.accept(session.solve())


def posed_as_written(document: Path, host: Any) -> Session:
    """A session on a document in another program, whose bones take its poses."""
    session = Session.open(document, host=host, discover=False)
    for surface, pose in session.document.poses.items():
        session.surfaces.set_pose(surface, Pose(pose.joints, pose.local))
    return session


def turned_apart(first: Pose, second: Pose) -> float:
    """The largest angle between the joints of two poses, radians."""
    at = [second.joints.index(joint) for joint in first.joints]
    turns = [Rotation.from_matrix(each[:, :3, :3]) for each in (first.local, second.local[at])]
    return float((turns[0].inv() * turns[1]).magnitude().max())


def check(original: Session, session: Session, read: Pose) -> None:
    """Patches, pairs and poses are those of the original; `read` is what the bones of the program say."""
    document, told = session.document, original.document
    assert set(document.patches) == set(told.patches) and set(document.pairs) == set(told.pairs)
    for name in told.patches:
        assert document.patches[name].placement == told.patches[name].placement
    pose = told.poses["arm"]
    assert turned_apart(pose, Pose.rest(arm_rig())) > 0.1  # or there would be nothing to hand over
    assert turned_apart(pose, read) < RADIANS and turned_apart(pose, document.poses["arm"]) < RADIANS


def on_a_stage(*arguments: str | Path) -> None:
    """Run the script in the Python that runs the suite; skips where that has no OpenUSD."""
    python = os.environ.get("PYTHON_OF_THE_SUITE")
    if python is None or subprocess.run([python, "-c", "import pxr"], capture_output=True).returncode:
        pytest.skip("OpenUSD (usd-core) is not installed in the Python that started this suite")
    script = ON_A_STAGE.format(here=str(Path(__file__).parent))
    said = subprocess.run([python, "-c", script, *map(str, arguments)], capture_output=True, text=True)
    assert said.returncode == 0, said.stderr


def test_from_a_stage_into_blender_and_back(bpy: Any, empty: Any, tmp_path: Path) -> None:
    stage, out, back = tmp_path / "shot.usda", tmp_path / "out.json", tmp_path / "back.json"
    on_a_stage("out", stage, out)
    furnished(empty)
    bpy.context.view_layer.update()
    with Session.open(out, discover=False) as original, posed_as_written(out, empty) as session:
        check(original, session, empty.read_pose("arm"))
        empty.save(tmp_path / "shot.blend")
        session.save(back)
        on_a_stage("back", tmp_path / "back.usda", back, tmp_path / "again.json")
        with Session.open(tmp_path / "again.json", discover=False) as again:
            check(original, session, again.document.poses["arm"])


def test_from_a_scene_of_the_application_into_blender_and_back(bpy: Any, empty: Any, tmp_path: Path) -> None:
    from contact_core.scene.memory_host import MemoryHost

    scene, out, back = tmp_path / "shot.contactscene", tmp_path / "out.json", tmp_path / "back.json"
    host = MemoryHost()
    furnished(host)
    with Session(host=host, objects=None, discover=False) as session:
        painted_and_solved(session)
        session.save(scene)
        session.save(out)
    furnished(empty)
    bpy.context.view_layer.update()
    with Session(host=MemoryHost.open(scene), discover=False) as original:
        with posed_as_written(out, empty) as session:
            check(original, session, empty.read_pose("arm"))
            session.save(back)
        other = MemoryHost()
        furnished(other)
        with posed_as_written(back, other) as session:
            check(original, session, other.read_pose("arm"))
