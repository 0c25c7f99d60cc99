"""A walk through gestures, edits of Blender's own, undo, modes and files, with a model of the scene beside it.

It needs no pytest: the window's tests take it along into their Blender.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from contact_core.scene.host import StoredDocument

FORWARD = ("rotate", "scale", "transfer", "pair", "unpair", "remove", "paint", "solve", "recolor", "link")


def set_up(bpy: Any, scenes: Any) -> None:
    """An arm with a rig and a group "tip" of its vertices, and a sheet."""
    from contact_core.scene.host import SceneSpace
    from contact_core.testing.host_scenes import HostScene, SceneRig, arm_rig

    scenes.build(HostScene(SceneSpace(1.0, "Z"), rigs=(SceneRig("arm", arm_rig()),)))
    add_sheet_and_tip(bpy)


def add_sheet_and_tip(bpy: Any) -> None:
    """What is the same in every scene of a walk, beside the skinned mesh "arm"."""
    bpy.context.preferences.edit.undo_steps = 256
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=12, y_subdivisions=12, size=4.0, location=(0.0, 3.0, 0.0))
    bpy.context.object.name = "sheet"
    arm = bpy.data.objects["arm"]
    places = np.array([vertex.co for vertex in arm.data.vertices])
    far = np.argsort(places @ np.ptp(places, axis=0))[-12:]
    arm.vertex_groups.new(name="tip").add([int(vertex) for vertex in far], 1.0, "REPLACE")


class Walk:
    """Blender and the model beside it."""

    def __init__(self, bpy: Any, scenes: Any, shared: Any, folder: Path, seed: int) -> None:
        self.bpy, self.scenes, self.shared, self.folder = bpy, scenes, shared, folder
        self.random = np.random.default_rng(seed)
        self.states, self.now = [self.state()], 0
        self.done: dict[str, int] = {}

    def state(self) -> Any:
        return self.scenes.whole_state()

    def forward(self, name: str, run: Callable[[], Any]) -> None:
        """An act that is one step when it does something, and nothing at all where it is refused."""
        before = self.state()
        try:
            finished = run() == {"FINISHED"}
        except RuntimeError as refused:
            assert "fault of the add-on" not in str(refused) and "Traceback" not in str(refused), refused
            finished = False
        if not finished:
            assert self.state() == before, f"{name} was refused, and changed the scene"
            return
        self.done[name] = self.done.get(name, 0) + 1
        self.states[self.now + 1 :] = [self.state()]
        self.now += 1

    def travel(self, operator: Any, by: int) -> None:
        """Undo or redo: the scene of the model's step, whole, or nothing at the end of the history."""
        if not 0 <= self.now + by < len(self.states):
            return
        assert operator() == {"FINISHED"}
        self.travelled(by)

    def travelled(self, by: int) -> None:
        """Blender has gone that far."""
        self.now += by
        assert self.state() == self.states[self.now], f"not the scene of step {self.now}"

    def patch(self) -> str:
        there = list(self.shared.session().document.patches)
        return str(self.random.choice(there)) if there else ""

    def ours(self, name: str) -> None:
        ops, random = self.bpy.ops.contact, self.random
        given: dict[str, dict[str, Any]] = {
            "rotate": {"angle": float(random.uniform(-1.0, 1.0))},
            "scale": {"along": float(random.uniform(0.8, 1.1))},
            "transfer": {"object": "sheet", "pair": bool(random.integers(2))},
            "pair": {"other": self.patch()},
            "link": {"parent": self.patch()},
            "paint": {"object": "arm", "group": "tip", "patch": f"patch {random.integers(4)}"},
            "recolor": {"color": tuple(random.uniform(size=3))},
            "solve": {"keyed": self.is_animated() or bool(random.integers(3) == 0), "first": 1, "last": 2},
        }
        own = given.get(name, {})
        if name not in ("paint", "solve", "unpair"):
            own["patch"] = self.patch()
        x, y = random.uniform(-1.5, 1.5, 2)
        self.bpy.context.scene.cursor.location = (x, y + 3.0, 0.0)
        before = self.state()
        try:
            self.forward(name, lambda: getattr(ops, name)(**own))
        except RuntimeError:
            assert self.state() == before
            raise

    def is_animated(self) -> bool:
        """Whether the bones have curves: a pose that is not keyed then goes with any change of them, in Blender's
        own undo as well."""
        animation = self.bpy.data.objects["arm"].parent.animation_data
        return animation is not None and animation.action is not None

    def move(self) -> None:
        """As a user moves an object, or a bone in Pose Mode."""

        def act() -> set[str]:
            if self.bpy.context.mode == "POSE" and not self.is_animated():
                self.bpy.data.objects["arm"].parent.pose.bones[1].rotation_quaternion.x += 0.1
            else:
                self.bpy.data.objects["sheet"].location.z += 0.01
            self.bpy.context.view_layer.update()
            self.bpy.ops.ed.undo_push(message="Move")
            return {"FINISHED"}

        self.forward("move", act)

    def mode(self) -> None:
        """Into another mode of the object that has it; each change is a step, as by a key."""
        wanted, name = (("OBJECT", ""), ("POSE", "arm"), ("WEIGHT_PAINT", "sheet"))[self.random.integers(3)]

        def act() -> set[str]:
            if self.bpy.context.mode != "OBJECT":
                self.bpy.ops.object.mode_set(mode="OBJECT")
            if name:
                thing = self.bpy.data.objects[name]
                self.bpy.context.view_layer.objects.active = thing.parent if wanted == "POSE" else thing
                self.bpy.ops.object.mode_set(mode=wanted)
            self.bpy.ops.ed.undo_push(message="Mode")
            return {"FINISHED"}

        self.forward(f"mode {wanted}", act)

    def edit_mode(self) -> None:
        """There and back: our operators are grey, and nothing of ours changes."""
        if self.bpy.context.mode != "OBJECT":
            return
        self.bpy.context.view_layer.objects.active = self.bpy.data.objects["sheet"]
        self.bpy.ops.object.mode_set(mode="EDIT")
        stored = self.state()[-1]
        for name in FORWARD:
            assert not getattr(self.bpy.ops.contact, name).poll()
        assert self.state()[-1] == stored
        self.bpy.ops.object.mode_set(mode="OBJECT")

    def reload(self) -> None:
        path, before = self.saved()
        self.bpy.ops.wm.open_mainfile(filepath=path)
        self.reopened(before)

    def saved(self) -> tuple[str, Any]:
        """Save the scene: (path, its state), to be opened again."""
        scene = self.bpy.context.scene
        scene.frame_set(scene.frame_current)  # opening does so: a pose that is not keyed on animated bones is lost
        path, before = str(self.folder / "shot.blend"), self.state()
        self.bpy.ops.wm.save_as_mainfile(filepath=path)
        return path, before

    def reopened(self, before: Any) -> None:
        """The file was opened: the scene is what it was, and nothing can be undone."""
        self.bpy.ops.ed.undo_push(message="Original")
        if self.shared.is_stored():
            self.bpy.ops.contact.begin()
        assert self.state() == before
        self.states, self.now = [before], 0
        self.done["reload"] = self.done.get("reload", 0) + 1

    def agree(self) -> None:
        """What the scene stores, what the session has and what the panel lists are one document."""
        session = self.shared.session()
        stored = session.host.stored_document()
        if stored is None:
            assert not session.document.patches and not session.document.surfaces
            return
        assert stored.stamp.revision == session.revision
        assert stored.stamp.digest == StoredDocument.of(session.timed_document, session.revision).stamp.digest
        assert [row.name for row in self.bpy.context.window_manager.contact.rows] == [*session.document.patches]

    def step(self) -> None:
        kind = self.random.uniform()
        if 0.65 <= kind < 0.83:
            self.travel(self.bpy.ops.ed.undo, -1)
        elif 0.83 <= kind < 0.98:
            self.travel(self.bpy.ops.ed.redo, 1)
        else:
            self.act(kind)
        self.agree()

    def act(self, kind: float) -> None:
        """Something that is a step of its own, or opens a file. kind: 0 to 1, chosen at random."""
        if kind < 0.45:
            self.ours(str(self.random.choice((*FORWARD, "paint", "paint", "transfer", "solve"))))
        elif kind < 0.55:
            self.move()
        elif kind < 0.62:
            self.mode()
        elif kind < 0.65:
            self.edit_mode()
        else:
            self.reload()
