"""Contacts as prims that any USD host can show: Points for patches, BasisCurves for axes, relationships for pairs.

The document on /Contacts is the truth; what lies below it is derived, for viewers and other tools. Every value is
authored and found again by its property, so all of it can be read without our schema plugin.

    /Contacts                   Scope, ContactDocumentAPI
    /Contacts/Patches/tip       Points, ContactPatchAPI
    /Contacts/Patches/tip_axis  BasisCurves, a sibling: inside Points it would be an invalid nested gprim
    /Contacts/Pairs/tip_mug     Scope, ContactPairAPI
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from pxr import Sdf, Tf, Usd, UsdGeom, Vt

from contact_core.arrays import FloatArray
from contact_core.document.document import ContactDocument, ContactPair
from contact_core.edit.document_geometry import DocumentGeometry
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.transform import transform_points
from contact_core.session import Session
from contact_usd.host import UsdHost
from contact_usd.storage import ROOT, contacts_prim

PATCHES, PAIRS = ROOT.AppendChild("Patches"), ROOT.AppendChild("Pairs")
_SIZE = 0.35  # width of a drawn point, of the mean spacing of the patch's points
_SOURCE = "contact:source"
_TYPES = Sdf.ValueTypeNames


@dataclass(frozen=True, eq=False)
class PatchPrim:
    """A patch as it stands in a stage. surface: prim path. positions: (k, 3) world. axis: None for one point."""

    name: str
    surface: str
    points: SurfacePoints
    positions: FloatArray
    axis: SurfacePoints | None
    role: str
    topology: str


@dataclass(frozen=True)
class PairPrim:
    """A pair as it stands in a stage, by the names of its patches."""

    name: str
    manipulator: str
    object: str
    weight: float


def publish(host: UsdHost, session: Session, prims: Mapping[str, str]) -> None:
    """Write the session's patches, axes and pairs in place of those published before: one undo step.

    Each prim says what it was made from, and what would be made from the same is left as it is. prims: path of the
    Mesh or Skeleton behind each of the document's surfaces. Raises InvalidInput for a patch on a surface that
    `prims` does not name.
    """
    document = session.document
    missing = sorted({patch.surface for patch in document.patches.values()} - set(prims))
    if missing:
        raise InvalidInput(f"publishing needs the prim of the surface {missing[0]!r}; given are {sorted(prims)}.")
    paths = {name: PATCHES.AppendChild(key) for name, key in _identifiers(document.patches).items()}
    pairs = {name: PAIRS.AppendChild(key) for name, key in _identifiers(document.pairs).items()}
    with host.step("Publish contacts"), Usd.EditContext(host.stage, Usd.EditTarget(host.layer)):
        contacts_prim(host.layer)
        _keep_only(host, PATCHES, {*paths.values(), *map(_axis_path, paths.values())})
        _keep_only(host, PAIRS, set(pairs.values()))
        _write_patches(host, session, prims, paths)
        for name, path in pairs.items():
            _write_pair(host, path, name, document.pairs[name], paths)
        _hide_those_below(host.stage, host.layer)


def key(host: UsdHost, document: ContactDocument, geometry: DocumentGeometry, frame: float) -> None:
    """Key what is published where it is at a frame. document, geometry: as the scene has them at that frame."""
    with host.step("Key contacts"), Usd.EditContext(host.stage, Usd.EditTarget(host.layer)):
        for name, key_ in _identifiers(document.patches).items():
            surface = document.surfaces[document.patches[name].surface]
            mesh, path = geometry.posed_mesh(surface.name), PATCHES.AppendChild(key_)
            drawn = {path: geometry.reconstruction(name).points, _axis_path(path): geometry.axis(name).points}
            for place, points in drawn.items():
                prim = UsdGeom.PointBased(host.stage.GetPrimAtPath(place))
                if prim:
                    positions = _placed(points.positions(mesh), surface.world_from_surface).astype(np.float32)
                    prim.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(positions), frame)
                    extent = UsdGeom.Boundable.ComputeExtentFromPlugins(prim, frame)
                    prim.GetExtentAttr().Set(extent, frame)


def read_patches(stage: Usd.Stage) -> tuple[PatchPrim, ...]:
    """All published patches, by their properties: the schema need not be known."""
    found = []
    for prim in stage.Traverse():
        face = prim.GetAttribute("primvars:contact:face")
        surface = prim.GetRelationship("contact:surface")
        if not (prim.IsA(UsdGeom.Points) and face and face.HasAuthoredValue() and surface):
            continue
        axis = prim.GetRelationship("contact:axis").GetTargets()
        targets = surface.GetTargets()
        found.append(
            PatchPrim(
                prim.GetAttribute("contact:name").Get(),
                str(targets[0]) if targets else "",
                _surface_points(prim),
                np.asarray(UsdGeom.Points(prim).GetPointsAttr().Get(), np.float64),
                _surface_points(stage.GetPrimAtPath(axis[0])) if axis else None,
                str(prim.GetAttribute("contact:role").Get()),
                prim.GetAttribute("contact:topology").Get(),
            )
        )
    return tuple(found)


def read_pairs(stage: Usd.Stage) -> tuple[PairPrim, ...]:
    """All published pairs."""
    found = []
    for prim in stage.Traverse():
        ends = [prim.GetRelationship(f"contact:{end}") for end in ("manipulator", "object")]
        if all(ends) and all(end.GetTargets() for end in ends):
            one, other = (
                stage.GetPrimAtPath(end.GetTargets()[0]).GetAttribute("contact:name").Get() for end in ends
            )
            weight = float(prim.GetAttribute("contact:weight").Get())
            found.append(PairPrim(prim.GetAttribute("contact:name").Get(), one, other, weight))
    return tuple(found)


def _keep_only(host: UsdHost, scope: Sdf.Path, wanted: Collection[Sdf.Path]) -> None:
    """Have the scope, without what we published there of things that the document no longer has."""
    if not host.stage.GetPrimAtPath(scope):
        UsdGeom.Scope.Define(host.stage, scope)
    spec = host.layer.GetPrimAtPath(scope)
    for path in [child.path for child in spec.nameChildren if child.path not in wanted] if spec is not None else []:
        host.stage.RemovePrim(path)


def _made_from(layer: Sdf.Layer, path: Sdf.Path) -> str:
    """What our layer's prim there says it was made from, "" where there is none, or one that `key` has changed."""
    spec = layer.GetAttributeAtPath(path.AppendProperty(_SOURCE))
    keyed = layer.GetNumTimeSamplesForPath(path.AppendProperty("points"))
    return "" if spec is None or keyed else str(spec.default)


def _source(*data: object) -> str:
    """Digest of what a prim is made from: plain values, whose texts say all of them."""
    return hashlib.sha256(repr(data).encode()).hexdigest()


def _write_pair(host: UsdHost, path: Sdf.Path, name: str, pair: ContactPair, paths: Mapping[str, Sdf.Path]) -> None:
    ends = {end: paths[getattr(pair, end)] for end in ("manipulator", "object")}
    source = _source(name, sorted(map(str, ends.items())), pair.weight)
    if _made_from(host.layer, path) == source:
        return
    prim = UsdGeom.Scope.Define(host.stage, path).GetPrim()
    prim.AddAppliedSchema("ContactPairAPI")
    _text(prim, "contact:name", name)
    _text(prim, _SOURCE, source)
    for end, target in ends.items():
        prim.CreateRelationship(f"contact:{end}", False).SetTargets([target])
    prim.CreateAttribute("contact:weight", _TYPES.Float, False, Sdf.VariabilityUniform).Set(pair.weight)


def _hide_those_below(stage: Usd.Stage, layer: Sdf.Layer) -> None:
    """What a layer further below published (of a shot under this one) is shown where we wrote it, else not."""
    for scope in (PATCHES, PAIRS):
        for prim in stage.GetPrimAtPath(scope).GetAllChildren():
            ours = layer.GetPrimAtPath(prim.GetPath()) is not None
            if prim.IsActive() != ours:
                prim.SetActive(ours)


def _write_patches(
    host: UsdHost, session: Session, prims: Mapping[str, str], paths: Mapping[str, Sdf.Path]
) -> None:
    """Every patch that our layer does not have as it is now."""
    document = session.document
    meshes = {
        name: session.geometry.posed_mesh(name) for name in {patch.surface for patch in document.patches.values()}
    }
    for name, path in paths.items():
        patch = document.patches[name]
        mesh, surface = meshes[patch.surface], document.surfaces[patch.surface]
        world, target = surface.world_from_surface, prims[patch.surface]
        look = (name, patch.color, patch.original, surface.topology_digest, mesh.digest, world.tolist(), target)
        source = _source(*look, session.derived.key(document, name))
        if _made_from(host.layer, path) != source:
            _write_patch(host, path, session, name, mesh, Sdf.Path(target), source)


def _write_patch(
    host: UsdHost,
    path: Sdf.Path,
    session: Session,
    name: str,
    mesh: TriangleMesh,
    surface_path: Sdf.Path,
    source: str,
) -> None:
    """mesh: what the animator sees; the triangles are those of the rest pose."""
    stage, patch = host.stage, session.document.patches[name]
    surface = session.document.surfaces[patch.surface]
    points = session.geometry.points(name)
    positions = _placed(points.positions(mesh), surface.world_from_surface)
    axis, curve_path = session.geometry.axis_points(name), _axis_path(path)
    is_curve = len(axis) > 1
    for old in (path, curve_path):
        stage.RemovePrim(old)
    drawn = UsdGeom.Points.Define(stage, path)
    prim = drawn.GetPrim()
    prim.AddAppliedSchema("ContactPatchAPI")
    spacing = float(np.linalg.norm(np.ptp(positions, axis=0))) / max(np.sqrt(len(positions)), 1.0)
    drawn.CreateWidthsAttr(Vt.FloatArray([_SIZE * spacing] * len(positions)))
    _write_points(drawn, positions, points, patch.color)
    _text(prim, "contact:name", name)
    _text(prim, "contact:topology", surface.topology_digest)
    _text(prim, _SOURCE, source)
    role = "original" if patch.original else "transferred"
    prim.CreateAttribute("contact:role", _TYPES.Token, False, Sdf.VariabilityUniform).Set(role)
    prim.CreateRelationship("contact:surface", False).SetTargets([surface_path])
    if is_curve:
        curves = UsdGeom.BasisCurves.Define(stage, curve_path)
        curves.CreateTypeAttr(UsdGeom.Tokens.linear)
        curves.CreateCurveVertexCountsAttr(Vt.IntArray([len(axis)]))
        curves.CreateWidthsAttr(Vt.FloatArray([_SIZE * spacing]))
        curves.SetWidthsInterpolation(UsdGeom.Tokens.constant)
        _write_points(curves, _placed(axis.positions(mesh), surface.world_from_surface), axis, patch.color)
    prim.CreateRelationship("contact:axis", False).SetTargets([curve_path] if is_curve else [])


def _axis_path(path: Sdf.Path) -> Sdf.Path:
    return path.GetParentPath().AppendChild(f"{path.name}_axis")


def _write_points(
    drawn: UsdGeom.PointBased, positions: FloatArray, points: SurfacePoints, color: tuple[float, float, float]
) -> None:
    """Positions, colour, faces and barycentric coordinates; what USD draws and what the patch is."""
    drawn.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(positions.astype(np.float32)))
    drawn.CreateExtentAttr(UsdGeom.Boundable.ComputeExtentFromPlugins(drawn, Usd.TimeCode.Default()))
    drawn.CreateDisplayColorAttr(Vt.Vec3fArray([color]))
    primvars = UsdGeom.PrimvarsAPI(drawn)
    vertex = UsdGeom.Tokens.vertex
    faces = Vt.IntArray.FromNumpy(points.faces.astype(np.int32))
    primvars.CreatePrimvar("contact:face", _TYPES.IntArray, vertex).Set(faces)
    bary = Vt.Vec3fArray.FromNumpy(points.barycentric.astype(np.float32))
    primvars.CreatePrimvar("contact:bary", _TYPES.Float3Array, vertex).Set(bary)


def _surface_points(prim: Usd.Prim) -> SurfacePoints:
    faces = np.asarray(prim.GetAttribute("primvars:contact:face").Get(), np.int64)
    bary = np.asarray(prim.GetAttribute("primvars:contact:bary").Get(), np.float64).reshape(-1, 3)
    return SurfacePoints(faces, bary / bary.sum(axis=1, keepdims=True))


def _placed(points: FloatArray, world: FloatArray) -> FloatArray:
    return transform_points(world, points)


def _text(prim: Usd.Prim, attribute: str, value: str) -> None:
    prim.CreateAttribute(attribute, _TYPES.String, False, Sdf.VariabilityUniform).Set(value)


def _identifiers(names: Mapping[str, object]) -> dict[str, str]:
    """A prim name for each name, unique, also beside the names of axes."""
    taken: set[str] = set()
    result = {}
    for name in names:
        valid = Tf.MakeValidIdentifier(name)
        key, number = valid, 2
        while {key, f"{key}_axis"} & taken:
            key, number = f"{valid}_{number}", number + 1
        taken |= {key, f"{key}_axis"}
        result[name] = key
    return result
