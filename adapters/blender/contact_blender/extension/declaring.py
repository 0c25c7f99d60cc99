"""Operators out of functions: properties, when it may run, and errors as reports.

Classes are made, never inherited: registering a child of a registered operator breaks its parent. Each is one
step of undo with one owner. Where Blender runs an operator (a button, a key, F3, F9) its flag UNDO pushes the step,
so that F9 can take it back and run it again with other values. Where a script calls it Blender pushes none, and the
session's host does (ADR 0086).
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import Any

import bpy

from contact_blender.extension import frames, shared

# The modes in which a step of Blender's undo holds the whole scene (`undo.WHOLE_SCENE`).
MODES = frozenset(("OBJECT", "POSE", "SCULPT", "PAINT_WEIGHT", "PAINT_VERTEX"))
Action = Callable[[Any, Any, Any], str]
_made: list[Any] = []


def operator(
    name: str,
    label: str,
    needs: str = "",
    /,
    beside: Callable[[Any, Any], dict[str, Any]] | None = None,
    **properties: Any,
) -> Callable[[Action], Action]:
    """Make `bpy.ops.contact.NAME` of a function (session, context, properties) that returns what it did, in words.

    needs: "mesh" (active), "patch", "two" (patches) or "pair"; without it the button is grey and says why.
    beside: given context and properties, the arguments of `contact.propose` with which a button or a key begins the
    work beside the window in place of the function, none where it has to wait.
    """

    def declare(action: Action) -> Action:
        def poll(cls: Any, context: Any) -> bool:
            reason = why_not(context, needs)
            if reason:
                cls.poll_message_set(reason)
            return not reason

        def execute(self: Any, context: Any) -> set[str]:
            again = self.options.is_repeat or self.options.is_repeat_last
            return _run(self, context, action, by_blender=again)

        def invoke(self: Any, context: Any, event: Any) -> set[str]:
            if not event.type or event.type == "NONE":  # a script said INVOKE_DEFAULT without a window
                return _run(self, context, action)
            instead = {} if beside is None else beside(context, self)
            if instead:  # goes on by itself, and its step is its own
                bpy.ops.contact.propose("INVOKE_DEFAULT", at_once=True, **instead)
                return {"CANCELLED"}
            return _run(self, context, action, by_blender=True)

        _made.append(
            type(
                f"CONTACT_OT_{name}",
                (bpy.types.Operator,),
                {
                    "__annotations__": properties,
                    "__doc__": action.__doc__,
                    "__module__": __name__,
                    "bl_idname": f"contact.{name}",
                    "bl_label": label,
                    "bl_description": " ".join((action.__doc__ or label).split()).rstrip("."),
                    "bl_options": {"REGISTER", "UNDO"},
                    "poll": classmethod(poll),
                    "execute": execute,
                    "invoke": invoke,
                },
            )
        )
        return action

    return declare


def made() -> tuple[Any, ...]:
    """Every class that was declared, in order."""
    return tuple(_made)


def why_not(context: Any, needs: str) -> str:
    """Why an operator cannot run now, "" where it can. Reads what is kept, and computes nothing."""
    if context.mode not in MODES:
        return "Leave this mode first (Tab leaves Edit Mode; the selection stays): its undo holds no contacts"
    if needs == "mesh":
        active = context.active_object
        return "" if active is not None and active.type == "MESH" else "Make a mesh the active object first"
    found = shared.held()
    if not needs or (found is None and shared.is_stored()):
        return ""
    patches = 0 if found is None else len(found.session.document.patches)
    pairs = 0 if found is None else len(found.session.document.pairs)
    if needs == "pair":
        return "" if pairs else "There is no pair yet: pair two patches first"
    if needs == "two" and patches == 1:
        return "There is one patch only: paint or transfer a second one first"
    return "" if patches else "There is no patch yet: select vertices and paint one first"


def _run(self: Any, context: Any, action: Action, by_blender: bool = False) -> set[str]:
    """Run an action; what it refuses is a report. A fault of the program becomes a sentence, too, and its traceback
    goes to the console for those who report it. by_blender: whether Blender pushes the step of undo."""
    from contact_core.errors import ContactError

    try:
        session = shared.session()
        frames.follow_frame(session)
        with session.host.step_of_operator() if by_blender else contextlib.nullcontext():
            said = action(session, context, self)
    except ContactError as error:
        self.report({"ERROR"}, _sentence(error))
        return {"CANCELLED"}
    except ImportError as error:
        self.report({"ERROR"}, f"A library cannot be loaded ({error}): install the zip built for this Blender.")
        return {"CANCELLED"}
    except Exception as error:
        import logging

        logging.getLogger(__name__).exception("contact.%s failed", self.bl_idname)
        self.report({"ERROR"}, f"This is a fault of the add-on, and nothing was changed ({error!r}).")
        return {"CANCELLED"}
    self.report({"INFO"}, said)
    return {"FINISHED"}


def _sentence(error: Exception) -> str:
    text = str(error)
    return text[:1].upper() + text[1:]
