"""USD shots as jobs of `contact batch`: solve the pairs, key the poses, publish the contacts, one layer each."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from contact_core.plugins.slots import JobOutcome, JobRequest
from contact_core.progress import Progress

if TYPE_CHECKING:
    from contact_core.geometry.mesh import TriangleMesh
    from contact_core.plugins.manager import PluginManager
    from contact_core.session import Session


class ShotJob:
    """`contact usd solve` on one shot, whose result is a new layer over it. pxr is imported when a job runs."""

    name = "shot"
    summary = "a USD shot with contacts: a layer over it with keyed poses and contacts to look at"
    suffixes: tuple[str, ...] = (".usda", ".usdc", ".usd", ".usdz")

    def claims(self, path: Path) -> bool:
        """In a folder, contact layers are the jobs: NAME.contact.usda; what they lie over is not."""
        return path.stem.endswith(".contact")

    def run(self, request: JobRequest, plugins: PluginManager, progress: Progress) -> JobOutcome:
        """Solve and save. A surface whose asset has other triangles now is rebound, where it is known."""
        from contact_core.atomic_set import replacing_set
        from contact_core.farm.kinds import check_finished
        from contact_core.farm.solved import THUMBNAIL, draw_solved, outcome_of
        from contact_usd import rebinding, shots

        layer = shots.contact_layer(request.path)
        name = f"{layer.stem.removesuffix('.contact')}.contact.usda"
        notes: list[str] = []
        painted: dict[str, TriangleMesh] = {}

        def mend(shot: Session) -> None:
            moved, surfaces = rebinding.rebind_changed(shot, request.folder / rebinding.KEPT)
            notes.extend(moved)
            painted.update(surfaces)

        with shots.open_shot(layer, plugins=plugins, mend=mend) as shot:
            read = {str(layer), *(item.realPath for item in shot.host.stage.GetUsedLayers() if item.realPath)}
            frames = None if request.frames is None else list(request.frames)
            proposal = shots.solve_open(shot, frames, request.solver, progress.part(0.1, 0.8, "Solving"))
            check_finished(proposal.after.status.name)
            names = (name, rebinding.KEPT, THUMBNAIL)
            with replacing_set(request.folder, names) as stage:
                shot.host.save(stage / name, request.folder)
                rebinding.keep(stage / rebinding.KEPT, painted)
                picture = draw_solved(shot, proposal, stage / THUMBNAIL)
            files = names if picture is not None else names[:-1]
            inputs = tuple(map(Path, sorted(read)))
            return outcome_of(
                proposal, files, frames=frames, picture=picture, notes=(*notes, *shot.notes), inputs=inputs
            )
