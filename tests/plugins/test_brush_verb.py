"""Brushes through a session: one step, points only, and what an eraser takes."""

from __future__ import annotations

import numpy as np
import pytest

from contact_core.arrays import FloatArray
from contact_core.contact.brush import BrushGesture, BrushMark
from contact_core.document.schema import dump_document
from contact_core.errors import CommandRejected, InvalidInput
from contact_core.geometry.exact_geodesics import log_map
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.plugins import hookimpl
from contact_core.session import Session
from contact_core.testing import meshes


@pytest.fixture
def session() -> Session:
    """A ball of radius 1, and the patch "pad" as a stroke over its top, all with the built-in brushes."""
    session = Session()
    session.surfaces.add("ball", meshes.icosphere(3))
    session.patches.brush("disk", "pad", over(session, (-0.4, 0.0, 0.9), (0.4, 0.0, 0.9)), surface="ball")
    return session


def over(session: Session, *places: tuple[float, float, float], radius: float = 0.25) -> BrushGesture:
    """A stroke over the ball along places in space."""
    mesh = session.geometry.mesh("ball")
    path = Locator.of(mesh).closest(np.array(places)).points
    return BrushGesture(mesh, path, radius=radius, spacing=0.06, seed=1)


def distance(session: Session, points: SurfacePoints, path: SurfacePoints) -> FloatArray:
    """(n,) over the ball, of points from the nearest point of a path."""
    return log_map(session.geometry.mesh("ball"), path, points).distance


def test_several_marks_are_one_step_and_only_the_brush_knows_them(session: Session) -> None:
    """The patch holds what the marks hold together; undone and redone it is the same, and no brush is written."""
    gestures = [over(session, (0.0, 1.0, 0.0)), over(session, (0.0, -1.0, 0.0))]
    brush, before, revision = session.makers.brush("disk"), session.document, session.revision
    wanted = SurfacePoints.concatenate([brush.mark(gesture).points for gesture in gestures])
    with pytest.raises(InvalidInput, match="surface"):
        session.patches.brush("disk", "sides", *gestures)
    session.patches.brush("disk", "sides", *gestures, surface="ball", generator="principal")
    assert session.revision == revision + 1
    mesh, sides = session.geometry.mesh("ball"), session.geometry.points("sides")
    np.testing.assert_allclose(sides.positions(mesh), wanted.positions(mesh), atol=1e-9)
    text = dump_document(session.document)
    assert b"disk" not in text
    session.undo()
    assert session.document is before
    session.redo()
    assert dump_document(session.document) == text


def test_more_of_a_patch_is_one_step(session: Session) -> None:
    before, revision = session.geometry.points("pad"), session.revision
    gesture = over(session, (0.0, 1.0, 0.0))
    mark = session.makers.brush("disk").mark(gesture)
    session.patches.brush("disk", "pad", gesture)
    assert session.revision == revision + 1
    assert len(session.geometry.points("pad")) == len(before) + len(mark.points)


def test_the_eraser_takes_what_lies_under_its_strokes_and_nothing_else(session: Session) -> None:
    """Over two strokes: within the radius nothing stays, beyond radius and one gap everything does, in one step."""
    ends = [over(session, (-0.4, 0.0, 0.9), radius=0.2), over(session, (0.4, 0.0, 0.9), radius=0.2)]
    before, revision = session.geometry.points("pad"), session.revision
    document = session.document
    session.patches.brush("eraser", "pad", *ends)
    assert session.revision == revision + 1
    paths = SurfacePoints.concatenate([gesture.path for gesture in ends])
    was, stays = distance(session, before, paths), distance(session, session.geometry.points("pad"), paths)
    assert (was <= 0.2).sum() > 20 and (stays > 0.2).all()
    assert (was > 0.32).sum() > 10 and (stays > 0.32).sum() == (was > 0.32).sum()
    session.undo()
    assert session.document is document


def test_what_cannot_be_brushed_is_said_and_changes_nothing(session: Session) -> None:
    document = session.document
    far = over(session, (0.0, 0.0, -1.0))
    with pytest.raises(CommandRejected, match="lies under"):
        session.patches.brush("eraser", "pad", far)
    with pytest.raises(InvalidInput, match="no brush 'disc'; there are: disk"):
        session.patches.brush("disc", "pad", far)
    with pytest.raises(InvalidInput, match="gesture"):
        session.patches.brush("disk", "pad")
    other = BrushGesture(meshes.icosphere(2), far.path, radius=0.2)
    with pytest.raises(InvalidInput, match="another mesh"):
        session.patches.brush("disk", "pad", other)
    assert session.document is document


class Dot:
    """A studio's own brush: the points of the path at half strength."""

    name, summary, erases = "dot", "half a dot", False

    def mark(self, gesture: BrushGesture) -> BrushMark:
        return BrushMark(gesture.path, np.full(len(gesture.path), 0.5))


class Plugin:
    @hookimpl
    def contact_brushes(self) -> list[object]:
        return [Dot]


def test_a_drag_with_a_brush_of_a_plugin_previews_and_commits_once() -> None:
    """Each gesture of a drag replaces the one before; strength halves the weight that the area gives."""
    with Session(plugins=[Plugin()], discover=False) as session:
        session.surfaces.add("ball", meshes.icosphere(3))
        path = over(session, (-0.3, 0.0, 0.9), (0.0, 0.0, 1.0), (0.3, 0.1, 0.9))
        revision, dot = session.revision, session.makers.brush("dot")
        with session.stroke() as drag:
            with pytest.raises(InvalidInput, match="no brush 'dash'"):
                drag.patches.brush("dash", "dots", path, surface="ball", axis=path.path)
            assert not hasattr(drag, "export_set") and not hasattr(drag, "import_set")  # no files in a drag
            for radius in (0.1, 0.2):
                drag.patches.brush(dot, "dots", over(session, (0.0, 0.0, radius)), surface="ball", axis=path.path)
            drag.patches.brush("dot", "dots", path, surface="ball", axis=path.path)
            assert drag.makers.brush("dot") is drag.makers.brush("dot")
        assert session.revision == revision + 1 and len(session.geometry.points("dots")) == 3
        session.patches.paint("whole", path.path, surface="ball", axis=path.path)
        half, whole = (session.document.shape_of(name).weights for name in ("dots", "whole"))
        np.testing.assert_allclose(half, 0.5 * whole)


def test_a_new_patch_in_a_drag_gets_the_axis_that_it_gets_without(session: Session) -> None:
    """By the name of the brush and that of an axis generator; the committed document is the same."""
    gesture = over(session, (0.0, 1.0, 0.0), (0.3, 0.9, 0.0))
    session.patches.brush("disk", "side", gesture, surface="ball", generator="principal")
    directly = dump_document(session.document)
    session.undo()
    with session.stroke() as drag:
        drag.patches.brush("disk", "side", gesture, surface="ball", generator="principal")
    assert dump_document(session.document) == directly
