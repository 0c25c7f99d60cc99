"""A rig that Blender itself evaluates, whatever it is made of: for solves where linear skinning is not exact.

    black_box = EvaluatedRig(host, "hand")
    problem = PoseProblem(bodies=(Body.evaluated("hand", black_box), ...), ...)
    pose = black_box.pose(solution.poses["hand"])

Every evaluation poses the bones, lets the dependency graph run and takes the pose back: a few milliseconds.
A session chooses between this and the analytic rig by comparing skins (`scene.evaluated_rig`).
"""

from contact_core.scene.evaluated_rig import EvaluatedRig

__all__ = ["EvaluatedRig"]
