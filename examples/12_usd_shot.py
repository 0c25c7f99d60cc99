"""A shot in USD: open it, paint, solve at two frames, accept, save; what comes out is one layer over the shot."""

import numpy as np

import contact_core as contact
from contact_core.cli import main

main(["usd", "export", "sample:human_hand", "sample:baseball", "--out", "shot.usda"])  # a shot to work on

with contact.open("shot.usda") as session:
    hand, thing = session.document.surfaces  # every object of the stage is a surface
    rig, ball = session.rigs[hand], session.geometry.mesh(thing)
    size = np.ptp(ball.points, axis=0).max()
    for side, name in ((-1.0, "thumb_distal"), (1.0, "index_distal")):
        tip = rig.rest_world[rig.joint_index(name), :3, 3]
        session.patches.brush("disk", name, surface=hand, at=tip, radius=0.05 * size)
        root = contact.SurfacePoints.at_vertices(ball, [int(np.argmax(side * ball.points[:, 0]))])
        session.pairs.add(name, session.patches.transfer(name, thing, root, direction=[0.0, 1.0, 0.0]))
    session.accept(session.solve(frames=[1, 12]))  # contacts, pose and keys: one undo step of the stage
    session.draw("usd_shot.png", camera_from=(-0.6, 0.5, 1.0))
    session.save("shot.contact.usda")

with contact.open("shot.contact.usda") as again:
    print(len(again.document.pairs), "pairs, keys at", again.host.pose_keys(again.binding.surfaces[hand].object_id))
