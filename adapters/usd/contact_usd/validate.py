"""What USD's own validators say about a stage, as sentences."""

from __future__ import annotations

from typing import Any

from pxr import Sdf, Usd

from contact_core.errors import MissingExtra


def problems(stage: Usd.Stage, *, ours: Sdf.Layer | None = None) -> tuple[str, ...]:
    """Errors of all validators; `ours`: only those at prims and layers that this layer has an opinion about.

    Raises MissingExtra where this pxr has no UsdValidation (before 24.11 or so).
    """
    try:
        from pxr import UsdValidation
    except ImportError as error:
        raise MissingExtra("Validating a stage (UsdValidation of usd-core 26.3 or later)", "usd") from error
    context = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
    found = []
    for finding in context.Validate(stage):
        if finding.GetType() != UsdValidation.ValidationErrorType.Error:
            continue
        sites = finding.GetSites()
        if ours is None or any(_touches(site, ours) for site in sites):
            found.append(f"{finding.GetName()}: {finding.GetMessage()}")
    return tuple(found)


def _touches(site: Any, layer: Sdf.Layer) -> bool:
    """Whether a validation site is our layer, or something it has an opinion about."""
    if site.IsProperty():
        return layer.GetPropertyAtPath(site.GetProperty().GetPath()) is not None
    if site.IsPrim():
        return site.GetPrim().IsPseudoRoot() or layer.GetPrimAtPath(site.GetPrim().GetPath()) is not None
    return not site.GetLayer() or site.GetLayer() == layer
