"""Scenes for the studies of the pose solver, out of built-in samples: a tentacle on a pole, a body on a chair."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contact_builtins.samples import catalogue
from contact_builtins.terms.aims import Look, LookTerm
from contact_core.arrays import FloatArray
from contact_core.contact.axis import draw_axis
from contact_core.contact.patch import parameterize_patch, reconstruct_patch
from contact_core.contact.placement import Root
from contact_core.contact.shape import PatchShape
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import direction_to_heading
from contact_core.rig.rig import Pose, Rig
from contact_core.solve.body import Body, PairedPoints
from contact_core.solve.penetration import PenetrationTerm
from contact_core.solve.problem import PoseProblem
from contact_core.solve.terms import paper_terms


@dataclass(frozen=True, eq=False)
class Scene:
    """A problem, and what makes its picture."""

    problem: PoseProblem
    camera_from: tuple[float, float, float]


def cast(mesh: TriangleMesh, origins: FloatArray, direction: FloatArray) -> SurfacePoints:
    """Where rays along one direction leave the mesh; rays that miss are left out."""
    hits = Locator.of(mesh).cast(origins, np.broadcast_to(direction, origins.shape))
    return hits.points[hits.found]


def rig_of(name: str) -> Rig:
    """The rig of a built-in sample."""
    rig = getattr(catalogue, name).build().rig
    assert rig is not None
    return rig


def wrap(along: float = 0.8, rise: float = 0.32, first: int = 5, last: int = 19) -> Scene:
    """The tentacle beside the pole, with a strip on its flat side from joint `first` to `last`, transferred to a
    helix that rises by `rise` per length. along: the scale of the strip along its axis."""
    rig, pole = rig_of("TENTACLE"), catalogue.POLE.build().mesh
    skin = rig.surface
    inner = np.array([0.0, 0.0, 1.0])
    centres = rig.rest_world[first : last + 1, :3, 3]
    shape_axis, axis = draw_axis(skin, cast(skin, centres, inner))
    width = np.linspace(0.5, 0.35, len(centres))[:, None] * np.linspace(0.035, 0.012, len(centres))[:, None]
    rows = [centres + side * width * [[1.0, 0.0, 0.0]] for side in (-1.0, -0.5, 0.0, 0.5, 1.0)]
    halves = [0.5 * (row[1:] + row[:-1]) for row in rows]
    points = cast(skin, np.concatenate(rows + halves), inner)
    shape = PatchShape(shape_axis, parameterize_patch(skin, axis, points), np.ones(len(points)))
    root = root_near(pole, np.array([0.03, 0.35, 0.0]), np.array([0.0, rise, 1.0]))
    placed = reconstruct_patch(pole, shape, root, replace(shape.axis, along=along, mirrored=True))
    local = rig.rest_local.copy()
    local[0] = np.array([[0, 0, 1, 0.3], [0, 1, 0, 0.1], [-1, 0, 0, 0.0], [0, 0, 0, 1]], float) @ local[0]
    return Scene(
        PoseProblem(
            (Body.skinned(rig, name="tentacle", pose=Pose(rig.joints, local)), Body.rigid("pole", pole)),
            (PairedPoints("strip", "tentacle", points, "pole", placed.points),),
        ),
        (1.0, 0.4, 0.8),
    )


def root_near(mesh: TriangleMesh, near: FloatArray, direction: FloatArray) -> Root:
    """A root at the point of a mesh nearest to `near`, heading along `direction`."""
    point = Locator.of(mesh).closest(near[None]).points
    return Root.at(point, complex(direction_to_heading(mesh, point, direction[None])[0]))


def transferred(
    skin: TriangleMesh, picks: SurfacePoints, points: SurfacePoints, target: TriangleMesh, root: Root
) -> SurfacePoints:
    """Points of a patch with an axis through `picks`, carried onto a target, as `points` in order."""
    shape, axis = draw_axis(skin, picks)
    patch = PatchShape(shape, parameterize_patch(skin, axis, points), np.ones(len(points)))
    return reconstruct_patch(target, patch, root, shape.transformed(mirrored=True)).points


def block(start: FloatArray, end: FloatArray, across: FloatArray, rows: int = 9, columns: int = 5) -> FloatArray:
    """(rows * columns, 3) a grid of points from start to end, `across` wide to both sides."""
    along = np.linspace(0.0, 1.0, rows)[:, None, None]
    side = np.linspace(-1.0, 1.0, columns)[None, :, None]
    return (start + along * (end - start) + side * across).reshape(-1, 3)


LEGS = tuple(f"{part}_{side}" for side in "lr" for part in ("thigh", "calf", "foot", "toes"))
ARMS = tuple(f"{part}_{side}" for side in "lr" for part in ("clavicle", "upperarm", "lowerarm", "hand"))
STAGES = [
    {"name": "root", "free": {"body": ["hips"]}, "contacts": ["seat_l", "seat_r"]},
    {"name": "legs", "free": {"body": ["hips", *LEGS]}, "contacts": ["seat_l", "seat_r", "foot_l", "foot_r"]},
    {"name": "arms", "free": {"body": [*ARMS, "spine_1", "spine_2", "chest"]}},
]


def chair() -> Scene:
    """The body in front of the chair: backs of the thighs to the seat, soles to the floor, palms to the thighs."""
    rig = rig_of("HUMAN_BODY")
    skin, seat, floor = rig.surface, catalogue.CHAIR.build().mesh, catalogue.FLOOR.build().mesh
    at = {name: rig.rest_world[j, :3, 3] for j, name in enumerate(rig.joints)}
    contacts = []
    for side, sign in (("l", 1.0), ("r", -1.0)):
        hip, knee = at[f"thigh_{side}"], at[f"calf_{side}"]
        top, low = hip + 0.12 * (knee - hip), hip + 0.62 * (knee - hip)
        width = np.array([0.035, 0.0, 0.0])
        back, front = np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, 1.0])
        ends = cast(skin, np.array([top, low]), back), cast(skin, block(top, low, width), back)
        root = root_near(seat, np.array([sign * 0.1, 0.47, -0.05]), front)
        contacts.append(
            PairedPoints(f"seat_{side}", "body", ends[1], "chair", transferred(skin, *ends, seat, root))
        )
        heel, toe = at[f"foot_{side}"] * [1.0, 0.0, 1.0], at[f"toes_{side}"] * [1.0, 0.0, 1.0]
        heel, toe = heel + np.array([0.0, 0.035, -0.01]), toe + np.array([0.0, 0.02, 0.03])
        down = np.array([0.0, -1.0, 0.0])
        ends = cast(skin, np.array([heel, toe]), down), cast(skin, block(heel, toe, 0.6 * width), down)
        root = root_near(floor, np.array([sign * 0.11, 0.0, 0.36]), toe - heel)
        contacts.append(
            PairedPoints(f"foot_{side}", "body", ends[1], "floor", transferred(skin, *ends, floor, root))
        )
        palm = np.array([-0.5 * sign, -0.55, -0.67])
        wrist, fingers = at[f"hand_{side}"], at[f"fingers_{side}"]
        across = 0.025 * np.cross(fingers - wrist, palm) / np.linalg.norm(np.cross(fingers - wrist, palm))
        grid = block(wrist + 0.25 * (fingers - wrist), fingers, across, 7, 5)
        ends = cast(skin, np.array([grid[2], grid[-3]]), palm), cast(skin, grid, palm)
        lap = cast(skin, (hip + 0.55 * (knee - hip))[None], front)
        root = Root.at(lap, complex(direction_to_heading(skin, lap, (knee - hip)[None])[0]))
        contacts.append(PairedPoints(f"hand_{side}", "body", ends[1], "body", transferred(skin, *ends, skin, root)))
    local = rig.rest_local.copy()
    local[0, :3, 3] += [0.0, 0.0, 0.75]
    bodies = (
        Body.skinned(rig, name="body", pose=Pose(rig.joints, local)),
        Body.rigid("chair", seat),
        Body.rigid("floor", floor),
    )
    # Pelvis and chest stay upright: contacts of the legs alone would let the body lean back.
    above = {name: rig.rest_world[rig.joint_index(name), 1, :3].tolist() for name in ("hips", "chest")}
    upright = tuple(Look("body", name, (0.0, 100.0, 0.0), (x, y, z)) for name, (x, y, z) in above.items())
    terms = (*paper_terms(), PenetrationTerm(), LookTerm(upright))
    return Scene(PoseProblem(bodies, tuple(contacts), terms=terms), (1.0, 0.35, 0.9))
