"""Stages for tests, written with pxr alone: nothing of the adapter's own writing helps its reading."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt

from contact_core.testing.host_scenes import HostScene, SceneMesh, SceneRig


def write_scene(scene: HostScene, path: Path) -> Path:
    """The contract's scene as a usda or usdc file."""
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, scene.space.meters_per_unit)
    UsdGeom.SetStageUpAxis(stage, scene.space.up_axis)
    where: dict[str, Sdf.Path] = {}
    for mesh in scene.meshes:
        above = where[mesh.parent].GetParentPath() if mesh.parent else Sdf.Path("/World")
        where[mesh.name] = write_mesh(stage, above.AppendChild(f"{mesh.name}_group"), mesh)
    for rig in scene.rigs:
        write_rig(stage, Sdf.Path("/World").AppendChild(f"{rig.name}_root"), rig)
    stage.GetRootLayer().Save()
    return path


def gf(matrix: np.ndarray) -> Gf.Matrix4d:
    return Gf.Matrix4d(np.asarray(matrix, float).T.tolist())


def write_mesh(stage: Usd.Stage, group: Sdf.Path, mesh: SceneMesh) -> Sdf.Path:
    """A placed Xform with the mesh below it, so that children inherit the placement."""
    UsdGeom.Xform.Define(stage, group).MakeMatrixXform().Set(gf(mesh.parent_from_local))
    prim = UsdGeom.Mesh.Define(stage, group.AppendChild(mesh.name))
    prim.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.asarray(mesh.points, np.float32)))
    prim.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.asarray(mesh.face_sizes, np.int32)))
    prim.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.asarray(mesh.face_indices, np.int32)))
    prim.CreateSubdivisionSchemeAttr("none")
    for name, vertices in mesh.selections.items():
        UsdGeom.Subset.CreateGeomSubset(prim, name, UsdGeom.Tokens.point, Vt.IntArray(list(vertices)))
    return prim.GetPath()


def write_rig(stage: Usd.Stage, root: Sdf.Path, made: SceneRig) -> None:
    """SkelRoot, Skeleton and mesh; joint influences in an order of the mesh's own."""
    rig = made.rig
    UsdSkel.Root.Define(stage, root).MakeMatrixXform().Set(gf(made.world_from_local))
    skeleton = UsdSkel.Skeleton.Define(stage, root.AppendChild(made.name))
    paths: list[str] = []
    for name, parent in zip(rig.joints, rig.parents, strict=True):
        paths.append(name if parent < 0 else f"{paths[parent]}/{name}")
    skeleton.CreateJointsAttr(paths)
    skeleton.CreateBindTransformsAttr(Vt.Matrix4dArray([gf(m) for m in rig.bind_world]))
    skeleton.CreateRestTransformsAttr(Vt.Matrix4dArray([gf(m) for m in rig.rest_local]))
    mesh = UsdGeom.Mesh.Define(stage, root.AppendChild(f"{made.name}_skin"))
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(rig.bind_points.astype(np.float32)))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray([3] * len(rig.faces)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(rig.faces.astype(np.int32).ravel()))
    mesh.CreateSubdivisionSchemeAttr("none")
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    binding.CreateJointsAttr(paths[::-1])
    width = rig.skin_joints.shape[1]
    turned = len(paths) - 1 - rig.skin_joints
    binding.CreateJointIndicesPrimvar(False, width).Set(Vt.IntArray.FromNumpy(turned.astype(np.int32).ravel()))
    weights = Vt.FloatArray.FromNumpy(rig.skin_weights.astype(np.float32).ravel())
    binding.CreateJointWeightsPrimvar(False, width).Set(weights)
