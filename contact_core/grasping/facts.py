"""What an eye sees of a grasp and its contact metrics do not: which digits touch, whether they hold the object,
skin through a thin wall, how alike the fingers are bent, and whether the hand could have come there."""

from __future__ import annotations

import numpy as np

from contact_core.arrays import BoolArray, FloatArray
from contact_core.geometry.distance_field import DistanceField
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.transform import transform_points
from contact_core.grasping.hand import Hand, spread_out
from contact_core.rig.capsules import closest_on_segments

FRICTION = 0.6
CONE = 6  # edges of the pyramid in place of a friction cone
TOUCHES = 0.012  # hand lengths: skin this near touches
FACES = -0.3  # n.n' of skin that presses on the object
POINTS = 16  # of contact, for closure
STRAIGHT = np.radians(40.0)  # all joints of a finger together: less is no bend that holds
DIRECTIONS = 96
ROUND = (
    0.1  # by how much normals vary more across a thing than along it, as mean squares, where it is round for sure
)
RAISED = 0.3  # hand lengths: a thumb that is farther off is as good as there
BACK = (0.06, 0.12, 0.2, 0.3)  # hand lengths of the way back out


def digits_in_contact(hand: Hand, skin: FloatArray, locator: Locator) -> BoolArray:
    """(D,) which digits have skin within touch of the object. skin: (n, 3) posed vertices, object space."""
    result = np.zeros(len(hand.bones) - 1, bool)
    for digit, vertices in enumerate(hand.skin_of_digits):
        if len(vertices):
            reach = TOUCHES * hand.length
            near = locator.closest(skin[vertices], max_distance=reach)
            result[digit] = bool(near.found.any())
    return result


def skin_through(hand: Hand, skin: FloatArray, world: FloatArray, mesh: TriangleMesh) -> FloatArray:
    """(D,) How far a digit's skin is beyond the first wall between it and its bone: the depth that a thin wall
    hides, and that holds for open surfaces too. skin: (n, 3), world: (j, 4, 4) object_from_joint, both posed.
    Object units."""
    deepest = np.zeros(len(hand.skin_of_digits))
    vertices = np.concatenate(hand.skin_of_digits)
    b = hand.bone_of_skin[vertices]
    ends = np.einsum("kij,kej->kei", world[hand.joints[b]][:, :3, :3], hand.capsules[b])
    ends += world[hand.joints[b]][:, None, :3, 3]
    along = ends[:, 1] - ends[:, 0]
    size = np.maximum(np.einsum("ki,ki->k", along, along), 1e-30)
    share = np.clip(np.einsum("ki,ki->k", skin[vertices] - ends[:, 0], along) / size, 0.0, 1.0)
    start = ends[:, 0] + share[:, None] * along
    way = skin[vertices] - start
    real = np.linalg.norm(way, axis=1) > 1e-9 * hand.length
    hit = Locator.of(mesh).cast(start[real], way[real], max_distance=1.0)
    normal = mesh.face_normals[hit.points.faces[hit.found]]
    beyond = (1.0 - hit.distance[hit.found]) * np.abs(np.einsum("ki,ki->k", normal, way[real][hit.found]))
    digit = np.searchsorted(hand.bones, b[real][hit.found], side="right") - 1
    np.maximum.at(deepest, digit, beyond)
    return deepest


def contact_wrenches(skin: TriangleMesh, mesh: TriangleMesh, length: float) -> FloatArray:
    """(k, 6) wrenches of unit forces along the edges of the friction pyramids at some points, far from one another,
    where skin touches, torques in half hand lengths about their middle. skin: posed, in the mesh's space."""
    found = Locator.of(mesh).closest(skin.points, max_distance=TOUCHES * length)
    near = np.flatnonzero(found.found)
    normals = mesh.face_normals[found.points.faces]
    near = near[np.einsum("ki,ki->k", skin.vertex_normals[near], normals[near]) < FACES]
    if len(near) < 3:
        return np.zeros((0, 6))
    near = near[spread_out(skin.points[near], POINTS, 0)]
    at, inward = skin.points[near], -normals[near]
    first = np.array([_across(normal) for normal in inward])
    second = np.cross(inward, first)
    angle = (np.arange(CONE) * 2.0 * np.pi / CONE)[:, None, None]
    forces = inward + FRICTION * (np.cos(angle) * first + np.sin(angle) * second)  # (CONE, k, 3)
    torques = np.cross(at - at.mean(axis=0), forces) / (0.5 * length)
    return np.concatenate([forces, torques], axis=2).reshape(-1, 6)


def closure(wrenches: FloatArray) -> float:
    """Ferrari and Canny (1992): the radius of the largest ball about 0 in the hull of the wrenches; below 0 by how
    far 0 is outside. -1 where there are too few contacts."""
    from scipy.spatial import ConvexHull, QhullError

    if len(wrenches) < 7:
        return -1.0
    try:
        return float(-ConvexHull(wrenches).equations[:, -1].max())
    except QhullError:
        return -1.0


def enclosure(normals: FloatArray, weights: FloatArray) -> FloatArray:
    """(N,) how well contacts surround: the least over all directions of the largest component of any contact's
    normal (N, k, 3) with weight (N, k) in 0..1; above 0 where no way out is free."""
    ways = sphere_directions(DIRECTIONS)
    along = np.einsum("nki,di->nkd", normals, ways)
    along = np.where(weights[:, :, None] > 0.0, along * weights[:, :, None], -1.0)
    return np.asarray(along.max(axis=1).min(axis=1))


def along(normals: FloatArray, press: BoolArray, tip: FloatArray) -> FloatArray:
    """(N,) 0 to 1: how much a thumb points along what the fingers go round: cos^2 of its angle to the way in which
    the object's normals (N, k, 3) under pads that press (N, k) vary least. tip: (N, 3), of any length. 0 where
    fingers go round nothing: under a flat hand normals do not vary, on a ball they vary in all ways."""
    weighted = normals * press[:, :, None]
    spread = np.einsum("nbi,nbj->nij", weighted, weighted) / np.maximum(press.sum(axis=1), 1)[:, None, None]
    vary, ways = np.linalg.eigh(spread)
    unit = tip / np.maximum(np.linalg.norm(tip, axis=1), 1e-30)[:, None]
    sure = np.clip((vary[:, 1] - vary[:, 0]) / ROUND, 0.0, 1.0)
    return np.asarray(sure * np.einsum("ni,ni->n", unit, ways[:, :, 0]) ** 2)


def thumb_along(hand: Hand, skin: FloatArray, world: FloatArray, mesh: TriangleMesh) -> float:
    """`along` of the thumb of a posed hand, by the object's mean normals under each bone of the fingers that
    touches; 0 without a thumb. skin: (n, 3), world: (j, 4, 4), in the object's space."""
    if hand.thumb < 0:
        return 0.0
    found = Locator.of(mesh).closest(skin, max_distance=TOUCHES * hand.length)
    near = np.flatnonzero(found.found & (hand.bone_of_skin >= hand.bones[hand.thumb + 1]))
    sums = np.zeros((len(hand.joints), 3))
    np.add.at(sums, hand.bone_of_skin[near], mesh.face_normals[found.points.faces[near]])
    size = np.linalg.norm(sums, axis=1)
    press = (size > 0.0) & hand.flexes
    last = int(hand.bones[hand.thumb + 1]) - 1
    tip = world[hand.joints[last], :3, :3] @ np.diff(hand.capsules[last], axis=0)[0]
    return float(along((sums / np.maximum(size, 1e-30)[:, None])[None], press[None], tip[None])[0])


def thumb_away(hand: Hand, skin: FloatArray, mesh: TriangleMesh, used: BoolArray) -> float:
    """Hand lengths from the object to the nearest skin of the thumb's last bone, `RAISED` at most: a thumb whose
    root alone touches sticks out into the air. 0 without a thumb that takes part. As for `opposition`."""
    last = np.flatnonzero(hand.bone_of_skin == hand.bones[hand.thumb + 1] - 1)
    if hand.thumb < 0 or not used[hand.thumb] or not len(last):
        return 0.0
    found = Locator.of(mesh).closest(skin[last], max_distance=RAISED * hand.length)
    return float(found.distance[found.found].min(initial=RAISED * hand.length)) / hand.length


def opposition(hand: Hand, skin: FloatArray, mesh: TriangleMesh, used: BoolArray) -> float:
    """Radians, 0 to pi: from how far apart the fingers that take part and the thumb or the palm press on the
    object: of each finger the largest angle between the object's mean normal under its last bone that touches and
    those under bones of the thumb and under the palm; of all fingers the median. Nearly pi where they oppose, half
    of that for a hand that is laid along a thing or under it, though friction may hold it; 0 where only one side
    touches. Where neither thumb nor palm does and the thumb takes no part, fingers press against one another, as on
    a cigarette. skin: (n, 3) posed, in the object's space; used: (D,) digits that take part."""
    found = Locator.of(mesh).closest(skin, max_distance=TOUCHES * hand.length)
    near = np.flatnonzero(found.found)
    normals = mesh.face_normals[found.points.faces[near]]
    sums = np.zeros((len(hand.joints) + 1, 3))  # the palm's last, where bone_of_skin is -1
    np.add.at(sums, hand.bone_of_skin[near], normals)
    stiff = np.flatnonzero(~hand.flexes)  # metacarpals are the palm's
    sums[-1] += sums[stiff].sum(axis=0)
    sums[stiff] = 0.0
    size = np.linalg.norm(sums, axis=1)
    means = sums / np.maximum(size, 1e-30)[:, None]
    other = [-1, *(range(hand.bones[hand.thumb], hand.bones[hand.thumb + 1]) if hand.thumb >= 0 else ())]
    against = means[[b for b in other if size[b] > 0.0]]
    last = {
        int(digit): means[touching[-1]]
        for digit in np.flatnonzero(used)
        if digit != hand.thumb
        and (touching := [b for b in range(hand.bones[digit], hand.bones[digit + 1]) if size[b] > 0.0])
    }
    between = not len(against) and not (hand.thumb >= 0 and used[hand.thumb])
    angles = [
        float(np.arccos(np.clip((opposite @ normal).min(), -1.0, 1.0)))
        for digit, normal in last.items()
        if len(opposite := np.array([n for d, n in last.items() if d != digit]) if between else against)
    ]
    return float(np.median(angles)) if angles else 0.0


def crossing(hand: Hand, world: FloatArray) -> float:
    """How far bones of different digits are in one another, at most, as a share of how near they may come (their
    capsules' radii, or how near they are at rest). world: (j, 4, 4) object_from_joint."""
    frames = world[hand.joints]
    ends = np.einsum("bij,bej->bei", frames[:, :3, :3], hand.capsules) + frames[:, None, :3, 3]
    first, second = np.nonzero(np.triu(hand.room > 0.0))
    if not len(first):
        return 0.0
    share = closest_on_segments(ends[first], ends[second])
    one = ends[first, 0] + share[:, :1] * (ends[first, 1] - ends[first, 0])
    two = ends[second, 0] + share[:, 1:] * (ends[second, 1] - ends[second, 0])
    apart = np.linalg.norm(one - two, axis=1)
    return float(max((1.0 - apart / hand.room[first, second]).max(), 0.0))


def uneven_curl(hand: Hand, angles: FloatArray, used: BoolArray, through: BoolArray | None = None) -> float:
    """The largest difference between neighbouring fingers' bends in all, radians, of the fingers that take part.
    through: (D,) which go through a loop; where the end of a handle is between two fingers half of it counts."""
    total = hand.turned(angles)
    fingers = [d for d in range(len(total)) if d != hand.thumb and used[d]]
    apart = np.abs(np.diff(total[fingers]))
    if through is not None:
        apart = np.where(np.diff(through[fingers]), 0.5 * apart, apart)
    return float(apart.max(initial=0.0))


def comfort(hand: Hand, angles: FloatArray) -> float:
    """0 to 1: how far joints keep from the ends of their room, and how alike the fingers are bent."""
    room = np.maximum(hand.high - hand.low, 1e-9)
    share = np.clip((angles - hand.low) / room, 0.0, 1.0)[hand.flexes]
    strain = np.clip(np.abs(2.0 * share - 1.0) - 0.7, 0.0, 0.3) / 0.3
    uneven = uneven_curl(hand, angles, np.ones(len(hand.bones) - 1, bool))
    total = hand.turned(angles)
    fingers = [d for d in range(len(total)) if d != hand.thumb]
    flat = float((total[fingers] < STRAIGHT).mean()) if fingers else 0.0
    return float((1.0 - 0.5 * strain.mean()) * (1.0 - 0.5 * min(uneven / np.pi, 1.0)) * (1.0 - 0.4 * flat))


def clearance(hand: Hand, field: DistanceField, placed: FloatArray, way: FloatArray) -> float:
    """0 to 1: the share of the way back out, against `way` (3,), on which palm and wrist find room."""
    points = transform_points(placed, np.concatenate([hand.tested, hand.rest]))
    free = [float(field.distances(points - back * hand.length * way).min()) > 0.0 for back in BACK]
    return float(np.mean(free))


def sphere_directions(count: int) -> FloatArray:
    """(count, 3) unit vectors evenly over the sphere (a Fibonacci spiral)."""
    place = np.arange(count) + 0.5
    z = 1.0 - 2.0 * place / count
    turn = np.pi * (1.0 + np.sqrt(5.0)) * place
    return np.stack([np.sqrt(1.0 - z * z) * np.cos(turn), np.sqrt(1.0 - z * z) * np.sin(turn), z], axis=1)


def _across(normal: FloatArray) -> FloatArray:
    """(3,) a unit vector across a unit one."""
    first = np.cross(normal, np.eye(3)[int(np.abs(normal).argmin())])
    return np.asarray(first / np.linalg.norm(first))
