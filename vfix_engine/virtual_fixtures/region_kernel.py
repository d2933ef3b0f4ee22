"""Penetration depth of a tool in a solid region, from signed distances on grids (compiled).

A region is two grids of signed distances, a fine one that takes precedence over a coarse one; space outside both is
free. The numbers of the region are packed, see ``soft_region.region_numbers``.

At a point p of the axis of a capsule of radius r, with the signed distance d(p), the depth of the tool's surface below
the region's border is at most layer + r − d(p), since a signed distance is Lipschitz continuous with constant 1. The
excess is that depth, plus the error of d, minus the greatest depth allowed at p.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..kernels.compiled import compiled, inlined
from .boundary import approach

LEAST_ADVANCE_MM = 0.1  # smallest sampling interval along an axis
WINDOW_MM = 1.0  # of an axis: each window has at most one row
CONTACT = 9  # columns of a contact: segment, position (3), depth, excess, outward direction (3), 0 if undefined
STEEPEST = 1.5  # Lipschitz bound of the excess per mm: 1 of the distance, 0.5 of the greatest depth

# Offsets of the packed numbers: origin (3), step and error of both grids; layer; greatest depth; centre (3), radius and
# greatest depth of the deeper place, and the slope of the transition between the two depths, per mm.
FINE, COARSE, LAYER, DEPTH, DEEPER, NUMBERS = 0, 5, 10, 11, 12, 18
_FAR = 1e3  # [mm] substitute for an unknown distance
_LONGEST_ADVANCE_MM = 4.0
_FLAT = 0.2  # a smaller gradient has no reliable direction


@inlined
def _in_grid(values: Any, x: float, y: float, z: float) -> float:
    """Trilinear interpolation at a position in grid units; NaN outside the grid."""
    top_k, top_j, top_i = values.shape[0] - 1, values.shape[1] - 1, values.shape[2] - 1
    if not (0.0 <= x <= top_i and 0.0 <= y <= top_j and 0.0 <= z <= top_k):
        return np.nan
    i, j, k = min(int(x), top_i - 1), min(int(y), top_j - 1), min(int(z), top_k - 1)
    a, b, c = x - i, y - j, z - k
    v00 = values[k, j, i] + a * (values[k, j, i + 1] - values[k, j, i])
    v01 = values[k, j + 1, i] + a * (values[k, j + 1, i + 1] - values[k, j + 1, i])
    v10 = values[k + 1, j, i] + a * (values[k + 1, j, i + 1] - values[k + 1, j, i])
    v11 = values[k + 1, j + 1, i] + a * (values[k + 1, j + 1, i + 1] - values[k + 1, j + 1, i])
    v0, v1 = v00 + b * (v01 - v00), v10 + b * (v11 - v10)
    return float(v0 + c * (v1 - v0))


@compiled
def _distance(fine: Any, coarse: Any, numbers: Any, x: float, y: float, z: float) -> Any:
    """Signed distance at a point and its error, mm; _FAR where unknown, with the distance to the known space."""
    step = numbers[FINE + 3]
    found = _in_grid(fine, (x - numbers[FINE]) / step, (y - numbers[FINE + 1]) / step, (z - numbers[FINE + 2]) / step)
    if found == found:
        return found, numbers[FINE + 4]
    step = numbers[COARSE + 3]
    found = _in_grid(
        coarse, (x - numbers[COARSE]) / step, (y - numbers[COARSE + 1]) / step, (z - numbers[COARSE + 2]) / step
    )
    if found == found:
        return found, numbers[COARSE + 4]
    away, place = 0.0, (x, y, z)
    for k in range(3):
        first = numbers[COARSE + k]
        away = max(away, first - place[k], place[k] - first - step * (coarse.shape[2 - k] - 1))
    return _FAR, max(away, LEAST_ADVANCE_MM)


@inlined
def _allowed(numbers: Any, x: float, y: float, z: float) -> float:
    """Greatest allowed depth at a point, mm."""
    a, b, c = x - numbers[DEEPER], y - numbers[DEEPER + 1], z - numbers[DEEPER + 2]
    beyond = max(np.sqrt(a * a + b * b + c * c) - numbers[DEEPER + 3], 0.0)
    return float(max(numbers[DEEPER + 4] - numbers[DEEPER + 5] * beyond, numbers[DEPTH]))


@compiled
def largest_excess(
    fine: Any, coarse: Any, numbers: Any, start: Any, end: Any, radius: Any, share: float, start_2: Any, end_2: Any,
    floor: float,
) -> tuple[float, int, float]:  # fmt: skip
    """Return the largest excess of a tool in mm, its segment, and its position as a fraction of the segment's axis.

    If the excess is less than ``floor``: ``floor``, −1 and 0.
    The tool is at fraction ``share`` of the straight motion of its segments from (start, end) to (start_2, end_2),
    each (S, 3). Between the samples the excess can be larger by STEEPEST · LEAST_ADVANCE_MM / 2.
    """
    worst, segment, place = floor, -1, 0.0
    first, along = np.empty(3), np.empty(3)
    for s in range(len(radius)):
        length = 0.0
        for k in range(3):
            first[k] = start[s, k] + share * (start_2[s, k] - start[s, k])
            along[k] = end[s, k] + share * (end_2[s, k] - end[s, k]) - first[k]
            length += along[k] * along[k]
        length = np.sqrt(length)
        at = 0.0
        while True:
            t = at / length if length > 0.0 else 0.0
            x, y, z = first[0] + t * along[0], first[1] + t * along[1], first[2] + t * along[2]
            distance, error = _distance(fine, coarse, numbers, x, y, z)
            excess = numbers[LAYER] + radius[s] - distance + error - _allowed(numbers, x, y, z)
            if excess > worst:
                worst, segment, place = excess, s, t
            if at >= length:
                break
            advance = min(max((worst - excess) / STEEPEST, LEAST_ADVANCE_MM), _LONGEST_ADVANCE_MM)
            at = min(at + (error if distance == _FAR else advance), length)
    return worst, segment, place


@compiled
def keeps_depth(
    fine: Any, coarse: Any, numbers: Any, start: Any, end: Any, radius: Any, start_2: Any, end_2: Any,
    sag: float, limit: float, between: float, most: int,
) -> bool:  # fmt: skip
    """Whether the excess stays within its limit during the motion of a tool from (start, end) to (start_2, end_2).

    The excess of every sampled pose is at most ``limit``, or that of the first pose if it is larger.
    Poses are sampled so densely that the excess between them is larger by at most ``between``.

    Args:
        sag: largest deviation of a point from its chord, mm. most: largest number of sampled poses.
    """
    chord = 0.0
    for s in range(len(radius)):
        one, two = 0.0, 0.0
        for k in range(3):
            one += (start_2[s, k] - start[s, k]) ** 2
            two += (end_2[s, k] - end[s, k]) ** 2
        chord = max(chord, one, two)
    chord = np.sqrt(chord)
    clear = limit - STEEPEST * (chord + sag)  # the motion stays within chord + sag of its last pose
    last, _, _ = largest_excess(fine, coarse, numbers, start, end, radius, 1.0, start_2, end_2, clear)
    if last <= clear:
        return True
    if last > limit:
        limit, _, _ = largest_excess(fine, coarse, numbers, start, end, radius, 0.0, start_2, end_2, limit)
        if last > limit:
            return False
    left = between / STEEPEST - sag
    if not left > 0.0:
        return False
    poses = int(np.ceil(0.5 * chord / left))
    if poses > most:
        return False
    for n in range(1, poses):
        if largest_excess(fine, coarse, numbers, start, end, radius, n / poses, start_2, end_2, limit)[0] > limit:
            return False
    return True


@compiled
def _direction(fine: Any, coarse: Any, numbers: Any, place: Any, out: Any) -> bool:
    """Write the unit direction out of the region at a point, by differences over one grid step, or more deep inside."""
    reach = numbers[FINE + 3]
    for _ in range(4):
        size = 0.0
        for k in range(3):
            x, y, z = place[0], place[1], place[2]
            dx, dy, dz = reach * (k == 0), reach * (k == 1), reach * (k == 2)
            ahead, _ = _distance(fine, coarse, numbers, x + dx, y + dy, z + dz)
            behind, _ = _distance(fine, coarse, numbers, x - dx, y - dy, z - dz)
            out[k] = 0.0 if ahead == _FAR or behind == _FAR else (ahead - behind) / (2.0 * reach)
            size += out[k] * out[k]
        size = np.sqrt(size)
        if size > _FLAT:
            for k in range(3):
                out[k] /= size
            return True
        reach *= 2.0
    return False


@compiled
def contacts(
    fine: Any, coarse: Any, numbers: Any, start: Any, end: Any, radius: Any, ahead: float, limit: float, found: Any
) -> int:
    """Write the deepest point of every window of the tool's axes that is in the region or can be in the next step.

    ahead: largest displacement of the tool in the step, mm; limit: excess above which a row is needed.
    found: (m, CONTACT) out; returns the number of contacts written.
    """
    count = 0
    place, along, out = np.empty(3), np.empty(3), np.empty(3)
    for s in range(len(radius)):
        length = 0.0
        for k in range(3):
            along[k] = end[s, k] - start[s, k]
            length += along[k] * along[k]
        length, at, window, kept = np.sqrt(length), 0.0, -1, -np.inf
        while True:
            t = at / length if length > 0.0 else 0.0
            for k in range(3):
                place[k] = start[s, k] + t * along[k]
            distance, error = _distance(fine, coarse, numbers, place[0], place[1], place[2])
            depth = numbers[LAYER] + radius[s] - distance
            excess = depth + error - _allowed(numbers, place[0], place[1], place[2])
            if depth > -ahead or excess > limit - ahead:
                if int(at / WINDOW_MM) != window:
                    window, kept = int(at / WINDOW_MM), -np.inf
                    if count == len(found):
                        return count
                    count += 1
                    found[count - 1, 4] = -np.inf
                if depth > kept:
                    kept = depth
                    row = found[count - 1]
                    row[0], row[4], row[5] = s, depth, excess
                    for k in range(3):
                        row[1 + k] = place[k]
            if at >= length:
                break
            free = min(-ahead - depth, (limit - ahead - excess) / STEEPEST)
            advance = min(max(free, 2.0 * LEAST_ADVANCE_MM), _LONGEST_ADVANCE_MM)
            at = min(at + (error if distance == _FAR else advance), length)
    for n in range(count):
        for k in range(3):
            place[k] = found[n, 1 + k]
        knows = _direction(fine, coarse, numbers, place, out)
        for k in range(3):
            found[n, 6 + k] = out[k] if knows else 0.0
    return count


@compiled
def contact_rows(numbers: Any, chosen: Any, hard: bool, position: Any, jacobian: Any, matrix: Any) -> None:
    """Write rows over Δq (the first n columns) of the growth of the contacts' depth, or of their excess (``hard``)."""
    normal, place = np.empty(3), np.empty(3)
    for n in range(len(chosen)):
        away = 0.0
        for k in range(3):
            place[k], normal[k] = chosen[n, 1 + k], chosen[n, 6 + k]
            away += (place[k] - numbers[DEEPER + k]) ** 2
        away = np.sqrt(away)
        edge = numbers[DEEPER + 4] - numbers[DEEPER + 5] * (away - numbers[DEEPER + 3])
        if hard and away > numbers[DEEPER + 3] and edge > numbers[DEPTH]:
            for k in range(3):  # the greatest depth decreases away from the centre of the deeper place
                normal[k] -= numbers[DEEPER + 5] * (place[k] - numbers[DEEPER + k]) / away
        approach(normal, place, position, jacobian, matrix[n])
