"""An asset as named arrays, one of them a JSON header: what a numpy archive keeps without pickles."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from contact_core.document.asset import Asset
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.rig.rig import JointFreedom, Rig

RIG_ARRAYS = ("parents", "rest_local", "bind_world", "bind_points", "faces", "skin_joints", "skin_weights")


def pack(asset: Asset) -> dict[str, npt.NDArray[Any]]:
    """The arrays of an asset; meshes and rigs, not the ways back to a file (a sample has none)."""
    header: dict[str, Any] = {
        "name": asset.name,
        "meters_per_unit": asset.meters_per_unit,
        "up_axis": asset.up_axis,
        "notes": list(asset.notes),
        "details": asset.details,
    }
    arrays: dict[str, npt.NDArray[Any]] = {"points": asset.mesh.points, "faces": asset.mesh.faces}
    if asset.rig is not None:
        header["joints"] = list(asset.rig.joints)
        header["freedoms"] = [_freedom_to_json(freedom) for freedom in asset.rig.freedoms]
        arrays |= {f"rig_{name}": getattr(asset.rig, name) for name in RIG_ARRAYS}
    return {"header": np.frombuffer(json.dumps(header).encode(), np.uint8), **arrays}


def unpack(arrays: Mapping[str, npt.NDArray[Any]]) -> Asset:
    """The asset of packed arrays. Raises InvalidInput when they are not what `pack` makes."""
    try:
        header = json.loads(arrays["header"].tobytes())
        return Asset(
            name=header["name"],
            mesh=TriangleMesh(arrays["points"], arrays["faces"]),
            rig=_rig(header, arrays) if "joints" in header else None,
            meters_per_unit=header["meters_per_unit"],
            up_axis=header["up_axis"],
            notes=tuple(header["notes"]),
            details=header["details"],
        )
    except (KeyError, TypeError, ValueError) as error:
        raise InvalidInput(f"these arrays are no packed asset of this version: {error!r}.") from error


def _rig(header: dict[str, Any], arrays: Mapping[str, npt.NDArray[Any]]) -> Rig:
    return Rig(
        name=header["name"],
        joints=tuple(header["joints"]),
        freedoms=tuple(_freedom_from_json(entry) for entry in header["freedoms"]),
        meters_per_unit=header["meters_per_unit"],
        up_axis=header["up_axis"],
        **{name: arrays[f"rig_{name}"] for name in RIG_ARRAYS},
    )


def _freedom_to_json(freedom: JointFreedom) -> dict[str, Any]:
    numbers = {
        name: np.asarray(getattr(freedom, name)).tolist()
        for name in ("frame", "lower", "upper", "prior_weight", "locked")
    }
    return {"kind": freedom.kind, "order": freedom.order, "translates": freedom.translates, **numbers}


def _freedom_from_json(entry: dict[str, Any]) -> JointFreedom:
    return JointFreedom(**entry)
