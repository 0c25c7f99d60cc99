"""The contract of grasp samplers. Subclass it and give the fixture `sampler`."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from contact_core.geometry.distance_field import DistanceField
from contact_core.geometry.mesh import TriangleMesh
from contact_core.grasping.closing import close_hands
from contact_core.grasping.hand import Hand, hand_of
from contact_core.grasping.slots import Approaches, GraspRequest, GraspSampler
from contact_core.hands.describe import describe_hand
from contact_core.testing import meshes, rigs
from contact_core.testing.contract import Contract, needs
from contact_core.testing.settings_checks import check_settings

OBJECTS = ("ball", "rod", "slab")


@cache
def hand() -> Hand:
    """A plain hand, 19 units long."""
    rig = rigs.hand_like(rigs.limited_freedom)
    return hand_of(rig, describe_hand(rig))


@cache
def thing(name: str) -> TriangleMesh:
    """Objects that such a hand can hold."""
    ball = meshes.icosphere(3)
    size = {"ball": (3.0, 3.0, 3.0), "rod": (1.2, 1.2, 12.0), "slab": (5.0, 0.9, 3.0)}[name]
    return TriangleMesh(ball.points * np.array(size), ball.faces)


def request_for(name: str, **others: object) -> GraspRequest:
    mesh = thing(name)
    return replace(GraspRequest(hand(), mesh, DistanceField.of(mesh, resolution=40)), **others)  # type: ignore[arg-type]


def same(one: Approaches, other: Approaches) -> bool:
    names = ("placed", "ways", "bars", "curls", "limits")
    return one.kinds == other.kinds and all(np.array_equal(getattr(one, n), getattr(other, n)) for n in names)


class GraspSamplerContract(Contract):
    """Fixture: `sampler`, a GraspSampler."""

    about, letter = "grasp sampler", "G"

    def test_g01_is_named(self, sampler: GraspSampler) -> None:
        """Has a name and says in a sentence what it does."""
        assert sampler.name == sampler.name.strip() != ""
        assert len(sampler.summary.split()) >= 3, sampler.summary

    @pytest.mark.parametrize("name", OBJECTS)
    def test_g02_comes_from_somewhere(self, sampler: GraspSampler, name: str) -> None:
        """Finds approaches to a ball, a rod and a slab, each a rigid placement with its way, bar, curl and
        limits."""
        found = sampler.sample(request_for(name))
        assert isinstance(found, Approaches) and len(found.kinds) > 0
        assert (np.linalg.det(found.placed[:, :3, :3]) > 0.0).all(), "a hand must not be mirrored"
        assert found.limits.shape[1] == len(hand().bones) - 1
        assert ((found.limits >= 0.0) & (found.limits <= 1.0)).all() and (
            (found.curls >= 0.0) & (found.curls <= 1.0)
        ).all()

    def test_g03_gives_what_is_asked_for(self, sampler: GraspSampler) -> None:
        """Only kinds that were asked for come out."""
        for kind in ("power", "pinch"):
            found = sampler.sample(request_for("slab", kinds=(kind,)))
            assert set(found.kinds) <= {kind}, set(found.kinds)

    def test_g04_is_deterministic(self, sampler: GraspSampler) -> None:
        """The same seed gives the same approaches, to the bit."""
        asked = request_for("rod", seed=3)
        assert same(sampler.sample(asked), sampler.sample(asked))

    @pytest.mark.parametrize("name", OBJECTS)
    def test_g05_reaches_the_object(self, sampler: GraspSampler, name: str) -> None:
        """A hand that comes that way and closes touches the object in at least one of three approaches."""
        asked = request_for(name)
        found = sampler.sample(asked)[np.arange(0, len(sampler.sample(asked).kinds), 7)]
        closed = close_hands(
            asked.hand, asked.field, found.placed, found.ways, found.bars, found.curls, found.limits
        )
        near = np.minimum(closed.clear.min(axis=1), closed.palm) < 0.02 * asked.hand.length
        assert (near & np.isfinite(closed.travel)).mean() > 1.0 / 3.0

    @needs("places")
    def test_g06_keeps_to_the_place(self, sampler: GraspSampler) -> None:
        """Asked to hold one end of a rod, no approach starts nearer to the other end."""
        end = np.array([0.0, 0.0, 11.0])
        found = sampler.sample(request_for("rod", at=end))
        palms = found.placed @ np.append(hand().description.palm.point, 1.0)
        assert len(palms) and (palms[:, 2] > 0.0).mean() > 0.9

    def test_g07_leaves_its_input_alone(self, sampler: GraspSampler) -> None:
        """Mesh, field and hand are the same bits afterwards."""
        asked = request_for("slab")
        arrays = [asked.mesh.points, asked.mesh.faces, asked.field.values, asked.hand.probes, asked.hand.links]
        before = [array.tobytes() for array in arrays]
        sampler.sample(asked)
        assert before == [array.tobytes() for array in arrays]

    def test_g08_declares_its_settings(self, sampler: GraspSampler) -> None:
        """Its settings say unit, range and help; a value out of range and a name it does not know are refused."""
        check_settings(sampler)
