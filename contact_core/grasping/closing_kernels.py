"""Kernels that bring a hand to an object and curl its digits until they touch (GraspIt!'s rule, Miller and Allen
2004), one digit's links at a few dozen points, with steps that the clearance allows (sphere tracing, Hart 1996).

Flat arrays: see `closing.Hand`. A frame is (3, 4), the upper rows of a rigid matrix. Nothing is allocated.
"""

from __future__ import annotations

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.geometry.jit import constant, inlined, kernel

LEAST_STEP, LARGEST_STEP = np.radians(1.0), np.radians(15.0)
LAST_RATIO = 0.7  # the last joint of a digit curls more slowly, as tendons make it
OUT_OF_BAR = 0.02  # hand lengths: a digit that is deeper in the object than this does not fit beside a bar
TURNED = 0.04  # hand lengths that a pad is worth that looks away from the object
ROUNDS = constant(120)
ZERO, ONE = constant(0), constant(1)


@inlined
def field_at(values: FloatArray, origin: FloatArray, spacing: float, x: float, y: float, z: float) -> float:
    """Trilinear signed distance, as `DistanceField.distances`."""
    nx, ny, nz = values.shape
    gx, gy, gz = (x - origin[0]) / spacing, (y - origin[1]) / spacing, (z - origin[2]) / spacing
    cx, cy, cz = min(max(gx, 0.0), nx - 1.0), min(max(gy, 0.0), ny - 1.0), min(max(gz, 0.0), nz - 1.0)
    i, j, k = min(np.int64(cx), nx - 2), min(np.int64(cy), ny - 2), min(np.int64(cz), nz - 2)
    fx, fy, fz = cx - i, cy - j, cz - k
    a = values[i, j, k] + fx * (values[i + 1, j, k] - values[i, j, k])
    b = values[i, j + 1, k] + fx * (values[i + 1, j + 1, k] - values[i, j + 1, k])
    c = values[i, j, k + 1] + fx * (values[i + 1, j, k + 1] - values[i, j, k + 1])
    d = values[i, j + 1, k + 1] + fx * (values[i + 1, j + 1, k + 1] - values[i, j + 1, k + 1])
    low, high = a + fy * (b - a), c + fy * (d - c)
    away = np.sqrt((gx - cx) ** 2 + (gy - cy) ** 2 + (gz - cz) ** 2) * spacing
    return low + fz * (high - low) + away


@inlined
def distance_at(
    values: FloatArray, origin: FloatArray, spacing: float, bar: FloatArray, x: float, y: float, z: float,
) -> float:  # fmt: skip
    """Signed distance to the object; where bar[6] > 0 to a round bar alone: middle (3), axis (3), radius."""
    if bar[6] <= 0.0:
        return field_at(values, origin, spacing, x, y, z)
    px, py, pz = x - bar[0], y - bar[1], z - bar[2]
    along = px * bar[3] + py * bar[4] + pz * bar[5]
    px, py, pz = px - along * bar[3], py - along * bar[4], pz - along * bar[5]
    return np.sqrt(px * px + py * py + pz * pz) - bar[6]


@inlined
def bent(
    out: FloatArray, base: FloatArray, link: FloatArray, pre: FloatArray, axis: FloatArray, angle: float,
) -> None:  # fmt: skip
    """out = base @ link @ pre @ turn(axis, angle); base, link, out (3, 4), pre (3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = axis[0], axis[1], axis[2]
    t = 1.0 - c
    r00, r01, r02 = c + t * x * x, t * x * y - s * z, t * x * z + s * y
    r10, r11, r12 = t * x * y + s * z, c + t * y * y, t * y * z - s * x
    r20, r21, r22 = t * x * z - s * y, t * y * z + s * x, c + t * z * z
    for i in range(3):
        b0, b1, b2 = base[i, 0], base[i, 1], base[i, 2]
        l0 = b0 * link[0, 0] + b1 * link[1, 0] + b2 * link[2, 0]
        l1 = b0 * link[0, 1] + b1 * link[1, 1] + b2 * link[2, 1]
        l2 = b0 * link[0, 2] + b1 * link[1, 2] + b2 * link[2, 2]
        out[i, 3] = b0 * link[0, 3] + b1 * link[1, 3] + b2 * link[2, 3] + base[i, 3]
        p0 = l0 * pre[0, 0] + l1 * pre[1, 0] + l2 * pre[2, 0]
        p1 = l0 * pre[0, 1] + l1 * pre[1, 1] + l2 * pre[2, 1]
        p2 = l0 * pre[0, 2] + l1 * pre[1, 2] + l2 * pre[2, 2]
        out[i, 0] = p0 * r00 + p1 * r10 + p2 * r20
        out[i, 1] = p0 * r01 + p1 * r11 + p2 * r21
        out[i, 2] = p0 * r02 + p1 * r12 + p2 * r22


@inlined
def moved(frame: FloatArray, p: FloatArray, axis: int) -> float:
    """One coordinate of a point (3,) in a frame."""
    return frame[axis, 0] * p[0] + frame[axis, 1] * p[1] + frame[axis, 2] * p[2] + frame[axis, 3]


@kernel
def pose_digit(
    d: int, base: FloatArray, bones: IntArray, links: FloatArray, pres: FloatArray, axes: FloatArray, angles:
    FloatArray, frames: FloatArray,
) -> None:  # fmt: skip
    """Frames of the bones of digit d at their angles."""
    first = bones[d]
    for b in range(first, bones[d + 1]):
        if b == first:
            bent(frames[b], base, links[b], pres[b], axes[b], angles[b])
        else:
            bent(frames[b], frames[b - 1], links[b], pres[b], axes[b], angles[b])


@kernel
def segments_apart(p: FloatArray, q: FloatArray, r: FloatArray, s: FloatArray) -> float:
    """Distance of segments pq and rs, each end (3,). Ericson, "Real-Time Collision Detection", 5.1.9."""
    a = e = f = b = c = 0.0
    for i in range(3):
        d1, d2, w = q[i] - p[i], s[i] - r[i], p[i] - r[i]
        a, e, f, b, c = a + d1 * d1, e + d2 * d2, f + d2 * w, b + d1 * d2, c + d1 * w
    u = 0.0
    parallel = a * e - b * b
    if parallel > 1e-12 * a * e:
        u = min(max((b * f - c * e) / parallel, 0.0), 1.0)
    t = (b * u + f) / e if e > 1e-30 else 0.0
    inside = min(max(t, 0.0), 1.0)
    if inside != t:
        u = min(max((b * inside - c) / a, 0.0), 1.0) if a > 1e-30 else 0.0
    total = 0.0
    for i in range(3):
        gap = p[i] + u * (q[i] - p[i]) - r[i] - inside * (s[i] - r[i])
        total += gap * gap
    return np.sqrt(total)


@kernel
def place_capsules(d: int, bones: IntArray, frames: FloatArray, capsules: FloatArray, ends: FloatArray) -> None:
    """Ends (B, 2, 3) of the capsules of digit d in the object's space."""
    for b in range(bones[d], bones[d + 1]):
        for e in range(2):
            for i in range(3):
                ends[b, e, i] = moved(frames[b], capsules[b, e], i)


@kernel
def touched_digit(
    d: int, bones: IntArray, radii: FloatArray, room: FloatArray, ends: FloatArray, done: BoolArray,
) -> int:  # fmt: skip
    """The last bone of digit d whose capsule is in another placed digit's, -1 for none.

    room: (B, B) how near two capsules may come; done: (D,) which digits are placed.
    """
    last = -ONE
    for b in range(bones[d], bones[d + 1]):
        if radii[b] <= 0.0:
            continue
        for other in range(len(done)):
            if not done[other] or other == d:
                continue
            for c in range(bones[other], bones[other + 1]):
                if radii[c] > 0.0 and room[b, c] > 0.0:
                    gap = segments_apart(ends[b, 0], ends[b, 1], ends[c, 0], ends[c, 1])
                    if gap < room[b, c]:
                        last = b
    return last


@kernel
def close_digit(
    d: int, base: FloatArray, bones: IntArray, links: FloatArray, pres: FloatArray, axes: FloatArray, high:
    FloatArray, moves: BoolArray, angles: FloatArray, frames: FloatArray, probes: FloatArray, probe_bones:
    IntArray, probe_starts: IntArray, levers: FloatArray, values: FloatArray, origin: FloatArray, spacing:
    float, bar: FloatArray, touch: float, capsules: FloatArray, radii: FloatArray, room: FloatArray, ends:
    FloatArray, done: BoolArray, going: BoolArray, leads: IntArray, ratios: FloatArray,
) -> float:  # fmt: skip
    """Curl digit d from `angles` until each joint's link, or one beyond it, touches; returns the least clearance.

    leads: (B,) the bone with which each turns, `ratios` times as much, -1 for none.
    """
    first, end = bones[d], bones[d + 1]
    last_moving = -ONE
    for b in range(first, end):
        going[b] = moves[b] and leads[b] < 0
        if going[b]:
            last_moving = b
    least = np.inf
    for _ in range(ROUNDS):
        for b in range(first, end):
            if leads[b] >= 0:
                angles[b] = ratios[b] * angles[leads[b]]
        pose_digit(d, base, bones, links, pres, axes, angles, frames)
        least = np.inf
        stop = -ONE
        step = LARGEST_STEP
        for p in range(probe_starts[d], probe_starts[d + 1]):
            b = probe_bones[p]
            clear = distance_at(
                values, origin, spacing, bar, moved(frames[b], probes[p], 0), moved(frames[b], probes[p], 1),
                moved(frames[b], probes[p], 2),
            )  # fmt: skip
            least = min(least, clear)
            if clear < touch:
                stop = max(stop, b)
            else:
                step = min(step, (clear - 0.5 * touch) / levers[p])
        place_capsules(d, bones, frames, capsules, ends)
        stop = max(stop, touched_digit(d, bones, radii, room, ends, done))
        any_going = False
        step = max(step, LEAST_STEP)
        for b in range(first, end):
            if b <= stop:
                going[b] = False
            if going[b]:
                rate = LAST_RATIO if b == last_moving and last_moving > first else 1.0
                angle = min(angles[b] + step * rate, max(high[b], angles[b]))
                if angle <= angles[b]:
                    going[b] = False
                else:
                    angles[b] = angle
                    any_going = True
        if not any_going:
            break
    return least


@kernel
def pad_fit(
    b: int, frames: FloatArray, pads: FloatArray, pad_normals: FloatArray, values: FloatArray, origin:
    FloatArray, spacing: float, bar: FloatArray, out: FloatArray,
) -> None:  # fmt: skip
    """Of the pad below bone b: out = distance, n . gradient, gradient (3), position (3)."""
    h = 0.5 * spacing
    x, y, z = moved(frames[b], pads[b], 0), moved(frames[b], pads[b], 1), moved(frames[b], pads[b], 2)
    out[0] = distance_at(values, origin, spacing, bar, x, y, z)
    gx = distance_at(values, origin, spacing, bar, x + h, y, z)
    gx -= distance_at(values, origin, spacing, bar, x - h, y, z)
    gy = distance_at(values, origin, spacing, bar, x, y + h, z)
    gy -= distance_at(values, origin, spacing, bar, x, y - h, z)
    gz = distance_at(values, origin, spacing, bar, x, y, z + h)
    gz -= distance_at(values, origin, spacing, bar, x, y, z - h)
    size = max(np.sqrt(gx * gx + gy * gy + gz * gz), 1e-30)
    out[2], out[3], out[4] = gx / size, gy / size, gz / size
    out[5], out[6], out[7] = x, y, z
    out[1] = 0.0
    for i in range(3):
        n = frames[b, i, 0] * pad_normals[b, 0] + frames[b, i, 1] * pad_normals[b, 1]
        n += frames[b, i, 2] * pad_normals[b, 2]
        out[1] += n * out[2 + i]


@kernel
def approach_one(
    frame: FloatArray, way: FloatArray, tested: FloatArray, tested_bones: IntArray, bones: IntArray, links:
    FloatArray, pres: FloatArray, axes: FloatArray, angles: FloatArray, frames: FloatArray, values: FloatArray,
    origin: FloatArray, spacing: float, bar: FloatArray, touch: float,
) -> float:  # fmt: skip
    """Move `frame` back along `way` (3,) until the tested skin is clear, then on until it touches.

    tested_bones: the bone that carries each point, -1 for the palm. Returns how far it went; inf where it passes
    by.
    """
    for d in range(len(bones) - 1):
        pose_digit(d, frame, bones, links, pres, axes, angles, frames)
    reach = spacing * (values.shape[0] + values.shape[1] + values.shape[2])
    travelled, forward = 0.0, False
    for _ in range(ROUNDS):
        least = np.inf
        for p in range(len(tested)):
            b = tested_bones[p]
            carrier = frame if b < 0 else frames[b]
            least = min(least, distance_at(
                values, origin, spacing, bar, moved(carrier, tested[p], 0) + travelled * way[0],
                moved(carrier, tested[p], 1) + travelled * way[1],
                moved(carrier, tested[p], 2) + travelled * way[2],
            ))  # fmt: skip
        if least >= 0.0:
            forward = True
            if least < touch:
                break
            travelled += max(0.9 * (least - 0.5 * touch), 0.25 * touch)
        elif forward:
            break
        else:
            travelled -= max(-least, touch)
        if abs(travelled) > reach:
            return np.inf
    for i in range(3):
        frame[i, 3] += travelled * way[i]
    return travelled


@kernel
def clearance(
    d: int, frames: FloatArray, probes: FloatArray, probe_bones: IntArray, probe_starts: IntArray, values:
    FloatArray, origin: FloatArray, spacing: float,
) -> float:  # fmt: skip
    """The least signed distance of digit d's skin to the object."""
    least = np.inf
    for p in range(probe_starts[d], probe_starts[d + 1]):
        b = probe_bones[p]
        clear = field_at(
            values, origin, spacing, moved(frames[b], probes[p], 0), moved(frames[b], probes[p], 1),
            moved(frames[b], probes[p], 2),
        )  # fmt: skip
        least = min(least, clear)
    return least


@inlined
def turned_root(out: FloatArray, frame: FloatArray, x: float, y: float) -> None:
    """out (3, 3) = frame @ turn about x @ turn about y @ frame.T, frame (3, 3)."""
    cx, sx, cy, sy = np.cos(x), np.sin(x), np.cos(y), np.sin(y)
    for i in range(3):
        f0, f1, f2 = frame[i, 0], frame[i, 1], frame[i, 2]
        a = f0 * cy + (f1 * sx - f2 * cx) * sy
        b = f1 * cx + f2 * sx
        c = f0 * sy - (f1 * sx - f2 * cx) * cy
        for j in range(3):
            out[i, j] = a * frame[j, 0] + b * frame[j, 1] + c * frame[j, 2]


@inlined
def between(prices: FloatArray, counts: IntArray, low: FloatArray, high: FloatArray, at: FloatArray) -> float:
    """Trilinear in prices of a grid with so many nodes each way (flat, the last way fastest) from low to high."""
    total = 0.0
    for corner in range(8):
        place, share = ZERO, 1.0
        for axis in range(3):
            side = (corner >> axis) & 1
            g = (at[axis] - low[axis]) / (high[axis] - low[axis]) * (counts[axis] - 1)
            g = min(max(g, 0.0), counts[axis] - 1.0)
            cell = min(np.int64(g), counts[axis] - 2)
            share *= g - cell if side else 1.0 - (g - cell)
            place = place * counts[axis] + cell + side
        total += share * prices[place]
    return total


@kernel
def misfit_of(
    d: int, least: float, price: float, bones: IntArray, frames: FloatArray, pads: FloatArray, pad_normals:
    FloatArray, has_pad: BoolArray, capsules: FloatArray, values: FloatArray, origin: FloatArray, spacing: float,
    bar: FloatArray, length: float, oppose: float, along: float, mean: FloatArray, normals: FloatArray,
    is_thumb: bool, fit: FloatArray,
) -> float:  # fmt: skip
    """What is amiss with a closed digit, in hand lengths: skin in the object, pads off it, and of a thumb that it
    does not press against the fingers (`mean`, their normal on the object) or lies along what they go round.

    normals: (3, 3) the mean of n n^T of the object's normals under the fingers. A thumb is across a rod where its
    tip points the way in which they vary; for a ball or a plate no way is better than another.
    """
    misfit = price - 3.0 * min(least, 0.0) / length
    count, against = 0.0, 0.0
    for b in range(bones[d], bones[d + 1]):
        if has_pad[b]:
            pad_fit(b, frames, pads, pad_normals, values, origin, spacing, bar, fit)
            count += 1.0
            misfit += abs(fit[0]) / length + TURNED * (1.0 + fit[1])
            against += fit[2] * mean[0] + fit[3] * mean[1] + fit[4] * mean[2]
    if is_thumb and count > 0.0:
        misfit += oppose * max(against / count + 0.6, 0.0)
        last = bones[d + 1] - 1
        size, across = 1e-30, 0.0
        for i in range(3):
            u = moved(frames[last], capsules[last, 1], i) - moved(frames[last], capsules[last, 0], i)
            fit[i] = u
            size += u * u
        for i in range(3):
            for j in range(3):
                across += fit[i] * normals[i, j] * fit[j]
        misfit += along * max(1.0 - 3.0 * across / size, 0.0)
    return misfit


@kernel
def close_all(
    placed: FloatArray, ways: FloatArray, bars: FloatArray, curls: FloatArray, limits: FloatArray, bones:
    IntArray, links: FloatArray, axes: FloatArray, low: FloatArray, high: FloatArray, flexes: BoolArray, thumb:
    int, starts: FloatArray, start_counts: IntArray, start_angles: FloatArray, start_prices: FloatArray, probes:
    FloatArray, probe_bones: IntArray, probe_starts: IntArray, levers: FloatArray, tested: FloatArray,
    tested_bones: IntArray, rest: FloatArray, pads: FloatArray, pad_normals: FloatArray, has_pad: BoolArray,
    capsules: FloatArray, radii: FloatArray, room: FloatArray, values: FloatArray, origin: FloatArray, spacing:
    float, touch: float, on: float, length: float, oppose: float, along: float, looks: IntArray, look_frame:
    FloatArray, look_low: FloatArray, look_high: FloatArray, out_angles: FloatArray, out_turns: FloatArray,
    out_fits: FloatArray, out_clear: FloatArray, out_rest: FloatArray, out_palm: FloatArray, out_travel:
    FloatArray, pres: FloatArray, angles: FloatArray, frames: FloatArray, ends: FloatArray, done: BoolArray, going:
    BoolArray, moves: BoolArray, best_angles: FloatArray, fit: FloatArray, mean: FloatArray, none: FloatArray,
    firsts: IntArray, ceiling: FloatArray, leads: IntArray, ratios: FloatArray, normals: FloatArray, at:
    FloatArray, best_at: FloatArray, best_turn: FloatArray,
) -> None:  # fmt: skip
    """Approach and close a hand at every placement (see `closing.close_hands` for the arrays)."""
    digits = len(bones) - 1
    for n in range(len(placed)):
        bar = bars[n]
        for b in range(len(links)):
            angles[b] = min(max(curls[n] * high[b] if flexes[b] else 0.0, low[b]), high[b])
            for i in range(3):
                for j in range(3):
                    pres[b, i, j] = 1.0 if i == j else 0.0
        if thumb >= 0:
            for b in range(bones[thumb], bones[thumb + 1]):
                angles[b] = 0.0
        out_travel[n] = 0.0
        if ways[n, 0] != 0.0 or ways[n, 1] != 0.0 or ways[n, 2] != 0.0:
            out_travel[n] = approach_one(
                placed[n], ways[n], tested, tested_bones, bones, links, pres, axes, angles, frames, values, origin,
                spacing, bar, touch,
            )  # fmt: skip
        if not np.isfinite(out_travel[n]):
            continue
        for d in range(digits):
            done[d] = False
            for b in range(bones[d], bones[d + 1]):
                ceiling[b] = limits[n, d] * high[b]
        mean[0] = mean[1] = mean[2] = 0.0
        pressing = 0.0
        for i in range(3):
            for j in range(3):
                normals[i, j] = 0.0
        for turn in range(digits):
            d = turn if thumb < 0 else (turn + 1 if turn + 1 < digits else ZERO)  # digits in order, the thumb last
            first, end = bones[d], bones[d + 1]
            best = np.inf
            chosen, step, better = ZERO, 0.5, True
            more = 6 * looks[3] if d == thumb and start_counts[d] > 1 else ZERO
            # its starts, then of a thumb what is near the best of them, either way of each of three, in steps that
            # halve
            for tried in range(start_counts[d] + more):
                price, near = 0.0, tried - start_counts[d]
                for b in range(first, end):
                    moves[b] = flexes[b]
                    angles[b] = min(max(curls[n] * high[b], low[b]), high[b]) if flexes[b] and d != thumb else 0.0
                if near < 0:
                    price = start_prices[d, tried]
                    for i in range(3):
                        for j in range(3):
                            pres[firsts[d], i, j] = starts[d, tried, i, j]
                    if d == thumb:
                        angles[firsts[d]] = start_angles[d, tried]
                else:
                    if near == 0:
                        for k in range(2, -1, -1):
                            best_at[k] = chosen % looks[k] * (look_high[k] - look_low[k]) / (looks[k] - 1.0)
                            best_at[k] += look_low[k]
                            chosen = chosen // looks[k]
                    if near % 6 == 0:
                        step = step if better else 0.5 * step
                        better = False
                    for k in range(3):
                        at[k] = best_at[k]
                    k = near % 6 // 2
                    stride = step * (look_high[k] - look_low[k]) / (looks[k] - 1.0)
                    at[k] = min(max(at[k] + (stride if near % 2 else -stride), look_low[k]), look_high[k])
                    price = between(start_prices[d], looks, look_low, look_high, at)
                    turned_root(pres[firsts[d]], look_frame, at[0], at[1])
                    angles[firsts[d]] = at[2]
                if d == thumb:
                    moves[firsts[d]] = False
                least = close_digit(
                    d, placed[n], bones, links, pres, axes, ceiling, moves, angles, frames, probes, probe_bones,
                    probe_starts, levers, values, origin, spacing, bar, touch, capsules, radii, room, ends, done,
                    going, leads, ratios,
                )  # fmt: skip
                misfit = misfit_of(
                    d, least, price, bones, frames, pads, pad_normals, has_pad, capsules, values, origin, spacing,
                    bar, length, oppose, along, mean, normals, d == thumb, fit,
                )  # fmt: skip
                if misfit < best - 1e-12:
                    best, better = misfit, True
                    if near < 0:
                        chosen = tried
                    else:
                        for k in range(3):
                            best_at[k] = at[k]
                    for b in range(first, end):
                        best_angles[b] = angles[b]
                    for i in range(3):
                        for j in range(3):
                            best_turn[i, j] = pres[firsts[d], i, j]
            for i in range(3):
                for j in range(3):
                    pres[firsts[d], i, j] = best_turn[i, j]
                    out_turns[n, d, i, j] = best_turn[i, j]
            for b in range(first, end):
                angles[b] = best_angles[b]
                out_angles[n, b] = best_angles[b]
            pose_digit(d, placed[n], bones, links, pres, axes, angles, frames)
            out_clear[n, d] = clearance(d, frames, probes, probe_bones, probe_starts, values, origin, spacing)
            if (
                bar[6] > 0.0 and out_clear[n, d] < -OUT_OF_BAR * length
            ):  # no room beside the bar: close on all of it
                for b in range(first, end):
                    moves[b] = flexes[b] and not (d == thumb and b == firsts[d])
                    angles[b] = 0.0 if moves[b] else angles[b]
                close_digit(
                    d, placed[n], bones, links, pres, axes, ceiling, moves, angles, frames, probes, probe_bones,
                    probe_starts, levers, values, origin, spacing, none, touch, capsules, radii, room, ends, done,
                    going, leads, ratios,
                )  # fmt: skip
                for b in range(first, end):
                    out_angles[n, b] = angles[b]
                pose_digit(d, placed[n], bones, links, pres, axes, angles, frames)
                out_clear[n, d] = clearance(d, frames, probes, probe_bones, probe_starts, values, origin, spacing)
            place_capsules(d, bones, frames, capsules, ends)
            done[d] = True
            for b in range(first, end):
                if has_pad[b]:
                    pad_fit(b, frames, pads, pad_normals, values, origin, spacing, none, out_fits[n, b])
                    if d != thumb and abs(out_fits[n, b, 0]) < on * length:
                        pressing += 1.0
                        for i in range(3):
                            mean[i] += out_fits[n, b, 2 + i]
                            for j in range(3):
                                normals[i, j] += out_fits[n, b, 2 + i] * out_fits[n, b, 2 + j]
            size = np.sqrt(mean[0] ** 2 + mean[1] ** 2 + mean[2] ** 2)
            if turn == digits - 2 and size > 0.0:
                for i in range(3):
                    mean[i] = mean[i] / size
                    for j in range(3):
                        normals[i, j] = normals[i, j] / pressing
        out_rest[n] = np.inf
        for p in range(len(rest)):
            out_rest[n] = min(out_rest[n], field_at(
                values, origin, spacing, moved(placed[n], rest[p], 0), moved(placed[n], rest[p], 1),
                moved(placed[n], rest[p], 2),
            ))  # fmt: skip
        out_palm[n] = np.inf
        for p in range(len(tested)):
            out_palm[n] = min(out_palm[n], field_at(
                values, origin, spacing, moved(placed[n], tested[p], 0), moved(placed[n], tested[p], 1),
                moved(placed[n], tested[p], 2),
            ))  # fmt: skip
