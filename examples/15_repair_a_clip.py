"""A clip of a body whose feet slip: find its contacts, hold them, keep its style; the scene gets few keys."""

import json
from pathlib import Path

import numpy as np

import contact_core as contact
from contact_core.cli import main
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.reading import read_asset
from contact_core.rig.rotations import exponential

# A scene to work on: a body that swings its arms, and wanders over the floor by three centimetres, feet and all.
body = read_asset("sample:human_body", PluginManager())
rig = body.rig
assert rig is not None
up = ["X", "Y", "Z"].index(body.up_axis)
along, across = (axis for axis in range(3) if axis != up)
low, size = rig.surface.points[:, up].min(), np.ptp(rig.surface.points[:, up])
corners = np.zeros((4, 3))
corners[:, [along, across]] = size * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
corners[:, up] = low
faces = [[0, 1, 2], [0, 2, 3]] if np.linalg.det(np.eye(3)[[along, across, up]]) > 0.0 else [[0, 2, 1], [0, 3, 2]]
floor = contact.TriangleMesh(corners, faces)
host = contact.MemoryHost()
actor = host.add(body)
host.add(contact.Asset("floor", floor, meters_per_unit=body.meters_per_unit, up_axis=body.up_axis))
for frame in range(25):
    local = rig.rest_local.copy()
    local[0, along, 3] += 0.03 * np.sin(0.25 * frame)
    local[0, across, 3] += 0.02 * np.sin(0.4 * frame)
    for joint, way in (("upperarm_l", 1.0), ("upperarm_r", -1.0)):
        index = rig.joint_index(joint)
        shoulder = rig.rest_world[rig.parents[index], :3, :3]
        turn = exponential(0.5 * way * np.sin(0.25 * frame) * np.eye(3)[[along]])[0][0]
        local[index, :3, :3] = shoulder.T @ turn @ shoulder @ local[index, :3, :3]
    host.write_pose(actor, contact.Pose(rig.joints, local), float(frame))
with contact.Session(host=host, objects=None) as session:
    session.timeline.set(0, 24, rate=24)
    session.save("clip.contactscene")

command = "motion clip.contactscene --out repaired --detect --follow 50 --skate 50 --no-pictures --quiet"
main(command.split())  # without --no-pictures: a film strip and a movie, too
report = json.loads(Path("repaired/motion.json").read_text())
for name, pair in report["pairs"].items():
    print(f"{name}: slips by {1e3 * pair['skate_rms_per_second']:.2f} mm/s")

with contact.open("repaired/clip.keyed.contactscene") as again:
    track = again.timeline.track("pose", "human_body")
    assert track is not None
    there = again.host.pose_keys(actor)
    print(f"{len(track.keys)} keys in the document; {len(there)} in the scene, which had its own")
