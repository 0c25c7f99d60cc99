"""Every hook of contact-core, on one screen. Mark an implementation with `contact_core.plugins.hookimpl`.

The first sixteen return what a plugin offers: an iterable of objects that satisfy the slot's protocol, or of
references "package.module:Name" to them, imported when first wanted (a class is then called without arguments),
so that offering costs nothing and a missing library takes away one object, not a plugin.
"""
# mypy: disable-error-code="empty-body"

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, TypeAlias

import pluggy

if TYPE_CHECKING:
    from contact_core.document.document import ContactDocument
    from contact_core.solve.problem import PoseProblem
    from contact_core.solve.solver import PoseSolution

API_VERSION = (1, 1)  # a plugin may set CONTACT_API = ">=1.0,<2"; the major number grows when a hook breaks
Offers: TypeAlias = Iterable[object]
hookspec = pluggy.HookspecMarker("contact")


# fmt: off
@hookspec
def contact_brushes() -> Offers:
    """Ways to paint a patch: `contact.brush.Brush`."""
@hookspec
def contact_axis_generators() -> Offers:
    """Ways to lay a default axis through a patch: `contact.axis_generator.AxisGenerator`."""
@hookspec
def contact_placers() -> Offers:
    """Ways to choose where patches go on the object: `plugins.slots.Placer`."""
@hookspec
def contact_grasp_samplers() -> Offers:
    """Where a hand may come from to grasp: `grasping.slots.GraspSampler`."""
@hookspec
def contact_grasp_scores() -> Offers:
    """How good a solved grasp is: `grasping.slots.GraspScore`."""
@hookspec
def contact_pose_solvers() -> Offers:
    """Optimisers of a pose problem: `solve.solver.PoseSolver`."""
@hookspec
def contact_pose_terms() -> Offers:
    """Terms of the pose objective: `solve.term.PoseTerm` (classes; every problem makes its own)."""
@hookspec
def contact_geodesic_engines() -> Offers:
    """Engines for distances, log maps and traces: `geometry.engine.GeodesicEngine`."""
@hookspec
def contact_hosts() -> Offers:
    """Hosts: DCCs, stages, viewers: `scene.host.HostAdapter` (classes; `Host.open(path)` opens a file)."""
@hookspec
def contact_tools() -> Offers:
    """Tools for pointer and keys: `interaction.tool.Tool`."""
@hookspec
def contact_formats() -> Offers:
    """File formats: `plugins.slots.Format`."""
@hookspec
def contact_renderers() -> Offers:
    """Off-screen renderers: `plugins.slots.Renderer`."""
@hookspec
def contact_samples() -> Offers:
    """Sample manipulators and objects: `plugins.slots.Sample`."""
@hookspec
def contact_commands() -> Offers:
    """Edit commands: `edit.command.Command` (classes), so that journals which hold them replay."""
@hookspec
def contact_job_kinds() -> Offers:
    """Kinds of jobs for `contact batch`: `plugins.slots.JobKind`."""
@hookspec
def contact_proxy_makers() -> Offers:
    """Makers of closed manifolds that stand for broken meshes: `plugins.slots.ProxyMaker`."""
@hookspec
def contact_cli() -> Offers:
    """Sub-commands of `contact`: `plugins.slots.CliCommand`."""
@hookspec(firstresult=True)
def contact_choose_axis_generator(surface: str, patch: str, offered: Sequence[str]) -> str | None:
    """The axis generator for a patch that names none; None leaves the choice to the next plugin."""
@hookspec(firstresult=True)
def contact_choose_pose_solver(problem: PoseProblem, offered: Sequence[str]) -> str | None:
    """The solver for a problem that names none; None leaves the choice to the next plugin."""
@hookspec
def contact_document_changed(document: ContactDocument, revision: int, origin: str) -> None:
    """Told after every commit, undo and redo; never during a stroke."""
@hookspec
def contact_pose_solved(problem: PoseProblem, solution: PoseSolution) -> None:
    """Told after every solve, whatever its status."""
