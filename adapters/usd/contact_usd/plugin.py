"""What the USD adapter offers to the core, by reference, so that nothing imports pxr before it is used."""

from __future__ import annotations

from contact_core.plugins import hookimpl


@hookimpl
def contact_hosts() -> list[object]:
    return ["contact_usd.host:UsdHost"]


@hookimpl
def contact_job_kinds() -> list[object]:
    return ["contact_usd.jobs:ShotJob"]


@hookimpl
def contact_cli() -> list[object]:
    return ["contact_usd.command:UsdCommand"]


@hookimpl
def contact_formats() -> list[object]:
    return ["contact_usd.files:UsdFiles"]
