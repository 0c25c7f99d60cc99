"""The film strip of docs/motion.md: the body sits down and stands up, as the benchmark solves it.

python benchmarks/sitting_strip.py docs/images/sitting-strip.png
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from motion_scenes import sitting

from contact_core.film.film import SKIN, THING
from contact_core.geometry.transform import transform_points
from contact_core.motion.solving import MotionSolution, solve_motion
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import RENDERERS
from contact_core.rig.rig import skin
from contact_core.scene.picture import Picture, PictureMesh

ROWS = (0, 34, 44, 60, 80, 92, 120)


def picture(solution: MotionSolution, row: int) -> Picture:
    """Everything at a frame."""
    problem = solution.motion.posed[row]
    state, meshes = problem.state(solution.thetas[row]), []
    for index, body in enumerate(problem.bodies):
        posed = len(problem.free_of_body[index]) > 0
        placed = (
            skin(body.rig, state.motions[index].world)
            if posed
            else transform_points(body.world_from_rig, body.rig.surface.points)
        )
        meshes.append(PictureMesh(body.rig.surface.with_points(placed), SKIN if posed else THING))
    return Picture(tuple(meshes), camera_from=(1.0, 0.25, 0.75), caption=f"frame {row}")


if __name__ == "__main__":
    solved = solve_motion(sitting(leaning=True))
    pictures = [picture(solved, row) for row in ROWS]
    everything = [item.mesh.points for each in pictures for item in each.meshes[:2]]  # not the floor
    focus = np.concatenate([np.stack([points.min(axis=0), points.max(axis=0)]) for points in everything])
    plugins = PluginManager()
    renderer = plugins.get(RENDERERS, plugins.name_for(RENDERERS, "thumbnail"))
    renderer.render([replace(each, focus=focus) for each in pictures], Path(sys.argv[1]), size=(1750, 340))
