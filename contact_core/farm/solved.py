"""What the report shows of a solve: how near each pair came, how good that is, and a small picture."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from contact_core.errors import ContactError
from contact_core.grasping.verdict import ACCEPT
from contact_core.plugins.registry import RENDERERS
from contact_core.plugins.slots import JobOutcome
from contact_core.scene.picture import Picture, PictureMesh
from contact_core.solve.body import manipulator_length
from contact_core.solve.solver import posed_mesh

if TYPE_CHECKING:
    from contact_core.arrays import FloatArray
    from contact_core.proposals.proposal import Proposal
    from contact_core.session import Session
    from contact_core.solve.solver import PoseSolution

THUMBNAIL = "picture.png"
SIZE = (320, 240)  # pixels
_SKIN, _THING = (0.84, 0.64, 0.53), (0.66, 0.69, 0.74)
_LIMIT = ACCEPT["mean_contact_distance"][1]  # of the manipulator's length: what a grasp is judged by


def outcome_of(
    proposal: Proposal,
    files: tuple[str, ...],
    *,
    frames: Sequence[float] | None = None,
    picture: str | None = None,
    notes: tuple[str, ...] = (),
    inputs: tuple[Path, ...] = (),
) -> JobOutcome:
    """The outcome of a solve: the pair that is farthest from its partner, over all frames, says how good it is.

    frames: those of the solutions, None for a solve of the scene as it stands.
    A pair fails where its points are on average farther apart than 2.5 % of the manipulator's length.
    """
    rows, failures, worst = [], [], 0.0
    for frame, solution in zip_longest(frames or (), proposal.solutions):
        for name, share in gaps(solution).items():
            worst = max(worst, share / _LIMIT)
            label = name if frame is None else f"{name}, frame {frame:g}"
            rows.append((label, f"{100 * share:.2f} % apart", share > _LIMIT))
            if share > _LIMIT:
                failures.append(f"{label}: {100 * share:.1f} % of the hand's length apart, at most"
                                f" {100 * _LIMIT:g} % expected")  # fmt: skip
    return JobOutcome(files, worst, tuple(failures), tuple(rows), notes, picture, inputs)


def gaps(solution: PoseSolution) -> dict[str, float]:
    """By pair, the mean distance of its points, in lengths of its manipulator."""
    problem = solution.problem
    lengths = {}
    for body in problem.bodies:
        scale = float(abs(np.linalg.det(body.world_from_rig[:3, :3])) ** (1.0 / 3.0))
        lengths[body.name] = manipulator_length(body.rig) * scale
    manipulator = {contact.name: contact.manipulator for contact in problem.contacts}
    return {name: gap.mean / lengths[manipulator[name]] for name, gap in solution.patches.items()}


def draw_solved(session: Session, proposal: Proposal, path: Path) -> str | None:
    """A picture of the solved scene by the renderer for thumbnails; its file's name, None where nothing draws."""
    try:
        name = session.plugins.name_for(RENDERERS, "thumbnail")
        session.plugins.get(RENDERERS, name).render([_picture(session, proposal.after)], path, size=SIZE)
    except ContactError:  # a job without a picture is a job
        return None
    return path.name


def _picture(session: Session, solution: PoseSolution) -> Picture:
    problem, state = solution.problem, solution.problem.state(solution.theta)
    drawn = [body.name for body in problem.bodies if body.black_box is None]
    meshes = {name: posed_mesh(problem, state, name) for name in drawn}
    points: list[tuple[FloatArray, tuple[float, float, float]]] = []
    for contact in problem.contacts:
        color = session.document.patch(session.document.pairs[contact.name].manipulator).color
        ends = ((contact.manipulator, contact.manipulator_points), (contact.object, contact.object_points))
        points += [(on.positions(meshes[body]), color) for body, on in ends if body in meshes]
    colors = {body.name: _SKIN if body.name in session.rigs else _THING for body in problem.bodies}
    return Picture(tuple(PictureMesh(mesh, colors[name]) for name, mesh in meshes.items()), tuple(points))
