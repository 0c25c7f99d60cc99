"""What an operator means: the patch, the surface of an object, a point at the cursor."""

from __future__ import annotations

from typing import Any

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.document.document import ContactDocument
from contact_core.edit.commands import SetExtra
from contact_core.errors import InvalidInput
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import heading_to_direction
from contact_core.scene.binding import surface_of
from contact_core.session import Session


def patch_of(session: Session, context: Any, name: str) -> str:
    """The patch of this name; without one the active patch of the panel. Raises InvalidInput."""
    chosen = name or str(context.window_manager.contact.patch)
    if chosen in session.document.patches:
        return chosen
    there = ", ".join(session.document.patches) or "none"
    raise InvalidInput(f"there is no patch {chosen!r}; there are: {there}.")


def object_id_of(session: Session, scene_object: Any) -> str:
    """The host's id of an object. Raises InvalidInput for what is no mesh of this scene."""
    name = None if scene_object is None else str(scene_object.name)
    for item in session.host.objects():
        if item.name == name:
            return str(item.id)
    raise InvalidInput(f"contacts lie on meshes of this scene, but got {name or 'no object'}.")


def named_object(context: Any, name: str) -> Any:
    """The object of this name; without one the active object."""
    return context.scene.objects.get(name) if name else context.active_object


def surface_name(session: Session, object_id: str) -> str | None:
    """The surface behind which this object stands, None where it has none yet."""
    bound = session.binding.surfaces.items()
    return next((n for n, b in bound if b.object_id == object_id and n in session.document.surfaces), None)


def surface_for(session: Session, object_id: str) -> str:
    """The surface of an object, added where it has none yet. Part of a macro."""
    known = surface_name(session, object_id)
    if known is not None:
        return known
    asset = session.host.read_surface(object_id)
    name = session.document.free_name(asset.name, session.document.surfaces)
    session.surfaces.bring(surface_of(name, asset), object_id)
    binding = session.binding
    remembered = binding.remembering(session.document)
    if remembered is not session.document:
        session.do(SetExtra(binding.key, remembered.extras[binding.key]))
    return name


def point_for(session: Session, context: Any, surface: str, at: str) -> SurfacePoints:
    """The point of a surface, as it stands in the scene, nearest to the 3D cursor or amid the selected vertices."""
    scene = session.binding.read(session.document)
    if at == "SELECTION":
        object_id = session.binding.surfaces[surface].object_id
        chosen = session.host.selected_points(object_id, "selection")
        places = chosen.positions(session.geometry.mesh(surface))
        return chosen[int(np.argmin(np.linalg.norm(places - places.mean(axis=0), axis=1)))]
    world = np.append(np.array(context.scene.cursor.location, float), 1.0)
    place = (np.linalg.inv(scene.surface(surface).world_from_surface) @ world)[:3]
    return Locator.of(session.geometry.of(scene).posed_mesh(surface)).closest(place[None]).points


def direction_for(session: Session, patch: str, surface: str, wanted: Any) -> FloatArray:
    """(3,) in the space of `surface`: a direction of the world, or that of the patch's axis where none is given."""
    scene = session.binding.read(session.document)
    world = np.array(wanted, float)
    if not world.any():
        world = _axis_in_world(session, scene, patch)
    return np.asarray(scene.surface(surface).world_from_surface[:3, :3].T @ world)


def _axis_in_world(session: Session, scene: ContactDocument, patch: str) -> FloatArray:
    geometry = session.geometry.of(scene)
    surface, root = scene.patch(patch).surface, geometry.root(patch)
    carrier = geometry.posed_carrier(surface, geometry.posed_mesh(surface))
    direction = heading_to_direction(carrier, root.point(), np.array([root.heading]))[0]
    return np.asarray(scene.surface(surface).world_from_surface[:3, :3] @ direction)


def in_order(session: Session, first: str, second: str) -> tuple[str, str]:
    """The patch that is posed, then that which is touched: what has a rig comes first."""
    rigged = [session.document.patch(name).surface in session.rigs for name in (first, second)]
    return (second, first) if rigged == [False, True] else (first, second)
