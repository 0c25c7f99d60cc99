"""The interaction of one scene inside Blender: events in, bones, overlay and line of status out.

One of these belongs to each session of `shared`. It keeps no Blender object: what it needs of the window comes with
each event.
"""

from __future__ import annotations

import contextlib
import time
from typing import Any

import bpy

from contact_blender.extension import drawn, frames, settings, where
from contact_blender.extension.region_view import RegionView
from contact_core.edit.listeners import DocumentChanged
from contact_core.interaction.events import Pointer
from contact_core.interaction.interaction import Interaction
from contact_core.interaction.tool import TOOLS
from contact_core.rig.rig import Pose
from contact_core.session import Session

PREFIX = "contact."  # of the ids of our tools
_LOOKS = 0.2  # seconds between looks at the scene while the pointer hovers
_READS = frozenset(("select", "place"))  # tools that take up no object which is no surface yet


class _NothingDone(Exception):
    """A gesture that changed nothing: the surface that it began on is not kept either."""


class Artist:
    """See the module. busy: whether one of our modal operators runs."""

    def __init__(self, session: Session) -> None:
        self.session, self.host = session, session.host
        self.interaction = Interaction(session, meters_per_unit=self.host.space().meters_per_unit, beside=True)
        self.drawing = drawn.Drawing(self.is_shown)
        self.busy = False
        self._looked = 0.0
        self._previewed: dict[str, Pose] = {}  # what bones show, by surface
        self._configured: dict[str, dict[str, Any]] = {}
        self._panel_patch = ""
        self._macro: contextlib.ExitStack | None = None
        self._stop_listening = session.listen(self._heard)

    def close(self) -> None:
        """Put back what is under way and draw no more; the session stays."""
        self._stop_listening()
        if self.session.host is None:  # its scene has gone, and the bones with it
            self._previewed = {}
            self.host.forget_previews()
            self._macro = None
        else:
            self.leave()
            self.cancel()
        self.interaction.close()
        self.drawing.close()

    def is_shown(self) -> bool:
        """Whether contacts are drawn in the view that Blender draws now: always while we work, else with one of our
        tools in the hand, or where the panel says so."""
        manager = bpy.context.window_manager
        if self.session.host is None:
            return False
        if self.busy or getattr(getattr(manager, "contact", None), "show", False):
            return True
        return tool_in_hand(bpy.context).startswith(PREFIX)

    # -- the scene -------------------------------------------------------------------------------------------

    def look(self, patient: bool = False) -> None:
        """Look where things stand and how hands are posed now. patient: only where the last look is some time ago.

        Raises InvalidInput where an object cannot be read.
        """
        now = time.monotonic()
        if self.interaction.is_busy or (patient and now - self._looked < _LOOKS):
            return
        self._looked = now
        frames.follow_frame(self.session)
        desk = self.interaction.desk
        bound = self.session.binding.surfaces
        desk.hidden = frozenset(name for name, found in bound.items() if not self.host.is_seen(found.object_id))
        self.interaction.look()

    def configure(self) -> None:
        """Take over what the tool's header and the panel say. Raises InvalidInput."""
        for name, values in settings.values_of_tools(bpy.context).items():
            if values != self._configured.get(name):
                self._configured[name] = values
                self.interaction.configure(TOOLS, name, **values)
        values = settings.values_of_all(bpy.context)
        if values != self._configured.get(""):
            self._configured[""] = values
            self.interaction.set(**values)
        patch = str(getattr(getattr(bpy.context.window_manager, "contact", None), "patch", ""))
        if patch != self._panel_patch:
            self._panel_patch = patch
            if patch in self.session.document.patches and patch not in self.interaction.selection.patches:
                self.interaction.select(patch)

    def take_up(self, tool: str) -> None:
        """The tool whose button is pressed in the toolbar. Raises InvalidInput."""
        self.configure()
        if self.interaction.tool != tool:
            self.interaction.take_up(tool)

    # -- events ----------------------------------------------------------------------------------------------

    def press(self, context: Any, pointer: Pointer, view: RegionView) -> bool:
        """Begin a gesture; whether one has begun. An object that is no surface yet becomes one within its step."""
        self.look()
        try:
            self._bring_what_is_under(context, pointer, view)
            self.interaction.handle(pointer, view)
        except BaseException:
            self._end_macro(kept=False)
            raise
        if not self.interaction.is_busy:
            self._end_macro(kept=False)
        self.show()
        return self.interaction.is_busy

    def move(self, pointer: Pointer, view: RegionView) -> None:
        """The pointer moved, in a gesture or hovering."""
        self.interaction.handle(pointer, view)
        self.show()

    def release(self, pointer: Pointer, view: RegionView) -> None:
        """End the gesture: one step of undo, or none where it is refused."""
        before = self.session.document
        self._end_previews()  # the step that is written starts from the scene as it was
        try:
            self.interaction.handle(pointer, view)
        finally:
            self._end_macro(kept=self.session.document is not before)
        self.show()

    def keep_radius(self, pointer: Pointer, view: RegionView) -> None:
        """The click that ends setting the radius by the pointer: the header of the tool shows it from now on."""
        self.interaction.handle(pointer, view)
        settings.follow(bpy.context, self.interaction)
        self.show()

    def advance(self) -> None:
        """Once a tick of the timer: the hand follows the newest state, and what long work has found is shown."""
        self.interaction.advance()
        self.show()

    def cancel(self) -> None:
        """Put back everything: document, bones, selection."""
        self._end_previews()
        self.interaction.cancel()
        self._end_macro(kept=False)
        self.show()

    def accept(self) -> None:
        """Keep what is proposed, as one step. Raises ContactError."""
        self._end_previews()
        self.interaction.do("edit.accept")
        self.show()

    def leave(self) -> None:
        """Stop the work and leave what is proposed."""
        self._end_previews()
        self.interaction.worker.drop()
        self.interaction.proposing.dismiss()
        self.show()

    def do(self, action: str) -> None:
        """An action of the table. Raises ContactError."""
        self.look()
        self.configure()
        self._end_previews()
        self.interaction.do(action)
        settings.follow(bpy.context, self.interaction)
        self.show()

    def solve_frames(self, first: int, last: int) -> None:
        """Begin to solve frames beside the window, as a whole. Raises ContactError."""
        self.look()
        self.configure()
        self._end_previews()
        self.interaction.solve_frames(range(first, last + 1))
        self.show()

    # -- what is seen ----------------------------------------------------------------------------------------

    def show(self) -> None:
        """Bring bones and overlay in line with what the interaction shows."""
        changes = self.interaction.changes()
        if not changes:
            return
        if changes.surfaces:
            self._show_poses()
        if changes.surfaces or changes.parts & {"document", "overlay", "selection"}:
            overlay = self.interaction.overlay()
            seen = None if overlay.tint is None else self.interaction.desk.scene.surfaces.get(overlay.tint.surface)
            self.drawing.replace(overlay, *(() if seen is None else (seen.points, seen.mesh.faces)))
            drawn.redraw()

    def status(self) -> str:
        """The line of status."""
        return self.interaction.status.line()

    def _show_poses(self) -> None:
        """Let bones show what is previewed or proposed; where nothing is, they are as the scene has them."""
        desk = self.interaction.desk
        shown, base = desk.document.poses, desk.base.poses
        bound = self.session.binding.surfaces
        previewed = {
            name: shown[name]
            for name in bound
            if name in self.session.rigs and name in shown and shown[name] is not base.get(name)
        }
        if not previewed:
            self._end_previews()
        for name, pose in previewed.items():
            if self._previewed.get(name) is not pose:
                self.host.preview_pose(bound[name].object_id, pose)
        self._previewed = previewed

    def _end_previews(self) -> None:
        """Put the bones back as the scene has them."""
        self._previewed = {}
        self.host.end_previews()

    # -- inside ----------------------------------------------------------------------------------------------

    def _bring_what_is_under(self, context: Any, pointer: Pointer, view: RegionView) -> None:
        """Where the pointer is over a mesh that is no surface, open a step in which it becomes one."""
        desk = self.interaction.desk
        if self.interaction.tool in _READS or desk.selection.surface in desk.scene.surfaces:
            return
        found = object_under(context, pointer, view)
        if found is None:
            return
        object_id = where.object_id_of(self.session, found)
        if where.surface_name(self.session, object_id) is not None:
            return
        self._macro = contextlib.ExitStack()
        self._macro.enter_context(self.session.macro(f"{self.interaction.tool.capitalize()} on {found.name}"))
        where.surface_for(self.session, object_id)
        self.interaction.look()

    def _end_macro(self, kept: bool) -> None:
        macro, self._macro = self._macro, None
        if macro is None:
            return
        if kept:
            macro.close()
            return
        with contextlib.suppress(_NothingDone), macro:
            raise _NothingDone
        self.interaction.look()

    def _heard(self, change: DocumentChanged) -> None:
        if change.origin == "host" and change.kind != "preview":
            self._previewed = {}
            self.host.forget_previews()
        if not self.busy and change.kind != "preview":
            self.show()


def tool_in_hand(context: Any) -> str:
    """The id of the tool that is active in the 3D view's mode, "" where there is none."""
    workspace = getattr(context, "workspace", None)
    if workspace is None:
        return ""
    tool = workspace.tools.from_space_view3d_mode(context.mode, create=False)
    return "" if tool is None else str(tool.idname)


def object_under(context: Any, pointer: Pointer, view: RegionView) -> Any:
    """The visible mesh object that the ray through a pixel meets first, for immediate use; else None."""
    origins, directions = view.rays(pointer.pixel[None])
    depsgraph = context.evaluated_depsgraph_get()
    hit, _, _, _, found, _ = context.scene.ray_cast(depsgraph, origins[0].tolist(), directions[0].tolist())
    if not hit or found is None:
        return None
    original = context.scene.objects.get(found.name)
    return original if original is not None and original.type == "MESH" and original.visible_get() else None
