"""`contact library`: grasps from files onto the shelf, and from the shelf onto files."""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from contact_core.atomic_file import read_bounded
from contact_core.document.schema import MAX_BYTES, parse_document
from contact_core.errors import Cancelled, FileRefused, InvalidInput
from contact_core.grasp_files.grasp import HAND, OBJECT, GraspResult, prepare, write_results
from contact_core.grasping.searching import GraspSettings
from contact_core.library.shelf import Library
from contact_core.library.verbs import apply_grasp, library_scene, save_grasp
from contact_core.opening import DOCUMENT_SUFFIX
from contact_core.opening import open as open_scene
from contact_core.plugins.manager import PluginManager
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.session import Session

if TYPE_CHECKING:
    from contact_core.document.document import ContactDocument
    from contact_core.grasping.slots import Kind


def save_file(
    library: Library,
    name: str,
    source: Path,
    files: Sequence[str] = (),
    *,
    scale: float = 1.0,
    kind: Kind | None = None,
    tags: Sequence[str] = (),
    note: str = "",
    replace: bool = False,
    plugins: PluginManager | None = None,
) -> int:
    """Save the grasp in a document, with the files of its hand and its object, or in a scene, which has both.

    scale: of the object's file, as the document was made with. Returns the number of the version. Raises
    FileRefused, InvalidInput.
    """
    plugins = plugins or PluginManager()
    save = partial(save_grasp, kind=kind, tags=tuple(tags), note=note, replace=replace)
    if source.suffix.lower() != DOCUMENT_SUFFIX:
        if files:
            raise InvalidInput(f"{source.name} is a scene and has its meshes: give no files for them.")
        with open_scene(source, plugins=plugins) as session:
            return save(session, library, name, *ends_of(session))
    if len(files) != 2:
        raise InvalidInput("a document holds no meshes: give the files of the hand and of the object after it.")
    document = parse_document(read_bounded(source, MAX_BYTES), source.name)
    job = prepare(files[0], files[1], scale, plugins)
    session = Session(document, plugins=plugins)
    names = []
    for role, file in ((HAND, files[0]), (OBJECT, files[1])):
        made = job.session.document.surface(role)
        surface = _surface_of(document, made.digest, source.name, file)
        mesh, rig = job.session.geometry.mesh(role), job.session.rigs.get(role)
        session.surfaces.add(surface, mesh, meters_per_unit=made.meters_per_unit, rig=rig)
        names.append(surface)
    return save(session, library, name, names[0], names[1], words=job.words)


def _surface_of(document: ContactDocument, digest: str, source: str, file: str) -> str:
    for name, surface in document.surfaces.items():
        if surface.digest == digest:
            return name
    raise FileRefused(
        f"{source} was not made with {file}: none of its surfaces ({', '.join(document.surfaces)}) is that mesh;"
        " give the same file, and --scale as it was."
    )


def ends_of(session: Session) -> tuple[str, str]:
    """The surfaces that the first pair of a rig and of what does not bend is on. Raises InvalidInput."""
    for pair in session.document.pairs.values():
        ends = [session.document.patch(end).surface for end in (pair.manipulator, pair.object)]
        if ends[0] in session.rigs and ends[1] not in session.rigs:
            return ends[0], ends[1]
    raise InvalidInput("no patch of a rig is paired with one of an object, so there is no grasp to save.")


def apply_files(
    library: Library,
    name: str,
    hand: str,
    thing: str,
    out: Path,
    *,
    scale: float = 1.0,
    at: tuple[float, float, float] | None = None,
    count: int = 1,
    plugins: PluginManager | None = None,
    progress: Progress = NO_PROGRESS,
) -> GraspResult:
    """A saved grasp on the hand in one file and the object in another, written as `contact grasp` writes.

    Raises ContactError; then nothing is half-written.
    """
    plugins = plugins or PluginManager()
    began = time.perf_counter()
    job = prepare(hand, thing, scale, plugins)
    try:
        found = apply_grasp(
            job.session, library, name, HAND, OBJECT, at=at, count=count, words=job.words,
            progress=progress.part(0.05, 0.85),
        )  # fmt: skip
        seconds = {"all": round(time.perf_counter() - began, 2)}
        job.notes.extend(dict.fromkeys(note for one in found for note in one.notes))
        scene = library_scene(job.session, HAND, OBJECT, job.words)
        suggestions = [one.suggestion for one in found]
        return write_results(job, scene, suggestions, out, plugins, seconds, GraspSettings(count), progress)
    except Cancelled as cancelled:
        raise Cancelled("applying the grasp was cancelled; nothing was written.") from cancelled
