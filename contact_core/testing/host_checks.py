"""Measures that the clauses of the host contract take."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, digest
from contact_core.document.schema import VERSION
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.transform import transform_points
from contact_core.rig.rig import Pose, Rig
from contact_core.scene.host import DocumentStamp, DocumentStorage, PoseWriting, RigReading, StoredDocument
from contact_core.scene.picture import Picture, PictureMesh
from contact_core.testing.host_scenes import HostScene

ACCURACY = 1e-5  # of a size: what single precision leaves after a few matrix products


def object_id(host: Any, name: str) -> str:
    """Id of the object that has a name."""
    found = [item.id for item in host.objects() if item.name == name]
    assert len(found) == 1, f"{name}: {found} among {host.objects()}"
    return str(found[0])


def revision_of(host: Any) -> int | None:
    """The stored document's revision."""
    stamp = host.stored_stamp()
    return None if stamp is None else int(stamp.revision)


def stored(revision: int, parts: Mapping[str, str] | None = None, schema: int = VERSION) -> StoredDocument:
    """What a host may be given to keep: it believes the digest, and does not read the parts."""
    return StoredDocument(DocumentStamp(revision, f"{revision:064x}", schema), dict(parts or {}))


def store(host: Any, document: StoredDocument) -> None:
    """Let a host hold that and no more."""
    before = host.stored_document()
    gone = () if before is None else set(before.parts) - set(document.parts)
    host.store_document(document.stamp, document.parts, gone)


def surfaces_of(host: Any) -> dict[str, str]:
    """Digest of each object's surface by id."""
    return {item.id: host.read_surface(item.id).mesh.digest for item in host.objects()}


def volume(mesh: TriangleMesh) -> float:
    """Signed volume: positive where the triangles are counter-clockwise seen from outside."""
    a, b, c = (mesh.points[mesh.faces[:, k]] for k in range(3))
    return float(np.einsum("mi,mi->", a, np.cross(b, c)) / 6.0)


def same_triangles(ours: Any, theirs: Any) -> bool:
    """Equal triangle by triangle, up to which corner comes first."""
    turned = [np.roll(theirs, k, axis=1) for k in range(3)]
    return np.shape(ours) == np.shape(theirs) and all(
        any((ours[k] == t[k]).all() for t in turned) for k in range(len(ours))
    )


def is_rigid(matrix: FloatArray) -> bool:
    """A rotation, no mirror, and a shift."""
    turn = matrix[:3, :3]
    return bool(np.abs(turn @ turn.T - np.eye(3)).max() < ACCURACY and np.linalg.det(turn) > 0)


def placement_error(host: Any, key: str, world: FloatArray) -> float:
    """Largest difference of entries between a placement, which must be rigid, and a rigid world matrix."""
    placement = host.placement(key)
    assert is_rigid(placement), placement
    return float(np.abs(placement - world).max())


def world_error(host: Any, name: str, scene: HostScene) -> float:
    """Largest distance between surface points put into the world and the scene's own, by the object's size."""
    key = object_id(host, name)
    mesh, placement = host.read_surface(key).mesh, host.placement(key)
    assert is_rigid(placement), placement
    made = next(mesh for mesh in scene.meshes if mesh.name == name)
    world = scene.world_of(name)
    wanted = transform_points(world, made.points)
    ours = transform_points(placement, mesh.points)
    return float(np.abs(ours - wanted).max() / mesh.bounding_box_diagonal)


def pose_error(ours: Pose, theirs: Pose) -> float:
    """Largest difference of entries between local matrices, joints matched by name."""
    at = {name: k for k, name in enumerate(ours.joints)}
    assert set(at) == set(theirs.joints), (ours.joints, theirs.joints)
    return float(np.abs(ours.local[[at[name] for name in theirs.joints]] - theirs.local).max())


def dense_weights(rig: Rig) -> FloatArray:
    """(n, j) weight of every joint on every vertex."""
    weights = np.zeros((len(rig.bind_points), len(rig.joints)))
    np.add.at(weights, (np.arange(len(weights))[:, None], rig.skin_joints), rig.skin_weights)
    return weights


def picture_of(host: Any, name: str) -> Picture:
    """The object where it stands."""
    key = object_id(host, name)
    mesh, placement = host.read_surface(key).mesh, host.placement(key)
    placed = mesh.with_points(transform_points(placement, mesh.points))
    return Picture(meshes=(PictureMesh(placed, (0.5, 0.5, 0.5)),))


def readable_state(host: Any) -> Any:
    """All that the host reads, poses rounded: what an undo must bring back."""
    state: list[Any] = [host.objects(), surfaces_of(host)]
    for item in host.objects():
        state.append(digest(np.round(host.placement(item.id), 5) + 0.0))
        if item.kind == "rig" and isinstance(host, RigReading):
            frames = host.pose_keys(item.id) if isinstance(host, PoseWriting) else ()
            state.append(frames)
            state += [digest(np.round(host.read_pose(item.id, f).local, 4) + 0.0) for f in (None, *frames)]
    return [*state, host.stored_document() if isinstance(host, DocumentStorage) else None]
