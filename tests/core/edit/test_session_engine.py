"""The engine that a session was given measures what is painted; what is in the document asks nobody again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from contact_core.arrays import ComplexArray, FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.geometry import SurfacePoints, TriangleMesh, log_map
from contact_core.geometry.engine import EngineTolerances, ExactEngine, LogMapResult, TraceResult
from contact_core.plugins import hookimpl
from contact_core.session import Session
from contact_core.testing import meshes


class Counting(ExactEngine):
    """The exact engine, counting its queries."""

    name = "counting"

    def __init__(self) -> None:
        self.queries = 0

    def log_map(self, *arguments: object, **options: object) -> LogMapResult:  # type: ignore[override]
        self.queries += 1
        return super().log_map(*arguments, **options)  # type: ignore[arg-type]


class Straight:
    """Exact, but without chains, and everything `factor` times as far."""

    name = "straight"
    summary = "Exact, but without chains, and everything a factor as far"
    exact = False
    tolerances = EngineTolerances(0.5, 0.5, 0.5)

    def __init__(self, factor: float = 1.0) -> None:
        self.factor = factor

    def log_map(
        self, mesh: TriangleMesh, sources: SurfacePoints, targets: SurfacePoints, max_distance: float | None = None
    ) -> LogMapResult:
        log = log_map(mesh, sources, targets, max_distance)
        return Bare(log.anchor, log.distance * self.factor, log.coordinates * self.factor)

    def trace_geodesic(self, mesh: TriangleMesh, starts: SurfacePoints, vectors: ComplexArray) -> TraceResult:
        raise AssertionError("what a document holds is walked by the exact tracer alone")


class Bare:
    """A log map and no more."""

    def __init__(self, anchor: IntArray, distance: FloatArray, coordinates: ComplexArray) -> None:
        self.anchor, self.distance, self.coordinates = anchor, distance, coordinates


def session(engine: object = None, **arguments: object) -> Session:
    """A session on a bumpy ball and a flat sheet."""
    made = Session(engine=engine, discover=False, **arguments)  # type: ignore[arg-type]
    made.surfaces.add("ball", meshes.noisy(3, 0.02))
    made.surfaces.add("sheet", meshes.plane(12))
    return made


def paint(edited: Session, name: str = "patch") -> SurfacePoints:
    """Paint what lies around a vertex; answers the points painted."""
    ball = meshes.noisy(3, 0.02)
    vertices = SurfacePoints.at_vertices(ball, np.arange(len(ball.points)))
    middle = SurfacePoints.at_vertices(ball, 40)
    painted = vertices[log_map(ball, middle, vertices).distance < 0.5]
    edited.patches.paint(name, painted, surface="ball", axis=middle, heading=1.0)
    return painted


def positions(edited: Session, name: str) -> FloatArray:
    return edited.geometry.points(name).positions(edited.geometry.mesh_of(name))


def test_painting_asks_the_engine_and_what_follows_does_not() -> None:
    engine = Counting()
    edited, usual = session(engine), session()
    paint(edited), paint(usual)
    assert engine.queries == 1
    for each in (edited, usual):
        middle = SurfacePoints.at_vertices(meshes.plane(12), 6 * 13 + 6)
        each.patches.rotate("patch", 0.3)
        each.patches.transfer("patch", "sheet", middle, direction=[1.0, 0.0, 0.0], name="copy")
        each.undo()
        each.redo()
    assert engine.queries == 1
    for name in ("patch", "copy"):
        assert np.array_equal(positions(edited, name), positions(usual, name))


def test_within_a_stroke_it_is_the_same_engine() -> None:
    engine = Counting()
    edited = session(engine)
    with edited.stroke() as drag:
        paint(drag)  # type: ignore[arg-type]
    assert engine.queries == 1


def test_what_an_engine_measures_reaches_the_patch_and_its_transfers() -> None:
    """Told that everything is half as far, a patch comes out half as large, and so does its copy."""
    edited, usual = session(Straight(0.5)), session(Straight())
    middle = SurfacePoints.at_vertices(meshes.plane(12), 6 * 13 + 6)
    for each in (edited, usual):
        paint(each)
        each.patches.transfer("patch", "sheet", middle, direction=[1.0, 0.0, 0.0], name="copy")
    centre = middle.positions(meshes.plane(12))[0]
    half, whole = (np.linalg.norm(positions(each, "copy") - centre, axis=1) for each in (edited, usual))
    assert half == pytest.approx(0.5 * whole, abs=1e-9)


def test_chains_bring_points_back_that_lie_behind_saddle_vertices() -> None:
    """The exact engine has them and comes back to rounding; without them the same distances miss."""
    missed = {}
    for name, engine in (("chains", Counting()), ("straight", Straight())):
        edited = session(engine)
        painted = paint(edited).positions(meshes.noisy(3, 0.02))
        missed[name] = np.linalg.norm(positions(edited, "patch") - painted, axis=1).max()
    assert missed["chains"] < 1e-9 < 1e-4 < missed["straight"]


def test_an_engine_is_selected_by_name(tmp_path: Path) -> None:
    class Plugin:
        @hookimpl
        def contact_geodesic_engines(self) -> list[object]:
            return [Straight(0.5)]

    with session("straight", plugins=[Plugin()]) as edited:
        paint(edited)
        told = positions(edited, "patch")
        edited.save(tmp_path / "hand.json")
    with Session.open(tmp_path / "hand.json", discover=False) as later:  # a session that does not know the engine
        later.surfaces.add("ball", meshes.noisy(3, 0.02))
        assert np.array_equal(positions(later, "patch"), told)
    with pytest.raises(InvalidInput, match="no geodesic engine 'straigt'; there are: straight"):
        session("straigt", plugins=[Plugin()])


def test_the_approximate_engine_stays_within_what_it_promises() -> None:
    pytest.importorskip("potpourri3d")
    from contact_builtins.engines.vector_heat import VectorHeatEngine

    engine = VectorHeatEngine()
    edited = session(engine)
    ball = meshes.noisy(3, 0.02)
    painted = paint(edited).positions(ball)
    off = np.linalg.norm(positions(edited, "patch") - painted, axis=1)
    assert 1e-6 < off.max() <= engine.tolerances.round_trip * ball.bounding_box_diagonal
