"""In Blender (`blender --background --python 16_blender.py`, or its text editor): a hand posed by two contacts."""

import bpy
import numpy as np

import contact_core as contact
from contact_blender.host import BlenderHost

bpy.ops.wm.read_factory_settings(use_empty=True)  # a scene of our own; leave it out to work on the one that is open
host = BlenderHost()
for name in ("human_hand", "baseball"):
    host.add(contact.read_asset(f"sample:{name}"))

with contact.Session(host=host, objects=None) as session:
    hand, thing = session.document.surfaces  # every mesh object is a surface
    rig, ball = session.rigs[hand], session.geometry.mesh(thing)
    size = np.ptp(ball.points, axis=0).max()
    for side, name in ((-1.0, "thumb_distal"), (1.0, "index_distal")):
        tip = rig.rest_world[rig.joint_index(name), :3, 3]
        session.patches.brush("disk", name, surface=hand, at=tip, radius=0.05 * size)
        root = contact.SurfacePoints.at_vertices(ball, [int(np.argmax(side * ball.points[:, 0]))])
        session.pairs.add(name, session.patches.transfer(name, thing, root, direction=[0.0, 0.0, 1.0]))
    session.accept(session.solve(frames=[1]))  # contacts, bones and keys: one step of Blender's undo
    session.draw("blender.png", camera_from=(-0.6, -1.0, 0.5), up=(0.0, 0.0, 1.0))
    session.save("hand.blend")
    print(len(session.document.pairs), "pairs, keys at", host.pose_keys(session.binding.surfaces[hand].object_id))
