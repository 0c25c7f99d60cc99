"""Assets to prims: triangles, and rigs as SkelRoot, Skeleton and a skinned mesh."""

from __future__ import annotations

import json

import numpy as np
from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdSkel, Vt

from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset
from contact_core.geometry.mesh import TriangleMesh
from contact_core.rig.rig import Rig
from contact_usd.freedoms import FREEDOMS, freedom_to_json
from contact_usd.mesh import gf_matrix


def add_surface(stage: Usd.Stage, asset: Asset, world: FloatArray) -> str:
    """Define the asset's mesh at the root of the stage, placed by world (4, 4); its path."""
    path = free_path(stage, asset.name)
    _define_mesh(stage, path, asset.mesh)
    _place(UsdGeom.Xformable(stage.GetPrimAtPath(path)), world)
    return str(path)


def add_rig(stage: Usd.Stage, asset: Asset, rig: Rig, world: FloatArray) -> str:
    """Define SkelRoot `name`_rig with the Skeleton `name` and the mesh `name`_skin; the skeleton's path."""
    root_path = free_path(stage, f"{asset.name}_rig")
    root = UsdSkel.Root.Define(stage, root_path)
    _place(UsdGeom.Xformable(root), world)
    name = Tf.MakeValidIdentifier(asset.name)
    skeleton = UsdSkel.Skeleton.Define(stage, root_path.AppendChild(name))
    skeleton.CreateJointsAttr(joint_paths(rig))
    skeleton.CreateJointNamesAttr(list(rig.joints))
    skeleton.CreateBindTransformsAttr(Vt.Matrix4dArray([gf_matrix(m) for m in rig.bind_world]))
    skeleton.CreateRestTransformsAttr(Vt.Matrix4dArray([gf_matrix(m) for m in rig.rest_local]))
    freedoms = skeleton.GetPrim().CreateAttribute(FREEDOMS, Sdf.ValueTypeNames.String, True, Sdf.VariabilityUniform)
    freedoms.Set(json.dumps([freedom_to_json(item) for item in rig.freedoms]))

    mesh_path = root_path.AppendChild(f"{name}_skin")
    mesh = _define_mesh(stage, mesh_path, TriangleMesh(rig.bind_points, rig.faces))
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))
    width = rig.skin_joints.shape[1]
    joints = binding.CreateJointIndicesPrimvar(False, width)
    joints.Set(Vt.IntArray.FromNumpy(rig.skin_joints.astype(np.int32).ravel()))
    weights = binding.CreateJointWeightsPrimvar(False, width)
    weights.Set(Vt.FloatArray.FromNumpy(rig.skin_weights.astype(np.float32).ravel()))
    return str(skeleton.GetPath())


def joint_paths(rig: Rig) -> list[str]:
    """UsdSkel's joint tokens: the path from the root, of valid and unique names."""
    used: set[str] = set()
    paths: list[str] = []
    for name, parent in zip(rig.joints, rig.parents, strict=True):
        valid, number = Tf.MakeValidIdentifier(name), 2
        while valid in used:
            valid, number = f"{Tf.MakeValidIdentifier(name)}_{number}", number + 1
        used.add(valid)
        paths.append(valid if parent < 0 else f"{paths[parent]}/{valid}")
    return paths


def free_path(stage: Usd.Stage, name: str) -> Sdf.Path:
    """A path at the root of the stage that no prim has."""
    valid, number = Tf.MakeValidIdentifier(name), 2
    path = Sdf.Path.absoluteRootPath.AppendChild(valid)
    while stage.GetPrimAtPath(path):
        path, number = Sdf.Path.absoluteRootPath.AppendChild(f"{valid}_{number}"), number + 1
    return path


def _define_mesh(stage: Usd.Stage, path: Sdf.Path, surface: TriangleMesh) -> UsdGeom.Mesh:
    mesh = UsdGeom.Mesh.Define(stage, path)
    points = Vt.Vec3fArray.FromNumpy(surface.points.astype(np.float32))
    mesh.CreatePointsAttr(points)
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(surface.faces), 3, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(surface.faces.astype(np.int32).ravel()))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)  # what is drawn is what is painted on
    mesh.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(points))
    return mesh


def _place(xformable: UsdGeom.Xformable, world: FloatArray) -> None:
    if not np.array_equal(world, np.eye(4)):
        xformable.MakeMatrixXform().Set(gf_matrix(world))
