"""Widest route of a tool's tip through the air, from an entry to a target."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError
from ..validate import point
from .room import Room

GRID_MM = 1.0  # spacing of the search grid
AROUND_MM = 15.0  # extent of the grid around entry and target
REACHED_MM = 4.0  # a route that ends this near to the target has reached it, since targets can lie on walls
LONGEST_MM = 350.0  # between entry and target
SPACING_MM = 6.0  # between the points of a smoothed route
_AIR_MM = 0.1  # smallest distance of the tip's axis from soft tissue
_WIDE_MM = 5.0  # a larger clearance has no further benefit
_NARROW_MM = 0.2  # a smaller clearance counts as this
_TOLERANCE_MM = 0.6  # root mean square displacement allowed in smoothing


@dataclass(frozen=True, eq=False)
class TipWay:
    """A route of the tip, positions (n, 3) in LPS mm from the entry.

    reached: whether it reaches the target; gap_mm: distance of its end from there.
    in_the_way: what lies between its end and the target, 'bone', 'soft tissue' or 'the end of the scan'; '' if reached.
    """

    places: Array
    reached: bool
    gap_mm: float
    in_the_way: str


def widest_way(room: Room, entry: ArrayLike, target: ArrayLike, radius_mm: float, margin_mm: float) -> TipWay:
    """Find the route that minimises ∫ 1 / clearance² ds for a tip with a radius.

    The tip stays outside the margin to bone, and its axis in air.
    The search covers the box of entry and target extended by 15 mm, as far as the scan reaches.

    Raises:
        InputError: the entry is in bone, in soft tissue or outside the scan, or a point is not finite.
    """
    first, last = point("the entry", entry), point("the target", target)
    origin, shape = _box(first, last)
    cost = _costs(room, origin, shape, radius_mm + margin_mm)
    start, goal = (_cell(p, origin, shape) for p in (first, last))
    start = _free_near(cost, start, origin, first)
    from skimage.graph import MCP_Geometric  # imported here: slow to load

    graph: Any = MCP_Geometric(cost)
    ends = [goal] if cost[goal] > 0.0 else None
    costs, _ = graph.find_costs([start], ends)
    end = goal if ends and np.isfinite(costs[goal]) else _nearest_reached(costs, last, origin)
    places = np.array(graph.traceback(end), dtype=np.float64)[:, ::-1] * GRID_MM + origin
    gap = 0.0 if end == goal else float(np.linalg.norm(places[-1] - last))
    reached = gap <= REACHED_MM
    places[0] = first
    if end == goal:
        places[-1] = last
    return TipWay(places, reached, gap, "" if reached else _between(room, places[-1], last))


def smoothed(places: ArrayLike, spacing_mm: float = SPACING_MM) -> Array:
    """Return few points (m, 3) on a smoothing cubic spline through a route (n, 3); the ends are fixed."""
    way = np.asarray(places, dtype=np.float64)
    kept = np.concatenate([[True], np.linalg.norm(np.diff(way, axis=0), axis=1) > 1e-6])
    way = way[kept]
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1))])
    if len(way) < 4:
        return np.array(way)
    from scipy.interpolate import splev, splprep  # imported here: slow to load

    spline, _ = splprep(way.T, u=along, s=len(way) * _TOLERANCE_MM**2, k=3)
    count = max(round(along[-1] / spacing_mm), 2) + 1
    points: Array = np.array(splev(np.linspace(0.0, along[-1], count), spline)).T
    points[0], points[-1] = way[0], way[-1]
    return points


def _box(first: Array, last: Array) -> tuple[Array, tuple[int, int, int]]:
    """Origin (3,) and shape (K, J, I) of the grid, which has the target at one of its points."""
    low = np.minimum(first, last) - AROUND_MM
    origin = last - GRID_MM * np.ceil((last - low) / GRID_MM)
    apart = float(np.linalg.norm(last - first))
    counts = np.ceil((np.maximum(first, last) + AROUND_MM - origin) / GRID_MM).astype(int) + 1
    if apart > LONGEST_MM:
        raise InputError(f"entry and target are {apart:.0f} mm apart; a way is up to {LONGEST_MM:g} mm long")
    return origin, (int(counts[2]), int(counts[1]), int(counts[0]))


def _costs(room: Room, origin: Array, shape: tuple[int, int, int], away: float) -> Array:
    """Cost (K, J, I) per mm at each grid point; −1 where the tip must not be."""
    k, j, i = np.indices(shape).reshape(3, -1)
    places = origin + GRID_MM * np.column_stack([i, j, k])
    bone = room.bone.at(places)
    tissue = bone if room.tissue is None else room.tissue.at(places)
    width = np.minimum(np.minimum(tissue, bone - away), _WIDE_MM)
    free = (tissue > _AIR_MM) & (bone > away)  # False for NaN, i.e. unknown
    cost = np.where(free, 1.0 / np.maximum(width, _NARROW_MM) ** 2, -1.0)
    found: Array = cost.reshape(shape)
    return found


def _cell(place: Array, origin: Array, shape: tuple[int, int, int]) -> tuple[int, int, int]:
    i, j, k = np.rint((place - origin) / GRID_MM).astype(int).tolist()
    return min(max(k, 0), shape[0] - 1), min(max(j, 0), shape[1] - 1), min(max(i, 0), shape[2] - 1)


def _free_near(cost: Array, cell: tuple[int, int, int], origin: Array, entry: Array) -> tuple[int, int, int]:
    """Return the free cell nearest to the entry, at most 2 mm away."""
    low = [max(c - 2, 0) for c in cell]
    box = cost[tuple(slice(a, c + 3) for a, c in zip(low, cell, strict=True))]
    free = np.argwhere(box > 0.0) + low
    away = np.linalg.norm(free[:, ::-1] * GRID_MM + origin - entry, axis=1)
    if not len(free) or away.min() > 2.0:
        raise InputError("the entry is in bone or soft tissue, or outside of the scan; put it in the air of a nostril")
    k, j, i = free[away.argmin()].tolist()
    return k, j, i


def _nearest_reached(costs: Array, goal: Array, origin: Array) -> tuple[int, int, int]:
    """Return the reached cell nearest to the goal."""
    reached = np.argwhere(np.isfinite(costs))
    away = np.linalg.norm(reached[:, ::-1] * GRID_MM + origin - goal, axis=1)
    k, j, i = reached[away.argmin()].tolist()
    return k, j, i


def _between(room: Room, end: Array, goal: Array) -> str:
    """Return what most of the straight line from the end to the goal runs through."""
    places = end + np.linspace(0.0, 1.0, 80)[:, None] * (goal - end)
    bone = room.bone.at(places)
    if np.isnan(bone).any():
        return "the end of the scan"
    return "bone" if room.tissue is None or (bone < 1.0).any() else "soft tissue"
