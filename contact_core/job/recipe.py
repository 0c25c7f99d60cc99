"""Recipes: what `contact pose` is asked to do, as a strict TOML file.

Lengths are in the units of the surface they lie on, directions and positions in that surface's own space,
angles in degrees. The whole schema, with every default, is in docs/recipes.md, which a test compares.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from contact_core.errors import ContactError, FileRefused, InvalidInput
from contact_core.job.table import Table, Vector

SCHEMA = 1
_LARGEST_FILE = 4_000_000  # bytes


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

    axis: two or more points to draw it through, else the generator named. place: overrides the placer.
    """

    name: str
    vertices: tuple[int, ...] = ()
    positions: tuple[Vector, ...] = ()
    disk: DiskSpec | None = None
    axis: tuple[PointSpec, ...] = ()
    generator: str = "along_bone"
    generator_options: Mapping[str, Any] = field(default_factory=dict)
    place: RootSpec | None = None


@dataclass(frozen=True)
class ObjectSpec:
    """The object. scale: of its file. solids: which insides count for depth; see `metrics.PosedScene`.

    fill_low, fill_high: the hull is taken of the points within this box of the object's surface space.
    """

    source: AssetSource
    scale: float = 1.0
    solids: tuple[str, ...] = ("surface",)
    fill_low: Vector | None = None
    fill_high: Vector | None = None


@dataclass(frozen=True)
class CoarseSpec:
    """How the object lies in the manipulator's hand, roughly: the artist's part.

    object_center: of the object's bounding box, in rig space. object_rotation: degrees about x, y, z of rig
    space, in this order. pose: per joint or pattern, degrees per rotation dof.
    """

    object_center: Vector = (0.0, 0.0, 0.0)
    object_rotation: Vector = (0.0, 0.0, 0.0)
    pose: Mapping[str, tuple[float, ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class SolveSpec:
    """solver: a plugin's name; None leaves the choice to the plugins. start: "open" (rest pose, away from the
    object) or "coarse". penetration: weight of the depth term, 0 switches it off. limits: whether the rig's
    limits hold. settle: rounds of re-placing each contact at its closest facing point (changes the contacts).
    weights: of distance, normal and prior."""

    solver: str | None = None
    start: str = "open"
    weights: Vector = (1.0, 1.0, 10.0)
    penetration: float = 5.0
    limits: bool = True
    settle: int = 0
    options: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class ViewSpec:
    """camera_from: direction from the scene to the eye, and up, in the object's space as it lies in the hand."""

    camera_from: Vector | None = None
    up: Vector = (0.0, 1.0, 0.0)
    size: tuple[int, int] = (1280, 720)


@dataclass(frozen=True)
class Recipe:
    """A whole job. folder: where relative file names are looked up first."""

    name: str
    manipulator: AssetSource
    object: ObjectSpec
    patches: tuple[PatchSpec, ...]
    title: str = ""
    away: float = 1.25
    away_direction: Vector | None = None
    coarse: CoarseSpec = field(default_factory=CoarseSpec)
    placer: str = "from pose"
    placer_options: Mapping[str, Any] = field(default_factory=dict)
    solve: SolveSpec = field(default_factory=SolveSpec)
    accept: Mapping[str, float] = field(default_factory=dict)
    view: ViewSpec = field(default_factory=ViewSpec)
    folder: Path | None = None


# What a grasp must reach unless its recipe says otherwise; fractions, degrees, counts. The loosest of GRASP.
ACCEPT: dict[str, tuple[str, float]] = {
    "mean_contact_distance": ("<=", 0.025),
    "p95_contact_distance": ("<=", 0.055),
    "gap": ("<=", 0.015),
    "opposed_normals": (">=", 0.92),
    "opposed_normals_45": (">=", 0.52),
    "worst_patch_opposed_45": (">=", 0.20),
    "max_penetration": ("<=", 0.018),
    "skin_inside": ("<=", 0.034),
    "bones_through": ("<=", 0.0),
    "skin_stretch_p99": ("<=", 1.6),
    "max_joint_change_deg": ("<=", 120.0),
}


def load_recipe(path: Path) -> Recipe:
    """Read a recipe file. Raises FileRefused, InvalidInput; each message begins with the file's name."""
    try:
        if path.stat().st_size > _LARGEST_FILE:
            raise FileRefused(f"{path} is larger than {_LARGEST_FILE} bytes: too large for a recipe.")
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise FileRefused(f"cannot read the recipe {path}: {error.strerror or error}.") from error
    except UnicodeDecodeError as error:
        raise FileRefused(f"{path} is no recipe: it is not UTF-8 text.") from error
    return parse_recipe(text, name=path.name, folder=path.parent)


def parse_recipe(text: str, *, name: str, folder: Path | None = None) -> Recipe:
    """A recipe out of TOML text. Raises InvalidInput naming the table and key."""
    try:
        values = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InvalidInput(f"{name} is not TOML: {error}.") from error
    except RecursionError as error:
        raise InvalidInput(f"{name} is nested too deeply for a recipe.") from error
    try:
        return _recipe(Table(values, "recipe"), folder)
    except ContactError as error:
        raise type(error)(f"{name}: {error}") from error


def _recipe(top: Table, folder: Path | None) -> Recipe:
    schema = top.count("schema", at_least=1, at_most=10**6)
    if schema > SCHEMA:
        raise InvalidInput(
            f"it has recipe schema {schema}; this contact-core reads up to {SCHEMA}. Update contact-core."
        )
    scene = top.table("scene", None)
    placer = top.table("placer", None)
    recipe = Recipe(
        name=top.text("name"),
        title=top.text("title", ""),
        manipulator=_source(top.table("manipulator"), sidecar=True),
        object=_object(top.table("object")),
        patches=tuple(spec for table in top.tables("patch") for spec in _patches(table)),
        away=scene.number("away", 1.25, at_least=0.0, at_most=100.0),
        away_direction=scene.vector("direction", None, direction=True),
        coarse=_coarse(top.table("coarse", None)),
        placer=placer.text("name", "from pose"),
        placer_options={key: placer.raw(key) for key in placer.values if key != "name"},
        solve=_solve(top.table("solve", None)),
        accept=_accept(top.table("accept", None)),
        view=_view(top.table("view", None)),
        folder=folder,
    )
    scene.done()
    top.done()
    names = [patch.name for patch in recipe.patches]
    if len(set(names)) != len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise InvalidInput(f"patch names must be unique, but {twice!r} comes twice.")
    return recipe


def _source(table: Table, *, sidecar: bool = False, done: bool = True) -> AssetSource:
    kind = table.exactly_one("file", "sample")
    value, digest = table.text(kind), table.text("sha256", None)
    if digest is not None and (
        kind != "file" or len(digest) != 64 or set(digest.lower()) - set("0123456789abcdef")
    ):
        raise InvalidInput(f"{table.where}.sha256 must be 64 hex digits and goes with a file.")
    beside = table.text("rig", None) if sidecar else None
    if done:
        table.done()
    if kind == "sample":
        return AssetSource(sample=value, sidecar=beside)
    return AssetSource(file=value, sha256=digest and digest.lower(), sidecar=beside)


def _object(table: Table) -> ObjectSpec:
    solids = table.texts("solids", ("surface",))
    for kind in solids:
        if kind not in ("surface", "hull"):
            raise InvalidInput(f"{table.where}.solids holds 'surface' and 'hull', but {kind!r} came.")
    box = table.table("hull_box", None)
    spec = ObjectSpec(
        source=_source(table, done=False),
        scale=table.number("scale", 1.0, above=0.0, at_most=1e6),
        solids=solids,
        fill_low=box.vector("low", None),
        fill_high=box.vector("high", None),
    )
    box.done()
    table.done()
    return spec


def _patches(table: Table) -> list[PatchSpec]:
    """One patch, or one for each of `joints`, whose name stands for {joint}."""
    joints = table.texts("joints", ())
    name = table.text("name")
    if joints and "{joint}" not in name:
        raise InvalidInput(f"{table.where}.name must hold {{joint}} where 'joints' lists several patches.")
    return [_patch(table, name.replace("{joint}", joint), joint) for joint in joints] or [_patch(table, name, None)]


def _patch(table: Table, name: str, joint: str | None) -> PatchSpec:
    kind = table.exactly_one("vertices", "positions", "disk")
    disk = None
    if kind == "disk":
        inner = table.table("disk")
        disk = DiskSpec(
            at=_point(inner, joint, done=False),
            radius=inner.number("radius", above=0.0),
            count=inner.count("points", 80, at_least=3, at_most=20_000),
        )
        inner.done()
    axis = table.table("axis", None)
    place = table.table("place") if "place" in table else None
    spec = PatchSpec(
        name=name,
        vertices=table.counts("vertices", ()),
        positions=table.vectors("positions", ()),
        disk=disk,
        axis=tuple(_point(point, joint) for point in axis.tables("through")) if "through" in axis else (),
        generator=axis.text("generator", "along_bone"),
        generator_options={k: axis.raw(k) for k in axis.values if k not in ("through", "generator")},
        place=None if place is None else _root(place),
    )
    table.raw("place", None)
    table.done()
    if len(spec.axis) == 1 or (spec.axis and spec.generator_options):
        raise InvalidInput(
            f"{axis.where}.through needs at least two points, and no generator's settings beside it."
        )
    return spec


def _point(table: Table, joint: str | None, *, done: bool = True) -> PointSpec:
    if joint is not None and not {"vertex", "position", "joint"} & set(table.values):
        kind = "joint"
    else:
        kind, joint = table.exactly_one("vertex", "position", "joint"), None
    toward = table.raw("toward", "palm")
    spec = PointSpec(
        vertex=table.count("vertex", at_most=10**9) if kind == "vertex" else None,
        position=table.vector("position") if kind == "position" else None,
        joint=(joint or table.text("joint")) if kind == "joint" else None,
        along=table.number("along", 0.5, at_least=-1.0, at_most=2.0),
        toward="palm" if toward == "palm" else table.vector("toward", direction=True),
    )
    if done:
        table.done()
    return spec


def _root(table: Table) -> RootSpec:
    kind = table.exactly_one("direction", "aim")
    spec = RootSpec(
        root=_point(table.table("root"), None),
        direction=table.vector("direction", direction=True) if kind == "direction" else None,
        aim=_point(table.table("aim"), None) if kind == "aim" else None,
    )
    table.done()
    return spec


def _coarse(table: Table) -> CoarseSpec:
    pose = table.table("pose", None)
    spec = CoarseSpec(
        object_center=table.vector("object_center", (0.0, 0.0, 0.0)),
        object_rotation=table.vector("object_rotation", (0.0, 0.0, 0.0)),
        pose={joint: _angles(pose, joint) for joint in pose.values},
    )
    table.done()
    return spec


def _angles(table: Table, joint: str) -> tuple[float, ...]:
    value = table.raw(joint)
    rows = value if isinstance(value, list) else [value]
    if not 1 <= len(rows) <= 3 or any(type(x) not in (int, float) or not abs(x) <= 360 for x in rows):
        raise InvalidInput(f"{table.where}.{joint} must be one to three angles in degrees, but {value!r} came.")
    return tuple(float(x) for x in rows)


def _solve(table: Table) -> SolveSpec:
    spec = SolveSpec(
        solver=table.text("solver", None),
        start=table.choice("start", ("open", "coarse"), "open"),
        weights=table.vector("weights", (1.0, 1.0, 10.0)),
        penetration=table.number("penetration", 5.0, at_least=0.0),
        limits=table.flag("limits", True),
        settle=table.count("settle", 0, at_most=10),
        options=dict(table.table("options", None).values),
    )
    table.done()
    if min(spec.weights) < 0:
        raise InvalidInput(f"{table.where}.weights are not negative, but {list(spec.weights)} came.")
    return spec


def _accept(table: Table) -> dict[str, float]:
    limits = {key: table.number(key) for key in ACCEPT if key in table}
    for key in ACCEPT:
        table.raw(key, None)
    table.done()
    return limits


def _view(table: Table) -> ViewSpec:
    size = table.counts("size", [1280, 720])
    if len(size) != 2 or not all(64 <= n <= 8192 for n in size):
        raise InvalidInput(
            f"{table.where}.size must be [width, height] of 64 to 8192 pixels, but {list(size)} came."
        )
    spec = ViewSpec(
        camera_from=table.vector("camera_from", None, direction=True),
        up=table.vector("up", (0.0, 1.0, 0.0), direction=True),
        size=(size[0], size[1]),
    )
    table.done()
    return spec
