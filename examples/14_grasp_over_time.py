"""Contacts over time: two fingertips take hold of a ball that flies, slide a little, and let go; then one edit."""

import numpy as np

import contact_core as contact

with contact.new(hand="sample:human_hand", ball="sample:baseball") as session:
    rig, ball = session.rigs["hand"], session.geometry.mesh("ball")
    size = np.ptp(ball.points, axis=0).max()
    film = session.timeline
    film.set(0, 36, rate=24)
    for side, name in ((-1.0, "thumb_distal"), (1.0, "index_distal")):
        tip = rig.rest_world[rig.joint_index(name), :3, 3]
        session.patches.brush("disk", name, surface="hand", at=tip, radius=0.05 * size)
        root = contact.SurfacePoints.at_vertices(ball, [int(np.argmax(side * ball.points[:, 0]))])
        spot = session.patches.transfer(name, "ball", root, direction=[0.0, 1.0, 0.0], name=f"{name} spot")
        session.pairs.add(name, spot, name=name)
        film.hold(name, on=12, off=26)  # fades in before, and out after

    film.key("place", "ball", frame=0)  # from here on, moving the ball at a frame is a key
    film.key("placement", "index_distal spot", frame=12)  # and so is sliding the contact
    film.go(36)
    flown = np.eye(4)
    flown[:3, 3] = [0.10, 0.12, 0.0]
    session.surfaces.place("ball", flown)
    film.go(26)
    near = np.argsort(np.linalg.norm(ball.points - ball.points[int(np.argmax(ball.points[:, 0]))], axis=1))
    session.patches.translate("index_distal spot", contact.SurfacePoints.at_vertices(ball, near[60:61]))

    found = session.solve(frames=film.settings.frames())  # all frames at once; nothing has changed yet
    report = found.report(depth=False)
    for name, pair in report.pairs.items():
        print(
            f"{name}: {1e3 * pair.mean:.1f} mm apart while it holds, slips at most {1e3 * pair.skate_max:.1f} mm/s"
        )
    print(f"{report.keys['hand']} keys, the skin within {1e3 * report.key_error['hand']:.2f} mm of what was solved")
    session.accept(found)  # few keys, one undo step

    film.go(18)
    pose = session.document.poses["hand"]
    local = pose.local.copy()
    local[0, :3, 3] += [0.0, 0.004, 0.0]
    session.surfaces.set_pose(
        "hand", contact.Pose(pose.joints, local)
    )  # a key of one's own: solved ones keep to it
    print("stale now:", film.stale("hand"))
    session.accept(session.solve(frames=film.window()))
    print("stale after the window was solved again:", film.stale("hand"))
