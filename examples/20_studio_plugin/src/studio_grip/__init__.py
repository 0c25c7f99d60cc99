"""A studio's plugin. Each hook returns references, imported when the slot is first asked for."""

from contact_core.plugins import hookimpl

CONTACT_API = ">=1.0,<2"


@hookimpl
def contact_axis_generators() -> list[object]:
    return ["studio_grip.crosswise:Crosswise"]


@hookimpl
def contact_pose_solvers() -> list[object]:
    return ["studio_grip.lbfgsb:LBFGSB"]
