"""The binding of a document to a scene: which object of the host stands behind each surface, where, in which pose.

The host is the truth about where things stand and how rigs are posed; the document is the truth about contacts.
`Binding.read` brings the first into the second, `Binding.write` brings solved poses back.
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset
from contact_core.document.document import ContactDocument, Surface
from contact_core.edit.commands import SetExtra
from contact_core.errors import CommandRejected, InvalidInput
from contact_core.rig.pose_keys import PoseKeys
from contact_core.rig.rig import JointFreedom, Pose, Rig
from contact_core.scene.evaluated_rig import EvaluatingHost, HostRig, evaluated_by_host
from contact_core.scene.host import (
    BoneChoosing,
    CurveWriting,
    HostAdapter,
    LossTelling,
    PoseWriting,
    RigReading,
    SceneObject,
    SceneReading,
)

PLACED_ALIKE = 1e-9  # world_from_surface entries that count as equal
POSED_ALIKE = 2e-6  # of a rotation's entries, and of the rig's size: what single precision of hosts keeps


@dataclass(frozen=True, eq=False)
class BoundSurface:
    """A surface and the object behind it. asset: as the host read it, with the rig of a rigged one."""

    object_id: str
    asset: Asset

    @property
    def rig(self) -> Rig | None:
        """The rig, None for what has none."""
        return self.asset.rig


class Binding:
    """Surfaces of a document bound to objects of a scene.

    host: None for a document without a scene, which binds nothing. surfaces: what is bound, by surface. missing: by
    surface, a sentence on why no object was found.
    """

    def __init__(self, host: HostAdapter | None = None) -> None:
        self._host = host
        self._scene: SceneReading | None = host if isinstance(host, SceneReading) else None
        self.surfaces: dict[str, BoundSurface] = {}
        self.missing: dict[str, str] = {}
        self._of_scene: tuple[str, ...] = ()
        self._evaluated: dict[str, HostRig | None] = {}

    @property
    def has_scene(self) -> bool:
        """Whether there is a scene to bind to."""
        return self._host is not None

    @property
    def host(self) -> HostAdapter | None:
        """The scene, None without."""
        return self._host

    @property
    def key(self) -> str:
        """The namespace of the document's extras that remembers the object of each surface: "host.usd"."""
        return "host" if self._host is None else f"host.{self._host.name}"

    @property
    def notes(self) -> tuple[str, ...]:
        """What reading the scene found: of the scene as a whole when it was bound, of each surface, what is
        missing."""
        told = (f"{name}: {note}" for name, found in self.surfaces.items() for note in found.asset.notes)
        return (*self._of_scene, *told, *self.missing.values())

    def objects(self) -> tuple[SceneObject, ...]:
        """What the scene holds; nothing without a scene."""
        return () if self._scene is None else self._scene.objects()

    # --- finding objects ----------------------------------------------------------------------------------------

    def bind(self, document: ContactDocument, told: Mapping[str, str] | None = None) -> ContactDocument:
        """Find the object behind every surface; what has none is in `missing`, and stays as it was.

        Returns the document with the shape that those objects have now. told: object ids by surface, for those that
        cannot be found. Raises InvalidInput for an id in `told` that the scene does not have.
        """
        self.surfaces.clear()
        self.missing.clear()
        self._evaluated.clear()
        if self._scene is None:
            return document
        losses = self._scene.losses() if isinstance(self._scene, LossTelling) else ()
        self._of_scene = (*self._scene.space().notes, *losses)
        read: dict[str, Asset] = {}
        remembered = document.extras.get(self.key, {})
        for surface in document.surfaces.values():
            name = surface.name
            try:
                found = self.find(surface, (told or {}).get(name), remembered.get(name), read)
            except InvalidInput as error:
                if name in (told or {}):
                    raise
                self.missing[name] = str(error)
                continue
            self.surfaces[name] = found
            if surface.digest != found.asset.mesh.digest:  # the same triangles, in another shape
                now = replace(surface, digest=found.asset.mesh.digest)
                document = replace(document, surfaces=document.surfaces.with_item(name, now))
        return document

    def find(
        self,
        surface: Surface,
        told: str | None = None,
        remembered: str | None = None,
        read: dict[str, Asset] | None = None,
    ) -> BoundSurface:
        """The object that is told, or remembered, or that alone has the surface's triangles.

        read: assets by id, kept between calls. Raises InvalidInput where there is none, or several, or where the
        object has other triangles.
        """
        read = {} if read is None else read
        ids = [item.id for item in self.objects()]
        known = told or (remembered if remembered in ids else None)
        if known is not None:
            self._check_id(known, ids)
            asset = self._read(known, read)
            if asset.mesh.topology_digest != surface.topology_digest:
                raise InvalidInput(
                    f"{surface.name!r} is another mesh now: {known} has {len(asset.mesh.points)} points and"
                    f" {len(asset.mesh.faces)} faces, and its contacts were painted on {surface.points} and"
                    f" {surface.faces}. Use rebind to project them onto it."
                )
            return BoundSurface(known, asset)
        alike = [i for i in ids if self._read(i, read).mesh.topology_digest == surface.topology_digest]
        named = [i for i in alike if self._read(i, read).name == surface.name]
        for found in (alike, named):
            if len(found) == 1:
                return BoundSurface(found[0], read[found[0]])
        raise InvalidInput(
            f"{len(alike) or 'no'} objects of the scene have the {surface.faces} triangles of the surface"
            f" {surface.name!r}; say which one it is. There are {', '.join(ids[:8]) or 'no meshes at all'}."
        )

    def _read(self, object_id: str, read: dict[str, Asset]) -> Asset:
        assert self._scene is not None  # an id came out of `objects`
        if object_id not in read:
            read[object_id] = self._scene.read_surface(object_id)
        return read[object_id]

    def _check_id(self, object_id: str, ids: Iterable[str]) -> None:
        ids = list(ids)
        if object_id not in ids:
            near = difflib.get_close_matches(object_id, ids, n=3) or ids[:5]
            raise InvalidInput(f"the scene has no object {object_id!r}; near ids: {', '.join(near) or 'none'}.")

    def with_objects(self, document: ContactDocument, wanted: Iterable[str] | None = None) -> ContactDocument:
        """A document with a surface for every object of the scene that has none yet, bound to it.

        wanted: ids or names of objects; all by default. Objects that cannot be read are in `missing`, unless they
        were asked for by name: then InvalidInput is raised.
        """
        bound = {found.object_id for found in self.surfaces.values()}
        for item in self._chosen(wanted):
            if item.id in bound:
                continue
            try:
                asset = self._read(item.id, {})
            except InvalidInput as error:
                if wanted is not None:
                    raise
                self.missing[item.name] = str(error)
                continue
            name = document.free_name(item.name, document.surfaces)
            surface = surface_of(name, asset, self.placement(item.id, None))
            document = replace(document, surfaces=document.surfaces.with_item(name, surface))
            self.surfaces[name] = BoundSurface(item.id, asset)
        return self.remembering(document)

    def remembering(self, document: ContactDocument) -> ContactDocument:
        """A document whose extras say which object is behind which surface."""
        remembered = dict(document.extras.get(self.key, {}))
        known = remembered | {name: found.object_id for name, found in self.surfaces.items()}
        known = {name: object_id for name, object_id in known.items() if name in document.surfaces}
        if known == remembered:
            return document
        return SetExtra(self.key, known).apply(document)

    def _chosen(self, wanted: Iterable[str] | None) -> list[SceneObject]:
        items = list(self.objects())
        if wanted is None:
            return items
        result = []
        for name in wanted:
            found = [item for item in items if name == item.id] or [item for item in items if name == item.name]
            if len(found) != 1:
                self._check_id(name, [item.id for item in items])
                raise InvalidInput(f"{len(found)} objects of the scene are called {name!r}: give an id.")
            result += found
        return result

    # --- what the scene says --------------------------------------------------------------------------------

    def read(
        self, document: ContactDocument, frame: float | None = None, leave: Collection[str] = ()
    ) -> ContactDocument:
        """The document with bound surfaces placed and bound rigs posed as the scene has them at a frame.

        The very same document where nothing differs. A surface whose object left the scene stays as it is, and is
        in `missing`; one in `leave` is not asked for.
        """
        there = {item.id for item in self.objects()}
        for name, found in self.surfaces.items():
            if name not in document.surfaces or name in leave:
                continue
            if found.object_id not in there:
                self.missing[name] = f"the object {found.object_id!r} behind {name!r} has left the scene."
                continue
            self.missing.pop(name, None)
            document = self._placed(document, name, found, frame)
            document = self._posed(document, name, found, frame)
        return document

    def _placed(
        self, document: ContactDocument, name: str, found: BoundSurface, frame: float | None
    ) -> ContactDocument:
        surface, world = document.surface(name), self.placement(found.object_id, frame)
        if np.abs(surface.world_from_surface - world).max() <= PLACED_ALIKE:
            return document
        moved = replace(surface, world_from_surface=world)
        return replace(document, surfaces=document.surfaces.with_item(name, moved))

    def _posed(
        self, document: ContactDocument, name: str, found: BoundSurface, frame: float | None
    ) -> ContactDocument:
        rig = found.rig
        if rig is None or not isinstance(self._host, RigReading):
            return document
        pose = self._host.read_pose(found.object_id, frame)
        if same_pose(rig, pose, document.poses.get(name)):
            return document
        return replace(document, poses=document.poses.with_item(name, pose))

    def placement(self, object_id: str, frame: float | None = None) -> FloatArray:
        """(4, 4) world_from_surface of an object, as `SceneReading.placement` has it."""
        assert self._scene is not None  # an id came out of `objects`
        return self._scene.placement(object_id, frame)

    def evaluated(self, names: Iterable[str]) -> dict[str, HostRig]:
        """Of the rigs behind these surfaces, those whose skin only the host can evaluate; each is compared once."""
        host = self._host
        for name in names:
            found = self.surfaces.get(name)
            if found is None or found.rig is None or name in self._evaluated:
                continue
            if isinstance(host, SceneReading) and isinstance(host, RigReading):
                self._evaluated[name] = evaluated_by_host(cast(EvaluatingHost, host), found.object_id)
        return {name: rig for name in names if (rig := self._evaluated.get(name)) is not None}

    def follow_freedoms(self) -> dict[str, Rig]:
        """By surface, rigs whose locks, limits or choice of bones have changed in the scene since then."""
        host, changed = self._host, dict[str, Rig]()
        for name, found in tuple(self.surfaces.items()):
            if found.rig is None or name in self.missing or not isinstance(host, BoneChoosing):
                continue
            now = host.freedoms(found.object_id)
            alike = len(now) == len(found.rig.freedoms) and all(map(JointFreedom.is_like, now, found.rig.freedoms))
            if not alike and len(now) == len(found.rig.joints):
                changed[name] = replace(found.rig, freedoms=now)
                self.surfaces[name] = BoundSurface(found.object_id, replace(found.asset, rig=changed[name]))
                self._evaluated.pop(name, None)
        return changed

    # --- what the scene is told -----------------------------------------------------------------------------

    def write(self, poses: Mapping[str, Pose], frame: float | None = None) -> None:
        """Pose the rigs behind surfaces, keyed at `frame` where one is given; what is not bound is left out.

        Raises CommandRejected where the host cannot pose rigs.
        """
        for name, pose in poses.items():
            found = self.surfaces.get(name)
            if found is None or found.rig is None or name in self.missing:
                continue
            if not isinstance(self._host, PoseWriting):
                raise CommandRejected(f"the host {getattr(self._host, 'name', '')} cannot pose the rig {name!r}.")
            self._host.write_pose(found.object_id, pose, frame)

    def takes_curves(self, name: str) -> bool:
        """Whether the scene keys the rig behind a surface by cubic curves."""
        found = self.surfaces.get(name)
        return found is not None and found.rig is not None and isinstance(self._host, CurveWriting)

    def write_curves(self, name: str, keys: PoseKeys) -> None:
        """Key the rig behind a surface by curves, as `CurveWriting.write_curves`; nothing for what is not bound."""
        found = self.surfaces.get(name)
        if found is not None and isinstance(self._host, CurveWriting) and name not in self.missing:
            self._host.write_curves(found.object_id, keys)

    def pose_keys(self, name: str) -> tuple[float, ...]:
        """Frames at which the scene keys the rig behind a surface."""
        found = self.surfaces.get(name)
        if found is None or found.rig is None or name in self.missing or not isinstance(self._host, PoseWriting):
            return ()
        return self._host.pose_keys(found.object_id)

    def follow(self, before: ContactDocument, after: ContactDocument) -> None:
        """Write to the scene what an edit changed of the poses: a pose taken away is the rest pose."""
        changed = {name: pose for name, pose in after.poses.items() if before.poses.get(name) is not pose}
        rested = {
            name: Pose.rest(found.rig)
            for name, found in self.surfaces.items()
            if found.rig is not None and name in before.poses and name not in after.poses
        }
        if changed or rested:
            self.write({**changed, **rested})


def surface_of(name: str, asset: Asset, world_from_surface: object = None) -> Surface:
    """The record of an asset's surface in a document."""
    mesh = asset.mesh
    return Surface(
        name,
        mesh.digest,
        mesh.topology_digest,
        len(mesh.points),
        len(mesh.faces),
        asset.meters_per_unit or 1.0,
        asset.up_axis,
        None if asset.rig is None else asset.rig.name,
        np.eye(4) if world_from_surface is None else np.asarray(world_from_surface, float),
    )


def same_pose(rig: Rig, pose: Pose, other: Pose | None) -> bool:
    """Whether two poses of a rig agree to single precision; None is the rest pose."""
    mine, theirs = (_all_joints(rig, p) for p in (pose, other))
    size = rig.surface.bounding_box_diagonal or 1.0
    scale = np.where(np.arange(4)[None, None] == 3, size, 1.0)
    return bool((np.abs(mine - theirs) <= POSED_ALIKE * scale).all())


def _all_joints(rig: Rig, pose: Pose | None) -> FloatArray:
    local = rig.rest_local.copy()
    if pose is not None:
        known = dict(zip(pose.joints, pose.local, strict=True))
        for j, joint in enumerate(rig.joints):
            local[j] = known.get(joint, local[j])
    return local
