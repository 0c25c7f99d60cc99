"""What joints may do, which USD has no word for (limits, hinges): JSON on the skeleton, written by our exporter."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from pxr import Usd

from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.rig.rig import JointFreedom

FREEDOMS = "contact:jointFreedoms"


def read_freedoms(prim: Usd.Prim, count: int) -> tuple[JointFreedom, ...]:
    """Those of a skeleton's joints, all free where none are written. Raises InvalidInput where they are damaged."""
    text = prim.GetAttribute(FREEDOMS).Get() if prim.HasAttribute(FREEDOMS) else None
    if not text:
        return (JointFreedom(),) * count
    try:
        data = json.loads(text)
        return tuple(freedom_from_json(item) for item in data)
    except (ValueError, TypeError, KeyError, RecursionError, InvalidInput) as error:
        raise InvalidInput(f"{FREEDOMS} is damaged: {error}") from error


def freedom_from_json(data: dict[str, Any]) -> JointFreedom:
    """A joint's freedom; limits that are null are free."""
    values = dict(data)
    for key, free in (("lower", -np.inf), ("upper", np.inf)):
        values[key] = [free if v is None else v for v in values[key]]
    return JointFreedom(**values)


def freedom_to_json(freedom: JointFreedom) -> dict[str, object]:
    """JSON has no infinity: a free limit is null."""

    def limits(values: FloatArray | None) -> list[float | None]:
        return [float(v) if np.isfinite(v) else None for v in (values if values is not None else ())]

    return {
        "kind": freedom.kind,
        "order": freedom.order,
        "translates": freedom.translates,
        "frame": np.asarray(freedom.frame).tolist(),
        "lower": limits(freedom.lower),
        "upper": limits(freedom.upper),
        "prior_weight": np.asarray(freedom.prior_weight).tolist(),
        "locked": np.asarray(freedom.locked).tolist(),
        "follows": freedom.follows,
        "ratio": freedom.ratio,
        "locked_translation": np.asarray(freedom.locked_translation).tolist(),
    }
