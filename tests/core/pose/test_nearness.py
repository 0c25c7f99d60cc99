"""How near contacts came is told with a unit, whatever the scene's is."""

from __future__ import annotations

import re

import numpy as np
import pytest

import contact_core as contact
from contact_core.document.document import Surface
from contact_core.errors import InvalidInput
from contact_core.interaction.interaction import Interaction
from contact_core.scene.host import SceneSpace
from contact_core.scene.memory_host import MemoryHost
from contact_core.testing import meshes
from contact_core.testing.host_scenes import arm_rig


def session_in(meters_per_unit: float) -> contact.Session:
    """An arm whose tip is paired with a ball, in a scene of this unit."""
    host, rig, small = MemoryHost(space=SceneSpace(meters_per_unit, "Z")), arm_rig(), meshes.icosphere(2)
    host.add(contact.Asset("arm", rig.surface, rig, meters_per_unit=meters_per_unit, up_axis="Z"))
    ball = contact.TriangleMesh(0.2 * small.points + [0.6, 0.5, 0.1], small.faces)
    host.add(contact.Asset("ball", ball, meters_per_unit=meters_per_unit, up_axis="Z"))
    session = contact.Session(host=host, discover=False, objects=None)
    arm, thing = (session.geometry.mesh(name) for name in ("arm", "ball"))
    tip = contact.SurfacePoints.at_vertices(arm, [int(np.argmax(arm.points[:, 1] + arm.points[:, 0]))])
    session.patches.paint("tip", tip, surface="arm", axis=tip, heading=1.0)
    side = contact.SurfacePoints.at_vertices(thing, [int(np.argmin(thing.points[:, 0]))])
    session.pairs.add("tip", session.patches.transfer("tip", "ball", side, heading=1.0), name="touch")
    return session


@pytest.mark.parametrize("meters_per_unit", [1.0, 0.01])
def test_a_proposal_tells_it_in_millimetres(meters_per_unit: float) -> None:
    with session_in(meters_per_unit) as session:
        proposal = session.solve()
        worst = proposal.after.patches["touch"].p95
        assert proposal.nearness == f"{1e3 * meters_per_unit * worst:.3g} mm"
        hands = Interaction(session, meters_per_unit=meters_per_unit)
        hands.proposing.proposal = proposal
        assert f"contacts within {proposal.nearness};" in hands.proposing.summary
        with pytest.raises(InvalidInput, match=r"lies within [\d.e-]+ m?m of"):
            session.patches.paint_touching("pad", "arm", "ball", 1e-9)


def test_lengths_are_told_as_they_are_read() -> None:
    surface = Surface("thing", "", "", 0, 0, meters_per_unit=0.01)
    told = [surface.told(length) for length in (0.0, 0.0123456, 0.42, 99.96, 135.2)]
    assert told == ["0 mm", "0.123 mm", "4.2 mm", "1 m", "1.35 m"]
    assert all(re.fullmatch(r"[\d.]+ m?m", each) for each in told)
