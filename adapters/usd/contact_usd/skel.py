"""UsdSkel rigs to the analytic rig: all meshes that one skeleton drives become one skin.

UsdSkel skins in skeleton space: sum of weight * joint * inverse bind * geomBindTransform * point; the meshes' own
transforms play no part. So rig space is skeleton space with the stretch of the skeleton's world matrix applied.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdGeom, UsdSkel, Vt

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.document.asset import Asset
from contact_core.errors import InvalidInput
from contact_core.geometry.sound import sound_polygons
from contact_core.geometry.transform import transform_points
from contact_core.geometry.triangulate import triangulate
from contact_core.rig.rig import Rig, still_following
from contact_core.scene.host import SceneSpace
from contact_core.scene.mesh_names import shown
from contact_core.scene.reading import stretch_rig
from contact_usd.freedoms import read_freedoms
from contact_usd.mesh import AS_IT_STANDS, matrix_of, placement_of, read_arrays
from contact_usd.primitives import is_hidden, names_of, stands_in

INSTANCES = Usd.TraverseInstanceProxies()
_FLAT = 1e-9  # volume of a unit cube in a joint's axes, made unit: below it the axes are as good as in one plane
_ODD = 0.01  # of the points of a mesh, how many may have odd influences before it is damaged


@dataclass(frozen=True, eq=False)
class SkinPart:
    """One skinned mesh, in skeleton space. first: (p,) the mesh's own point behind each skin point.
    of_source: (n,) skin point of each of the mesh's own points. joints, weights: (p, K) as authored."""

    path: str
    points: FloatArray
    faces: IntArray
    source_faces: IntArray
    first: IntArray
    of_source: IntArray
    joints: IntArray
    weights: FloatArray
    notes: tuple[str, ...]


def bindings(stage: Usd.Stage) -> dict[str, tuple[UsdSkel.Cache, UsdSkel.Binding]]:
    """Every skeleton that drives a mesh, by path. Read anew each time: the cache does not notice a new binding."""
    found: dict[str, tuple[UsdSkel.Cache, UsdSkel.Binding]] = {}
    for prim in stage.Traverse(INSTANCES):
        if not prim.IsA(UsdSkel.Root):
            continue
        cache = UsdSkel.Cache()
        root = UsdSkel.Root(prim)
        cache.Populate(root, INSTANCES)
        for binding in cache.ComputeSkelBindings(root, INSTANCES):
            path = str(binding.GetSkeleton().GetPrim().GetPath())
            if path not in found and any(True for _ in skinned_meshes(binding)):
                found[path] = (cache, binding)
    return found


def influenced_meshes(binding: UsdSkel.Binding) -> Iterator[UsdSkel.SkinningQuery]:
    """The meshes that a skeleton moves by joint influences."""
    for query in binding.GetSkinningTargets():
        if query.GetPrim().IsA(UsdGeom.Mesh) and query.HasJointInfluences():
            yield query


def skinned_meshes(binding: UsdSkel.Binding) -> list[UsdSkel.SkinningQuery]:
    """Those that are the skin: guides and proxies, hulls and coarser copies only where there is nothing else.

    Purposes and names decide: what an artist hides for a while stays part of the skin that patches lie on.
    """
    return _skin_and_notes(binding)[0]


def _skin_and_notes(binding: UsdSkel.Binding) -> tuple[list[UsdSkel.SkinningQuery], list[str]]:
    every = list(influenced_meshes(binding))
    drawn = [query for query in every if not stands_in(query.GetPrim())] or every
    kept, notes = shown([names_of(query.GetPrim()) for query in drawn])
    return [drawn[k] for k in kept], notes


def losses(binding: UsdSkel.Binding) -> list[str]:
    """Notes on meshes of a rig that are left out of its skin, or that are in it and cannot be seen."""
    queries, notes = _skin_and_notes(binding)
    skin = {str(query.GetPrim().GetPath()): query.GetPrim() for query in queries}
    others = [query.GetPrim() for query in influenced_meshes(binding) if str(query.GetPrim().GetPath()) not in skin]
    unseen = [path for path, prim in skin.items() if is_hidden(prim)]
    told = {
        "guides and proxies of the rig, left out of its skin": [
            str(prim.GetPath()) for prim in others if stands_in(prim)
        ],
        "invisible, and part of the rig all the same": unseen if len(unseen) < len(skin) else [],
    }
    return [*notes, *(f"{what}: {', '.join(paths[:8])}." for what, paths in told.items() if paths)]


def joint_names(skeleton: UsdSkel.Skeleton) -> tuple[str, ...]:
    """Unique names: `jointNames` where authored, else the last part of each path, else whole paths."""
    paths = [str(token) for token in skeleton.GetJointsAttr().Get() or ()]
    names_given = skeleton.GetJointNamesAttr().Get()
    given = list(map(str, names_given)) if isinstance(names_given, Vt.TokenArray) else []
    for names in (given, [path.rsplit("/", 1)[-1] for path in paths]):
        if len(names) == len(paths) == len(set(names)):
            return tuple(names)
    return tuple(paths)


def read_rig(cache: UsdSkel.Cache, binding: UsdSkel.Binding, space: SceneSpace) -> tuple[Asset, list[SkinPart]]:
    """The rig as an asset in surface space, and its parts. Raises InvalidInput naming what cannot be reproduced."""
    skeleton = binding.GetSkeleton()
    prim = skeleton.GetPrim()
    query = _query(cache, skeleton)
    parts = [_read_part(item, query) for item in skinned_meshes(binding)]
    starts = np.cumsum([0, *(len(part.points) for part in parts)])
    joints, weights, weight_notes = _influences(parts)
    parents = parents_of(cache, skeleton)
    bind = _bind_world(query, prim)
    rest, rest_notes = _rest_local(skeleton, parents, bind)
    placement = placement_of(prim)
    try:
        local = Rig(
            name=prim.GetName(),
            joints=joint_names(skeleton),
            parents=parents,
            rest_local=rest,
            bind_world=bind,
            bind_points=np.concatenate([part.points for part in parts]),
            faces=np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=False)]),
            skin_joints=joints,
            skin_weights=weights,
            freedoms=still_following(joint_names(skeleton), read_freedoms(prim, len(parents))),
            meters_per_unit=space.meters_per_unit,
            up_axis=space.up_axis,
        )
        rig = stretch_rig(local.in_tree_order, placement, space)
    except InvalidInput as error:
        raise InvalidInput(f"{prim.GetPath()}: {error}") from error
    face_starts = np.cumsum([0, *(int(part.source_faces.max(initial=-1)) + 1 for part in parts)])
    asset = Asset(
        name=prim.GetName(),
        mesh=rig.surface,
        rig=rig,
        source_vertices=np.concatenate([p.of_source + start for p, start in zip(parts, starts, strict=False)]),
        source_faces=np.concatenate([p.source_faces + start for p, start in zip(parts, face_starts, strict=False)]),
        meters_per_unit=space.meters_per_unit,
        up_axis=space.up_axis,
        notes=(*rest_notes, *weight_notes, *(note for part in parts for note in part.notes)),
        details={"prim": str(prim.GetPath()), "parts": _part_table(parts)},
    )
    return asset, parts


def rest_local(cache: UsdSkel.Cache, skeleton: UsdSkel.Skeleton) -> FloatArray:
    """(j, 4, 4) parent_from_joint of the rest pose, in skeleton space."""
    query = _query(cache, skeleton)
    bind = _bind_world(query, skeleton.GetPrim())
    return _rest_local(skeleton, parents_of(cache, skeleton), bind)[0]


def parents_of(cache: UsdSkel.Cache, skeleton: UsdSkel.Skeleton) -> IntArray:
    """(j,) index of each joint's parent, -1 for a root, in the skeleton's own order."""
    return np.asarray(_query(cache, skeleton).GetTopology().GetParentIndices(), np.int64)


def skin_of_stage(
    cache: UsdSkel.Cache, binding: UsdSkel.Binding, parts: list[SkinPart], time: Usd.TimeCode
) -> FloatArray:
    """(n, 3) skin points by UsdSkel's own evaluation at a time, in skeleton space."""
    transforms = cache.GetSkelQuery(binding.GetSkeleton()).ComputeSkinningTransforms(time)
    moved = []
    for query, part in zip(skinned_meshes(binding), parts, strict=True):
        points = UsdGeom.Mesh(query.GetPrim()).GetPointsAttr().Get(AS_IT_STANDS)
        if not query.ComputeSkinnedPoints(transforms, points, AS_IT_STANDS):
            raise InvalidInput(f"{part.path}: UsdSkel could not skin the points.")
        moved.append(np.asarray(points, np.float64)[part.first])
    return np.concatenate(moved)


def _read_part(query: UsdSkel.SkinningQuery, skeleton: UsdSkel.SkeletonQuery) -> SkinPart:
    prim = query.GetPrim()
    path = str(prim.GetPath())
    method = query.GetSkinningMethod()
    if method != UsdSkel.Tokens.classicLinear:
        raise InvalidInput(
            f"{path} is skinned by {method}, which a linear rig does not reproduce (differences reach 4% of the"
            " size). Set primvars:skel:skinningMethod to classicLinear to pose it here."
        )
    arrays = read_arrays(prim)
    notes = list(arrays.notes)
    if query.HasBlendShapes():
        notes.append("blend shapes are not part of the rig; the skin is without them.")
    joints, weights, odd = _varying_influences(query, skeleton, len(arrays.points), path)
    notes += odd
    # points at one position stay apart where their influences differ, or the skin would tear differently
    alike = np.unique(np.hstack([joints, weights]), axis=0, return_inverse=True)[1].reshape(-1)
    sound = sound_polygons(
        arrays.points,
        arrays.face_sizes,
        arrays.face_indices,
        apart=alike,
        exact=True,
        clockwise=arrays.left_handed,
    )
    first = sound.first
    faces, cut, cut_notes = triangulate(sound.sizes, sound.indices, arrays.points[first])
    bind = matrix_of(query.GetGeomBindTransform(AS_IT_STANDS))
    if not np.isfinite(bind).all():
        raise InvalidInput(f"{path} has a geomBindTransform that is no number.")
    if arrays.left_handed != bool(np.linalg.det(bind[:3, :3]) < 0):
        faces = faces[:, [0, 2, 1]]
    return SkinPart(
        path,
        transform_points(bind, arrays.points[first]),
        faces,
        arrays.faces[sound.face_of[cut]],
        first,
        sound.point_of,
        joints[first],
        weights[first],
        tuple(f"{prim.GetName()}: {note}" for note in (*notes, *sound.notes, *cut_notes)),
    )


def _varying_influences(
    query: UsdSkel.SkinningQuery, skeleton: UsdSkel.SkeletonQuery, count: int, path: str
) -> tuple[IntArray, FloatArray, list[str]]:
    """(n, K) joints in the skeleton's order and weights, for constant influences and own joint orders too, and
    notes. A few odd influences count for nothing; many are damage."""
    computed = query.ComputeVaryingJointInfluences(count, AS_IT_STANDS)
    if computed is None or len(computed[0]) % max(count, 1):
        raise InvalidInput(f"{path}: the joint influences do not fit its {count} points.")
    joints = np.asarray(computed[0], np.int64).reshape(count, -1)
    weights = np.asarray(computed[1], np.float64).reshape(count, -1)
    order = [str(token) for token in skeleton.GetJointOrder()]
    own = None if query.GetJointOrder() is None else [str(token) for token in query.GetJointOrder()]
    listed = len(order if own is None else own)
    odd = ~np.isfinite(weights) | (joints < 0) | (joints >= listed)
    points, notes = int(np.count_nonzero(odd.any(axis=1))), list[str]()
    if 0 < points <= _ODD * count:
        joints, weights = np.where(odd, 0, joints), np.where(odd, 0.0, weights)
        notes.append(
            f"{points} points had weights that are no numbers, or joints that are not there, which count as 0."
        )
    if not np.isfinite(weights).all():
        raise InvalidInput(f"{path} has joint weights that are no numbers.")
    if own is not None:
        place = {name: k for k, name in enumerate(order)}
        lost = [name for name in own if name not in place]
        if lost:
            raise InvalidInput(f"{path} names the joint {lost[0]!r}, which its skeleton does not have.")
        if not 0 <= joints.min() <= joints.max() < listed:
            off = joints.min() if joints.min() < 0 else joints.max()
            raise InvalidInput(f"{path} names its joint number {off}, but lists {listed} joints of its own.")
        joints = np.array([place[name] for name in own])[joints]
    return joints, weights, notes


def _influences(parts: list[SkinPart]) -> tuple[IntArray, FloatArray, tuple[str, ...]]:
    """(n, K) joints and weights of the whole skin, weights normalised, and what had to be done for that."""
    width = max(part.joints.shape[1] for part in parts)
    joints = np.concatenate([np.pad(part.joints, ((0, 0), (0, width - part.joints.shape[1]))) for part in parts])
    weights = np.concatenate([np.pad(part.weights, ((0, 0), (0, width - part.weights.shape[1]))) for part in parts])
    total = weights.sum(axis=1)
    notes = []
    loose = total < 1e-6
    if loose.any():
        notes.append(f"{np.count_nonzero(loose)} points had no weights and follow the first joint.")
        weights = np.where(loose[:, None], np.eye(1, width), weights)
        joints = np.where(loose[:, None], 0, joints)
        total = np.where(loose, 1.0, total)
    off = np.abs(total - 1.0) > 1e-4
    if off.any():
        notes.append(
            f"the weights of {np.count_nonzero(off)} points summed to {total.min():.4g}..{total.max():.4g} and were"
            " normalised; UsdSkel does not do that, so it draws those points elsewhere."
        )
    return joints, weights / total[:, None], tuple(notes)


def _query(cache: UsdSkel.Cache, skeleton: UsdSkel.Skeleton) -> UsdSkel.SkeletonQuery:
    """Raises InvalidInput where there is no tree of joints to ask about."""
    query = cache.GetSkelQuery(skeleton)
    if not query or not query.GetJointOrder():
        raise InvalidInput(f"{skeleton.GetPath()} is a skeleton without joints, or its topology is not valid.")
    return query


def _bind_world(query: UsdSkel.SkeletonQuery, prim: Usd.Prim) -> FloatArray:
    """(j, 4, 4) of the joints where the skin is bound. Raises InvalidInput where that is no place for a joint."""
    joints = [str(token) for token in query.GetJointOrder()]
    given = query.GetJointWorldBindTransforms()
    if len(given) != len(joints):
        raise InvalidInput(
            f"{prim.GetPath()} has {len(joints)} joints, and its bindTransforms do not fit them: where its skin is"
            " bound is not said."
        )
    bind = np.stack([matrix_of(m) for m in given])
    upright = _upright(bind)
    if not upright.all():
        raise InvalidInput(
            f"{prim.GetPath()}: the bindTransform of the joint {joints[int(upright.argmin())]} flattens space, or"
            " is no number."
        )
    return bind


def _rest_local(
    skeleton: UsdSkel.Skeleton, parents: IntArray, bind: FloatArray
) -> tuple[FloatArray, tuple[str, ...]]:
    """(j, 4, 4) rest transforms, or those of the bind pose where none are authored."""
    above = np.where((parents >= 0)[:, None, None], bind[parents], np.eye(4))
    bound = np.linalg.inv(above) @ bind
    given = skeleton.GetRestTransformsAttr().Get()
    if not isinstance(given, Vt.Matrix4dArray) or len(given) != len(parents):  # a layer may name any type
        return bound, ("the skeleton has no rest pose; its bind pose stands in.",)
    rest = np.stack([matrix_of(m) for m in given])
    odd = ~_upright(rest)
    if not odd.any():
        return rest, ()
    names = [name for name, wrong in zip(joint_names(skeleton), odd, strict=True) if wrong]
    return np.where(odd[:, None, None], bound, rest), (
        f"the rest transforms of {', '.join(names[:8])} flatten space or are no numbers: the bind pose stands in.",
    )


def _upright(matrices: FloatArray) -> BoolArray:
    """(j,) which of them are numbers and flatten nothing."""
    axes = np.where(np.isfinite(matrices).all(axis=(1, 2), keepdims=True), matrices, 0.0)[:, :3, :3]
    return np.asarray(np.abs(np.linalg.det(axes)) > _FLAT * np.linalg.norm(axes, axis=1).prod(axis=1))


def _part_table(parts: list[SkinPart]) -> list[dict[str, object]]:
    """Where each mesh lies in the skin: path, own points, points and triangles."""
    return [
        {"prim": p.path, "own_points": len(p.of_source), "points": len(p.points), "triangles": len(p.faces)}
        for p in parts
    ]
