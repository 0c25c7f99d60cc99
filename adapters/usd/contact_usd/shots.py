"""Contacts over the shots of a sequence: find a document's surfaces in a stage, bring contacts in, solve frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from contact_core.document.asset import Asset
from contact_core.document.document import ContactDocument, Surface
from contact_core.edit.pose_problem import pose_problem
from contact_core.errors import FileRefused, InvalidInput
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.session import Session
from contact_core.solve.body import Body
from contact_core.solve.problem import PoseProblem
from contact_core.solve.sequence import SequenceSolution, solve_sequence
from contact_core.solve.solver import PoseSolver
from contact_usd import contacts
from contact_usd.host import UsdHost
from contact_usd.stage_io import SUFFIXES

KEY = "host.usd"  # the document's extras: the prim behind each surface


@dataclass
class Shot:
    """A stage and a session on the document in it. prims: path of the prim behind each surface of the document."""

    host: UsdHost
    session: Session
    prims: dict[str, str] = field(default_factory=dict)

    @classmethod
    def open(cls, path: Path, wanted: Mapping[str, str] | None = None) -> Shot:
        """A file, with all surfaces of its document found in it. wanted: prim paths by surface, told not found.

        As a context manager it lets go of the stage at the end, so that the next shot finds files as they are then.
        """
        host = UsdHost(path)
        shot = cls(host, Session(host=host))
        try:
            for surface in shot.session.document.surfaces.values():
                shot.bind(surface, wanted or {})
        except BaseException:
            shot.__exit__()
            raise
        return shot

    def __enter__(self) -> Shot:
        return self

    def __exit__(self, *_: object) -> None:
        self.session.close()
        self.session.host = None  # the stage ends now, whenever Python finds time to free the session

    def bind(self, surface: Surface, wanted: Mapping[str, str]) -> None:
        """Give the session the mesh behind a surface, where it stands now. Raises InvalidInput."""
        path, asset = self._find(surface, wanted)
        placement = self.host.placement(path)
        self.session.add_surface(
            surface.name,
            asset.mesh,
            rig=asset.rig,
            meters_per_unit=asset.meters_per_unit or 1.0,
            up_axis=asset.up_axis,
            world_from_surface=placement,
        )
        if np.abs(self.session.document.surface(surface.name).world_from_surface - placement).max() > 1e-9:
            self.session.place_surface(surface.name, placement)
        self.prims[surface.name] = path

    def _find(self, surface: Surface, wanted: Mapping[str, str]) -> tuple[str, Asset]:
        """Path and asset of the prim that is told, or remembered, or alone has the surface's triangles."""
        remembered = self.session.document.extras.get(KEY, {}).get(surface.name)
        paths = [item.id for item in self.host.objects()]
        told = wanted.get(surface.name)
        if told is not None or remembered in paths:
            path = str(told or remembered)
            return path, self.host.read_surface(path)
        alike = [
            (path, asset)
            for path, asset in ((path, self.host.read_surface(path)) for path in paths)
            if asset.mesh.topology_digest == surface.topology_digest
        ]
        if len(alike) == 1:
            return alike[0]
        named = [(path, asset) for path, asset in alike if asset.name == surface.name]
        if len(named) == 1:
            return named[0]
        raise InvalidInput(
            f"{len(alike) or 'no'} prims have the {surface.faces} triangles of the surface {surface.name!r}:"
            f" name one with --surface {surface.name}=PATH; there are {', '.join(paths[:8]) or 'no meshes at all'}."
        )

    def publish(self) -> None:
        """Remember which prim is which, and write what viewers see."""
        if dict(self.session.document.extras.get(KEY, {})) != self.prims:
            self.session.set_extra(KEY, dict(self.prims))
        contacts.publish(self.host, self.session, self.prims)


def read_contacts(path: Path) -> ContactDocument:
    """The document in a stage or in a document file. Raises FileRefused where there is none, or it is empty."""
    if path.suffix.lower() in SUFFIXES:
        with Shot(host := UsdHost(path), Session(host=host, discover=False)) as shot:
            document = shot.session.document
    elif path.is_file():
        with Session.open(path) as session:  # with what an interrupted journal holds, which stays there unsaved
            document = session.document
    else:
        raise FileRefused(f"there is no file {path}.")
    if not document.patches:
        raise FileRefused(f"{path} holds no contacts.")
    return document


def transfer(
    document: ContactDocument, path: Path, wanted: Mapping[str, str], out: Path | None
) -> dict[str, object]:
    """Bring a document's contacts onto a shot and save it; facts for the report.

    Surfaces must have the triangles that the contacts were painted on. Raises ContactError.
    """
    with Session(document, discover=False) as source:
        loaded = source.contact_set("contacts", list(document.patches))
    with Shot.open(path, wanted) as shot:
        with shot.host.step("Transfer contacts"):
            for surface in loaded.surfaces.values():
                if surface.name not in shot.prims:
                    shot.bind(surface, wanted)
            names = shot.session.import_set(loaded)
            shot.publish()
        shot.host.save(out)
        return {"patches": list(names.values()), "surfaces": shot.prims}


def solve(
    path: Path,
    frames: Sequence[float] | None,
    solver: PoseSolver,
    wanted: Mapping[str, str],
    out: Path | None,
    progress: Progress = NO_PROGRESS,
) -> dict[str, object]:
    """Solve the pairs of a shot at frames, key the rigs there and save it; facts for the report.

    frames: None for one solve without a key. Each frame starts from the animator's pose, later ones from the last.
    """
    with Shot.open(path, wanted) as shot:
        if not shot.session.document.pairs:
            raise InvalidInput(f"{path} has no contact pairs, so there is nothing to solve.")
        times: list[float | None] = list(frames) if frames is not None else [None]
        problems = ((0.0 if frame is None else frame, _problem(shot, frame)) for frame in times)
        solved = solve_sequence(solver, problems, progress=progress, count=len(times))
        if solved.solutions:  # else it was cancelled before the first
            _write(shot, times, solved)
            shot.host.save(out)
        return {"frames": [_frame_facts(frame, k, solved) for k, frame in enumerate(times)]}


def _write(shot: Shot, times: Sequence[float | None], solved: SequenceSolution) -> None:
    """Key what was solved, keep the last pose in the document, and show it: one step."""
    rigs = [name for name in shot.prims if name in shot.session.rigs]
    with shot.host.step("Solve and key"):
        for frame, solution in zip(times, solved.solutions, strict=False):
            for name in rigs:
                if name in solution.poses:
                    shot.host.write_pose(shot.prims[name], solution.poses[name], frame)
        for name in rigs:
            if name in solved.solutions[-1].poses:
                shot.session.set_pose(name, solved.solutions[-1].poses[name])
        shot.publish()


def _problem(shot: Shot, frame: float | None) -> PoseProblem:
    """The document's pairs, with everything where the stage has it at a frame."""

    def body_of(name: str) -> Body:
        placement = shot.host.placement(shot.prims[name], frame)
        rig = shot.session.rigs.get(name)
        if rig is None:
            return Body.rigid(name, shot.session.meshes[name], world_from_surface=placement)
        pose = shot.host.read_pose(shot.prims[name], frame)
        return Body.skinned(rig, name=name, pose=pose, world_from_rig=placement)

    return pose_problem(shot.session.pairs(), body_of)


def _frame_facts(frame: float | None, k: int, solved: SequenceSolution) -> dict[str, object]:
    if k >= len(solved.solutions):
        return {"frame": frame, "status": "CANCELLED"}
    solution = solved.solutions[k]
    return {
        "frame": frame,
        "status": solution.status.name,
        "value": solution.value if np.isfinite(solution.value) else None,
        "start_value": solution.start_value if np.isfinite(solution.start_value) else None,
    }
