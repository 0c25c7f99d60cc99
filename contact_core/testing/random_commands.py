"""Random but valid commands of every kind, without any mesh: what the laws of the command stack are tried on.

`MAKERS` has one maker for each built-in command. A test compares it with the registry, so that a new command
cannot escape the laws.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from contact_core.contact.placement import Link, Root
from contact_core.document.document import ContactDocument, ContactPair
from contact_core.document.frozen_map import FrozenMap
from contact_core.document.timeline import Key, Span, Timeline, Track, address, of_address
from contact_core.edit import commands as kinds
from contact_core.edit.command import Command
from contact_core.edit.history import History
from contact_core.errors import CommandRejected
from contact_core.motion.placement_keys import PlacementKey
from contact_core.rig.rig import Pose
from contact_core.solve.body import HOLDS
from contact_core.testing.random_values import (
    Rng,
    moved_placement,
    new_patch,
    new_surface,
    pick,
    pick_patch,
    pick_surface,
    random_coordinates,
    random_link,
    random_motion,
    random_root,
    random_shape,
    random_track,
    random_way,
)

Maker = Callable[[ContactDocument, Rng], Command | None]


def random_command(document: ContactDocument, rng: Rng, json_id: str | None = None) -> Command | None:
    """A command of a kind, or of any; None where the document offers nothing to that kind."""
    return MAKERS[json_id or str(rng.choice(list(MAKERS)))](document, rng)


def random_document(seed: int, steps: int = 25) -> ContactDocument:
    """A document with two or more surfaces and whatever `steps` random commands made of it."""
    return random_history(seed, steps).document


def random_history(seed: int, steps: int, *, still: bool = False) -> History:
    """A history of at least three surfaces and patches, then random commands.

    still: without keys, so that a session without meshes can do the commands: there an edit of what has keys
    becomes a key, and for its way a mesh is wanted.
    """
    rng = np.random.default_rng(seed)
    history = History(ContactDocument())
    for json_id in 3 * ["surface.add", "contact.paint"]:
        command = random_command(history.document, rng, json_id)
        assert command is not None
        history.do(command)
    for _ in range(steps):
        command = random_command(history.document, rng)
        if command is not None and not (still and isinstance(command, kinds.SetKeys)):
            try_to_do(history, command)
    return history


def try_to_do(history: History, command: Command, **arguments: Any) -> bool:
    """Do a command; False where it was rejected, as some random ones are (cycles, links past a short axis)."""
    try:
        history.do(command, **arguments)
    except CommandRejected:
        return False
    return True


def add_surface(document: ContactDocument, rng: Rng) -> Command | None:
    return kinds.AddSurface(new_surface(rng, document.free_name("surface", document.surfaces)))


def remove_surface(document: ContactDocument, rng: Rng) -> Command | None:
    used = {patch.surface for patch in document.patches.values()}
    name = pick(rng, [name for name in document.surfaces if name not in used])
    return kinds.RemoveSurface(name) if name and len(document.surfaces) > 2 else None


def rename_surface(document: ContactDocument, rng: Rng) -> Command | None:
    surface = pick_surface(document, rng)
    return kinds.RenameSurface(surface.name, document.free_name("renamed", document.surfaces)) if surface else None


def place_surface(document: ContactDocument, rng: Rng) -> Command | None:
    surface = pick_surface(document, rng)
    return kinds.PlaceSurface(surface.name, random_motion(rng)) if surface else None


def rebind_surface(document: ContactDocument, rng: Rng) -> Command | None:
    surface = pick_surface(document, rng)
    if surface is None:
        return None
    new = replace(new_surface(rng, surface.name), rig=surface.rig)
    roots = [patch for patch in document.patches.values() if patch.surface == new.name]
    places = tuple((p.name, random_root(rng, new)) for p in roots if isinstance(p.placement, Root))
    owned = {patch.shape for patch in roots if patch.original}
    tracks = {
        where: random_track(rng, "placement", frames=track.frames, surface=new)
        for where, track in document.tracks.items()
        if (end := of_address(where))[0] == "placement" and document.patches[end[1]].surface == new.name
    }
    shapes = {
        key: replace(document.shapes[key], weights=document.shapes[key].weights * 0.5)
        if rng.random() < 0.7
        else random_shape(rng, len(document.shapes[key]))  # another axis, of more points or fewer
        for key in owned
    }
    return kinds.RebindSurface(new, FrozenMap(shapes), places, FrozenMap(tracks))


def settle(document: ContactDocument, rng: Rng) -> Command | None:
    patches = [patch for patch in document.patches.values() if rng.random() < 0.5]
    posed = [command for command in (set_pose(document, rng),) if isinstance(command, kinds.SetPose)]
    placements = tuple((patch.name, moved_placement(document, rng, patch)) for patch in patches)
    return kinds.Settle(placements, FrozenMap({command.surface: command.pose for command in posed}))


def set_pose(document: ContactDocument, rng: Rng) -> Command | None:
    surface = pick(rng, [s for s in document.surfaces.values() if s.rig])
    local = np.tile(np.eye(4), (2, 1, 1)) + rng.uniform(-0.1, 0.1, (2, 4, 4))
    return kinds.SetPose(surface.name, Pose(("wrist", "thumb"), local)) if surface else None


def clear_pose(document: ContactDocument, rng: Rng) -> Command | None:
    name = pick(rng, list(document.poses))
    return name and kinds.ClearPose(name)


def paint(document: ContactDocument, rng: Rng) -> Command | None:
    surface = pick_surface(document, rng)
    if surface is None:
        return None
    return kinds.Paint(new_patch(document, rng, document.free_name("patch"), surface), random_shape(rng))


def extend(document: ContactDocument, rng: Rng) -> Command | None:
    patch = pick_patch(document, rng)
    if patch is None:
        return None
    n = int(rng.integers(1, 5))
    count = document.shapes[patch.shape].axis.point_count
    return kinds.Extend(patch.name, random_coordinates(rng, n, count), rng.uniform(0.0, 1.0, n))


def erase(document: ContactDocument, rng: Rng) -> Command | None:
    patch = pick_patch(document, rng)
    n = len(document.shapes[patch.shape]) if patch else 0
    if patch is None or n < 2:
        return None
    return kinds.Erase(patch.name, np.sort(rng.choice(n, int(rng.integers(1, n)), replace=False)))


def reshape(document: ContactDocument, rng: Rng) -> Command | None:
    patch = pick_patch(document, rng)
    if patch is None:
        return None
    shape = random_shape(rng, len(document.shapes[patch.shape]))
    return kinds.Reshape(patch.name, shape, (), "Set the axis of")


def weigh(document: ContactDocument, rng: Rng) -> Command | None:
    patch = pick_patch(document, rng)
    return kinds.Weigh(patch.name, rng.uniform(0.0, 1.0, len(document.shapes[patch.shape]))) if patch else None


def detach(document: ContactDocument, rng: Rng) -> Command | None:
    patch = pick_patch(document, rng)
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
    patch = pick_patch(document, rng)
    return kinds.Translate(patch.name, moved_placement(document, rng, patch)) if patch else None


def rotate(document: ContactDocument, rng: Rng) -> Command | None:
    patch = pick_patch(document, rng)
    return kinds.Rotate(patch.name, moved_placement(document, rng, patch)) if patch else None


def bend(document: ContactDocument, rng: Rng) -> Command | None:
    bendable = [p for p in document.patches.values() if document.shapes[p.shape].axis.point_count > 2]
    patch = pick(rng, bendable)
    if patch is None:
        return None
    point = int(rng.integers(1, document.shapes[patch.shape].axis.point_count - 1))
    return kinds.Bend(patch.name, point, float(rng.uniform(-2.0, 2.0)))


def scale(document: ContactDocument, rng: Rng) -> Command | None:
    patch = pick_patch(document, rng)
    return kinds.Scale(patch.name, *rng.uniform(0.5, 2.0, 2).tolist()) if patch else None


def mirror(document: ContactDocument, rng: Rng) -> Command | None:
    patch = pick_patch(document, rng)
    return kinds.Mirror(patch.name, bool(rng.integers(2))) if patch else None


def transfer(document: ContactDocument, rng: Rng) -> Command | None:
    patch, surface = pick_patch(document, rng), pick_surface(document, rng)
    if patch is None or surface is None or len(document.patches) > 12:
        return None
    copy = new_patch(document, rng, document.free_name("copy"), surface)
    copy = replace(copy, shape=patch.shape, original=False, mirrored=not patch.mirrored)
    copies = [copy]
    for name in list(document.children(patch.name))[:2]:  # its children come along
        child = replace(document.patch(name), name=document.free_name(f"{name} too"), surface=surface.name)
        link = replace(random_link(rng, document, patch.name, child), parent=copy.name)
        copies.append(replace(child, placement=link, original=False))
    return kinds.Transfer(tuple(copies))


def link(document: ContactDocument, rng: Rng) -> Command | None:
    child = pick_patch(document, rng)
    if child is None:
        return None
    below = {child.name, *document.descendants(child.name)}
    same = [p for p in document.patches.values() if p.surface == child.surface and p.name not in below]
    parent = pick(rng, same)
    return parent and kinds.LinkPatch(child.name, random_link(rng, document, parent.name, child))


def unlink(document: ContactDocument, rng: Rng) -> Command | None:
    child = pick(rng, [p for p in document.patches.values() if isinstance(p.placement, Link)])
    return child and kinds.Unlink(child.name, random_root(rng, document.surface(child.surface)))


def pair(document: ContactDocument, rng: Rng) -> Command | None:
    if len(document.patches) < 2:
        return None
    a, b = rng.choice(sorted(document.patches), 2, replace=False).tolist()
    return kinds.Pair(ContactPair(f"pair {rng.integers(4)}", a, b, float(rng.uniform(0.0, 2.0))))


def unpair(document: ContactDocument, rng: Rng) -> Command | None:
    name = pick(rng, list(document.pairs))
    return name and kinds.Unpair(name)


def group(document: ContactDocument, rng: Rng) -> Command | None:
    if not document.patches:
        return None
    size = int(rng.integers(1, len(document.patches) + 1))
    members = rng.choice(sorted(document.patches), size, replace=False).tolist()
    return kinds.Group(f"group {rng.integers(3)}", tuple(members))


def ungroup(document: ContactDocument, rng: Rng) -> Command | None:
    name = pick(rng, list(document.groups))
    return name and kinds.Ungroup(name)


def rename(document: ContactDocument, rng: Rng) -> Command | None:
    patch = pick_patch(document, rng)
    return kinds.Rename(patch.name, document.free_name("thumb tip")) if patch else None


def recolor(document: ContactDocument, rng: Rng) -> Command | None:
    patch = pick_patch(document, rng)
    r, g, b = rng.uniform(0.0, 1.0, 3).tolist()
    return kinds.Recolor((patch.name,), (r, g, b)) if patch else None


def import_patches(document: ContactDocument, rng: Rng) -> Command | None:
    surface = pick_surface(document, rng)
    if surface is None or len(document.patches) > 12:
        return None
    shape = random_shape(rng)
    first = new_patch(document, rng, document.free_name("brought"), surface)
    second = new_patch(document, rng, document.free_name("brought too"), surface)
    second = replace(second, shape=first.shape, original=False)
    if rng.random() < 0.5:
        second = replace(second, placement=Link(first.name, 0.3, (0.1, 0.2), (0.5,), 1.0))
    pairs = (ContactPair(document.free_name("brought pair", document.pairs), first.name, second.name),)
    groups: FrozenMap[tuple[str, ...]] = FrozenMap(
        {document.free_name("brought group", document.groups): (first.name, second.name)}
    )
    return kinds.Import((first, second), FrozenMap({first.shape: shape}), pairs, groups, "a set")


def set_extra(document: ContactDocument, rng: Rng) -> Command | None:
    value = None if rng.random() < 0.2 else {"frame": int(rng.integers(100)), "layers": [1.5, "a", None]}
    return kinds.SetExtra(f"host.{rng.integers(3)}", value)


def set_timeline(document: ContactDocument, rng: Rng) -> Command | None:
    first = float(rng.integers(0, 50))
    rate = ((24, 1), (24000, 1001), (60, 1))[int(rng.integers(3))]
    return kinds.SetTimeline(Timeline(rate, first, first + float(rng.integers(0, 200))))


def set_keys(document: ContactDocument, rng: Rng) -> Command | None:
    known = pick(rng, list(document.tracks))
    if known and rng.random() < 0.7:
        track = document.tracks[known]
        kind, name = of_address(known)
        frame = float(rng.choice(track.frames)) if rng.random() < 0.5 else float(rng.integers(100))
        if frame in track.frames[1:] and rng.random() < 0.5 and kind != "placement":
            return kinds.SetKeys(known, (), (frame,))
        surface = document.surfaces[document.patches[name].surface] if kind == "placement" else None
        return kinds.SetKeys(known, beside(track, random_track(rng, kind, (frame,), surface).keys[0], rng))
    choices = [address("placement", p.name) for p in document.patches.values() if isinstance(p.placement, Root)]
    choices += [address("pose", s.name) for s in document.surfaces.values() if s.rig]
    choices += [address("place", name) for name in document.surfaces]
    choices += [address("weight", name) for name in document.pairs]
    where = pick(rng, choices)
    if where is None:
        return None
    kind, name = of_address(where)
    surface = document.surfaces[document.patches[name].surface] if kind == "placement" else None
    frames = tuple(sorted(rng.choice(100, int(rng.integers(1, 5)), replace=False).astype(float).tolist()))
    if where in document.tracks:
        return None
    return kinds.SetKeys(where, random_track(rng, kind, frames, surface).keys)


def beside(track: Track, key: Key, rng: Rng) -> tuple[Key, ...]:
    """A key with what it changes of the ways beside it."""
    if not isinstance(key, PlacementKey):
        return (key,)
    before = [other for other in track.of(PlacementKey) if other.frame < key.frame]
    after = [other for other in track.frames if other > key.frame]
    put: list[Key] = [replace(key, way=random_way(rng) if after else None)]
    if before and before[-1].way is None:
        put.append(replace(before[-1], way=random_way(rng)))
    return tuple(put)


def clear_track(document: ContactDocument, rng: Rng) -> Command | None:
    where = pick(rng, list(document.tracks))
    return where and kinds.ClearTrack(where)


def set_spans(document: ContactDocument, rng: Rng) -> Command | None:
    name = pick(rng, list(document.pairs))
    ends = np.sort(rng.choice(100, 2 * int(rng.integers(0, 3)), replace=False)).astype(float).reshape(-1, 2)
    spans = []
    for on, off in ends.tolist():
        rise, fall = rng.uniform(0.0, 12.0, 2).tolist()
        spans.append(Span(on, off, rise, fall, HOLDS[int(on) % 3]))
    return name and kinds.SetSpans(name, tuple(spans))


def macro(document: ContactDocument, rng: Rng) -> Command | None:
    first = bend(document, rng) or recolor(document, rng)
    second = set_extra(document, rng)
    inner = kinds.Macro("Within", (second,)) if second and rng.random() < 0.5 else second
    return first and inner and kinds.Macro("Two at once", (first, inner))


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
    "timeline.clear": clear_track,
    "timeline.keys": set_keys,
    "timeline.set": set_timeline,
    "timeline.spans": set_spans,
}
