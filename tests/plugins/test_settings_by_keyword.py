"""Settings reach brushes, axis generators and solvers by keyword, checked; what is refused changes nothing."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import contact_builtins
from contact_core.errors import InvalidInput
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import AXIS_GENERATORS
from contact_core.plugins.solving import PluginSolver, solve_by_plugin
from contact_core.session import Session
from contact_core.solve.solver import SolveOptions
from contact_core.testing.brush_contract import gesture
from contact_core.testing.solver_contract import small


@pytest.fixture
def session() -> Iterator[Session]:
    with Session(plugins=[contact_builtins], discover=False) as made:
        made.surfaces.add("sheet", gesture("saddle").mesh)
        yield made


def test_a_brush_takes_its_settings_by_keyword(session: Session) -> None:
    stroke = gesture("saddle")
    axis = stroke.path[[0, 6]]
    session.patches.brush("disk", "even", stroke, surface="sheet", axis=axis)
    session.patches.brush("disk", "fading", stroke, surface="sheet", axis=axis, falloff="smooth")
    session.patches.brush(
        session.makers.brush("disk"), "again", stroke, surface="sheet", axis=axis, falloff="smooth"
    )
    shapes, patches = session.document.shapes, session.document.patches
    even, fading, again = (shapes[patches[name].shape].weights for name in ("even", "fading", "again"))
    assert np.ptp(fading / even) > 0.5
    np.testing.assert_array_equal(fading, again)
    before = session.document
    for wrong, says in (
        ({"falloff": "cubic"}, "none, linear, smooth"),
        ({"fallof": "none"}, "did you mean 'falloff'"),
    ):
        with pytest.raises(InvalidInput, match=says):
            session.patches.brush("disk", "even", stroke, **wrong)
    assert session.document is before


def test_an_axis_generator_may_be_made_with_settings(session: Session) -> None:
    stroke = gesture("saddle")
    made = session.plugins.make(AXIS_GENERATORS, "guided", elongated=100.0)
    session.patches.paint("named", stroke.path, surface="sheet", generator="guided")
    session.patches.paint("made", stroke.path, surface="sheet", generator=made)
    assert {"named", "made"} <= set(session.document.patches)
    with pytest.raises(InvalidInput, match="elongated is at least 1"):
        session.plugins.make(AXIS_GENERATORS, "guided", elongated=0.5)


def test_a_solver_takes_its_settings_beside_the_options_of_all() -> None:
    plugins = PluginManager([contact_builtins], discover=False)
    few = SolveOptions(max_iterations=3)
    one = solve_by_plugin(small(), plugins, "multi-start", few, starts=1)
    three = PluginSolver(plugins, "multi-start", {"starts": 3}).solve(small(), few)
    assert len(one.trace) <= 3 < len(three.trace) <= 9
    with pytest.raises(InvalidInput, match="'multi-start': starts is at least 1, but got 0"):
        solve_by_plugin(small(), plugins, "multi-start", few, starts=0)
