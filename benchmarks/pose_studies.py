"""The paper's posing experiments, measured: ablation, kinds of contacts, the wrap, the chair, fingers together.

    python benchmarks/pose_studies.py [--out docs]

Writes docs/pose-studies.md and pictures into docs/images. Scenes: two recipes of examples/ (a ball held by the
fingertips, and with the palm) and the built-in tentacle, pole, body and chair.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from pose_scenes import LEGS, STAGES, chair, wrap

from contact_builtins.solvers.stepwise import ProgressiveSolver, StagedSolver
from contact_core.arrays import FloatArray
from contact_core.geometry.distance_field import DistanceField
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.transform import transform_points
from contact_core.job.run import prepare
from contact_core.plugins.manager import PluginManager
from contact_core.recipe.reader import load_recipe
from contact_core.rig.poses import blend
from contact_core.rig.rig import skin
from contact_core.scene.picture import Picture, PictureMesh
from contact_core.solve.body import PairedPoints
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.problem import Limits, PoseProblem
from contact_core.solve.solver import PoseSolution, PoseSolver, SolveOptions, patch_residuals, posed_mesh
from contact_core.solve.terms import DistanceTerm, PriorTerm, paper_terms
from contact_gallery.thinned import PAPER_WEIGHTS, thinned_to
from contact_viewer.renderer import PyVistaRenderer

REPOSITORY = Path(__file__).resolve().parents[1]
SKIN, OBJECT = (0.85, 0.7, 0.6), (0.75, 0.78, 0.85)
BACKDROP = ("floor", "pole")
COLORS = {"chair": (0.65, 0.5, 0.35), "floor": (0.8, 0.8, 0.8), "pole": (0.6, 0.6, 0.65)}
# Weights of distance, normal and prior, and whose limits hold.
WITHOUT: dict[str, tuple[tuple[float, float, float], Limits]] = {
    "all": ((1.0, 1.0, 10.0), "rig"),
    "no distance": ((0.0, 1.0, 10.0), "rig"),
    "no normals": ((1.0, 0.0, 10.0), "rig"),
    "no prior": ((1.0, 1.0, 0.0), "rig"),
    "no limits": ((1.0, 1.0, 10.0), "none"),
    "no limits, no prior": ((1.0, 1.0, 0.0), "none"),
}


@dataclass(frozen=True, eq=False)
class Judged:
    """One solved pose in figures: shares of the manipulator's length in %, fractions in %, degrees."""

    gap: float
    opposed: float
    worst: float
    deepest: float
    inside: float
    angle: float
    solution: PoseSolution

    def row(self, name: str) -> str:
        return (
            f"| {name} | {self.gap:.2f} | {self.opposed:.0f} | {self.worst:.0f} | {self.deepest:.2f} |"
            f" {self.inside:.1f} | {self.angle:.0f} |"
        )


HEADER = (
    "| | distance % | opposed % | worst patch within 45° % | deepest % | skin inside % | largest angle ° |\n"
    "|---|---|---|---|---|---|---|"
)


def judged(full: PoseProblem, solution: PoseSolution) -> Judged:
    """Figures of a solution on the contacts of `full`, whatever it was solved with."""
    full = replace(full, limits=solution.problem.limits)
    theta = full.theta_of(solution.poses)
    residuals = patch_residuals(full, theta)
    state, length = full.state(theta), full.manipulator_length
    gap = np.linalg.norm(state.vectors(full.pairs.gap), axis=1)
    world = state.motions[1].world[0] @ np.linalg.inv(full.bodies[1].rig.bind_world[0])
    into = np.linalg.inv(world)
    points = transform_points(into, skin(full.bodies[0].rig, state.motions[0].world))
    depth = -DistanceField.of(full.bodies[1].rig.surface, resolution=128).sample(points)[0]
    inner = ~(full.is_root | full.is_translation)
    return Judged(
        gap=100.0 * float(gap.mean()) / length,
        opposed=100.0 * float(np.mean([r.opposed for r in residuals.values()])),
        worst=100.0 * min(r.opposed_45 for r in residuals.values()),
        deepest=100.0 * max(float(depth.max()), 0.0) / length,
        inside=100.0 * float((depth > 0.0).mean()),
        angle=float(np.degrees(np.abs(theta[inner])).max()),
        solution=solution,
    )


def grip(recipe: str) -> PoseProblem:
    """The problem of an example recipe, with the paper's three terms."""
    plugins = PluginManager()
    job = prepare(load_recipe(REPOSITORY / "examples" / recipe), plugins)
    return job.session.problem()


def ablation(name: str, problem: PoseProblem, solver: PoseSolver) -> tuple[list[str], list[Judged]]:
    """All terms, and each left out."""
    rows, results = [f"### {name}", "", HEADER], []
    for label, (weights, limits) in WITHOUT.items():
        solved = solver.solve(replace(problem, terms=paper_terms(*weights), limits=limits), SolveOptions())
        results.append(judged(problem, solved))
        rows.append(results[-1].row(label))
    return [*rows, ""], results


def kinds(name: str, problem: PoseProblem) -> list[str]:
    """Point, curve and area contacts in the paper's weights, judged on the areas; how far the skins are apart."""
    rows = [f"### {name}", "", HEADER]
    solved = {}
    for kind in ("area", "curve", "point"):
        thin = replace(thinned_to(problem, kind), terms=paper_terms(*PAPER_WEIGHTS[kind]))
        solved[kind] = LevenbergMarquardt().solve(thin)
        rows.append(judged(problem, solved[kind]).row(kind))
    rows += ["", f"Skin of the curve pose from the area pose: {apart(problem, solved['area'], solved['curve'])}."]
    rows += [f"Skin of the point pose from the area pose: {apart(problem, solved['area'], solved['point'])}."]
    if any(contact.name.startswith("palm") for contact in problem.contacts):
        for angle in (45.0, 90.0):
            thin = replace(thinned_to(problem, "curve", angle), terms=paper_terms(*PAPER_WEIGHTS["curve"]))
            turned = LevenbergMarquardt().solve(thin)
            away = apart(problem, solved["curve"], turned)
            rows.append(f"Palm curve turned by {angle:.0f}°: {away} from unturned.")
    return [*rows, ""]


def apart(problem: PoseProblem, one: PoseSolution, two: PoseSolution) -> str:
    """Mean and largest distance of the skins of two poses."""
    rig = problem.bodies[0].rig
    skins = [skin(rig, problem.state(problem.theta_of(s.poses)).motions[0].world) for s in (one, two)]
    away = 100.0 * np.linalg.norm(skins[0] - skins[1], axis=1) / problem.manipulator_length
    return f"mean {away.mean():.2f} %, largest {away.max():.2f} %"


def wraps() -> tuple[list[str], list[Picture]]:
    """The tentacle round the pole: all contacts at once and one joint after another, at several scales."""
    rows, pictures = [HEADER], []
    for along in (1.0, 0.8, 0.62):
        scene = wrap(along)
        for solver in (LevenbergMarquardt(), ProgressiveSolver()):
            result = judged(scene.problem, solver.solve(scene.problem))
            rows.append(result.row(f"strip x {along:g}, {solver.name}, {result.solution.seconds:.1f} s"))
            if along == 0.8:
                pictures.append(picture(scene.problem, result.solution.theta, scene.camera_from, solver.name))
    return [*rows, ""], pictures


def seated() -> tuple[list[str], list[Picture]]:
    """The chair by stages, and 24 frames from standing to sitting with the feet held by their contacts."""
    scene = chair()
    problem, length = scene.problem, scene.problem.manipulator_length
    sit = StagedSolver(STAGES).solve(problem)
    rows = ["| contact | distance % of the body | within 45° % |", "|---|---|---|"]
    for name, patch in sit.patches.items():
        rows.append(f"| {name} | {100.0 * patch.mean / length:.2f} | {100.0 * patch.opposed_45:.0f} |")
    feet = tuple(contact for contact in problem.contacts if contact.name.startswith("foot"))
    body = problem.bodies[0]
    standing = replace(problem, contacts=feet, terms=paper_terms(), length=length)
    local = body.rig.rest_local.copy()
    local[0, 2, 3] += 0.36
    standing = replace(standing, bodies=(replace(body, pose=replace(body.pose, local=local)), *problem.bodies[1:]))
    stand = LevenbergMarquardt().solve(standing)
    slide, first, pictures = 0.0, np.zeros(0), []
    for frame in range(25):
        pose = blend(body.rig, stand.poses["body"], sit.poses["body"], frame / 24.0)
        held = replace(
            standing,
            bodies=(replace(body, pose=pose), *problem.bodies[1:]),
            free={"body": LEGS},
            prior={"body": pose},
        )
        solved = LevenbergMarquardt().solve(held, SolveOptions(candidates=("current",)))
        soles = held.state(solved.theta).vectors(held.pairs.manipulator_points)
        first = soles if frame == 0 else first
        slide = max(slide, 100.0 * float(np.linalg.norm(soles - first, axis=1).max()) / length)
        if frame in (0, 12):
            pictures.append(picture(held, solved.theta, scene.camera_from, f"frame {frame}"))
    pictures.append(picture(problem, sit.theta, scene.camera_from, "seated"))
    rows += ["", f"Solve {sit.seconds:.2f} s ({sit.status.name})."]
    rows += [f"Feet over 24 in-between frames: at most {slide:.2f} % of the body's length."]
    return [*rows, ""], pictures


def together(problem: PoseProblem) -> list[str]:
    """Index and middle finger of one hand, closed by a pair of patches between them."""
    rig = problem.bodies[0].rig
    surface = rig.surface
    owner = rig.skin_joints[rig.faces[:, 0], 0]
    names = ("index-finger-phalanx-intermediate", "middle-finger-phalanx-intermediate")
    ends: list[SurfacePoints] = []
    centres = [rig.rest_world[rig.joint_index(name), :3, 3] for name in names]
    toward = (centres[1] - centres[0]) / np.linalg.norm(centres[1] - centres[0])
    for joint, side in zip(names, (toward, -toward), strict=True):
        faces = np.flatnonzero(owner == rig.joint_index(joint))
        best = faces[np.argsort(surface.face_normals[faces] @ side)[-40:]]
        ends.append(SurfacePoints(best, np.full((len(best), 3), 1.0 / 3.0)))
    one, two = (end[np.argsort(end.positions(surface)[:, 2])] for end in ends)
    name = problem.bodies[0].name
    pair = PairedPoints("fingers", name, one, name, two)
    alone = PoseProblem(problem.bodies[:1], (pair,), terms=(DistanceTerm(), PriorTerm(1.0)))
    solved = LevenbergMarquardt().solve(alone)
    before, after = (_between(alone, theta) for theta in (alone.start, solved.theta))
    return [f"Distance between the patches' centres: {before:.2f} % of the length before, {after:.2f} % after.", ""]


def _between(problem: PoseProblem, theta: FloatArray) -> float:
    gap = problem.state(theta).vectors(problem.pairs.gap).mean(axis=0)
    return 100.0 * float(np.linalg.norm(gap)) / problem.manipulator_length


def picture(problem: PoseProblem, theta: FloatArray, camera: tuple[float, float, float], caption: str) -> Picture:
    """All bodies of a problem, posed; the long pole and the wide floor may run out of the frame."""
    state = problem.state(theta)
    meshes = {body.name: posed_mesh(problem, state, body.name) for body in problem.bodies}
    colors = [SKIN, *(COLORS.get(body.name, OBJECT) for body in problem.bodies[1:])]
    focus = np.concatenate([mesh.points for name, mesh in meshes.items() if name not in BACKDROP])
    drawn = tuple(PictureMesh(mesh, color) for mesh, color in zip(meshes.values(), colors, strict=True))
    return Picture(drawn, camera_from=camera, caption=caption, focus=focus)


def draw(pictures: Sequence[Picture], path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    PyVistaRenderer().render(pictures, path, size=(420 * len(pictures), 420))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=REPOSITORY / "docs")
    out = parser.parse_args().out
    tips, palm = grip("01_ball_fingertips.toml"), grip("02_ball_palm.toml")
    text = [(Path(__file__).parent / "pose_studies_head.md").read_text(encoding="utf-8"), "## Ablation", ""]
    for name, problem, solver, camera in (
        ("tentacle", wrap().problem, ProgressiveSolver(), wrap().camera_from),
        ("ball with palm", palm, LevenbergMarquardt(), (0.3, 1.0, 0.5)),
        ("ball, fingertips", tips, LevenbergMarquardt(), (0.3, 1.0, 0.5)),
    ):
        rows, results = ablation(name, problem, solver)
        text += rows
        pictures = [
            picture(r.solution.problem, r.solution.theta, camera, label)
            for label, r in zip(WITHOUT, results, strict=True)
        ]
        draw(pictures, out / "images" / f"ablation-{name.split()[0].strip(',')}-{len(problem.contacts)}.png")
    text += ["## Kinds of contacts", "", *kinds("ball with palm", palm), *kinds("ball, fingertips", tips)]
    rows, pictures = wraps()
    text += ["## The wrap", "", *rows]
    draw(pictures, out / "images" / "wrap.png")
    rows, pictures = seated()
    text += ["## The chair", "", *rows]
    draw(pictures, out / "images" / "chair.png")
    text += ["## Fingers together", "", *together(palm)]
    (out / "pose-studies.md").write_text("\n".join(text), encoding="utf-8")
    print("\n".join(text))


if __name__ == "__main__":
    main()
