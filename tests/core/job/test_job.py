"""The job on the built-in samples: what it writes, that it is repeatable, and how it refuses."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contact_builtins.demos import demo_names, demo_recipe
from contact_core.document.schema import parse_document
from contact_core.errors import Cancelled, ContactError, FileRefused, InvalidInput
from contact_core.geometry.hull import convex_hull
from contact_core.job.job import Job
from contact_core.job.outputs import write_outputs
from contact_core.job.points import painted_points
from contact_core.job.run import perform, run, target
from contact_core.plugins.manager import PluginManager
from contact_core.progress import CallbackProgress
from contact_core.recipe.reader import parse_recipe
from contact_core.recipe.recipe import AssetSource, PatchSpec, PointSpec, Recipe, RootSpec
from contact_core.recipe.sources import inputs_of
from contact_core.rig.pose_files import load_pose
from contact_core.scene.picture import Picture
from contact_core.testing.meshes import icosphere, torus

HAND = "manipulator"


@cache
def plugins() -> PluginManager:
    return PluginManager()


@cache
def demo(name: str = "mug") -> Job:
    return perform(demo_recipe(name), plugins())


@pytest.mark.parametrize("name", demo_names())
def test_every_demo_is_what_it_says(name: str) -> None:
    job = demo(name)
    assert job.verdict.is_grasp == (name != "bad"), job.verdict.failures
    assert job.start_distance[HAND] >= job.length(HAND)
    assert job.metrics["contacts"] >= 300


def test_the_demo_keeps_grasp() -> None:
    """The row of the acceptance table: built-in hand on built-in mug, depth against the filled mug too."""
    job = demo()
    most = {
        "mean_contact_distance": 2.0,
        "p95_contact_distance": 4.5,
        "gap": 1.3,
        "max_penetration": 1.8,
        "skin_inside": 3.0,
    }
    least = {"opposed_normals": 92, "opposed_normals_45": 60, "worst_patch_opposed_45": 20}
    assert all(100 * job.metrics[key] <= limit for key, limit in most.items())
    assert all(100 * job.metrics[key] >= limit for key, limit in least.items())
    assert job.metrics["bones_through"] == 0 and job.metrics["skin_stretch_p99"] < 1.6
    assert job.metrics["max_joint_change_deg"] <= 120
    names = " ".join(job.metrics["patches"])
    assert all(digit in names for digit in ("palm", "thumb", "index", "middle", "ring", "little"))
    assert len(job.solids["object"]) == 2


@pytest.mark.parametrize("name", ["mug", "pole"])
def test_the_thumb_opposes_the_fingers(name: str) -> None:
    """What makes a grip a grip: the surface under the thumb looks the other way than under the other contacts."""
    job = demo(name)
    pairs = {pair.pair.name: pair.object_points for pair in job.session.geometry.pairs()}
    normals = {name: points.normals(job.assets["object"].mesh).mean(axis=0) for name, points in pairs.items()}
    thumb = normals.pop("thumb_distal")
    others = np.mean(list(normals.values()), axis=0)
    assert thumb @ others < -0.5 * np.linalg.norm(thumb) * np.linalg.norm(others)


def test_the_bad_demo_names_what_failed() -> None:
    verdict = demo("bad").verdict
    assert verdict.failed_patches and any("penetration" in failure for failure in verdict.failures)


class Sketch:
    """A renderer that keeps what it was given and writes a token."""

    name = "sketch"
    summary = "draws nothing but remembers"
    priority = 10_000

    def __init__(self) -> None:
        self.pictures: list[Picture] = []

    def unavailable(self) -> str | None:
        return None

    def render(self, pictures: Any, path: Path, *, size: tuple[int, int] = (1280, 720)) -> None:
        self.pictures = list(pictures)
        path.write_bytes(b"drawn")


class Broken(Sketch):
    name = "broken"
    priority = 20_000

    def render(self, pictures: Any, path: Path, *, size: tuple[int, int] = (1280, 720)) -> None:
        raise FileRefused("libEGL is missing")


class Plugin:
    """Offers renderers above all others."""

    def __init__(self, *renderers: Sketch) -> None:
        from contact_core.plugins import hookimpl

        self.contact_renderers = hookimpl(lambda: list(renderers), specname="contact_renderers")


def with_renderers(*renderers: Sketch) -> PluginManager:
    return PluginManager([Plugin(*renderers)])


def test_a_job_writes_its_files_and_they_can_be_read_again(tmp_path: Path) -> None:
    sketch = Sketch()
    manager = with_renderers(Broken(), sketch)
    told: list[tuple[float, str]] = []
    progress = CallbackProgress(lambda fraction, text: told.append((fraction or 0.0, text)))
    result = run(demo_recipe("alien"), tmp_path / "out", plugins=manager, progress=progress)
    names = {"document.json", "pose.json", "posed.glb", "scene.contactscene", "picture.png", "report.json"}
    assert {path.name for path in (tmp_path / "out").iterdir()} == names == {p.name for p in result.files.values()}
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report == json.loads(json.dumps(dict(result.report)))
    assert report["renderer"] == "sketch" and any("libEGL is missing" in note for note in report["notes"])
    assert report["solver"] == "levenberg-marquardt" and report["inputs"]["recipe"]["name"] == "alien"
    assert "sample" in report["inputs"]["manipulator"] and "sample" in report["inputs"]["object"]
    assert set(report["seconds"]) >= {"read", "parameterize", "transfer", "solve", "render"}
    assert {"dofs", "iterations", "status", "verdict", "definitions"} <= set(report)
    assert set(report["definitions"]) >= set(report["limits"])
    fractions = [fraction for fraction, _ in told]
    assert fractions == sorted(fractions) and fractions[-1] == 1.0

    document = parse_document((tmp_path / "out" / "document.json").read_bytes(), "document.json")
    pose, stored = load_pose(tmp_path / "out" / "pose.json"), document.poses[HAND]
    assert pose.joints == stored.joints
    np.testing.assert_array_equal(pose.local, stored.local)
    assert len(document.pairs) == len(report["patches"])

    before, after, through = sketch.pictures
    assert len(before.points) == len(after.points) == len(through.points) == 2 * len(report["patches"])
    assert before.table[0][:2] == ("solved pose", "a grasp")
    assert [name for name, _ in before.legend] == list(report["patches"])
    assert len({color for _, color in before.legend}) == len(before.legend)
    assert through.meshes[0].opacity < 1.0 == through.meshes[1].opacity
    for pair in before.lines:  # pair lines join skin and object: long before, short after
        assert np.linalg.norm(pair[0][:, 1] - pair[0][:, 0], axis=1).min() > 0.5 * report["manipulator_length"]


def test_the_posed_model_is_the_pose(tmp_path: Path) -> None:
    job = demo("alien")
    result = run(demo_recipe("alien"), tmp_path, plugins=with_renderers(Sketch()))
    import trimesh

    scene = trimesh.load(result.files["model"])
    assert len(scene.geometry) == 2
    skin = job.session.geometry.posed_mesh(HAND)
    assert any(len(mesh.faces) == len(skin.faces) for mesh in scene.geometry.values())


def test_the_same_recipe_gives_the_same_bytes(tmp_path: Path) -> None:
    manager = with_renderers(Sketch())
    for place in ("one", "two"):
        run(demo_recipe("alien"), tmp_path / place, plugins=manager)
    for name in ("document.json", "pose.json", "posed.glb", "scene.contactscene"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


@pytest.mark.parametrize("stop", [0.0, 0.3, 0.45, 0.5, 1.0])
def test_cancelling_writes_nothing(tmp_path: Path, stop: float) -> None:
    def watch(fraction: float | None, _: str) -> None:
        if fraction is None or fraction >= stop:
            raise Cancelled("enough")

    with pytest.raises(Cancelled, match="nothing was written"):
        run(
            demo_recipe("alien"),
            tmp_path / "out",
            plugins=with_renderers(Sketch()),
            progress=CallbackProgress(watch),
        )
    assert not (tmp_path / "out").exists()


def test_explicit_roots_and_headings_are_used_as_given() -> None:
    """Two patches with a place of their own: by direction, and by a second point to aim at."""
    recipe = demo_recipe("alien")
    root = PointSpec(position=(0.03, 0.62, 0.0))
    by_direction = RootSpec(root, direction=(0.0, 1.0, 0.0))
    by_aim = RootSpec(root, aim=PointSpec(position=(0.03, 0.70, 0.0)))
    for place in (by_direction, by_aim):
        first, *others = recipe.patches
        job = perform(replace(recipe, patches=(replace(first, place=place), *others)), plugins())
        axis = job.session.geometry.axis(target(first.name)).points.positions(job.assets["object"].mesh)
        assert np.linalg.norm(axis[0] - [0.03, 0.62, 0.0]) < 3e-3
        way = axis[-1] - axis[0]
        assert way[1] / np.linalg.norm(way) > 0.95
        assert first.name not in job.left_out


def posing(recipe: Recipe, **changes: Any) -> Recipe:
    return replace(recipe, manipulators=(replace(recipe.manipulators[0], **changes),))


def touching(recipe: Recipe, **changes: Any) -> Recipe:
    return replace(recipe, objects=(replace(recipe.objects[0], **changes),))


def _patched(recipe: Recipe, **changes: Any) -> Recipe:
    return replace(recipe, patches=(replace(recipe.patches[0], **changes),))


REFUSALS: dict[str, tuple[Any, str]] = {
    "a manipulator without bones": (
        lambda r: posing(r, source=AssetSource(sample="mug")), "has no skeleton"
    ),
    "an unknown sample": (lambda r: posing(r, source=AssetSource(sample="tail")), "tail"),
    "a file that is nowhere": (
        lambda r: posing(r, source=AssetSource(file="nowhere.glb")), "nowhere.glb is not beside the recipe"
    ),
    "an unknown joint": (
        lambda r: _patched(r, disk=replace(r.patches[0].disk, at=PointSpec(joint="thumb_dist"))), "near names"
    ),
    "a vertex that does not exist": (lambda r: _patched(r, disk=None, vertices=(10**6,)), "has vertices 0..3816"),
    "an unknown generator": (lambda r: _patched(r, generator="vertical"), "there is no axis generator 'vertical'"),
    "an unknown placer": (lambda r: replace(r, placer="magic"), "there is no placer 'magic'"),
    "a misspelt setting": (
        lambda r: replace(r, placer_options={**r.placer_options, "thumbs": "x"}), "did you mean 'thumb'"
    ),
    "a pattern without joints": (
        lambda r: replace(r, placer_options={**r.placer_options, "close": ["toe*"]}), "no joint of .* matches 'toe"
    ),
    "an approach that misses": (
        lambda r: touching(r, center=(5.0, 0, 0)), "passes the object"
    ),
    "a coarse pose of no joint": (lambda r: posing(r, pose={"toe": (3.0,)}), "toe"),
    "too many angles": (
        lambda r: posing(r, pose={"thumb_tip": (3.0, 2.0)}), "has 0 angles, but got 2"
    ),
    "an object of another unit": (
        lambda r: touching(r, scale=1e-9), "across; mend object.scale, or the units"
    ),
    "a disk larger than the hand": (
        lambda r: _patched(r, disk=replace(r.patches[0].disk, radius=1e9)), "radius is 1e.09, but .* units across"
    ),
    "a direction into the object": (
        lambda r: _patched(r, place=RootSpec(PointSpec(position=(1.0, 0.6, 0.0)), direction=(1.0, 0.0, 0.0))),
        "stands upright on the object",
    ),
    "settings that a generator has not": (
        lambda r: _patched(r, generator_options={"bend": 3}), "has no setting 'bend'; its settings: none"
    ),
    "nothing near": (
        lambda r: replace(r, placer_options={**r.placer_options, "far": 1e-9}), "the hand is not near the object"
    ),
    "an unknown solver": (lambda r: replace(r, solve=replace(r.solve, solver="guess")), "there is no pose solver"),
    "a wrong solver setting": (
        lambda r: replace(r, solve=replace(r.solve, options={"candidates": ["luck"]})), "candidates is one of"
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSALS)
def test_what_cannot_be_done_is_a_sentence(case: str, tmp_path: Path) -> None:
    change, says = REFUSALS[case]
    with pytest.raises(ContactError, match=says):
        run(change(demo_recipe("alien")), tmp_path / "out", plugins=plugins())
    assert not (tmp_path / "out").exists()


def test_a_folder_that_cannot_be_written_is_told_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("mine")
    (tmp_path / "out" / "report.json").mkdir(parents=True)
    told: list[str] = []
    progress = CallbackProgress(lambda _, text: told.append(text))
    for out, says in (("taken", "is not a folder"), ("taken/below", "is not a folder"), ("out", "it is a folder")):
        with pytest.raises(FileRefused, match=says):
            run(
                demo_recipe("alien"),
                tmp_path / out,
                plugins=plugins(),
                progress=progress,
            )
    assert not told and (tmp_path / "taken").read_text() == "mine"
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["report.json"]


class Late(Sketch):
    """A renderer in whose time something happens that nobody expects."""

    def __init__(self, event: BaseException) -> None:
        super().__init__()
        self.event = event

    def render(self, pictures: Any, path: Path, *, size: tuple[int, int] = (1280, 720)) -> None:
        raise self.event


@pytest.mark.parametrize("event", [KeyboardInterrupt(), OSError(28, "No space left on device"), MemoryError()])
def test_what_ends_a_job_while_it_writes_leaves_the_old_results_whole(event: BaseException, tmp_path: Path) -> None:
    run(demo_recipe("alien"), tmp_path / "out", plugins=with_renderers(Sketch()))
    before = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}
    for place in ("out", "new"):
        with pytest.raises((type(event), FileRefused)):
            run(demo_recipe("pole"), tmp_path / place, plugins=with_renderers(Late(event)))
    assert {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()} == before
    assert not (tmp_path / "new").exists()


def test_a_picture_of_an_earlier_run_does_not_stay_beside_a_report_without_one(tmp_path: Path) -> None:
    run(demo_recipe("alien"), tmp_path, plugins=with_renderers(Sketch()))
    assert (tmp_path / "picture.png").exists()
    (tmp_path / "notes.txt").write_text("mine")
    nothing_draws_or_exports = PluginManager([Plugin(Broken())], discover=False)
    result = write_outputs(demo("alien"), tmp_path, nothing_draws_or_exports)
    assert set(result.files) == {"document", "pose", "scene", "report"}
    assert {path.name for path in tmp_path.iterdir()} == {
        "document.json",
        "pose.json",
        "scene.contactscene",
        "report.json",
        "notes.txt",
    }


def test_a_report_is_json_whatever_was_measured(tmp_path: Path) -> None:
    job = perform(demo_recipe("alien"), plugins())
    job.metrics = {**job.metrics, "gap": float("nan")}
    job.seconds["solve"] = float("inf")
    write_outputs(job, tmp_path, with_renderers(Sketch()))
    text = (tmp_path / "report.json").read_text()
    report = json.loads(text, parse_constant=lambda word: pytest.fail(f"{word} is no JSON"))
    assert (
        report["gap"] is None
        and report["seconds"]["solve"] is None
        and report["contacts"] == job.metrics["contacts"]
    )


def test_settling_moves_contacts_and_never_happens_unasked() -> None:
    recipe = demo_recipe("alien")
    settled = perform(replace(recipe, solve=replace(recipe.solve, settle=1)), plugins())
    plain = demo("alien")
    labels = [step.command.label() for step in settled.session.history.steps]
    assert "Settle contacts" in labels
    assert not any(step.command.label().startswith("Translate") for step in plain.session.history.steps)
    assert settled.metrics["gap"] <= 1.2 * plain.metrics["gap"]


def test_a_hull_holds_all_points_and_looks_outwards() -> None:
    mesh = torus()
    hull = convex_hull(mesh)
    centre = hull.points[np.unique(hull.faces)].mean(axis=0)
    middles = hull.points[hull.faces].mean(axis=1)
    assert (np.einsum("mi,mi->m", hull.face_normals, middles - centre) > 0).all()
    low = convex_hull(icosphere(3), high=(1.0, 1.0, 0.0))
    assert low.points[:, 2].max() <= 0.0
    with pytest.raises(InvalidInput, match=r"the box leaves 0 points"):
        convex_hull(mesh, low=(50.0, 50.0, 50.0))


def test_a_patch_by_file_vertices_uses_the_files_own_numbers() -> None:
    spec = PatchSpec("a", vertices=(5, 9))
    job = demo("alien")
    asset = job.assets[HAND]
    points = painted_points(spec, asset, HAND, job.session.geometry).positions(asset.mesh)
    vertices = np.array([5, 9]) if asset.source_vertices is None else asset.source_vertices[[5, 9]]
    np.testing.assert_allclose(points, asset.mesh.points[vertices])


def test_two_hands_take_one_pole_each_from_its_own_place(tmp_path: Path) -> None:
    """Any number of manipulators: the second hand, further along the pole, does what the first does."""
    recipe = demo_recipe("alien")
    (first,), along = recipe.manipulators, (0.0, 0.0, 0.0)
    (pole,) = recipe.objects
    extent = perform(recipe, plugins()).assets["object"].mesh.points
    shift = 0.2 * float(np.ptp(extent, axis=0).max())
    along = (shift, 0.0, 0.0) if abs(pole.rotation[2]) == 90.0 else (0.0, shift, 0.0)
    hands = (replace(first, name="left"), replace(first, name="right", position=along))
    patches = [
        replace(spec, name=f"{hand.name} {spec.name}", on=hand.name) for hand in hands for spec in recipe.patches
    ]
    both = replace(recipe, manipulators=hands, patches=tuple(patches))
    result = run(both, tmp_path, plugins=with_renderers(Sketch()))
    assert {"pose of left", "pose of right"} <= set(result.files)
    assert result.verdict.is_grasp, result.verdict.failures
    alone = demo("alien").metrics
    assert result.report["contacts"] == 2 * alone["contacts"]
    assert result.report["mean_contact_distance"] <= 1.5 * alone["mean_contact_distance"]


def test_two_objects_are_held_by_one_hand() -> None:
    """Any number of objects: the same pole twice, in one place; half of the contacts go to each."""
    recipe = demo_recipe("alien")
    (pole,) = recipe.objects
    poles = (replace(pole, name="upper"), replace(pole, name="lower"))
    patches = [replace(spec, onto=poles[number % 2].name) for number, spec in enumerate(recipe.patches)]
    job = perform(replace(recipe, objects=poles, patches=tuple(patches)), plugins())
    assert job.verdict.is_grasp, job.verdict.failures
    assert {job.session.document.patch(pair.object).surface for pair in job.session.document.pairs.values()} == {
        "upper", "lower",
    }  # fmt: skip
    assert job.metrics["contacts"] == demo("alien").metrics["contacts"]


def test_the_report_names_its_inputs_by_their_content(tmp_path: Path) -> None:
    """Another file, or another word in the recipe, is another digest; a remark in the recipe is not."""
    text = (
        'schema = 1\nname = "x"\n[manipulator]\nfile = "hand.glb"\n[object]\nfile = "thing.obj"\n'
        '[[patch]]\nname = "tip"\nvertices = [1]\n'
    )
    (tmp_path / "hand.glb").write_bytes(b"a hand")
    (tmp_path / "thing.obj").write_bytes(b"a thing")

    def found(text: str = text) -> dict[str, dict[str, str]]:
        return inputs_of(parse_recipe(text, name="x.toml", folder=tmp_path))

    first = found()
    assert first["object"] == {"file": "thing.obj", "sha256": hashlib.sha256(b"a thing").hexdigest()}
    assert found("# a remark\n" + text) == first
    assert found(text.replace("[1]", "[2]"))["recipe"] != first["recipe"]
    (tmp_path / "hand.glb").write_bytes(b"another")
    assert found()["manipulator"] != first["manipulator"] and found()["object"] == first["object"]
