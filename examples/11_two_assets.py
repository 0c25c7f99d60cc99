"""Two assets, two painted fingertips, one solve: from nothing to a posed hand. Files work as the samples do."""

import numpy as np

import contact_core as contact

with contact.new(hand="sample:human_hand", ball="sample:baseball") as session:
    rig, ball = session.rigs["hand"], session.geometry.mesh("ball")
    centre, size = ball.points.mean(axis=0), np.ptp(ball.points, axis=0).max()
    tips = {name: rig.rest_world[j, :3, 3] for j, name in enumerate(rig.joints) if name.endswith("distal")}

    for side, (name, tip) in zip((-1.0, 1.0), list(tips.items())[:2], strict=True):
        session.patches.brush("disk", name, surface="hand", at=tip, radius=0.05 * size)
        root = contact.SurfacePoints.at_vertices(ball, [int(np.argmax(side * ball.points[:, 0]))])
        session.pairs.add(name, session.patches.transfer(name, "ball", root, direction=[0.0, 1.0, 0.0]))

    proposal = session.solve()  # nothing has changed yet: look at it, then accept or dismiss it
    for name, pair in proposal.after.patches.items():
        print(f"{name}: {pair.mean:.3f} apart on the average, {100 * pair.opposed:.0f} % of it facing the ball")
    session.accept(proposal)
    session.draw("two_assets.png", camera_from=(0.5, 0.4, 1.0))
    session.undo()
    print("after one undo the hand is at rest:", not session.document.poses)
