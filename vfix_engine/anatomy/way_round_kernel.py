"""Smallest sideways distance at which air leads round tissue that an axis passes, compiled.

Grids are indexed [k, j, i] along z, y, x. A lattice of `LATTICE_MM` around a part of the axis is flooded in the order
of the distance to the axis, and evaluated only where the flood arrives.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from vfix_engine.geometry.grid_value import grid_value
from vfix_engine.kernels.compiled import compiled, nogil, shared

LATTICE_MM = 0.5
REACH_MM = 15.0  # largest distance of a route from the axis
WINDOW_MM = 15.0  # of the axis beyond both ends of the tissue, where a route may begin and end
TISSUE, AIR, ROOM, UNKNOWN = range(4)
_BIN_MM = 0.05  # accuracy of the result
_BINS = int((REACH_MM + 5.0) / _BIN_MM)
_SEEN, _GOAL, _BEGIN = 1, 2, 4


@shared
def _to_tissue(fine: Any, whole: Any, x: float, y: float, z: float) -> float:
    """Distance to tissue in mm, from the finer grid that contains the point; NaN outside both."""
    found = grid_value(fine[0], fine[1], fine[2], x, y, z)
    if found == found:
        return found
    return grid_value(whole[0], whole[1], whole[2], x, y, z)


@shared
def _kind(kinds: Any, x: float, y: float, z: float) -> int:
    """AIR, ROOM or UNKNOWN at a point, by the nearest cell; UNKNOWN beyond the grid."""
    values, origin, step = kinds
    i = math.floor((x - origin[0]) / step + 0.5)
    j = math.floor((y - origin[1]) / step + 0.5)
    k = math.floor((z - origin[2]) / step + 0.5)
    if 0 <= k < values.shape[0] and 0 <= j < values.shape[1] and 0 <= i < values.shape[2]:
        return int(values[k, j, i])
    return UNKNOWN


@compiled
def kinds_along(fine: Any, whole: Any, kinds: Any, points: Any, half_mm: float) -> Any:
    """Classify points (n, 3): UNKNOWN, TISSUE, or the AIR or ROOM of a ball of radius `half_mm` that contains it."""
    out = np.empty(len(points), np.uint8)
    near = half_mm + 0.5 * LATTICE_MM
    most = math.ceil(near / LATTICE_MM)
    for n in range(len(points)):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        kind, depth = _kind(kinds, x, y, z), _to_tissue(fine, whole, x, y, z)
        if kind == UNKNOWN or depth != depth:
            out[n] = UNKNOWN
            continue
        out[n] = TISSUE
        if depth >= half_mm:
            out[n] = kind
        elif depth > 0.0:
            ci, cj, ck = round(x / LATTICE_MM), round(y / LATTICE_MM), round(z / LATTICE_MM)
            for k in range(ck - most, ck + most + 1):
                for j in range(cj - most, cj + most + 1):
                    for i in range(ci - most, ci + most + 1):
                        px, py, pz = i * LATTICE_MM, j * LATTICE_MM, k * LATTICE_MM
                        close = (px - x) ** 2 + (py - y) ** 2 + (pz - z) ** 2 <= near * near
                        if close and _to_tissue(fine, whole, px, py, pz) >= half_mm:
                            out[n] = kind
    return out


@shared
def _to_axis(nodes: Any, x: float, y: float, z: float) -> float:
    """Distance of a point to a polyline (m, 3)."""
    least = math.inf
    for s in range(len(nodes) - 1):
        ax, ay, az = nodes[s, 0], nodes[s, 1], nodes[s, 2]
        dx, dy, dz = nodes[s + 1, 0] - ax, nodes[s + 1, 1] - ay, nodes[s + 1, 2] - az
        size = dx * dx + dy * dy + dz * dz
        share = 0.0
        if size > 0.0:
            share = min(max(((x - ax) * dx + (y - ay) * dy + (z - az) * dz) / size, 0.0), 1.0)
        ex, ey, ez = x - ax - share * dx, y - ay - share * dy, z - az - share * dz
        least = min(least, ex * ex + ey * ey + ez * ez)
    return math.sqrt(least)


@shared
def _passes(fine: Any, whole: Any, kinds: Any, x: float, y: float, z: float, half_mm: float, through: bool) -> int:
    """1 if a ball of radius `half_mm` is in air, 0 if it is not, -1 if that is unknown."""
    room = _to_tissue(fine, whole, x, y, z)
    if room != room or _kind(kinds, x, y, z) == UNKNOWN:
        return 1 if through else -1
    return 1 if room >= half_mm else 0


@shared
def _more(gives: Any, x: float, y: float, z: float) -> float:
    """Difference by which the tissue of an axis yields less at its point nearest to a position."""
    tissue, entry, near_mm, more_mm = gives
    if more_mm == 0.0:
        return 0.0
    least, at_x, at_y, at_z = math.inf, 0.0, 0.0, 0.0
    for n in range(len(tissue)):
        px, py, pz = tissue[n, 0], tissue[n, 1], tissue[n, 2]
        away = (x - px) ** 2 + (y - py) ** 2 + (z - pz) ** 2
        if away < least:
            least, at_x, at_y, at_z = away, px, py, pz
    from_entry = (at_x - entry[0]) ** 2 + (at_y - entry[1]) ** 2 + (at_z - entry[2]) ** 2
    return more_mm if from_entry > near_mm * near_mm else 0.0


@shared
def _mark_beside(points: Any, low: Any, near: float, mark: Any, value: int) -> None:
    """Mark the cells of a lattice within `near` of points (n, 3)."""
    most = math.ceil(near / LATTICE_MM)
    for n in range(len(points)):
        ci = round(points[n, 0] / LATTICE_MM) - low[0]
        cj = round(points[n, 1] / LATTICE_MM) - low[1]
        ck = round(points[n, 2] / LATTICE_MM) - low[2]
        for k in range(max(ck - most, 0), min(ck + most + 1, mark.shape[0])):
            for j in range(max(cj - most, 0), min(cj + most + 1, mark.shape[1])):
                for i in range(max(ci - most, 0), min(ci + most + 1, mark.shape[2])):
                    x, y, z = (i + low[0]) * LATTICE_MM, (j + low[1]) * LATTICE_MM, (k + low[2]) * LATTICE_MM
                    away = (x - points[n, 0]) ** 2 + (y - points[n, 1]) ** 2 + (z - points[n, 2]) ** 2
                    if away <= near * near:
                        mark[k, j, i] |= value


@nogil
def way_round(
    fine: Any,
    whole: Any,
    kinds: Any,
    nodes: Any,
    window: Any,
    outer: Any,
    inner: Any,
    half_mm: float,
    through: bool,
    gives: Any,
) -> Any:
    """Smallest distance from an axis within which air leads from one side of tissue to the other, and its location.

    Args:
        fine, whole: (values, origin, step) of the distance to tissue; kinds: of AIR, ROOM and UNKNOWN.
        nodes: (m, 3) polyline of the axis, from the tip on. window: (n, 3) points of it around the tissue; a route
            may extend beside them as far as the search reaches. outer, inner: points (n, 3) of it in the air on both
            sides; if `inner` is empty, the axis ends in the tissue at nodes[0], and the route leads to air that is as
            near to that end as the route is to the axis.
        half_mm: radius of the ball that moves along the route; the distance is that of its side that faces the axis.
        through: whether unknown space is treated as air.
        gives: (tissue (n, 3), entry (3,), near_mm, more_mm): the distance of a position is increased by more_mm if the
            nearest point of the tissue, which yields less by that, is farther than near_mm from the entry.

    Returns (5,): the distance, inf if there is none within REACH_MM; 1 if the flood met unknown space, else 0; and the
    point (3,) at which the route is farthest.
    """
    near, top = half_mm + 0.5 * LATTICE_MM, REACH_MM + half_mm
    low, shape = np.empty(3, np.int64), np.empty(3, np.int64)
    for axis in range(3):
        low[axis] = math.floor((window[:, axis].min() - top) / LATTICE_MM)
        shape[2 - axis] = math.ceil((window[:, axis].max() + top) / LATTICE_MM) - low[axis] + 1
    plane, row = shape[1] * shape[2], shape[2]
    mark = np.zeros((shape[0], shape[1], shape[2]), np.uint8)
    after = np.empty(shape[0] * plane, np.int32)
    heads = np.full(_BINS, -1, np.int32)
    out = np.array([math.inf, 0.0, math.nan, math.nan, math.nan])
    _mark_beside(inner, low, near, mark, _GOAL)
    _mark_beside(outer, low, near, mark, _BEGIN)
    # Only the cells next to `outer` are visited again: those of the whole lattice are many more.
    most = math.ceil(near / LATTICE_MM)
    for n in range(len(outer)):
        ci = round(outer[n, 0] / LATTICE_MM) - low[0]
        cj = round(outer[n, 1] / LATTICE_MM) - low[1]
        ck = round(outer[n, 2] / LATTICE_MM) - low[2]
        for k in range(max(ck - most, 0), min(ck + most + 1, shape[0])):
            for j in range(max(cj - most, 0), min(cj + most + 1, shape[1])):
                for i in range(max(ci - most, 0), min(ci + most + 1, shape[2])):
                    if mark[k, j, i] & (_BEGIN | _SEEN) != _BEGIN:
                        continue
                    mark[k, j, i] |= _SEEN
                    x, y, z = (i + low[0]) * LATTICE_MM, (j + low[1]) * LATTICE_MM, (k + low[2]) * LATTICE_MM
                    if _passes(fine, whole, kinds, x, y, z, half_mm, through) == 1:
                        away = _to_axis(nodes, x, y, z) + _more(gives, x, y, z)
                        at, cell = int(away / _BIN_MM), k * plane + j * row + i
                        after[cell], heads[at] = heads[at], cell
    to_tip, best, farthest = len(inner) == 0, math.inf, -1
    top_counted = top + gives[3]
    more_at_tip = _more(gives, nodes[0, 0], nodes[0, 1], nodes[0, 2])
    for at in range(int(top_counted / _BIN_MM) + 1):
        reached = at * _BIN_MM
        if reached >= best:
            break
        while heads[at] >= 0:
            cell = heads[at]
            heads[at] = after[cell]
            k, j, i = cell // plane, cell % plane // row, cell % row
            x, y, z = (i + low[0]) * LATTICE_MM, (j + low[1]) * LATTICE_MM, (k + low[2]) * LATTICE_MM
            if at > farthest:
                farthest = at
                out[2], out[3], out[4] = x, y, z
            if to_tip:
                tip = math.sqrt((x - nodes[0, 0]) ** 2 + (y - nodes[0, 1]) ** 2 + (z - nodes[0, 2]) ** 2)
                best = min(best, max(reached, tip + more_at_tip))
            elif mark[k, j, i] & _GOAL:
                out[0] = max(reached - half_mm, 0.0)
                return out
            for n in range(6):
                step = 1 if n % 2 else -1
                pk, pj, pi = k, j, i
                if n < 2:
                    pk += step
                elif n < 4:
                    pj += step
                else:
                    pi += step
                if not (0 <= pk < shape[0] and 0 <= pj < shape[1] and 0 <= pi < shape[2]):
                    continue
                if mark[pk, pj, pi] & _SEEN:
                    continue
                mark[pk, pj, pi] |= _SEEN
                px, py, pz = (pi + low[0]) * LATTICE_MM, (pj + low[1]) * LATTICE_MM, (pk + low[2]) * LATTICE_MM
                away = _to_axis(nodes, px, py, pz)
                if away > top:
                    continue
                passes = _passes(fine, whole, kinds, px, py, pz, half_mm, through)
                if passes == 1:
                    away += _more(gives, px, py, pz)
                    to, other = max(int(away / _BIN_MM), at), pk * plane + pj * row + pi
                    after[other], heads[to] = heads[to], other
                elif passes < 0:
                    out[1] = 1.0
    if best <= top_counted:
        out[0] = max(best - half_mm, 0.0)
    return out
