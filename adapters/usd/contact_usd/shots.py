"""Contacts over the shots of a sequence: find a document's surfaces in a stage, bring contacts in, solve frames."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from contact_core.document.document import ContactDocument
from contact_core.edit.document_geometry import DocumentGeometry
from contact_core.errors import Cancelled, FileRefused, InvalidInput
from contact_core.plugins.manager import PluginManager
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.proposals.proposal import Proposal
from contact_core.session import Session
from contact_core.solve.solver import PoseSolution, SolveStatus
from contact_usd import contacts
from contact_usd.host import UsdHost
from contact_usd.stage_io import SUFFIXES


@contextlib.contextmanager
def open_shot(
    path: Path,
    surfaces: Mapping[str, str] | None = None,
    plugins: PluginManager | None = None,
    mend: Callable[[Session], None] | None = None,
) -> Iterator[Session]:
    """A session on a stage, every surface of its document bound to a prim.

    surfaces: prim paths by surface, for those that cannot be told. mend: may bind what is missing.

    The stage ends with the block, so that the next shot finds files as they are then. Raises InvalidInput for a
    surface without a prim.
    """
    session = Session(host=UsdHost(path), surfaces=surfaces, plugins=plugins if plugins is not None else ())
    try:
        if mend is not None:
            mend(session)
        for name, why in session.binding.missing.items():
            raise InvalidInput(f"{why} Name its prim with --surface {name}=PATH.")
        yield session
    finally:
        session.close()


def prims_of(session: Session) -> dict[str, str]:
    """The path of the prim behind each surface."""
    return {name: found.object_id for name, found in session.binding.surfaces.items()}


def contact_layer(path: Path, folder: Path | None = None) -> Path:
    """The file that holds the contacts of a shot: the shot itself, else NAME.contact.usda in `folder` or beside it.

    Raises InvalidInput that names the layer where there is none, or where it lies over another shot.
    """
    host = UsdHost(path)
    if host.stored_document() is not None:
        return path
    name = f"{path.stem}.contact.usda"
    places = dict.fromkeys(place / name for place in (folder, path.parent) if place is not None)
    layer = next((place for place in places if place.is_file()), None)
    if layer is None:
        raise InvalidInput(
            f"{path} has no contact pairs of its own, and there is no {' nor '.join(map(str, places))}. Bring"
            f" contacts onto the shot with `contact usd transfer CONTACTS {path.name}`, or name the layer that has"
            " them."
        )
    over = UsdHost(layer)  # held until its list is copied
    below = list(over.layer.subLayerPaths)
    if path.resolve() not in {Path(item).resolve() for item in below}:
        raise InvalidInput(f"{layer} lies over {', '.join(below) or 'no shot'}, not over {path}; name the layer.")
    return layer


def publish(session: Session, frames: Sequence[float] = ()) -> None:
    """Remember which prim is which, and write what viewers see; where contacts are at frames is keyed there."""
    prims = prims_of(session)
    key = session.binding.key
    if dict(session.document.extras.get(key, {})) != prims:
        session.set_extra(key, dict(prims))
    contacts.publish(session.host, session, prims)
    for frame in frames:
        document = session.binding.read(session.timed_document.at(frame), frame)
        contacts.key(session.host, document, geometry_of(session, document), frame)


def geometry_of(session: Session, document: ContactDocument) -> DocumentGeometry:
    """Where the contacts of another document are on the session's meshes and rigs."""
    return DocumentGeometry(lambda: document, session.derived, session.rigs)


def review(
    path: Path, frames: Sequence[float] | None, wanted: Mapping[str, str], out: Path | None
) -> dict[str, object]:
    """Write contacts as points and curves that every viewer shows, keyed at frames; facts for the report."""
    with open_shot(contact_layer(path, None if out is None else out.parent), wanted) as shot:
        with shot.host.step("Publish contacts"):
            publish(shot, frames or ())
        shot.host.save(out)
        return {"patches": list(shot.document.patches), "surfaces": prims_of(shot)}


def read_contacts(path: Path) -> ContactDocument:
    """The document in a stage or in a document file. Raises FileRefused where there is none, or it is empty."""
    if path.suffix.lower() in SUFFIXES:
        with Session(host=UsdHost(path), discover=False) as session:
            document = session.document
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
        loaded = source.sets.of("contacts", list(document.patches))
    with open_shot(path, wanted) as shot:
        with shot.host.step("Transfer contacts"):
            for surface in loaded.surfaces.values():
                if surface.name not in shot.document.surfaces:
                    shot.surfaces.bring(surface, wanted.get(surface.name))
            names = shot.sets.read(loaded)
            publish(shot)
        shot.host.save(out)
        return {"patches": list(names.values()), "surfaces": prims_of(shot)}


def solve(
    path: Path,
    frames: Sequence[float] | None,
    solver: str | None,
    wanted: Mapping[str, str],
    out: Path | None,
    progress: Progress = NO_PROGRESS,
    plugins: PluginManager | None = None,
) -> dict[str, object]:
    """Solve the pairs of a shot at frames, key the rigs there and save it; facts for the report.

    path: the shot, or its contact layer. frames: None for one solve without a key. Each frame starts from the
    animator's pose, later ones from the last. solver: a name; None leaves the choice to the plugins.
    """
    with open_shot(contact_layer(path, None if out is None else out.parent), wanted, plugins) as shot:
        times: Sequence[float | None] = [None] if frames is None else frames
        try:
            proposal = solve_open(shot, frames, solver, progress)
        except Cancelled:  # before the first frame
            return {"frames": [_frame_facts(frame, None) for frame in times]}
        if proposal.after.status is not SolveStatus.CANCELLED:
            shot.host.save(out)
        return {"frames": [_frame_facts(*known) for known in itertools.zip_longest(times, proposal.solutions)]}


def solve_open(shot: Session, frames: Sequence[float] | None, solver: str | None, progress: Progress) -> Proposal:
    """Solve an open shot, and unless that was cancelled accept and publish what came out; nothing is saved."""
    if not shot.document.pairs:
        raise InvalidInput("the shot has no contact pairs, so there is nothing to solve.")
    proposal = shot.solve(frames=frames, solver=solver, progress=progress)
    if proposal.after.status is not SolveStatus.CANCELLED:
        with shot.host.step("Solve and key"):
            shot.accept(proposal)
            publish(shot, frames or ())
    return proposal


def _frame_facts(frame: float | None, solution: PoseSolution | None) -> dict[str, object]:
    if solution is None:
        return {"frame": frame, "status": "CANCELLED"}
    return {
        "frame": frame,
        "status": solution.status.name,
        "value": solution.value if np.isfinite(solution.value) else None,
        "start_value": solution.start_value if np.isfinite(solution.start_value) else None,
    }
