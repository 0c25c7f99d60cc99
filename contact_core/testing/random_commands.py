"""Random but valid commands of every kind, without any mesh: what the laws of the command stack are tried on.

`MAKERS` has one maker for each built-in command. A test compares it with the registry, so that a new command
cannot escape the laws.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from contact_core.contact.placement import Link, Placement, Root
from contact_core.contact.shape import AxisShape, PatchCoordinates, PatchShape
from contact_core.document.document import ContactDocument, ContactPair, Patch, Surface
from contact_core.document.frozen_map import FrozenMap
from contact_core.edit import commands as kinds
from contact_core.edit.command import Command
from contact_core.edit.history import History
from contact_core.errors import CommandRejected
from contact_core.pose.rig import Pose

Rng = np.random.Generator
Maker = Callable[[ContactDocument, Rng], Command | None]


def random_shape(rng: Rng, points: int | None = None) -> PatchShape:
    """A shape with an axis of 1 to 6 points and some chains."""
    segments, n = int(rng.integers(0, 6)), int(points or rng.integers(1, 9))
    axis = AxisShape(rng.uniform(0.1, 1.0, segments), rng.uniform(-1.0, 1.0, max(segments - 1, 0)))
    return PatchShape(axis, random_coordinates(rng, n, axis.point_count), rng.uniform(0.0, 2.0, n))


def random_coordinates(rng: Rng, n: int, axis_points: int) -> PatchCoordinates:
    """Coordinates of n points from an axis of so many points."""
    bends = rng.choice([0, 0, 0, 1, 2], n)
    starts = np.concatenate([[0], np.cumsum(bends)])
    legs = rng.uniform(-1.0, 1.0, n) + 1j * rng.uniform(-1.0, 1.0, n)
    c = int(starts[-1])
    return PatchCoordinates(
        rng.integers(0, axis_points, n), legs, starts, rng.uniform(-1.0, 1.0, c), rng.uniform(0.0, 1.0, c)
    )


def random_root(rng: Rng, surface: Surface) -> Root:
    """A root somewhere on a surface."""
    a, b, c = rng.dirichlet(np.ones(3)).tolist()
    return Root(int(rng.integers(surface.faces)), (a, b, c), complex(np.exp(1j * rng.uniform(-3.0, 3.0))))


def random_link(rng: Rng, document: ContactDocument, parent: str, child: Patch) -> Link:
    """A link that fits both axes."""
    turns = int(rng.integers(0, 3))
    return Link(
        parent,
        float(rng.uniform(-3.0, 3.0)),
        tuple(rng.uniform(0.0, 1.0, turns + 1).tolist()),
        tuple(rng.uniform(-1.0, 1.0, turns).tolist()),
        float(rng.uniform(-3.0, 3.0)),
        int(rng.integers(document.shape_of(parent).axis.point_count)),
        int(rng.integers(document.shapes[child.shape].axis.point_count)),
    )


def random_command(document: ContactDocument, rng: Rng, json_id: str | None = None) -> Command | None:
    """A command of a kind, or of any; None where the document offers nothing to that kind."""
    return MAKERS[json_id or str(rng.choice(list(MAKERS)))](document, rng)


def random_document(seed: int, steps: int = 25) -> ContactDocument:
    """A document with two or more surfaces and whatever `steps` random commands made of it."""
    return random_history(seed, steps).document


def random_history(seed: int, steps: int) -> History:
    """A history of at least three surfaces and patches, then random commands."""
    rng = np.random.default_rng(seed)
    history = History(ContactDocument())
    for json_id in 3 * ["surface.add", "contact.paint"]:
        command = random_command(history.document, rng, json_id)
        assert command is not None
        history.do(command)
    for _ in range(steps):
        command = random_command(history.document, rng)
        if command is not None:
            try_to_do(history, command)
    return history


def try_to_do(history: History, command: Command, **arguments: Any) -> bool:
    """Do a command; False where it was rejected, as some random ones are (cycles, links past a short axis)."""
    try:
        history.do(command, **arguments)
    except CommandRejected:
        return False
    return True


def _pick(rng: Rng, items: Sequence[Any]) -> Any:
    return items[int(rng.integers(len(items)))] if len(items) else None


def _patch(document: ContactDocument, rng: Rng) -> Patch | None:
    patch: Patch | None = _pick(rng, list(document.patches.values()))
    return patch


def _surface(document: ContactDocument, rng: Rng) -> Surface | None:
    surface: Surface | None = _pick(rng, list(document.surfaces.values()))
    return surface


def _new_surface(rng: Rng, name: str) -> Surface:
    rig = str(_pick(rng, ["hand", "tentacle"])) if rng.random() < 0.7 else None
    unit = float(_pick(rng, [1.0, 0.01]))
    return Surface(name, f"{rng.integers(1 << 30):x}", "topology", 50, int(rng.integers(5, 90)), unit, rig=rig)


def _new_patch(document: ContactDocument, rng: Rng, name: str, surface: Surface) -> Patch:
    color = tuple(rng.uniform(0.0, 1.0, 3).tolist())
    key = document.free_name(name, document.shapes)
    return Patch(name, surface.name, key, random_root(rng, surface), color=color)


def _moved(document: ContactDocument, rng: Rng, patch: Patch) -> Placement:
    if isinstance(patch.placement, Link):
        return random_link(rng, document, patch.placement.parent, patch)
    return random_root(rng, document.surface(patch.surface))


def _turn(rng: Rng) -> Any:
    angle = rng.uniform(-3.0, 3.0)
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    matrix[:3, 3] = rng.uniform(-1.0, 1.0, 3)
    return matrix


def add_surface(document: ContactDocument, rng: Rng) -> Command | None:
    return kinds.AddSurface(_new_surface(rng, document.free_name("surface", document.surfaces)))


def remove_surface(document: ContactDocument, rng: Rng) -> Command | None:
    used = {patch.surface for patch in document.patches.values()}
    name = _pick(rng, [name for name in document.surfaces if name not in used])
    return kinds.RemoveSurface(name) if name and len(document.surfaces) > 2 else None


def rename_surface(document: ContactDocument, rng: Rng) -> Command | None:
    surface = _surface(document, rng)
    return kinds.RenameSurface(surface.name, document.free_name("renamed", document.surfaces)) if surface else None


def place_surface(document: ContactDocument, rng: Rng) -> Command | None:
    surface = _surface(document, rng)
    return kinds.PlaceSurface(surface.name, _turn(rng)) if surface else None


def rebind_surface(document: ContactDocument, rng: Rng) -> Command | None:
    surface = _surface(document, rng)
    if surface is None:
        return None
    new = replace(_new_surface(rng, surface.name), rig=surface.rig)
    roots = [patch for patch in document.patches.values() if patch.surface == new.name]
    places = tuple((p.name, random_root(rng, new)) for p in roots if isinstance(p.placement, Root))
    owned = {patch.shape for patch in roots if patch.original}
    shapes = {key: replace(document.shapes[key], weights=document.shapes[key].weights * 0.5) for key in owned}
    return kinds.RebindSurface(new, FrozenMap(shapes), places)


def settle(document: ContactDocument, rng: Rng) -> Command | None:
    patches = [patch for patch in document.patches.values() if rng.random() < 0.5]
    posed = [command for command in (set_pose(document, rng),) if isinstance(command, kinds.SetPose)]
    placements = tuple((patch.name, _moved(document, rng, patch)) for patch in patches)
    return kinds.Settle(placements, FrozenMap({command.surface: command.pose for command in posed}))


def set_pose(document: ContactDocument, rng: Rng) -> Command | None:
    surface = _pick(rng, [s for s in document.surfaces.values() if s.rig])
    local = np.tile(np.eye(4), (2, 1, 1)) + rng.uniform(-0.1, 0.1, (2, 4, 4))
    return kinds.SetPose(surface.name, Pose(("wrist", "thumb"), local)) if surface else None


def clear_pose(document: ContactDocument, rng: Rng) -> Command | None:
    name = _pick(rng, list(document.poses))
    return name and kinds.ClearPose(name)


def paint(document: ContactDocument, rng: Rng) -> Command | None:
    surface = _surface(document, rng)
    if surface is None:
        return None
    return kinds.Paint(_new_patch(document, rng, document.free_name("patch"), surface), random_shape(rng))


def extend(document: ContactDocument, rng: Rng) -> Command | None:
    patch = _patch(document, rng)
    if patch is None:
        return None
    n = int(rng.integers(1, 5))
    count = document.shapes[patch.shape].axis.point_count
    return kinds.Extend(patch.name, random_coordinates(rng, n, count), rng.uniform(0.0, 1.0, n))


def erase(document: ContactDocument, rng: Rng) -> Command | None:
    patch = _patch(document, rng)
    n = len(document.shapes[patch.shape]) if patch else 0
    if patch is None or n < 2:
        return None
    return kinds.Erase(patch.name, np.sort(rng.choice(n, int(rng.integers(1, n)), replace=False)))


def reshape(document: ContactDocument, rng: Rng) -> Command | None:
    patch = _patch(document, rng)
    if patch is None:
        return None
    shape = random_shape(rng, len(document.shapes[patch.shape]))
    return kinds.Reshape(patch.name, shape, (), "Set the axis of")


def weigh(document: ContactDocument, rng: Rng) -> Command | None:
    patch = _patch(document, rng)
    return kinds.Weigh(patch.name, rng.uniform(0.0, 1.0, len(document.shapes[patch.shape]))) if patch else None


def detach(document: ContactDocument, rng: Rng) -> Command | None:
    patch = _patch(document, rng)
    return kinds.Detach(patch.name, document.free_name(patch.name, document.shapes)) if patch else None


def remove(document: ContactDocument, rng: Rng) -> Command | None:
    if len(document.patches) < 4:
        return None
    chosen = rng.choice(sorted(document.patches), int(rng.integers(1, 3)), replace=False).tolist()
    children = [document.patch(c) for name in chosen for c in document.children(name) if c not in chosen]
    return kinds.Remove(
        tuple(chosen), tuple((c.name, random_root(rng, document.surface(c.surface))) for c in children)
    )


def translate(document: ContactDocument, rng: Rng) -> Command | None:
    patch = _patch(document, rng)
    return kinds.Translate(patch.name, _moved(document, rng, patch)) if patch else None


def rotate(document: ContactDocument, rng: Rng) -> Command | None:
    patch = _patch(document, rng)
    return kinds.Rotate(patch.name, _moved(document, rng, patch)) if patch else None


def bend(document: ContactDocument, rng: Rng) -> Command | None:
    bendable = [p for p in document.patches.values() if document.shapes[p.shape].axis.point_count > 2]
    patch = _pick(rng, bendable)
    if patch is None:
        return None
    point = int(rng.integers(1, document.shapes[patch.shape].axis.point_count - 1))
    return kinds.Bend(patch.name, point, float(rng.uniform(-2.0, 2.0)))


def scale(document: ContactDocument, rng: Rng) -> Command | None:
    patch = _patch(document, rng)
    return kinds.Scale(patch.name, *rng.uniform(0.5, 2.0, 2).tolist()) if patch else None


def mirror(document: ContactDocument, rng: Rng) -> Command | None:
    patch = _patch(document, rng)
    return kinds.Mirror(patch.name, bool(rng.integers(2))) if patch else None


def transfer(document: ContactDocument, rng: Rng) -> Command | None:
    patch, surface = _patch(document, rng), _surface(document, rng)
    if patch is None or surface is None or len(document.patches) > 12:
        return None
    copy = _new_patch(document, rng, document.free_name("copy"), surface)
    return kinds.Transfer((replace(copy, shape=patch.shape, original=False, mirrored=not patch.mirrored),))


def link(document: ContactDocument, rng: Rng) -> Command | None:
    child = _patch(document, rng)
    if child is None:
        return None
    below = {child.name, *document.descendants(child.name)}
    same = [p for p in document.patches.values() if p.surface == child.surface and p.name not in below]
    parent = _pick(rng, same)
    return parent and kinds.LinkPatch(child.name, random_link(rng, document, parent.name, child))


def unlink(document: ContactDocument, rng: Rng) -> Command | None:
    child = _pick(rng, [p for p in document.patches.values() if isinstance(p.placement, Link)])
    return child and kinds.Unlink(child.name, random_root(rng, document.surface(child.surface)))


def pair(document: ContactDocument, rng: Rng) -> Command | None:
    if len(document.patches) < 2:
        return None
    a, b = rng.choice(sorted(document.patches), 2, replace=False).tolist()
    return kinds.Pair(ContactPair(f"pair {rng.integers(4)}", a, b, float(rng.uniform(0.0, 2.0))))


def unpair(document: ContactDocument, rng: Rng) -> Command | None:
    name = _pick(rng, list(document.pairs))
    return name and kinds.Unpair(name)


def group(document: ContactDocument, rng: Rng) -> Command | None:
    if not document.patches:
        return None
    size = int(rng.integers(1, len(document.patches) + 1))
    members = rng.choice(sorted(document.patches), size, replace=False).tolist()
    return kinds.Group(f"group {rng.integers(3)}", tuple(members))


def ungroup(document: ContactDocument, rng: Rng) -> Command | None:
    name = _pick(rng, list(document.groups))
    return name and kinds.Ungroup(name)


def rename(document: ContactDocument, rng: Rng) -> Command | None:
    patch = _patch(document, rng)
    return kinds.Rename(patch.name, document.free_name("thumb tip")) if patch else None


def recolor(document: ContactDocument, rng: Rng) -> Command | None:
    patch = _patch(document, rng)
    r, g, b = rng.uniform(0.0, 1.0, 3).tolist()
    return kinds.Recolor((patch.name,), (r, g, b)) if patch else None


def import_patches(document: ContactDocument, rng: Rng) -> Command | None:
    surface = _surface(document, rng)
    if surface is None or len(document.patches) > 12:
        return None
    shape = random_shape(rng)
    first = _new_patch(document, rng, document.free_name("brought"), surface)
    second = _new_patch(document, rng, document.free_name("brought too"), surface)
    second = replace(second, shape=first.shape, original=False)
    pairs = (ContactPair(document.free_name("brought pair", document.pairs), first.name, second.name),)
    groups: FrozenMap[tuple[str, ...]] = FrozenMap(
        {document.free_name("brought group", document.groups): (first.name, second.name)}
    )
    return kinds.Import((first, second), FrozenMap({first.shape: shape}), pairs, groups, "a set")


def set_extra(document: ContactDocument, rng: Rng) -> Command | None:
    value = None if rng.random() < 0.2 else {"frame": int(rng.integers(100)), "layers": [1.5, "a", None]}
    return kinds.SetExtra(f"host.{rng.integers(3)}", value)


def macro(document: ContactDocument, rng: Rng) -> Command | None:
    first = bend(document, rng) or recolor(document, rng)
    second = set_extra(document, rng)
    return first and second and kinds.Macro("Two at once", (first, second))


MAKERS: dict[str, Maker] = {
    "macro": macro,
    "contact.bend": bend,
    "contact.detach": detach,
    "contact.erase": erase,
    "contact.extend": extend,
    "contact.group": group,
    "contact.import": import_patches,
    "contact.link": link,
    "contact.mirror": mirror,
    "contact.paint": paint,
    "contact.pair": pair,
    "contact.recolor": recolor,
    "contact.remove": remove,
    "contact.rename": rename,
    "contact.reshape": reshape,
    "contact.rotate": rotate,
    "contact.scale": scale,
    "contact.settle": settle,
    "contact.transfer": transfer,
    "contact.translate": translate,
    "contact.ungroup": ungroup,
    "contact.unlink": unlink,
    "contact.unpair": unpair,
    "contact.weigh": weigh,
    "document.extra": set_extra,
    "pose.clear": clear_pose,
    "pose.set": set_pose,
    "surface.add": add_surface,
    "surface.place": place_surface,
    "surface.rebind": rebind_surface,
    "surface.remove": remove_surface,
    "surface.rename": rename_surface,
}
