"""The scene of the memory host as one immutable value, and its file: one .npz of arrays beside a JSON header."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from contact_core.arrays import FloatArray, IntArray
from contact_core.atomic_file import write_atomic
from contact_core.document.frozen_map import FrozenMap
from contact_core.errors import FileRefused, InvalidInput
from contact_core.rig.rig import JointFreedom, Pose, Rig
from contact_core.scene.host import DocumentStamp, SceneSpace, StoredDocument

FORMAT = "contact-core.memory-scene"
FORMAT_VERSION = 2  # 1 held the document in one piece
MAX_BYTES = 1 << 32  # of arrays in one file: beyond any scene, below a zip bomb
_FREEDOM_ARRAYS = ("frame", "lower", "upper", "prior_weight", "locked", "locked_translation")
_RIG_ARRAYS = (
    "parents",
    "rest_local",
    "bind_world",
    "bind_points",
    "faces",
    "skin_joints",
    "skin_weights",
)


@dataclass(frozen=True, eq=False)
class Polygons:
    """A polygon mesh in its own space: points (n, 3), corners per face (f,), indices face after face."""

    points: FloatArray
    face_sizes: IntArray
    face_indices: IntArray


@dataclass(frozen=True, eq=False)
class MemoryObject:
    """One object. world: (4, 4) world_from_local. pose: unkeyed, None for rest. keys: by frame, ascending.
    selections: vertex indices of the object's own points, by name. Rig and poses are in local space."""

    name: str
    shape: Polygons | Rig
    world: FloatArray
    pose: Pose | None = None
    keys: tuple[tuple[float, Pose], ...] = ()
    selections: Mapping[str, IntArray] = field(default_factory=dict)

    @property
    def kind(self) -> Literal["surface", "rig"]:
        return "rig" if isinstance(self.shape, Rig) else "surface"

    @property
    def rig(self) -> Rig:
        """Raises InvalidInput when the object is a surface."""
        if isinstance(self.shape, Rig):
            return self.shape
        raise InvalidInput(f"{self.name} is a surface and has no rig.")

    def pose_at(self, frame: float | None) -> Pose:
        """The pose as it stands (None), or between the keys around a frame, held beyond the first and last."""
        if frame is None or not self.keys:
            return self.pose or Pose.rest(self.rig)
        frames = [at for at, _ in self.keys]
        after = int(np.searchsorted(frames, frame))
        if after == 0 or after == len(frames):
            return self.keys[min(after, len(frames) - 1)][1]
        (start, first), (end, second) = self.keys[after - 1], self.keys[after]
        return _between(first, second, (frame - start) / (end - start))

    def with_pose(self, pose: Pose, frame: float | None) -> MemoryObject:
        """A copy with the named joints posed, keyed where a frame is given. Raises InvalidInput."""
        local = np.array(self.pose_at(frame).local)
        for name, matrix in zip(pose.joints, pose.local, strict=True):
            local[self.rig.joint_index(name)] = matrix
        whole = Pose(self.rig.joints, local)
        if frame is None:
            return replace(self, pose=whole)
        return replace(self, keys=tuple(sorted({**dict(self.keys), float(frame): whole}.items())))


@dataclass(frozen=True, eq=False)
class MemoryScene:
    """All that a memory host holds; an edit makes a new one."""

    space: SceneSpace
    objects: Mapping[str, MemoryObject] = field(default_factory=dict)
    document: StoredDocument | None = None

    def with_object(self, object_id: str, value: MemoryObject | None) -> MemoryScene:
        """A copy with an object put in, replaced or (None) taken out."""
        objects = {**self.objects, object_id: value}
        return replace(self, objects={key: item for key, item in objects.items() if item is not None})


def _between(first: Pose, second: Pose, t: float) -> Pose:
    """Translations by straight lines, rotations along the shortest turn, stretches linearly, as hosts do."""
    local = np.array(first.local)
    a, b = first.local[:, :3, :3], second.local[:, :3, :3]  # (j, 3, 3)
    turn_a, turn_b = _rotation_of(a), _rotation_of(b)
    stretch = (1 - t) * turn_a.transpose(0, 2, 1) @ a + t * turn_b.transpose(0, 2, 1) @ b
    local[:, :3, 3] = (1 - t) * first.local[:, :3, 3] + t * second.local[:, :3, 3]
    for k in range(len(local)):
        turn = Slerp([0.0, 1.0], Rotation.from_matrix(np.stack([turn_a[k], turn_b[k]])))(t).as_matrix()
        local[k, :3, :3] = turn @ stretch[k]
    return Pose(first.joints, local)


def _rotation_of(matrices: FloatArray) -> FloatArray:
    """(j, 3, 3) proper rotations nearest to (j, 3, 3) matrices."""
    left, _, right = np.linalg.svd(matrices)
    left = left * np.where(np.linalg.det(left @ right) < 0, -1.0, 1.0)[:, None, None]
    return left @ right


def save_scene(scene: MemoryScene, path: Path) -> None:
    """Write atomically. Raises FileRefused."""
    arrays: dict[str, Any] = {}
    objects = {key: _object_to_json(f"o{k}", item, arrays) for k, (key, item) in enumerate(scene.objects.items())}
    space = scene.space
    header: dict[str, Any] = {"format": FORMAT, "version": FORMAT_VERSION, "objects": objects}
    header["space"] = [space.meters_per_unit, space.up_axis, space.frames_per_second]
    if scene.document is not None:
        stamp = scene.document.stamp
        header["document"] = [stamp.revision, stamp.digest, stamp.schema]
        arrays["document"] = np.frombuffer(json.dumps(dict(scene.document.parts)).encode(), np.uint8)
    arrays["header"] = np.frombuffer(json.dumps(header).encode(), np.uint8)
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    write_atomic(path, stream.getvalue())


def load_scene(path: Path) -> MemoryScene:
    """The scene in a file. Raises FileRefused in a sentence, whatever is wrong with it."""
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(item.file_size for item in archive.infolist())
        if size > MAX_BYTES:
            raise FileRefused(f"{path} unpacks to {size} bytes; more than {MAX_BYTES} are refused.")
        with np.load(path, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
        return _scene_from_arrays(arrays, path)
    except FileRefused:
        raise
    except Exception as error:  # zipfile and numpy answer damaged bytes with a dozen kinds of errors
        raise FileRefused(
            f"{path} is no scene of the memory host, or damaged: take an earlier copy, or save it anew."
        ) from error


def _scene_from_arrays(arrays: dict[str, Any], path: Path) -> MemoryScene:
    header = json.loads(arrays["header"].tobytes())
    if header.get("format") != FORMAT or header.get("version") != FORMAT_VERSION:
        raise FileRefused(
            f"{path} says {header.get('format')!r} version {header.get('version')!r}; this release reads"
            f" {FORMAT!r} version {FORMAT_VERSION}."
        )
    document = None
    if "document" in header:
        document = StoredDocument(_stamp(*header["document"]), _parts(json.loads(arrays["document"].tobytes())))
    objects = {key: _object_from_json(data, arrays) for key, data in header["objects"].items()}
    return MemoryScene(SceneSpace(*header["space"]), objects, document)


def _stamp(revision: int, digest: str, schema: int) -> DocumentStamp:
    return DocumentStamp(int(revision), str(digest), int(schema))


def _parts(data: Mapping[str, Any]) -> FrozenMap[str]:
    return FrozenMap({str(key): str(text) for key, text in data.items()})


def _object_to_json(prefix: str, item: MemoryObject, arrays: dict[str, Any]) -> dict[str, Any]:
    """JSON data of an object; its arrays go into `arrays` under names that start with `prefix`."""

    def put(name: str, array: Any) -> str:
        arrays[f"{prefix}.{name}"] = array
        return f"{prefix}.{name}"

    data: dict[str, Any] = {"name": item.name, "world": put("world", item.world)}
    data["selections"] = {name: put(f"s{k}", a) for k, (name, a) in enumerate(item.selections.items())}
    data["keys"] = [[frame, put(f"k{k}", pose.local)] for k, (frame, pose) in enumerate(item.keys)]
    data["pose"] = None if item.pose is None else put("pose", item.pose.local)
    if isinstance(item.shape, Polygons):
        data["polygons"] = [put(name, getattr(item.shape, name)) for name in Polygons.__dataclass_fields__]
        return data
    rig = item.shape
    data["rig"] = {name: put(name, getattr(rig, name)) for name in _RIG_ARRAYS}
    data["joints"], data["units"] = list(rig.joints), [rig.name, rig.meters_per_unit, rig.up_axis]
    data["freedoms"] = [
        [f.kind, f.order, f.translates, *(put(f"f{k}.{name}", getattr(f, name)) for name in _FREEDOM_ARRAYS)]
        for k, f in enumerate(rig.freedoms)
    ]
    return data


def _object_from_json(data: dict[str, Any], arrays: dict[str, Any]) -> MemoryObject:
    shape: Polygons | Rig
    if "polygons" in data:
        shape = Polygons(*(arrays[name] for name in data["polygons"]))
    else:
        freedoms = tuple(_freedom_from_json(freedom, arrays) for freedom in data["freedoms"])
        name, meters_per_unit, up_axis = data["units"]
        rig_arrays = {key: arrays[value] for key, value in data["rig"].items()}
        joints = tuple(data["joints"])
        shape = Rig(name, joints, freedoms=freedoms, meters_per_unit=meters_per_unit, up_axis=up_axis, **rig_arrays)
    joints = tuple(data.get("joints", ()))
    return MemoryObject(
        name=data["name"],
        shape=shape,
        world=arrays[data["world"]],
        pose=None if data["pose"] is None else Pose(joints, arrays[data["pose"]]),
        keys=tuple((float(frame), Pose(joints, arrays[key])) for frame, key in data["keys"]),
        selections={name: arrays[key] for name, key in data["selections"].items()},
    )


def _freedom_from_json(data: list[Any], arrays: dict[str, Any]) -> JointFreedom:
    kind, order, translates, *keys = data
    names = _FREEDOM_ARRAYS if len(keys) >= len(_FREEDOM_ARRAYS) else _FREEDOM_ARRAYS[:-1]  # new in this release
    parts = {name: arrays[key] for name, key in zip(names, keys, strict=True)}
    return JointFreedom(kind=kind, order=order, translates=translates, **parts)
