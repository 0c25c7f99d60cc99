"""What the first drag would wait for, made beside the window: kernels, trees and normals, and what is solid."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import TYPE_CHECKING

from contact_core.errors import InvalidInput
from contact_core.geometry.distance_field import DistanceField
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.interaction.live import LiveSolve
from contact_core.progress import Progress
from contact_core.solve.penetration import RESOLUTION
from contact_core.solve.problem import PoseProblem
from contact_core.solve.warm_up import warm_up

if TYPE_CHECKING:
    from contact_core.interaction.desk import Desk


def preparation(desk: Desk) -> Callable[[Progress], None]:
    """The work that builds what picking and a live solve keep with the surfaces of a desk. The work reads only
    values, so it may run on another thread; it raises Cancelled."""
    rigs = desk.session.rigs
    surfaces = tuple(
        (seen.rest, name in rigs) for name, seen in desk.scene.surfaces.items() if len(seen.rest.faces)
    )
    problems: tuple[PoseProblem, ...] = ()
    with contextlib.suppress(InvalidInput):  # what cannot be built is left to the solve, which says why
        problems = LiveSolve(desk).before_any_contact()

    def work(progress: Progress) -> None:
        progress.tell(0.0, "kernels, compiled once on this machine")
        warm_up()
        for number, (mesh, bends) in enumerate(surfaces):
            _prepare(mesh, bends=bends, progress=progress.part(*_share(number, len(surfaces), 0.0, 0.7)))
        for number, problem in enumerate(problems):
            progress.tell(_share(number, len(problems), 0.7, 1.0)[0], "what is solid")
            with contextlib.suppress(InvalidInput):
                problem.value(problem.start_state)

    return work


def _prepare(mesh: TriangleMesh, *, bends: bool, progress: Progress) -> None:
    progress.tell(0.0, "trees and normals")
    Locator.of(mesh)
    mesh.normals_at(mesh.faces[0])
    progress.tell(0.5, "depths")
    with contextlib.suppress(InvalidInput):
        if not bends:
            DistanceField.of(mesh, resolution=RESOLUTION)


def _share(number: int, count: int, start: float, end: float) -> tuple[float, float]:
    """Where part `number` of `count` begins and ends between two fractions."""
    return start + (end - start) * number / count, start + (end - start) * (number + 1) / count
