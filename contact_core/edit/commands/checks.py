"""Checks that several commands share. Each returns what it checked or raises CommandRejected in a sentence."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from contact_core.contact.placement import Link, Placement
from contact_core.document.document import ContactDocument, Patch, check_name
from contact_core.errors import CommandRejected

NamedPlacements = tuple[tuple[str, Placement], ...]


def check_free(items: Mapping[str, Any], name: str, kind: str) -> None:
    """The name can be a new one."""
    check_name(name, f"a {kind}")
    if name in items:
        raise CommandRejected(f"there is a {kind} {name!r} already.")


def check_placement(document: ContactDocument, patch: Patch, placement: Placement) -> None:
    """The placement is possible for the patch in this document: faces in range, parents there, no cycle."""
    surface = document.surface(patch.surface)
    if not isinstance(placement, Link):
        if placement.face >= surface.carrier_faces:
            raise CommandRejected(
                f"{surface.name!r} has {surface.carrier_faces} faces, but got face {placement.face}."
            )
        return
    parent = document.patch(placement.parent)
    if placement.parent == patch.name or patch.name in document.ancestors(placement.parent):
        raise CommandRejected(
            f"{patch.name!r} cannot be a child of {placement.parent!r}, which descends from it, and a tree has no"
            " cycles. Unlink one of them first."
        )
    if parent.surface != patch.surface:
        raise CommandRejected(
            f"{patch.name!r} on {patch.surface!r} cannot be a child of {parent.name!r} on {parent.surface!r}:"
            " a link is a path on one surface."
        )
    for name, point in ((parent.name, placement.parent_point), (patch.name, placement.own_point)):
        key = document.patch(name).shape if name != patch.name else patch.shape
        count = document.shapes[key].axis.point_count
        if point >= count:
            raise CommandRejected(f"the axis of {name!r} has {count} points, but got point {point}.")


def check_links(document: ContactDocument) -> None:
    """No link points past an axis, as one that became shorter would leave it."""
    for patch in document.patches.values():
        link = patch.placement
        if not isinstance(link, Link):
            continue
        parent_points = document.shape_of(link.parent).axis.point_count
        own_points = document.shapes[patch.shape].axis.point_count
        if link.parent_point >= parent_points or link.own_point >= own_points:
            raise CommandRejected(f"the new axis is too short for the link of {patch.name!r}; link it anew.")


def place_all(document: ContactDocument, placements: NamedPlacements) -> ContactDocument:
    """Put every named patch at its new placement, checked one after the other."""
    for name, placement in placements:
        patch = document.patch(name)
        check_placement(document, patch, placement)
        document = document.with_patches(replace(patch, placement=placement))
    return document


def add_patches(document: ContactDocument, patches: Iterable[Patch]) -> ContactDocument:
    """Put new patches in; parents may come among them, before their children."""
    for patch in patches:
        check_free(document.patches, patch.name, "patch")
        if patch.shape not in document.shapes:
            raise CommandRejected(
                f"the patch {patch.name!r} wants the shape {patch.shape!r}, which does not exist."
            )
        check_placement(document, patch, patch.placement)
        document = document.with_patches(patch)
    return document


def without_unused_shapes(document: ContactDocument) -> ContactDocument:
    """Shapes that belong to no patch are dropped."""
    used = {patch.shape for patch in document.patches.values()}
    unused = [key for key in document.shapes if key not in used]
    return replace(document, shapes=document.shapes.without(*unused)) if unused else document
