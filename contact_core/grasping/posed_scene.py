"""A posed manipulator and an object of a document, as the metrics look at them."""

from __future__ import annotations

from contact_core.arrays import FloatArray
from contact_core.edit.document_geometry import DocumentGeometry
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.transform import transform_points
from contact_core.grasping.metrics import Contact, PosedScene
from contact_core.rig.bones import bone_segments
from contact_core.rig.chart import pose_on
from contact_core.rig.poses import posed_points, posed_world
from contact_core.rig.rig import Rig


def posed_scene(
    geometry: DocumentGeometry,
    rig: Rig,
    hand: str,
    thing: str,
    length: float,
    solids: tuple[TriangleMesh, ...] | None = None,
) -> PosedScene:
    """A manipulator as the document poses it, in the space of an object, with the contacts of the two.

    hand, thing: surfaces in the same units. length: of the manipulator. solids: whose inside counts for depth, by
    default the object's own.
    """
    into, mesh = geometry.surface_from_surface(thing, hand), geometry.mesh(thing)
    return posed_scene_in(geometry, rig, hand, thing, into, mesh, length, solids)


def posed_scene_in(
    geometry: DocumentGeometry,
    rig: Rig,
    hand: str,
    thing: str,
    into: FloatArray,
    mesh: TriangleMesh,
    length: float,
    solids: tuple[TriangleMesh, ...] | None = None,
) -> PosedScene:
    """`posed_scene` where the two have other units. into: (4, 4) the space that is looked at from the rig's; mesh:
    the object there."""
    pose = geometry.document.poses[hand]
    return PosedScene(
        rest=rig.surface,
        skin=rig.surface.with_points(transform_points(into, posed_points(rig, pose))),
        bones=bone_segments(rig.parents, into @ posed_world(rig, pose)),
        rest_local=rig.rest_local,
        local=pose_on(rig, pose),
        moving=rig.parents >= 0,
        object_mesh=mesh,
        solids=(mesh,) if solids is None else solids,
        contacts={
            pair.pair.name: Contact(pair.manipulator_points, pair.object_points)
            for pair in geometry.pairs()
            if (pair.manipulator_surface, pair.object_surface) == (hand, thing)
        },
        length=length,
    )
