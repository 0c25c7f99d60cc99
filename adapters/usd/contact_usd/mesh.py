"""UsdGeomMesh to surfaces. USD has no triangulator and lets faces through that are none; both are seen to here."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pxr import Gf, Tf, Usd, UsdGeom

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.document.asset import Asset
from contact_core.errors import InvalidInput
from contact_core.geometry.polar import PolarDecomposition, split_world_from_local
from contact_core.scene.host import SceneSpace
from contact_core.scene.reading import surface_of_polygons
from contact_usd.primitives import is_primitive, solid_of
from contact_usd.stage_io import reason

AS_IT_STANDS = Usd.TimeCode.EarliestTime()  # a default value, or the first sample where there are only samples


@dataclass(frozen=True, eq=False)
class MeshArrays:
    """A mesh as the stage holds it, in its own space, faces in holes left out.

    points (n, 3); face_sizes (f,); face_indices; faces (f,): number of each face in the stage's own count.
    """

    points: FloatArray
    face_sizes: IntArray
    face_indices: IntArray
    faces: IntArray
    left_handed: bool
    notes: tuple[str, ...]


def time_code(frame: float | None) -> Usd.TimeCode:
    """Frames are time codes; None is the stage as it stands."""
    return AS_IT_STANDS if frame is None else Usd.TimeCode(frame)


def matrix_of(matrix: Gf.Matrix4d) -> FloatArray:
    """(4, 4) for column vectors; Gf multiplies rows."""
    return np.array(matrix, dtype=np.float64).T


def gf_matrix(matrix: FloatArray) -> Gf.Matrix4d:
    """The way back."""
    return Gf.Matrix4d(np.asarray(matrix, dtype=np.float64).T.tolist())


def world_of(prim: Usd.Prim, frame: float | None = None) -> FloatArray:
    """(4, 4) world_from_local with all parents, honouring resetXformStack."""
    return matrix_of(UsdGeom.XformCache(time_code(frame)).GetLocalToWorldTransform(prim))


def placement_of(prim: Usd.Prim, frame: float | None = None) -> PolarDecomposition:
    """Where a prim stands: the stretch as it stands, the motion at the frame. Raises InvalidInput with its path."""
    try:
        still = split_world_from_local(world_of(prim))
        if frame is None:
            return still
        moved = split_world_from_local(world_of(prim, frame))
    except InvalidInput as error:
        raise InvalidInput(f"{prim.GetPath()}: {error}") from error
    except Tf.ErrorException as error:
        raise InvalidInput(f"{prim.GetPath()} has a transform that USD cannot compute: {reason(error)}") from error
    return replace(still, world_from_surface=moved.world_from_surface)


def array_of(attribute: Usd.Attribute, shape: tuple[int, ...], dtype: type) -> Any:
    """The numbers of an attribute as it stands; none where it has none. Raises InvalidInput with its path."""
    value = attribute.Get(AS_IT_STANDS)
    try:
        return np.asarray([] if value is None else value, dtype).reshape(shape)
    except (TypeError, ValueError) as error:
        got, expected = type(value).__name__, attribute.GetTypeName()
        raise InvalidInput(f"{attribute.GetPath()} holds a {got}, where a {expected} is expected.") from error


def is_empty(prim: Usd.Prim) -> bool:
    """Whether a prim is a mesh that draws nothing, because it has no points or no faces."""
    if is_primitive(prim):
        return False
    mesh = UsdGeom.Mesh(prim)
    return not (mesh.GetPointsAttr().Get(AS_IT_STANDS) and mesh.GetFaceVertexCountsAttr().Get(AS_IT_STANDS))


def read_arrays(prim: Usd.Prim) -> MeshArrays:
    """The arrays of a UsdGeomMesh. Raises InvalidInput naming the prim when they do not fit together."""
    if is_primitive(prim):
        solid_points, solid_faces = solid_of(prim)
        count = len(solid_faces)
        return MeshArrays(solid_points, np.full(count, 3), solid_faces.ravel(), np.arange(count), False, ())
    mesh = UsdGeom.Mesh(prim)
    points = array_of(mesh.GetPointsAttr(), (-1, 3), np.float64)
    sizes = array_of(mesh.GetFaceVertexCountsAttr(), (-1,), np.int64)
    indices = array_of(mesh.GetFaceVertexIndicesAttr(), (-1,), np.int64)
    if len(points) == 0 or len(sizes) == 0:
        raise InvalidInput(f"{prim.GetPath()} is a mesh without points or faces.")
    if sizes.min() < 0 or sizes.sum() != len(indices):
        raise InvalidInput(
            f"{prim.GetPath()}: faceVertexCounts add up to {sizes.sum()}, the least is {sizes.min()}, but there are"
            f" {len(indices)} indices."
        )
    if indices.size and not 0 <= indices.min() <= indices.max() < len(points):
        off = indices.min() if indices.min() < 0 else indices.max()
        raise InvalidInput(
            f"{prim.GetPath()}: a face names the point {off}, but the points are 0..{len(points) - 1}."
        )
    notes = []
    if mesh.GetPointsAttr().ValueMightBeTimeVarying():
        notes.append("the points are animated; the surface is that of the first sample.")
    scheme = mesh.GetSubdivisionSchemeAttr().Get()
    if scheme != UsdGeom.Tokens.none:
        notes.append(f"the mesh is a {scheme} cage; patches lie on the cage, not on the smooth surface drawn.")
    holes = array_of(mesh.GetHoleIndicesAttr(), (-1,), np.int64)
    kept = np.ones(len(sizes), bool)
    kept[holes[(holes >= 0) & (holes < len(sizes))]] = False
    if not kept.all():
        notes.append(f"{np.count_nonzero(~kept)} faces are holes and were left out.")
    points, sound = _finite(points, sizes, indices)
    if not sound[kept].all():
        notes.append(f"{np.count_nonzero(~sound & kept)} faces with corners that are not finite were left out.")
    kept &= sound
    if not kept.any():
        raise InvalidInput(f"{prim.GetPath()} has no face whose points are finite.")
    indices, sizes = indices[np.repeat(kept, sizes)], sizes[kept]
    left_handed = mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded
    return MeshArrays(points, sizes, indices, np.flatnonzero(kept), left_handed, tuple(notes))


def _finite(points: FloatArray, sizes: IntArray, indices: IntArray) -> tuple[FloatArray, BoolArray]:
    """Points (n, 3), those that are not finite put on another, and the faces (f,) that have none of them."""
    finite = np.asarray(np.isfinite(points).all(axis=1))
    sound = np.ones(len(sizes), bool)
    if finite.all() or not finite.any():
        sound[:] = finite.all()
        return points, sound
    sound[np.repeat(np.arange(len(sizes)), sizes)[~finite[indices]]] = False
    return np.where(finite[:, None], points, points[int(np.argmax(finite))]), sound


def read_surface(prim: Usd.Prim, space: SceneSpace) -> Asset:
    """The surface of a mesh prim. Raises InvalidInput."""
    arrays, placement = read_arrays(prim), placement_of(prim)
    try:
        asset = surface_of_polygons(
            prim.GetName(),
            arrays.points,
            arrays.face_sizes,
            arrays.face_indices,
            placement,
            space,
            clockwise=arrays.left_handed,
            notes=arrays.notes,
        )
    except InvalidInput as error:
        raise InvalidInput(f"{prim.GetPath()}: {error}") from error
    assert asset.source_faces is not None  # surface_of_polygons fills it
    return replace(asset, source_faces=arrays.faces[asset.source_faces], details={"prim": str(prim.GetPath())})


def selected_points_of(prim: Usd.Prim, subset: str) -> IntArray:
    """Indices of a mesh's own points that a GeomSubset of faces or points names. Raises InvalidInput."""
    there = {item.GetPrim().GetName(): item for item in UsdGeom.Subset.GetAllGeomSubsets(UsdGeom.Mesh(prim))}
    if subset not in there:
        raise InvalidInput(f"{prim.GetPath()} has no GeomSubset {subset!r}; it has {sorted(there)}.")
    chosen = array_of(there[subset].GetIndicesAttr(), (-1,), np.int64)
    kind = there[subset].GetElementTypeAttr().Get()
    if kind == UsdGeom.Tokens.point:
        count = len(UsdGeom.Mesh(prim).GetPointsAttr().Get(AS_IT_STANDS))
        if chosen.size and not 0 <= chosen.min() <= chosen.max() < count:
            raise InvalidInput(f"{prim.GetPath()}: the GeomSubset {subset!r} names points that the mesh has not.")
        return np.unique(chosen)
    if kind != UsdGeom.Tokens.face:
        raise InvalidInput(
            f"{prim.GetPath()}: the GeomSubset {subset!r} selects {kind}s: expected faces or points."
        )
    sizes = array_of(UsdGeom.Mesh(prim).GetFaceVertexCountsAttr(), (-1,), np.int64)
    indices = array_of(UsdGeom.Mesh(prim).GetFaceVertexIndicesAttr(), (-1,), np.int64)
    return np.unique(indices[np.repeat(np.isin(np.arange(len(sizes)), chosen), sizes)])


def subset_names(prim: Usd.Prim) -> tuple[str, ...]:
    """Names of a mesh's GeomSubsets."""
    subsets = UsdGeom.Subset.GetAllGeomSubsets(UsdGeom.Imageable(prim))
    return tuple(item.GetPrim().GetName() for item in subsets)
