"""Reading recipes: TOML in, a checked `Recipe` out, each mistake a sentence with file, table and key."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from contact_core.errors import ContactError, FileRefused, InvalidInput, shortened
from contact_core.grasping.verdict import ACCEPT
from contact_core.recipe.recipe import (
    AssetSource,
    DiskSpec,
    ManipulatorSpec,
    ObjectSpec,
    PatchSpec,
    PointSpec,
    Recipe,
    RootSpec,
    SolveSpec,
    ViewSpec,
)
from contact_core.strict_table import Table, parse_toml

SCHEMA = 1
_LARGEST_FILE = 4_000_000  # bytes


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
    values = parse_toml(text, name)
    try:
        return _recipe(Table(values, "recipe"), folder)
    except ContactError as error:
        raise type(error)(f"{name}: {shortened(str(error), 1000)}") from error


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
        manipulators=tuple(_manipulator(table) for table in top.one_or_more("manipulator")),
        objects=tuple(_object(table) for table in top.one_or_more("object")),
        patches=tuple(spec for table in top.tables("patch") for spec in _patches(table)),
        away=scene.number("away", 1.25, at_least=0.0, at_most=100.0),
        away_direction=scene.vector("direction", None, direction=True),
        placer=placer.text("name", None),
        placer_options={key: placer.raw(key) for key in placer.values if key != "name"},
        solve=_solve(top.table("solve", None)),
        accept=_accept(top.table("accept", None)),
        view=_view(top.table("view", None)),
        folder=folder,
    )
    scene.done()
    top.done()
    _check_names(recipe)
    return recipe


def _check_names(recipe: Recipe) -> None:
    """Names are unique, and patches name manipulators and objects that there are. Raises InvalidInput."""
    manipulators = [spec.name for spec in recipe.manipulators]
    objects = [spec.name for spec in recipe.objects]
    for kind, names in (("patch", [spec.name for spec in recipe.patches]), ("surface", manipulators + objects)):
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise InvalidInput(f"{kind} names must be unique, but {twice!r} comes twice.")
    for patch in recipe.patches:
        for key, name, known in (("on", patch.on, manipulators), ("onto", patch.onto, objects)):
            if name is not None and name not in known:
                raise InvalidInput(f"patch {patch.name!r}: {key} is one of {', '.join(known)}, but got {name!r}.")


def _source(table: Table, *, sidecar: bool = False) -> AssetSource:
    kind = table.exactly_one("file", "sample")
    value, digest = table.text(kind), table.text("sha256", None)
    if digest is not None and (
        kind != "file" or len(digest) != 64 or set(digest.lower()) - set("0123456789abcdef")
    ):
        raise InvalidInput(f"{table.where}.sha256 must be 64 hex digits and goes with a file.")
    beside = table.text("rig", None) if sidecar else None
    if kind == "sample":
        if beside is not None:
            raise InvalidInput(f"{table.where}.rig goes with a file; the sample {value!r} has its own limits.")
        return AssetSource(sample=value)
    return AssetSource(file=value, sha256=digest and digest.lower(), sidecar=beside)


def _manipulator(table: Table) -> ManipulatorSpec:
    pose = table.table("pose", None)
    spec = ManipulatorSpec(
        source=_source(table, sidecar=True),
        name=table.text("name", "manipulator"),
        position=table.vector("position", (0.0, 0.0, 0.0)),
        rotation=table.vector("rotation", (0.0, 0.0, 0.0)),
        pose={joint: _angles(pose, joint) for joint in pose.values},
    )
    table.done()
    return spec


def _object(table: Table) -> ObjectSpec:
    solids = table.texts("solids", ("surface",))
    for kind in solids:
        if kind not in ("surface", "hull"):
            raise InvalidInput(f"{table.where}.solids holds 'surface' and 'hull', but got {kind!r}.")
    box = table.table("hull_box", None)
    spec = ObjectSpec(
        source=_source(table),
        name=table.text("name", "object"),
        center=table.vector("center", (0.0, 0.0, 0.0)),
        rotation=table.vector("rotation", (0.0, 0.0, 0.0)),
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
    elif table.raw(kind) == []:
        raise InvalidInput(f"{table.where}.{kind} holds no point; a patch has at least one.")
    axis = table.table("axis", None)
    place = table.table("place") if "place" in table else None
    spec = PatchSpec(
        name=name,
        on=table.text("on", None),
        onto=table.text("onto", None),
        vertices=table.counts("vertices", ()),
        positions=table.vectors("positions", ()),
        disk=disk,
        axis=tuple(_point(point, joint) for point in axis.tables("through")) if "through" in axis else (),
        generator=axis.text("generator", None),
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


def _angles(table: Table, joint: str) -> tuple[float, ...]:
    value = table.raw(joint)
    rows = value if isinstance(value, list) else [value]
    if not 1 <= len(rows) <= 3 or any(type(x) not in (int, float) or not abs(x) <= 360 for x in rows):
        raise InvalidInput(f"{table.where}.{joint} must be one to three angles in degrees, but got {value!r}.")
    return tuple(float(x) for x in rows)


def _solve(table: Table) -> SolveSpec:
    spec = SolveSpec(
        solver=table.text("solver", None),
        start=table.choice("start", ("open", "coarse"), "open"),
        weights=table.vector("weights", (1.0, 1.0, 10.0)),
        penetration=table.number("penetration", 5.0, at_least=0.0),
        limits=table.flag("limits", True),
        settle=table.count("settle", 0, at_most=10),
        slide=table.number("slide", 0.0, at_least=0.0, at_most=1.0),
        options=_solve_options(table.table("options", None)),
    )
    table.done()
    if min(spec.weights) < 0:
        raise InvalidInput(f"{table.where}.weights are not negative, but got {list(spec.weights)}.")
    return spec


def _solve_options(table: Table) -> dict[str, Any]:
    """What every solver understands is checked here; what is left is the solver's own, which checks it itself."""
    options = {key: table.raw(key) for key in table.values}
    table.count("max_iterations", 1, at_least=1)
    table.number("tolerance", 0.0, at_least=0.0)
    table.count("seed", 0, at_most=2**32 - 1)
    if "candidates" in table:
        options["candidates"] = table.texts("candidates")
    return options


def _accept(table: Table) -> dict[str, float]:
    limits = {key: table.number(key) for key in ACCEPT if key in table}
    for key in ACCEPT:
        table.raw(key, None)
    table.done()
    return limits


def _view(table: Table) -> ViewSpec:
    size = table.counts("size", [1600, 640])
    if len(size) != 2 or not all(64 <= n <= 8192 for n in size):
        raise InvalidInput(
            f"{table.where}.size must be [width, height] of 64 to 8192 pixels, but got {list(size)}."
        )
    spec = ViewSpec(
        camera_from=table.vector("camera_from", None, direction=True),
        up=table.vector("up", (0.0, 1.0, 0.0), direction=True),
        size=(size[0], size[1]),
    )
    table.done()
    return spec
