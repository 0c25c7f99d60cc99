"""The operators `bpy.ops.contact.*`: each a function on the session of the open scene, one step of undo each.

Only bpy is imported at the top: the rest loads when an operator runs.
"""

from __future__ import annotations

from typing import Any

from bpy.props import BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, StringProperty

from contact_blender.extension import shared
from contact_blender.extension.declaring import made, operator

PATCH = StringProperty(name="Patch", description="A patch; empty: the active one of the panel")
PARTNER = StringProperty(name="Other patch", description="The other patch")
NAME = StringProperty(name="Name", description="The new name")
OBJECT = StringProperty(name="Object", description="A mesh object; empty: the active one")
GROUP = StringProperty(name="Vertex group", description="A vertex group; empty: the selected vertices")
PLACES = (
    ("CURSOR", "3D cursor", "The point nearest to the 3D cursor"),
    ("SELECTION", "Selected vertices", "The vertex amid those that are selected on the object"),
)
AT = EnumProperty(items=PLACES, name="At", description="Where to")
DIRECTION = FloatVectorProperty(
    name="Direction", description="Where the axis points, in the world; zero: as it is now", default=(0.0, 0.0, 0.0)
)
POINT = IntProperty(name="Axis point", description="Index of a point of the patch's axis", default=1, min=0)


def classes() -> tuple[Any, ...]:
    """The classes of all operators."""
    return made()


@operator("begin", "Show Contacts")
def begin(session: Any, context: Any, given: Any) -> str:
    """Read the contacts that this scene holds, and list them in the panel."""
    return (
        f"{len(session.document.patches)} patches, {len(session.document.pairs)} pairs. {' '.join(session.notes)}"
    )


@operator("add_surfaces", "Add Objects as Surfaces", "mesh", object=OBJECT)
def add_surfaces(session: Any, context: Any, given: Any) -> str:
    """Let the selected meshes be surfaces that contacts lie on."""
    from contact_blender.extension import where

    chosen = [named_object for named_object in context.selected_objects if named_object.type == "MESH"]
    if given.object or not chosen:
        chosen = [where.named_object(context, given.object)]
    with session.macro("Add surfaces"):
        names = [where.surface_for(session, where.object_id_of(session, each)) for each in chosen]
    return f"Surfaces: {', '.join(names)}."


@operator(
    "paint",
    "Paint Selection",
    "mesh",
    patch=PATCH,
    object=OBJECT,
    group=GROUP,
    color=FloatVectorProperty(name="Colour", subtype="COLOR", min=0.0, max=1.0, default=(0.9, 0.4, 0.3)),
)
def paint(session: Any, context: Any, given: Any) -> str:
    """Paint the selected vertices, or a vertex group: a new patch, or more of one that exists."""
    from contact_blender.extension import where

    object_id = where.object_id_of(session, where.named_object(context, given.object))
    points = session.host.selected_points(object_id, given.group or "selection")
    name = given.patch or given.group or session.document.free_name("patch", session.document.patches)
    with session.macro(f"Paint {name}"):
        if name in session.document.patches:
            session.patches.paint(name, points)
        else:
            surface = where.surface_for(session, object_id)
            session.patches.paint(name, points, surface=surface, color=tuple(given.color))
    context.window_manager.contact.patch = name
    return f"Painted {len(points)} vertices on {name}."


@operator(
    "erase",
    "Erase Selection",
    "patch",
    patch=PATCH,
    group=GROUP,
    radius=FloatProperty(name="Radius", description="How far round each vertex", default=1e-4, min=0.0),
)
def erase(session: Any, context: Any, given: Any) -> str:
    """Take the selected vertices, or a vertex group, out of a patch."""
    from contact_blender.extension import where

    patch = where.patch_of(session, context, given.patch)
    object_id = session.binding.surfaces[session.document.patch(patch).surface].object_id
    points = session.host.selected_points(object_id, given.group or "selection")
    session.patches.erase(patch, near=points, radius=given.radius)
    return f"Erased from {patch}."


@operator(
    "select",
    "Select Vertices of Patch",
    "patch",
    patch=PATCH,
    group=StringProperty(name="Vertex group", description="Also write them to this vertex group"),
)
def select(session: Any, context: Any, given: Any) -> str:
    """Select the vertices under a patch on its object, or write them to a vertex group."""
    from contact_blender.extension import where

    patch = where.patch_of(session, context, given.patch)
    object_id = session.binding.surfaces[session.document.patch(patch).surface].object_id
    found = session.host.select_points(object_id, session.geometry.points(patch), given.group or "selection")
    return f"{found} vertices of {patch}."


@operator(
    "transfer",
    "Transfer to Object",
    "patch",
    patch=PATCH,
    object=OBJECT,
    at=AT,
    direction=DIRECTION,
    name=NAME,
    pair=BoolProperty(name="Pair", description="Pair the copy with its original at once", default=True),
)
def transfer(session: Any, context: Any, given: Any) -> str:
    """Copy a patch onto another object, at the 3D cursor or its selected vertices, and pair the two."""
    from contact_blender.extension import where

    patch = where.patch_of(session, context, given.patch)
    object_id = where.object_id_of(session, where.named_object(context, given.object))
    with session.macro(f"Transfer {patch}"):
        surface = where.surface_for(session, object_id)
        apart = surface != session.document.patch(patch).surface
        copy = session.patches.transfer(
            patch,
            surface,
            where.point_for(session, context, surface, given.at),
            direction=where.direction_for(session, patch, surface, given.direction),
            name=given.name or None,
            mirrored=apart,
        )
        if given.pair and apart:
            session.pairs.add(*where.in_order(session, patch, copy))
    return f"{patch} was copied as {copy} onto {surface}."


@operator(
    "pair",
    "Pair",
    "two",
    patch=PATCH,
    other=PARTNER,
    weight=FloatProperty(name="Weight", description="How much the pair counts", default=1.0, min=0.0),
)
def pair(session: Any, context: Any, given: Any) -> str:
    """Say that two patches are to touch; that on a rig is the one which is posed."""
    from contact_blender.extension import where

    patch = where.patch_of(session, context, given.patch)
    other = where.patch_of(session, context, given.other or context.window_manager.contact.other)
    return f"Paired as {session.pairs.add(*where.in_order(session, patch, other), weight=given.weight)}."


@operator("unpair", "Unpair", "pair", pair=StringProperty(name="Pair", description="A pair; empty: of the patch"))
def unpair(session: Any, context: Any, given: Any) -> str:
    """Dissolve a pair; its patches stay."""
    from contact_blender.extension import where

    name = given.pair
    if not name:
        patch = where.patch_of(session, context, "")
        pairs = session.document.pairs.items()
        name = next((key for key, each in pairs if patch in (each.manipulator, each.object)), patch)
    session.pairs.remove(name)
    return f"{name} is a pair no more."


@operator(
    "rotate",
    "Turn",
    "patch",
    patch=PATCH,
    angle=FloatProperty(name="Angle", subtype="ANGLE", default=0.2617993877991494),
    about=IntProperty(name="About axis point", default=0, min=0),
)
def rotate(session: Any, context: Any, given: Any) -> str:
    """Turn a patch about a point of its axis, counter-clockwise seen from outside."""
    from contact_blender.extension import where

    patch = where.patch_of(session, context, given.patch)
    session.patches.rotate(patch, given.angle, about=given.about)
    return f"{patch} was turned."


@operator("translate", "Move to Cursor", "patch", patch=PATCH, at=AT)
def translate(session: Any, context: Any, given: Any) -> str:
    """Move a patch over its surface to the point nearest to the 3D cursor, or to the selected vertices."""
    from contact_blender.extension import where

    patch = where.patch_of(session, context, given.patch)
    surface = session.document.patch(patch).surface
    session.patches.translate(patch, where.point_for(session, context, surface, given.at))
    return f"{patch} was moved."


@operator(
    "bend",
    "Bend",
    "patch",
    patch=PATCH,
    point=POINT,
    angle=FloatProperty(name="Angle", subtype="ANGLE", default=0.2617993877991494),
)
def bend(session: Any, context: Any, given: Any) -> str:
    """Turn the part of a patch beyond an interior point of its axis."""
    from contact_blender.extension import where

    patch = where.patch_of(session, context, given.patch)
    session.patches.bend(patch, given.point, given.angle)
    return f"{patch} was bent."


@operator(
    "scale",
    "Scale",
    "patch",
    patch=PATCH,
    along=FloatProperty(name="Along", description="Factor along the axis", default=1.0, min=0.001),
    spread=FloatProperty(name="Across", description="Factor across the axis", default=1.0, min=0.001),
)
def scale(session: Any, context: Any, given: Any) -> str:
    """Set the size of a patch along its axis and across it; 1 is as painted."""
    from contact_blender.extension import where

    patch = where.patch_of(session, context, given.patch)
    session.patches.scale(patch, along=given.along, spread=given.spread)
    return f"{patch} was scaled."


@operator("link", "Link to Parent", "two", patch=PATCH, parent=PARTNER)
def link(session: Any, context: Any, given: Any) -> str:
    """Make a patch the child of another of its surface: it follows when that one moves."""
    from contact_blender.extension import where

    patch = where.patch_of(session, context, given.patch)
    parent = where.patch_of(session, context, given.parent or context.window_manager.contact.other)
    session.patches.link(patch, parent)
    return f"{patch} follows {parent}."


@operator("unlink", "Unlink", "patch", patch=PATCH)
def unlink(session: Any, context: Any, given: Any) -> str:
    """Take a patch off its parent; it stays where it is."""
    from contact_blender.extension import where

    patch = where.patch_of(session, context, given.patch)
    session.patches.unlink(patch)
    return f"{patch} follows no patch."


@operator("remove", "Remove Patch", "patch", patch=PATCH)
def remove(session: Any, context: Any, given: Any) -> str:
    """Remove a patch; its children stay where they are."""
    from contact_blender.extension import where

    patch = where.patch_of(session, context, given.patch)
    session.patches.remove(patch)
    return f"{patch} was removed."


@operator("rename", "Rename Patch", "patch", patch=PATCH, name=NAME)
def rename(session: Any, context: Any, given: Any) -> str:
    """Give a patch another name, everywhere."""
    from contact_blender.extension import where

    patch = where.patch_of(session, context, given.patch)
    session.patches.rename(patch, given.name)
    context.window_manager.contact.patch = given.name
    return f"{patch} is called {given.name} now."


@operator(
    "recolor",
    "Recolour Patch",
    "patch",
    patch=PATCH,
    color=FloatVectorProperty(name="Colour", subtype="COLOR", min=0.0, max=1.0, default=(0.9, 0.4, 0.3)),
)
def recolor(session: Any, context: Any, given: Any) -> str:
    """Give a patch another colour."""
    from contact_blender.extension import where

    patch = where.patch_of(session, context, given.patch)
    session.patches.recolor(patch, tuple(given.color))
    return f"{patch} has another colour."


def _solve_beside(context: Any, given: Any) -> dict[str, Any]:
    """A pose, or all frames; frames of a rig that only Blender evaluates are asked on no thread, and wait."""
    context.window_manager.contact_tools.all.penetration = given.penetration
    if not given.keyed:
        return {"action": "pose.solve"}
    session = shared.session()
    if session.binding.evaluated(sorted(session.rigs)):
        return {}
    return {"action": "pose.solve", "keyed": True, "first": given.first, "last": given.last}


@operator(
    "solve",
    "Solve Pose",
    "pair",
    beside=_solve_beside,
    penetration=BoolProperty(name="Penetration", description="Keep skin out of what is solid", default=True),
    keyed=BoolProperty(name="Key frames", description="Solve the frames and key them", default=False),
    first=IntProperty(name="First frame", default=1),
    last=IntProperty(name="Last frame", default=1),
)
def solve(session: Any, context: Any, given: Any) -> str:
    """Pose the rig so that all pairs touch; with frames, solve and key all of them at once."""
    context.window_manager.contact_tools.all.penetration = given.penetration
    frames = range(given.first, given.last + 1) if given.keyed else None
    return _accepted(session, session.solve(frames=frames, settings=_telling(session)))


@operator(
    "settle",
    "Settle Contacts",
    "pair",
    beside=lambda context, given: {"action": "pose.settle"},
    rounds=IntProperty(name="Rounds", default=2, min=1, max=20),
)
def settle(session: Any, context: Any, given: Any) -> str:
    """Put every contact at the closest point that faces it on its object, and solve again."""
    return _accepted(session, session.settle(rounds=given.rounds, settings=_telling(session)))


@operator("slide", "Slide Contacts", "pair", beside=lambda context, given: {"action": "pose.slide"})
def slide(session: Any, context: Any, given: Any) -> str:
    """Solve the pose with each contact free to slide a little over its object."""
    return _accepted(session, session.slide(settings=_telling(session)))


@operator("clear_pose", "Clear Pose", "patch", patch=PATCH)
def clear_pose(session: Any, context: Any, given: Any) -> str:
    """Put the rig under a patch back to rest."""
    from contact_blender.extension import where

    surface = session.document.patch(where.patch_of(session, context, given.patch)).surface
    session.surfaces.clear_pose(surface)
    return f"{surface} is at rest."


@operator(
    "choose_bones",
    "Choose Bones",
    "patch",
    patch=PATCH,
    bones=StringProperty(
        name="Bones",
        description="automatic, deform, controls, or collection:NAME for a bone collection",
        default="automatic",
    ),
)
def choose_bones(session: Any, context: Any, given: Any) -> str:
    """Say which bones of the rig under a patch a solve may pose."""
    from contact_blender.extension import where

    surface = session.document.patch(where.patch_of(session, context, given.patch)).surface
    session.surfaces.choose_bones(surface, given.bones)
    return f"A solve poses the bones: {given.bones}."


def _telling(session: Any) -> Any:
    """Settings of a solve that shows its progress, with the terms that it has beside the window."""
    from contact_core.proposals.proposal import SolveSettings

    artist = shared.artist()
    artist.configure()
    return SolveSettings(progress=session.host, objective=artist.interaction.proposing.objective())


def _accepted(session: Any, proposal: Any) -> str:
    """Accept a proposal and say how well the pairs are met."""
    session.accept(proposal)
    shared.keep_residuals(proposal)
    left_out = " ".join(f"{name} stays: {why}." for name, why in proposal.left_out.items())
    return f"Solved ({proposal.after.message}): contacts within {proposal.nearness}. {left_out}".strip()
