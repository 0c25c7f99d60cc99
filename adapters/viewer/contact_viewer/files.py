"""What an artist opens, saves and exports.

A session that edits mesh and rig files lives in a scene of the viewer's own (`ViewerHost`), whose file
(.contactscene) holds meshes, rigs, pose keys and contacts together. A USD stage is its own scene, a document
(.json) comes with the mesh files that it was painted on.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.atomic_file import read_bounded
from contact_core.document.asset import Asset
from contact_core.document.document import ContactDocument
from contact_core.document.schema import parse_document
from contact_core.errors import FileRefused
from contact_core.film.clip import standing_scene, write_clip
from contact_core.geometry.transform import transform_points
from contact_core.opening import DOCUMENT_SUFFIX
from contact_core.opening import open as open_in_host
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.reading import read_asset
from contact_core.plugins.registry import FORMATS, HOSTS
from contact_core.plugins.slots import ClipFormat
from contact_core.scene.host import SceneSpace, StoredDocument
from contact_core.session import Session
from contact_viewer.host import ViewerHost

SCENE_SUFFIX = ".contactscene"
MAX_DOCUMENT = 1 << 28  # bytes
START = ("sample:human_hand", "sample:mug")  # where no file is given
_GAP = 0.25  # of the larger of two things that are put side by side


def open_files(sources: Sequence[str], plugins: PluginManager, recovered: ContactDocument | None = None) -> Session:
    """A session on what is named: files, folders that a job wrote, "sample:NAME"; the built-in hand and mug
    without.

    recovered: what was edited there and not saved. Raises FileRefused, with a sentence.
    """
    sources = [_within_folder(source) for source in sources] or list(START)
    documents = [source for source in sources if source.lower().endswith(DOCUMENT_SUFFIX)]
    rest = [source for source in sources if source not in documents]
    if len(documents) > 1:
        raise FileRefused(f"one document at a time is edited, but got {len(documents)}: {', '.join(documents)}.")
    scenes = [source for source in rest if _is_scene(source, plugins)]
    if scenes and len(sources) > 1:
        raise FileRefused(f"{scenes[0]} is a scene of its own: open it alone, without other files.")
    if scenes and Path(scenes[0]).suffix.lower() != SCENE_SUFFIX:
        return open_in_host(scenes[0], plugins=plugins)
    if scenes:
        host = ViewerHost(scenes[0])
        return _session_in(host, plugins, recovered) if recovered else _opened(host, plugins)
    document = recovered or (_document(documents[0]) if documents else None)
    assets = [read_asset(source, plugins) for source in rest]
    if document is not None and not assets:
        raise FileRefused(_lacking(documents[0], document))
    return session_of(assets, plugins, document)


def session_of(assets: Sequence[Asset], plugins: PluginManager, document: ContactDocument | None = None) -> Session:
    """A session on assets in a new scene of the viewer, each where the document has it, else beside those before
    it.

    Raises FileRefused, also where a document has contacts on meshes that did not come.
    """
    units = [asset.meters_per_unit for asset in assets if asset.meters_per_unit is not None]
    host = ViewerHost(space=SceneSpace(min(units, default=1.0), assets[0].up_axis if assets else "Y"))
    known = {s.topology_digest: s.world_from_surface for s in document.surfaces.values()} if document else {}
    reach: float | None = None
    for asset in assets:
        place, reach = _beside(asset, reach, host.space())
        host.add(asset, known.get(asset.mesh.topology_digest, place))
    return _session_in(
        host, plugins, document, [f"{asset.name}: {note}" for asset in assets for note in asset.notes]
    )


def _session_in(
    host: ViewerHost, plugins: PluginManager, document: ContactDocument | None, notes: Sequence[str] = ()
) -> Session:
    """A session on a document in a scene, which is posed as the document says: all of this is where it begins, so
    that nothing of it can be undone."""
    if document is not None:
        bare = ViewerHost(scene=replace(host.scene, document=None))
        with Session(document, host=bare, objects=None, plugins=plugins) as posing:
            missing = list(posing.binding.missing.values())
            if missing:
                raise FileRefused(" ".join(missing))
            posing.binding.write(posing.document.poses)
        stored = StoredDocument.of(document, 0)
        host = ViewerHost(scene=replace(bare.scene, document=stored), path=host.path)
    return _opened(ViewerHost(scene=host.scene, path=host.path), plugins, notes)


def _opened(host: ViewerHost, plugins: PluginManager, notes: Sequence[str] = ()) -> Session:
    return Session(host=host, objects=None, plugins=plugins, notes=notes)


def add_files(session: Session, sources: Iterable[str | Path]) -> dict[str, tuple[str, ...]]:
    """Bring further meshes and rigs into the scene of a session, each beside what is there; the new surfaces, with
    what their readers say of them.

    All are read before the first is added: of several of which one cannot be read none comes in. Raises
    FileRefused, also where the scene is none that takes files.
    """
    host = session.host
    if not isinstance(host, ViewerHost):
        raise FileRefused("this scene belongs to another program: add the object there, and open it again.")
    added = {}
    for asset in [read_asset(str(source), session.plugins) for source in sources]:
        reach = _reach(session)
        place, _ = _beside(asset, reach, host.space())
        key = host.add(asset, place)
        placed = host.read_surface(key)
        name = session.document.free_name(asset.name, session.document.surfaces)
        session.surfaces.add(
            name,
            placed.mesh,
            rig=placed.rig,
            meters_per_unit=placed.meters_per_unit or 1.0,
            up_axis=placed.up_axis,
            world_from_surface=host.placement(key),
        )
        with contextlib.suppress(KeyError):
            session.binding.surfaces[name] = session.binding.find(session.document.surface(name), key)
        added[name] = asset.notes
    return added


def save(session: Session, path: Path | None) -> Path:
    """Save where it came from, or at a path; the path. Raises FileRefused."""
    if path is not None and session.host is not None and path.suffix.lower() not in _saved_as(session):
        raise FileRefused(f"a scene is saved as {' or '.join(_saved_as(session))}, but {path.name} was asked for.")
    written = session.save(path)
    if written is None and path is not None and isinstance(session.host, ViewerHost):
        session.host.path = path
    return written or path or Path(getattr(session.host, "path", None) or "")


def free_path(opened: Path | None) -> Path:
    """A scene file that does not exist, beside the file that was opened, or here. Raises FileRefused."""
    folder = opened.parent if opened is not None else Path.cwd()
    stem = opened.stem if opened is not None else "contacts"
    for number in range(1, 10_000):
        path = folder / f"{stem}{'' if number == 1 else f'-{number}'}{SCENE_SUFFIX}"
        if not path.exists():
            return path
    raise FileRefused(f"{folder} is full of files called {stem}: save under a name.")


def _saved_as(session: Session) -> tuple[str, ...]:
    return (*session.host.suffixes, DOCUMENT_SUFFIX) if session.host is not None else (DOCUMENT_SUFFIX,)


def export(session: Session, path: Path) -> None:
    """Write the scene, in the format that the path's suffix names (.glb, .usda ...): with its film where it has
    one and the format keeps animations, else as it is posed and placed now.

    Raises FileRefused.
    """
    offered = session.plugins.offers(FORMATS).values()
    writers = [kind for kind in offered if kind.can_write and path.suffix.lower() in kind.suffixes]
    if not writers:
        known = sorted({suffix for kind in offered if kind.can_write for suffix in kind.suffixes})
        raise FileRefused(
            f"nothing here writes {path.suffix or 'a name without suffix'}; there are {', '.join(known)}."
        )
    film = session.timeline.settings
    if film.first < film.last and isinstance(writers[0], ClipFormat):
        write_clip(session, film.frames(), path)
        return
    writers[0].write(path, *standing_scene(session, session.document))


def _within_folder(source: str) -> str:
    """The scene that a job left in a folder, for its folder; any other source as it is."""
    path = Path(source)
    if not path.is_dir():
        return source
    scenes = sorted(path.glob(f"*{SCENE_SUFFIX}"))
    if len(scenes) != 1:
        raise FileRefused(
            f"{source} is a folder with {len(scenes) or 'no'} {SCENE_SUFFIX} files: name the file to open."
        )
    return str(scenes[0])


def scenes_of(sources: Sequence[str], plugins: PluginManager) -> list[str]:
    """Those that are opened in place of what is there: scenes, documents, folders of a result."""
    return [
        source
        for source in sources
        if Path(source).is_dir() or source.lower().endswith(DOCUMENT_SUFFIX) or _is_scene(source, plugins)
    ]


def _is_scene(source: str, plugins: PluginManager) -> bool:
    suffix = Path(source).suffix.lower()
    return any(suffix in host.suffixes for host in plugins.offers(HOSTS).values())


def _document(source: str) -> ContactDocument:
    return parse_document(read_bounded(source, MAX_DOCUMENT), Path(source).name)


def _lacking(source: str, document: ContactDocument) -> str:
    wanted = ", ".join(
        f"{each.name} ({each.points} points, {each.faces} faces)" for each in document.surfaces.values()
    )
    return (
        f"{source} holds contacts, and no meshes: name the files of its surfaces as well. It was painted on"
        f" {wanted or 'none'}."
    )


def _beside(asset: Asset, reach: float | None, space: SceneSpace) -> tuple[FloatArray | None, float]:
    """Where to put an asset so that it stands clear of what reaches up to x = reach (scene units); and how far it
    reaches then."""
    scale = (asset.meters_per_unit or space.meters_per_unit) / space.meters_per_unit
    low, high = scale * asset.mesh.points.min(axis=0), scale * asset.mesh.points.max(axis=0)
    if reach is None:
        return None, float(high[0])
    place = np.eye(4)
    place[0, 3] = reach + _GAP * float((high - low).max()) - low[0]
    return place, float(high[0] + place[0, 3])


def _reach(session: Session) -> float:
    """The largest x of everything in the scene, scene units."""
    space = session.host.space()
    reach = [0.0]
    for surface in session.document.surfaces.values():
        mesh = session.derived.known_meshes.get(surface.digest)
        if mesh is not None:
            points = transform_points(surface.world_from_surface, mesh.points)
            reach.append(float(points[:, 0].max()) * surface.meters_per_unit / space.meters_per_unit)
    return max(reach)
