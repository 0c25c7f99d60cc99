"""The two ways into the product: open what there is, or begin with files.

import contact_core as contact

with contact.open("shot.usda") as session: ...
with contact.new(hand="hand.glb", ball="ball.obj") as session: ...
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from contact_core.document.asset import Asset
from contact_core.errors import FileRefused, InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.reading import SAMPLE, read_asset, unread
from contact_core.plugins.registry import FORMATS, HOSTS
from contact_core.scene.host import BoneChoosing, HostAdapter, SceneReading
from contact_core.session import Session

DOCUMENT_SUFFIX = ".json"

Source = Path | str | Asset | TriangleMesh


def open(  # noqa: A001 - as `pathlib.Path.open`: within this package the word means what it says
    path: Path | str,
    *,
    objects: Iterable[str] | None = None,
    surfaces: Mapping[str, str] | None = None,
    bones: Mapping[str, str] | None = None,
    plugins: PluginManager | Iterable[object] = (),
    discover: bool = True,
) -> Session:
    """A session on a document (.json), on a scene that a host opens (.usda, .contactscene, within Blender .blend),
    or on the one asset in a file of a mesh or a rig (.glb, .urdf, .obj ...) or in "sample:NAME".

    objects: of a scene, ids or names of those that become surfaces beside the ones that its document knows; all by
    default where it knows none. surfaces: object ids by surface, for those that cannot be told from their
    triangles. bones: of a scene, which bones of a rig are posed, by the object's id or name, in the host's words
    (Blender: "automatic", "deform", "controls", "collection:NAME"). plugins, discover: as for `Session`. Raises
    FileRefused, and InvalidInput for bones that cannot be chosen.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    manager = _manager(plugins, discover)
    if suffix == DOCUMENT_SUFFIX:
        return Session.open(path, plugins=manager)
    hosts = manager.offers(HOSTS)
    for host in hosts.values():
        if suffix in host.suffixes:
            scene = host.open(path)
            _choose_bones(scene, bones or {})
            return Session(host=scene, objects=objects, surfaces=surfaces, plugins=manager)
    formats = [kind for kind in manager.offers(FORMATS).values() if kind.can_read]
    if str(path).startswith(SAMPLE) or any(suffix in kind.suffixes for kind in formats):
        asset = read_asset(path, manager)
        return Session.of_assets({asset.name: asset}, plugins=manager)
    suffixes = [*(kind.suffixes for kind in hosts.values()), *(kind.suffixes for kind in formats)]
    known = (DOCUMENT_SUFFIX, *(s for several in suffixes for s in several))
    raise FileRefused(f"nothing here opens {path.name}: {unread(path, known)}")


def _choose_bones(scene: HostAdapter, bones: Mapping[str, str]) -> None:
    for name, choice in bones.items():
        if not isinstance(scene, BoneChoosing) or not isinstance(scene, SceneReading):
            raise InvalidInput(f"the bones that are posed cannot be chosen in {scene.summary}.")
        found = [item for item in scene.objects() if name in (item.id, item.name) and item.kind == "rig"]
        if len(found) != 1:
            raise InvalidInput(f"{len(found)} rigs of the scene are called {name!r}: give the id of one.")
        scene.choose_bones(found[0].id, choice)


def new(*, plugins: PluginManager | Iterable[object] = (), discover: bool = True, **sources: Source) -> Session:
    """A session on a new document with a surface for each source, under the name of its keyword.

    sources: a file, a sample ("sample:human"), an `Asset` or a mesh (in metres). All stand at the origin. Raises
    FileRefused.
    """
    manager = _manager(plugins, discover)

    def asset_of(name: str, source: Source) -> Asset:
        if isinstance(source, TriangleMesh):
            return Asset(name, source, meters_per_unit=1.0)
        return source if isinstance(source, Asset) else read_asset(source, manager)

    return Session.of_assets({name: asset_of(name, source) for name, source in sources.items()}, plugins=manager)


def _manager(plugins: PluginManager | Iterable[object], discover: bool) -> PluginManager:
    return PluginManager(tuple(plugins), discover=discover) if isinstance(plugins, Iterable) else plugins
