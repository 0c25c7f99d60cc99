"""What a host can do for the core, as small capabilities. `adapters/README.md` holds the promises, numbered.

A host class inherits from the capabilities that it offers, so a type checker compares the signatures and a
missing method fails when the host is made; what it does not inherit it declines. Objects are named by ids that
are unique in the scene and survive reads, undo and saving (never by handles). Lengths are in the host's units,
axes are the host's axes: the core converts nothing. Frames are the host's own frame numbers or time codes;
frame None is the scene as it stands, without a key. Refusals are sentences (`contact_core.errors`).
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Protocol, Self, runtime_checkable

from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset
from contact_core.document.document import ContactDocument
from contact_core.document.frozen_map import FrozenMap
from contact_core.document.parts import NO_PARTS, DocumentParts
from contact_core.document.schema import VERSION
from contact_core.errors import FileRefused, InvalidInput
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.progress import Progress
from contact_core.rig.pose_keys import PoseKeys
from contact_core.rig.rig import JointFreedom, Pose
from contact_core.scene.picture import Picture


@dataclass(frozen=True)
class SceneSpace:
    """Units and axes of a scene. Right-handed; a left-handed host converts and says so in its notes."""

    meters_per_unit: float
    up_axis: Literal["X", "Y", "Z"]
    frames_per_second: float = 24.0
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class SceneObject:
    """One thing to paint on: a surface, or a rig with its skin (whose meshes are not listed again)."""

    id: str
    name: str
    kind: Literal["surface", "rig"]


@dataclass(frozen=True)
class DocumentStamp:
    """What a stored document is known by: its history's revision, the digest of its content, its schema number."""

    revision: int
    digest: str
    schema: int


@dataclass(frozen=True)
class StoredDocument:
    """A document as a host keeps it: its stamp, and parts by key that are opaque to the host (`document.parts`).

    A key is an identifier of at most 63 characters, a text printable ASCII with line feeds.
    """

    stamp: DocumentStamp
    parts: Mapping[str, str]

    @classmethod
    def of(cls, document: ContactDocument, revision: int) -> StoredDocument:
        """A document as a session stores it."""
        parts, change = NO_PARTS.to(document)
        return cls(DocumentStamp(revision, parts.digest, VERSION), FrozenMap(change.put))

    def read(self, source: str) -> DocumentParts:
        """What it says. Raises FileRefused where it is damaged, or of a newer schema."""
        return DocumentParts.read(self.parts, self.stamp.schema, self.stamp.digest, source)


@runtime_checkable
class HostAdapter(Protocol):
    """What every host is. How it is made is its own: `Host()` is a new scene, or inside a DCC the open one."""

    name: str  # "memory", "usd", "blender"
    summary: str  # in a few words, what its scenes are
    suffixes: tuple[str, ...]  # of files that it opens, lower case: (".usda", ".usdc")

    @classmethod
    @abstractmethod
    def open(cls, path: Path) -> Self:
        """The host on the scene in a file. Opening changes nothing in the scene. Raises FileRefused."""
        ...

    @abstractmethod
    def space(self) -> SceneSpace: ...


@runtime_checkable
class SceneReading(HostAdapter, Protocol):
    """Meshes. A surface has the object's scale and shear applied (`geometry.polar`), nothing else."""

    @abstractmethod
    def objects(self) -> tuple[SceneObject, ...]: ...

    @abstractmethod
    def read_surface(self, object_id: str) -> Asset:
        """Surface with counter-clockwise triangles also where the object is mirrored, and the maps to the
        host's own vertices and faces. Same vertex order at each read. A rig's surface is its rest pose."""
        ...

    @abstractmethod
    def placement(self, object_id: str, frame: float | None = None) -> FloatArray:
        """(4, 4) rigid world_from_surface; of a rig, where its space lies in the scene."""
        ...


@runtime_checkable
class LossTelling(HostAdapter, Protocol):
    """A host that knows what of its scene it does not read."""

    @abstractmethod
    def losses(self) -> Sequence[str]:
        """Sentences on shapes of the scene that are no objects here, or not all that they could be."""
        ...


@runtime_checkable
class SceneWriting(HostAdapter, Protocol):
    """Making objects: what an exporter needs."""

    @abstractmethod
    def add(self, asset: Asset, world_from_surface: Any = None) -> str:
        """Create the asset's mesh, or its rig with skin, as triangles; the id of the new object."""
        ...


@runtime_checkable
class RigReading(HostAdapter, Protocol):
    """Rigs as the analytic `Rig`, joints named uniquely, weights normalised (the asset's notes say so)."""

    @abstractmethod
    def read_rig(self, object_id: str) -> Asset:
        """Asset with `rig`. What the analytic rig cannot reproduce is refused by name or told in the notes."""
        ...

    @abstractmethod
    def read_pose(self, object_id: str, frame: float | None = None) -> Pose:
        """The pose in the scene, for all joints of the rig."""
        ...

    @abstractmethod
    def skin_points(self, object_id: str, pose: Pose) -> FloatArray:
        """(n, 3) the host's OWN evaluation of the skin in that pose, in rig space; the scene is left as it was."""
        ...


@runtime_checkable
class BoneChoosing(HostAdapter, Protocol):
    """Rigs with more bones than an animator poses: which of them a solve may move is the artist's choice."""

    @abstractmethod
    def bones_of(self, object_id: str) -> str:
        """What was chosen for a rig, in the host's words."""
        ...

    @abstractmethod
    def choose_bones(self, object_id: str, choice: str) -> None:
        """Choose, for all that hangs on the same bones; one undo step. Raises InvalidInput for no known choice."""
        ...

    @abstractmethod
    def freedoms(self, object_id: str) -> tuple[JointFreedom, ...]:
        """What a solve may do with each joint as the scene has it now: choice, locks and limits."""
        ...


@runtime_checkable
class PoseWriting(HostAdapter, Protocol):
    @abstractmethod
    def write_pose(self, object_id: str, pose: Pose, frame: float | None = None) -> None:
        """Set the joints that `pose` names; keyed at `frame` when one is given, and at no other frame."""
        ...

    @abstractmethod
    def pose_keys(self, object_id: str) -> tuple[float, ...]:
        """Frames with a key on any joint, ascending."""
        ...


@runtime_checkable
class CurveWriting(PoseWriting, Protocol):
    """Keys that cubic curves join."""

    @abstractmethod
    def write_curves(self, object_id: str, pose_keys: PoseKeys) -> None:
        """Key the joints that cubic keys name by curves that move the skin as the keys do, in place of what these
        joints are keyed from the first of them to the last. Keys outside, other joints and other channels stay."""
        ...


@runtime_checkable
class DocumentStorage(HostAdapter, Protocol):
    """The document lives in the host's own file."""

    @abstractmethod
    def stored_stamp(self) -> DocumentStamp | None:
        """The stamp of what is stored, without its parts: sessions ask for it before each edit."""
        ...

    @abstractmethod
    def stored_document(self) -> StoredDocument | None:
        """What is stored, bit for bit, also under a schema that this core does not know."""
        ...

    @abstractmethod
    def store_document(self, stamp: DocumentStamp, put: Mapping[str, str], remove: Iterable[str] = ()) -> None:
        """Change what is stored: the stamp, parts that are new or replaced, and keys of parts that go.

        All other parts stay as they are, and the cost is that of what changes. Raises FileRefused, changing
        nothing, where what is stored has a newer schema than ours, or is damaged.
        """
        ...

    @abstractmethod
    def save(self, path: Path | None = None) -> None:
        """Write the scene with its document atomically; None: where it came from."""
        ...


@runtime_checkable
class Undo(HostAdapter, Protocol):
    """The host's own undo, which the core's history follows by revision."""

    @abstractmethod
    def step(self, label: str) -> AbstractContextManager[None]:
        """All that is written inside is ONE undo step of the host; after an exception nothing of it stays."""
        ...

    @abstractmethod
    def undo(self) -> bool:
        """What the user's undo does, be the step ours or foreign; False when there is nothing to undo."""
        ...

    @abstractmethod
    def redo(self) -> bool: ...

    @abstractmethod
    def on_undo(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call `listener` after each undo and redo, whoever asked for it; the returned function stops that."""
        ...


@runtime_checkable
class SceneLifetime(HostAdapter, Protocol):
    """A host that outlives its scene: the user opens another file, begins a new one, reverts, or takes it out."""

    @abstractmethod
    def on_close(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call `listener` when the scene goes, while it can still be read; the returned function stops that."""
        ...


@runtime_checkable
class SelectionReading(HostAdapter, Protocol):
    """What the user selected in the host becomes a patch."""

    @abstractmethod
    def selections(self, object_id: str) -> tuple[str, ...]:
        """Names: the live selection ("selection") where there is one, vertex groups, face sets."""
        ...

    @abstractmethod
    def selected_points(self, object_id: str, selection: str) -> SurfacePoints:
        """The selected vertices, or those of the selected faces, on the surface that `read_surface` gives."""
        ...


@runtime_checkable
class Display(HostAdapter, Protocol):
    @abstractmethod
    def show(self, picture: Picture | None) -> None:
        """Draw over the scene, in world space, in place of what was shown before; None clears."""
        ...


@runtime_checkable
class Picking(HostAdapter, Protocol):
    viewport: tuple[int, int]  # width and height, pixels

    @abstractmethod
    def rays(self, pixels: Any) -> tuple[FloatArray, FloatArray]:
        """World origins (k, 3) and unit directions (k, 3) of the rays through screen positions (k, 2).

        In pixels from the top left corner; (0.5, 0.5) is the centre of the first pixel.
        """
        ...


@runtime_checkable
class ProgressDisplay(HostAdapter, Progress, Protocol):
    """The host's own display of progress, and its user's wish to stop: a `contact_core.progress.Progress`."""

    @abstractmethod
    def cancel(self) -> None:
        """The user asks the work that runs to stop: the next `tell` raises Cancelled, once."""
        ...


CAPABILITIES: dict[str, type] = {
    "scene reading": SceneReading,
    "scene writing": SceneWriting,
    "rig reading": RigReading,
    "pose writing": PoseWriting,
    "document storage": DocumentStorage,
    "undo": Undo,
    "selection": SelectionReading,
    "display": Display,
    "picking": Picking,
    "progress": ProgressDisplay,
}


def check_overwrite(stamp: DocumentStamp | None) -> None:
    """What `store_document` asks first. Raises FileRefused where a newer contact-core wrote what is stored."""
    if stamp is not None and stamp.schema > VERSION:
        raise FileRefused(
            f"the scene holds a document of schema version {stamp.schema}, but this release writes version"
            f" {VERSION}: install a newer contact-core. What is stored was left untouched."
        )


def check_frame(frame: float | None) -> None:
    """What everything with a frame asks first. Raises InvalidInput for infinity, and for NaN, no frame to USD."""
    if frame is not None and not math.isfinite(frame):
        raise InvalidInput(f"a frame is a number, or None for the scene as it stands, but got {frame}.")


def capabilities(host: HostAdapter) -> tuple[str, ...]:
    """Names of what the host offers, in the order of CAPABILITIES."""
    return tuple(name for name, protocol in CAPABILITIES.items() if isinstance(host, protocol))
