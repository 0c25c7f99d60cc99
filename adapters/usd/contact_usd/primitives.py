"""UsdGeom's primitives (Sphere, Cube, Cylinder, Cone, Capsule, Plane) as triangles; what of a stage is drawn."""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from contact_core.errors import InvalidInput
from contact_core.geometry import solids
from contact_core.scene.mesh_names import MOST_AROUND, MeshNames, shown

AS_IT_STANDS = Usd.TimeCode.EarliestTime()
KINDS = ("Sphere", "Cube", "Cylinder", "Cylinder_1", "Cone", "Capsule", "Capsule_1", "Plane")
# columns: where the solid's x, y, z go, so that its z axis lies along the named one
ALONG = {"X": np.roll(np.eye(3), 1, axis=0), "Y": np.roll(np.eye(3), 2, axis=0), "Z": np.eye(3)}


def is_primitive(prim: Usd.Prim) -> bool:
    """Whether a prim is one of the solids that are read."""
    return str(prim.GetTypeName()) in KINDS


def solid_of(prim: Usd.Prim) -> solids.Solid:
    """Points (n, 3) and faces (m, 3) in the prim's own space. Raises InvalidInput naming it."""
    kind = str(prim.GetTypeName())
    if kind == "Cube":
        return solids.box(*[_size(prim, "size")] * 3)
    if kind == "Sphere":
        return solids.sphere(_size(prim, "radius"))
    if kind == "Plane":
        # width lies along x (along z where the plane faces x), length along y (along z where it faces y)
        axis = prim.GetAttribute("axis").Get(AS_IT_STANDS)
        width, length = _size(prim, "width"), _size(prim, "length")
        points, faces = solids.rectangle(*((length, width) if axis in ("X", "Y") else (width, length)))
        return _along(prim, (points, faces))
    height = _size(prim, "height")
    if kind.endswith("_1"):
        bottom, top = _size(prim, "radiusBottom"), _size(prim, "radiusTop")
    else:
        bottom = _size(prim, "radius")
        top = 0.0 if kind == "Cone" else bottom
    maker = solids.capsule(bottom, height, top) if kind.startswith("Capsule") else solids.cone(bottom, height, top)
    return _along(prim, maker)


def is_hidden(prim: Usd.Prim) -> bool:
    """Whether a prim, or something above it, is made invisible."""
    return bool(UsdGeom.Imageable(prim).ComputeVisibility(AS_IT_STANDS) == UsdGeom.Tokens.invisible)


def stands_in(prim: Usd.Prim) -> bool:
    """Whether a prim is a guide or a proxy by its purpose, which a renderer does not draw."""
    return UsdGeom.Imageable(prim).ComputePurpose() in (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy)


def drawn(prims: dict[str, Usd.Prim]) -> tuple[list[str], list[str]]:
    """The paths that a renderer draws by default, and notes on the others: guides, proxies, what is invisible."""
    left: dict[str, list[str]] = {"guides": [], "proxies": [], "invisible": []}
    kept = []
    for path, prim in prims.items():
        purpose = UsdGeom.Imageable(prim).ComputePurpose()
        if is_hidden(prim):
            left["invisible"].append(path)
        elif purpose == UsdGeom.Tokens.guide:
            left["guides"].append(path)
        elif purpose == UsdGeom.Tokens.proxy:
            left["proxies"].append(path)
        else:
            kept.append(path)
    if not kept and left["proxies"]:
        kept, left["proxies"] = left["proxies"], []
    which, stand_ins = shown([names_of(prims[path]) for path in kept])
    kept = [kept[k] for k in which]
    told = [*stand_ins, *_not_drawn(left)]
    return kept, told


def names_of(prim: Usd.Prim) -> MeshNames:
    """What a mesh is called, and the prims above it."""
    around, above = list[str](), prim.GetParent()
    while above and not above.IsPseudoRoot() and len(around) < MOST_AROUND:
        around.append(above.GetName())
        above = above.GetParent()
    return MeshNames((prim.GetName(),), tuple(around))


def _not_drawn(left: dict[str, list[str]]) -> list[str]:
    return [f"not drawn, and left out: {kind} {', '.join(paths[:8])}." for kind, paths in left.items() if paths]


def silent_losses(stage: Usd.Stage, skinned: set[str]) -> list[str]:
    """Notes on what a stage draws and this reading does not take: point instances, skins without a SkelRoot, and
    what is no mesh (curves, patches, points)."""
    notes = []
    others: dict[str, list[str]] = {}
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        if prim.IsA(UsdGeom.PointInstancer):
            count = len(UsdGeom.PointInstancer(prim).GetProtoIndicesAttr().Get(AS_IT_STANDS) or ())
            notes.append(f"{prim.GetPath()} scatters {count} copies (PointInstancer), which are not read.")
            continue
        if prim.IsA(UsdGeom.Gprim) and not prim.IsA(UsdGeom.Mesh) and not is_primitive(prim):
            if not stands_in(prim) and not is_hidden(prim):
                others.setdefault(str(prim.GetTypeName()), []).append(str(prim.GetPath()))
            continue
        influenced = prim.IsA(UsdGeom.Mesh) and prim.HasAttribute("primvars:skel:jointIndices")
        if influenced and str(prim.GetPath()) not in skinned:
            notes.append(
                f"{prim.GetPath()} has joint influences, but USD does not skin it (no SkelRoot above it, or no"
                " skeleton bound): it was read as a rigid mesh."
            )
    for kind, paths in others.items():
        more = f" and {len(paths) - 8} more" if len(paths) > 8 else ""
        notes.append(f"drawn, but not read, for a {kind} is no mesh: {', '.join(paths[:8])}{more}.")
    return notes


def unchosen_variants(stage: Usd.Stage) -> list[str]:
    """Notes on variant sets of which no variant is chosen: what they hold is not there."""
    notes = []
    for prim in stage.Traverse():
        for name in prim.GetVariantSets().GetNames():
            there = prim.GetVariantSet(name)
            if there.GetVariantNames() and not there.GetVariantSelection():
                listed = ", ".join(there.GetVariantNames()[:6])
                notes.append(f"{prim.GetPath()} has no choice in its variant set {name} ({listed}).")
    return notes


def _size(prim: Usd.Prim, name: str) -> float:
    value: Any = prim.GetAttribute(name).Get(AS_IT_STANDS)
    if not isinstance(value, (int, float)) or not 0.0 <= value < float("inf"):
        raise InvalidInput(f"{prim.GetPath()}: its {name} is {value!r}, where a length must stand.")
    return float(value)


def _along(prim: Usd.Prim, solid: solids.Solid) -> solids.Solid:
    axis = str(prim.GetAttribute("axis").Get(AS_IT_STANDS))
    if axis not in ALONG:
        raise InvalidInput(f"{prim.GetPath()}: its axis is {axis!r}, where X, Y or Z must stand.")
    return solid[0] @ ALONG[axis].T, solid[1]
