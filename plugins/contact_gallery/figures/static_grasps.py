"""Grasps of four manipulators: human, witch, alien, tentacle.

Each is a recipe: pads by joint, roughly how the object lies in the hand, and what a grasp has to reach to be called
one, stretched skin and depth included. `contact pose RECIPE.toml --out DIR` runs the same recipes from the command
line.
"""

from functools import partial
from importlib.resources import files

import numpy as np

import contact_core as contact
from contact_builtins.demos import demo_recipe
from contact_core.geometry.raycast import Locator
from contact_core.geometry.transform import transform_points
from contact_core.job.run import perform
from contact_core.recipe.reader import parse_recipe
from contact_core.recipe.recipe import Recipe
from contact_core.scene.picture import Picture
from contact_gallery.looks import LOOKS, SKIN, deepest, view
from contact_gallery.sheet import Sheet, timed

PAPER = "Figures 1, 6 and 8"
Vector = tuple[float, float, float]
LARGE = 0.5  # metres: of what is larger, the picture shows where it is held
WRAPS: tuple[tuple[str, int, Vector, Vector, Vector], ...] = (
    ("pole", 5, (0.05, 0.3, 0.0), (0.0, 0.4, 1.0), (1.0, 0.3, 0.7)),
    ("mug", 10, (0.03, 0.03, 0.05), (-1.0, 0.1, 0.3), (0.2, 0.5, 1.0)),
    ("baseball", 12, (0.0, 0.0, 0.05), (-1.0, 0.3, 0.0), (0.3, 0.4, 1.0)),
    ("chair", 8, (0.25, 0.2, 0.2), (0.0, 0.35, 1.0), (1.0, 0.3, 0.9)),
)
ROWS = (
    ("mug", "baseball", "pole", "human_rabbit"),
    ("witch", "witch_pole", "witch_ball", "witch_rabbit"),
    ("alien", "alien_ball", "alien_mug", "alien_rabbit"),
)


def draw(sheet: Sheet) -> None:
    for names in ROWS:
        pictures = []
        for name in names:
            recipe = recipe_of(name)
            job, spent = timed(partial(perform, recipe, sheet.plugins))
            sheet.recipe(recipe.title, job, spent)
            geometry = job.session.geometry
            thing, standing = geometry.mesh("object"), job.session.document.surface("object").world_from_surface
            small = thing.bounding_box_diagonal < LARGE
            shown = [thing.points] if small else [pair.object_points.positions(thing) for pair in geometry.pairs()]
            around = np.concatenate(
                [transform_points(standing, np.concatenate(shown)), geometry.posed_mesh("manipulator").points]
            )
            kind = recipe.manipulators[0].source.sample or ""
            skin = next((color for word, color in LOOKS.items() if kind.startswith(word)), SKIN)
            pictures.append(
                view(
                    job.session,
                    camera_from=recipe.view.camera_from or (0.6, 0.4, 1.0),
                    up=recipe.view.up,
                    caption=recipe.title,
                    colors={"manipulator": skin},
                    focus=around,
                    axes=False,
                )
            )
            apart, deep = (
                100.0 * (job.metrics[key] or 0.0) for key in ("mean_contact_distance", "max_penetration")
            )
            told = f"contacts {apart:.1f} % of a hand apart, skin {deep:.1f} % deep, {spent:.1f} s in all"
            judged = "a grasp" if job.verdict.is_grasp else job.verdict.failures[0]
            sheet.measure(recipe.title, f"{told}; {judged}")
        sheet.show(*pictures)
    sheet.show(*(wrapped(sheet, *wrap) for wrap in WRAPS))


def wrapped(sheet: Sheet, thing: str, first: int, start: Vector, way: Vector, camera: Vector) -> Picture:
    """The tentacle round an object: a strip along its flat side from joint `first`, one transfer, one solve."""
    with contact.new(tentacle="sample:tentacle", thing=f"sample:{thing}", plugins=sheet.plugins) as session:
        rig, skin = session.rigs["tentacle"], session.geometry.mesh("tentacle")
        along = Locator.of(skin).closest(rig.rest_world[first:20, :3, 3] + np.array([0.0, 0.0, 0.05])).points
        widths = np.linspace(0.014, 0.004, 14)[first - 5 :]
        strokes = [
            contact.BrushGesture(skin, along[k : k + 2], radius=w, spacing=0.35 * w) for k, w in enumerate(widths)
        ]
        with sheet.counting(session, f"The tentacle takes a {thing}"):
            session.patches.brush("disk", "strip", *strokes, surface="tentacle", axis=along)
            root = Locator.of(session.geometry.mesh("thing")).closest([start]).points
            copy = session.patches.transfer("strip", "thing", root, direction=way)
            session.patches.scale(copy, along=0.8)  # the inner side of a bend is shorter than the skin at rest
            session.pairs.add("strip", copy, name="strip")
            proposal, spent = timed(lambda: session.solve(solver="progressive", terms=["penetration"]))
            session.accept(proposal)
        apart, deep = proposal.after.patches["strip"].mean / 0.006, deepest(session, "tentacle", "thing") / 0.006
        told = f"contacts {apart:.1f} % of its length apart, skin {deep:.1f} % deep, {spent:.2f} s"
        sheet.measure(f"The tentacle takes a {thing}", told)
        held = session.geometry.points(copy).positions(session.geometry.mesh("thing"))
        near = np.concatenate([held - 0.07, held + 0.07])
        return view(session, camera_from=camera, caption=f"The tentacle takes a {thing}", focus=near, axes=False)


def recipe_of(name: str) -> Recipe:
    """A demo of the package, or a recipe of the gallery."""
    own = files("contact_gallery.grasps") / f"{name}.toml"
    return parse_recipe(own.read_text(encoding="utf-8"), name=name) if own.is_file() else demo_recipe(name)
