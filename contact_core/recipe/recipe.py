"""Recipes: what `contact pose` is asked to do. `reader` reads them from strict TOML.

Lengths are in the units of the surface they lie on, directions and positions in that surface's own space,
angles in degrees. The whole schema, with every default, is in docs/recipes.md, which a test compares.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from contact_core.strict_table import Vector


@dataclass(frozen=True)
class AssetSource:
    """A file or a built-in sample. file: name or path; sha256: of its bytes; sidecar: a rig.toml beside it."""

    file: str | None = None
    sample: str | None = None
    sha256: str | None = None
    sidecar: str | None = None


@dataclass(frozen=True)
class PointSpec:
    """A point of a surface: at a vertex, nearest to a position, or where a ray from a joint leaves the skin.

    joint, along: the ray starts at this fraction of the bone from the joint to its child. toward: direction of
    the ray in rig space, or "palm" for the palmar side of the joint's own flexion.
    """

    vertex: int | None = None
    position: Vector | None = None
    joint: str | None = None
    along: float = 0.5
    toward: Vector | str = "palm"


@dataclass(frozen=True)
class DiskSpec:
    """All points within a geodesic radius, `count` of them."""

    at: PointSpec
    radius: float
    count: int


@dataclass(frozen=True)
class RootSpec:
    """Where a patch goes on the object: a point, and a direction there or a second point to aim at."""

    root: PointSpec
    direction: Vector | None = None
    aim: PointSpec | None = None


@dataclass(frozen=True)
class PatchSpec:
    """One patch on the manipulator. Exactly one of vertices, positions, disk holds its points.

    axis: two or more points to draw it through, else the generator named. place: overrides the placer. on, onto:
    the manipulator that it is painted on, and the object that it goes to; the first of each by default.
    """

    name: str
    on: str | None = None
    onto: str | None = None
    vertices: tuple[int, ...] = ()
    positions: tuple[Vector, ...] = ()
    disk: DiskSpec | None = None
    axis: tuple[PointSpec, ...] = ()
    generator: str | None = None  # the default for recipes
    generator_options: Mapping[str, Any] = field(default_factory=dict)
    place: RootSpec | None = None


@dataclass(frozen=True)
class ManipulatorSpec:
    """What is posed. name: of its surface in the document. position, rotation: where its rig stands, in world space
    (degrees about x, y, z, in this order). pose: roughly, per joint or pattern, degrees per rotation dof.
    """

    source: AssetSource
    name: str = "manipulator"
    position: Vector = (0.0, 0.0, 0.0)
    rotation: Vector = (0.0, 0.0, 0.0)
    pose: Mapping[str, tuple[float, ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class ObjectSpec:
    """What is touched. name: of its surface in the document. scale: of its file. center: where the middle of its
    bounding box lies in world space, roughly: the artist's part. rotation: degrees about x, y, z, in this order.
    solids: which insides count for depth; see `metrics.PosedScene`.

    fill_low, fill_high: the hull is taken of the points within this box of the object's surface space.
    """

    source: AssetSource
    name: str = "object"
    scale: float = 1.0
    center: Vector = (0.0, 0.0, 0.0)
    rotation: Vector = (0.0, 0.0, 0.0)
    solids: tuple[str, ...] = ("surface",)
    fill_low: Vector | None = None
    fill_high: Vector | None = None


@dataclass(frozen=True)
class SolveSpec:
    """solver: a plugin's name; None leaves the choice to the plugins. start: "open" (rest pose, away from the
    object) or "coarse". penetration: weight of the depth term, 0 switches it off. limits: whether the rig's
    limits hold. What changes the contacts: settle, rounds of re-placing each at its closest facing point; slide,
    how far each may then slide with the pose, in manipulator lengths (0: not at all). weights:
    of distance, normal and prior."""

    solver: str | None = None
    start: str = "open"
    weights: Vector = (1.0, 1.0, 10.0)
    penetration: float = 5.0
    limits: bool = True
    settle: int = 0
    slide: float = 0.0
    options: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class ViewSpec:
    """camera_from: direction from the scene to the eye, and up, in the object's space as it lies in the hand."""

    camera_from: Vector | None = None
    up: Vector = (0.0, 1.0, 0.0)
    size: tuple[int, int] = (1600, 640)


@dataclass(frozen=True)
class Recipe:
    """A whole job. World space is that of the rigs as their files have them. folder: where relative file names are
    looked up first."""

    name: str
    manipulators: tuple[ManipulatorSpec, ...]
    objects: tuple[ObjectSpec, ...]
    patches: tuple[PatchSpec, ...]
    title: str = ""
    away: float = 1.25
    away_direction: Vector | None = None
    placer: str | None = None  # the default for recipes
    placer_options: Mapping[str, Any] = field(default_factory=dict)
    solve: SolveSpec = field(default_factory=SolveSpec)
    accept: Mapping[str, float] = field(default_factory=dict)
    view: ViewSpec = field(default_factory=ViewSpec)
    folder: Path | None = None
