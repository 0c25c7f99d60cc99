"""What `contact inspect` tells about a file: the facts that decide whether and how it can be posed."""

from __future__ import annotations

from dataclasses import asdict
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset
from contact_core.errors import FileRefused, InvalidInput
from contact_core.geometry.report import report
from contact_core.hands.describe import describe_hands
from contact_core.hands.description import HandDescription, HandWords
from contact_core.plugins.slots import Format
from contact_core.rig.rig import ROTATION_DOFS, Rig

OWN_FORMATS = ("gltf:GltfFiles", "mesh_files:MeshFiles", "urdf:UrdfFiles")


def inspect(path: Path, *, sidecar: Path | None = None) -> dict[str, Any]:
    """The facts of a file in one of the built-in formats, JSON-able. Raises FileRefused."""
    path = Path(path)
    for reference in OWN_FORMATS:
        module, name = reference.split(":")
        reader: Format = getattr(import_module(f"contact_builtins.formats.{module}"), name)()
        if path.suffix.lower() in reader.suffixes:
            return {"file": str(path), **inspect_asset(reader.read(path, sidecar=sidecar))}
    raise FileRefused(f"{path} ends in {path.suffix!r}, which no built-in reader knows.")


def inspect_asset(asset: Asset) -> dict[str, Any]:
    """The facts of an asset, whatever format it came from. JSON-able."""
    found = report(asset.mesh)
    facts = asdict(found)
    facts["non_manifold_edges"] = len(facts["non_manifold_edges"])
    for key in ("non_manifold_vertices", "degenerate_faces", "duplicate_faces"):
        facts[key] = len(facts[key])
    source_faces = asset.details.get("polygons")
    if source_faces is not None and asset.source_faces is not None:
        facts["dropped_source_faces"] = int(source_faces) - len(np.unique(asset.source_faces))
    return {
        "name": asset.name,
        "kind": "manipulator" if asset.rig is not None else "object",
        "mesh": {**facts, "manifold": found.is_manifold, "watertight": found.is_watertight},
        "source_vertices": None if asset.source_vertices is None else len(asset.source_vertices),
        "source_faces": source_faces,
        "meters_per_unit": asset.meters_per_unit,
        "up_axis": asset.up_axis,
        "hands": [] if asset.rig is None else [hand_facts(asset.rig, hand) for hand in hands_of(asset)],
        "rig": None if asset.rig is None else _rig_facts(asset.rig, asset.details),
        "details": {key: value for key, value in asset.details.items() if key != "polygons"},
        "notes": list(asset.notes),
    }


def hands_of(asset: Asset) -> tuple[HandDescription, ...]:
    """The hands of a rig, what its sidecar says about them included. Raises InvalidInput for an object."""
    if asset.rig is None:
        raise InvalidInput(f"{asset.name} is an object without joints, so it has no hands.")
    return describe_hands(asset.rig, tuple(HandWords(**words) for words in asset.details.get("hands", ())))


def hand_facts(rig: Rig, hand: HandDescription) -> dict[str, Any]:
    """A hand's description, JSON-able; directions and points in the rig's space at rest."""
    digits = []
    for digit in hand.digits:
        bones = [
            {
                "joint": rig.joints[bone.joint],
                "segment": bone.segment,
                "flexes": bone.flexes,
                "flexion_axis": _rounded(rig.rest_world[bone.joint, :3, :3] @ bone.frame[:, 2]),
            }
            for bone in digit.bones
        ]
        tip_joint = rig.joints[digit.tip_joint] if digit.tip_joint >= 0 else None
        digits.append({"role": digit.role, "tip": _rounded(digit.tip), "tip_joint": tip_joint, "bones": bones})
    pads = [
        {
            "name": pad.name,
            "joint": rig.joints[pad.joint],
            "centre": _rounded(pad.centre.positions(rig.surface)[0]),
            "normal": _rounded(pad.normal),
            "axis": [_rounded(end) for end in pad.axis.positions(rig.surface)],
            "radius": round(pad.radius, 6),
        }
        for pad in hand.pads
    ]
    return {
        "hub": rig.joints[hand.hub],
        "side": hand.side,
        "confidence": round(hand.confidence, 3),
        "palm": {
            "point": _rounded(hand.palm.point),
            "normal": _rounded(hand.palm.normal),
            "fingers": _rounded(hand.palm.fingers),
            "is_plane": hand.palm.is_plane,
        },
        "opposition": None if hand.opposition is None else _rounded(hand.opposition),
        "digits": digits,
        "pads": pads,
        "notes": list(hand.notes),
    }


def _rounded(vector: FloatArray) -> list[float]:
    return [round(float(value), 5) for value in vector]


def _rig_facts(rig: Rig, details: dict[str, Any]) -> dict[str, Any]:
    joints = []
    for index, name in enumerate(rig.joints):
        freedom, parent = rig.freedoms[index], int(rig.parents[index])
        joints.append(
            {
                "name": name,
                "parent": rig.joints[parent] if parent >= 0 else None,
                "kind": freedom.kind,
                "dofs": ROTATION_DOFS[freedom.kind] + 3 * freedom.translates,
                "locked": int(np.count_nonzero(np.asarray(freedom.locked))),
                **({} if freedom.follows is None else {"follows": freedom.follows, "ratio": freedom.ratio}),
                "limits_deg": [
                    [_degrees(low), _degrees(high)] for low, high in zip(freedom.lower, freedom.upper, strict=True)
                ]
                if freedom.lower is not None and freedom.upper is not None
                else [],
            }
        )
    used = rig.skin_weights > 0
    difference = np.abs(rig.rest_world - rig.bind_world)[:, :3].max(axis=(1, 2))
    return {
        "joints": len(rig.joints),
        "degrees_of_freedom": sum(joint["dofs"] for joint in joints),
        "locked_degrees_of_freedom": sum(joint["locked"] for joint in joints),
        "influences": int(details.get("influences", used.sum(axis=1).max(initial=0))),
        "weights_sum_to_1": bool(details.get("weights_sum_to_1", True)),
        "rest_is_bind": bool((difference <= 1e-5 * max(rig.surface.bounding_box_diagonal, 1e-12)).all()),
        "joint_tree": joints,
    }


def _degrees(angle: float) -> float | None:
    """Degrees for JSON; None where there is no limit."""
    return round(float(np.degrees(angle)), 3) if np.isfinite(angle) else None
