"""The slots of what stands below plugins, with the types of what fills them.

Those of higher floors are beside their protocols: `contact_core.grasping.slots`, `contact_core.interaction.tool`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from contact_core.plugins.slot import SLOTS, Slot

if TYPE_CHECKING:
    from contact_core.contact.axis_generator import AxisGenerator
    from contact_core.contact.brush import Brush
    from contact_core.edit.command import Command
    from contact_core.geometry.engine import GeodesicEngine
    from contact_core.plugins.slots import (
        CliCommand,
        Format,
        JobKind,
        Placer,
        ProxyMaker,
        Renderer,
        Sample,
    )  # fmt: skip
    from contact_core.scene.host import HostAdapter
    from contact_core.solve.solver import PoseSolver
    from contact_core.solve.term import PoseTerm

BRUSHES: Slot[Brush] = SLOTS["contact_brushes"]
AXIS_GENERATORS: Slot[AxisGenerator] = SLOTS["contact_axis_generators"]
PLACERS: Slot[Placer] = SLOTS["contact_placers"]
POSE_SOLVERS: Slot[PoseSolver] = SLOTS["contact_pose_solvers"]
POSE_TERMS: Slot[type[PoseTerm]] = SLOTS["contact_pose_terms"]
GEODESIC_ENGINES: Slot[GeodesicEngine] = SLOTS["contact_geodesic_engines"]
HOSTS: Slot[type[HostAdapter]] = SLOTS["contact_hosts"]
FORMATS: Slot[Format] = SLOTS["contact_formats"]
RENDERERS: Slot[Renderer] = SLOTS["contact_renderers"]
SAMPLES: Slot[Sample] = SLOTS["contact_samples"]
COMMANDS: Slot[type[Command]] = SLOTS["contact_commands"]
JOB_KINDS: Slot[JobKind] = SLOTS["contact_job_kinds"]
PROXY_MAKERS: Slot[ProxyMaker] = SLOTS["contact_proxy_makers"]
CLI: Slot[CliCommand] = SLOTS["contact_cli"]
