"""Patches joined, trees of any depth, sets and surfaces brought in: what stays in place, and in whose units."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from contact_core.arrays import FloatArray
from contact_core.contact.placement import Link, Root
from contact_core.document.codec import MAX_DEPTH
from contact_core.document.schema import dump_document, inconsistencies, parse_document
from contact_core.edit.command_table import command_from_json
from contact_core.edit.commands import Transfer
from contact_core.errors import FileRefused
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.session import Session
from contact_core.testing import meshes
from contact_core.testing.strategies import cached_family

GOAL = SurfacePoints([50], [[0.2, 0.3, 0.5]])


def where(session: Session, patch: str) -> FloatArray:
    return session.geometry.points(patch).positions(session.geometry.mesh_of(patch))


def test_what_hung_on_a_merged_patch_hangs_on_the_one_that_it_became_part_of(session: Session) -> None:
    session.patches.link("tip", "thumb", parent_point=1, own_point=1)
    before = where(session, "tip")
    session.patches.merge("palm", ["thumb"])
    link = session.document.patch("tip").placement
    assert isinstance(link, Link) and link.parent == "palm" and link.own_point == 1
    assert np.allclose(where(session, "tip"), before, atol=1e-12)
    session.patches.rotate("palm", 0.4)
    assert not np.allclose(where(session, "tip"), before)


@pytest.mark.parametrize("order", [("palm", "thumb", "tip"), ("thumb", "tip", "palm"), ("tip", "palm", "thumb")])
def test_patches_that_hang_on_one_another_merge_without_moving(session: Session, order: tuple[str, ...]) -> None:
    """The first hangs on the second, the second on the third, or the other way round: no cycle, nothing lost."""
    session.patches.paint("ring", SurfacePoints([220, 221, 222], np.eye(3)), surface="torus", axis=GOAL, heading=1j)
    session.patches.link("tip", "thumb")
    session.patches.link("thumb", "palm")
    session.patches.link("ring", "tip", own_point=0)
    names = ("palm", "thumb", "tip")
    before = {tuple(p) for name in names for p in np.round(where(session, name), 9)}
    ring = where(session, "ring")
    first, *others = order
    session.patches.merge(first, others)
    assert list(session.document.patches) == [name for name in (*names, "ring") if name not in others]
    assert list(inconsistencies(session.document)) == []
    assert {tuple(p) for p in np.round(where(session, first), 9)} == before
    assert np.allclose(where(session, "ring"), ring, atol=1e-11)
    assert isinstance(session.document.patch(first).placement, Root)
    session.undo()
    session.patches.merge(first, others[:1])
    assert list(inconsistencies(session.document)) == []


def test_weights_of_merged_patches_are_areas_in_one_unit(session: Session) -> None:
    """A copy remembers the units that it was painted in; weights are areas, so they go by the square."""
    session.patches.transfer("palm", "sphere", GOAL, heading=1.0, name="copy")
    session.patches.detach("copy")
    sphere = cached_family("sphere")
    points = SurfacePoints([200, 201, 202, 203], np.full((4, 3), 1 / 3))
    session.patches.paint("own", points, surface="sphere", axis=points[[0, 3]])
    shapes = [session.document.shape_of(name) for name in ("own", "copy")]
    areas = [shape.weights.sum() * shape.meters_per_unit**2 for shape in shapes]
    assert shapes[0].meters_per_unit != shapes[1].meters_per_unit and len(sphere.faces) > 203
    session.patches.merge("own", ["copy"])
    merged = session.document.shape_of("own")
    assert merged.weights.sum() * merged.meters_per_unit**2 == pytest.approx(sum(areas))


def test_places_that_merged_patches_share_are_kept_once(session: Session) -> None:
    count = len(session.geometry.points("palm"))
    root = session.geometry.root("palm")
    session.patches.transfer("palm", "torus", root.point(), heading=root.heading, name="twin", mirrored=False)
    session.patches.detach("twin")
    session.patches.paint("twin", session.geometry.points("thumb")[:3])
    session.patches.merge("palm", ["twin"])
    assert len(session.geometry.points("palm")) == count + 3


def test_a_tree_may_be_deeper_than_calls_may_nest(session: Session) -> None:
    source, depth = session.document.patch("palm"), 250
    for number in range(depth):
        link = Link("palm" if number == 0 else f"c{number - 1}", 0.1, (0.001,), (), 0.02)
        session.do(Transfer((replace(source, name=f"c{number}", original=False, placement=link),)))
    deepest = where(session, f"c{depth - 1}")
    computed = session.derived.computed
    session.patches.rotate("palm", 0.5)
    moved = where(session, f"c{depth - 1}")
    assert not np.allclose(moved, deepest)
    assert session.derived.computed - computed == depth + 2  # each axis once, and the points
    assert dump_document(parse_document(dump_document(session.document))) == dump_document(session.document)


def test_imported_groups_and_pairs_keep_apart_under_names_that_are_taken(session: Session) -> None:
    """A set with "g" and "g.2" into a document with "g": what "g" becomes is not what "g.2" is."""
    for name, patch in (("g", "palm"), ("g.2", "thumb")):
        session.patches.group(name, [patch])
    session.patches.transfer("palm", "sphere", GOAL, heading=1.0, name="copy")
    for name in ("p", "p.2"):
        session.pairs.add("palm", "copy", name=name)
    found = session.sets.of("both")
    session.patches.ungroup("g.2")
    session.pairs.remove("p.2")
    names = session.sets.read(found)
    assert len(session.document.groups) == 3 and len(session.document.pairs) == 3
    members = [patches for group, patches in session.document.groups.items() if group != "g"]
    assert sorted(members) == sorted([(names["palm"],), (names["thumb"],)])


def test_a_rebound_surface_leaves_trees_on_other_surfaces_in_place(session: Session) -> None:
    """The axis of a copy elsewhere gets as many points as that of its original has on the new mesh: one, here."""
    session.patches.transfer("palm", "sphere", GOAL, heading=1.0, name="parent")
    session.patches.transfer("tip", "sphere", SurfacePoints([60], [[0.2, 0.3, 0.5]]), heading=1.0, name="child")
    ends = (len(session.geometry.axis("parent")) - 1, len(session.geometry.axis("child")) - 1)
    session.patches.link("child", "parent", parent_point=ends[0], own_point=ends[1])
    roots = {
        name: session.geometry.root(name).point().positions(session.geometry.mesh("sphere"))
        for name in ("parent", "child")
    }
    far_away = meshes.plane(2, 1.0)
    session.surfaces.rebind("torus", far_away.with_points(far_away.points - 50.0))
    assert session.document.shape_of("palm").axis.point_count <= ends[0]
    assert list(inconsistencies(session.document)) == []
    for name, root in roots.items():
        assert np.allclose(
            session.geometry.root(name).point().positions(session.geometry.mesh("sphere")), root, atol=1e-12
        )


@pytest.mark.parametrize("levels", [MAX_DEPTH, MAX_DEPTH + 1, 400])
def test_free_data_is_as_deep_as_it_can_be_written_and_read(session: Session, levels: int) -> None:
    """What is accepted can be saved and opened again; the rest is refused before it is in the document."""
    value: Any = 1
    for _ in range(levels):
        value = [value]
    group: dict[str, Any] = {"command": "document.extra", "namespace": "a", "value": 1}
    for _ in range(levels):
        group = {"command": "macro", "title": "inner", "commands": [group]}
    if levels <= MAX_DEPTH:
        session.set_extra("deep", value)
        session.do(command_from_json(group))
        text = dump_document(session.document)
        assert dump_document(parse_document(text)) == text
        return
    for act in (lambda: session.set_extra("deep", value), lambda: command_from_json(group)):
        with pytest.raises(FileRefused, match=f"{MAX_DEPTH}"):
            act()
