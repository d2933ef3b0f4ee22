"""Orientations of the shaft along a path, ranked by the bone and the soft tissue that the whole tool would touch.

The same orientations are measured at every station of the path: directions in a cone about the path's chord, and for a
bent tool several rolls of each. A ranking selects one of them for the whole path, or lets the orientation change from
station to station within the robot's rotation speed; the best sequence is found by dynamic programming (Viterbi).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..anatomy.piercing import Ways
from ..arrays import Array, IntArray
from ..geometry.path import SplinePath
from ..geometry.shaft_directions import ShaftDirections, roll_of, rolled_frame
from ..kernels.threads import threads
from ..robots import Tool
from .room import Figures, Room

CONE_DEG, BENT_CONE_DEG = 34.0, 26.0  # half angles of the cone of directions
DIRECTIONS, BENT_DIRECTIONS, ROLLS = 1000, 140, 24
SAMPLE_MM = 1.0  # sample spacing along the tool
MOST_TURN_DEG_PER_MM = 1.2  # of the shaft along the path: a hand moves at up to 10 mm/s, a long shaft turns at 15°/s
MOST_ROLL_DEG_PER_MM = 4.0
_NEIGHBOURS = 48  # of a direction that are considered in the next station
COMFORT_MM = 1.2  # clearance beyond margin plus this has no further benefit
_BLOCKED = 100.0  # cost of a pose inside the margin; finite, since fields are not exact
_PIERCES_PER_MM = 20.0  # cost of each mm by which the air route round tissue exceeds what tissue yields, up to _BLOCKED
_PIERCES_RESERVE_MM = 1.0  # subtracted from what tissue yields, since a few orientations represent all
_PIERCES_DIRECTIONS, _PIERCES_ROLLS = 40, 6  # orientations for which piercing is evaluated
_PIERCES_EVERY_MM = 12.0  # station spacing of that evaluation
_STEADY = 0.002  # cost of a rotation per degree squared
_CHORD = 0.7  # fraction of the path that its chord spans
_MEASURED = 0.1  # fraction of the work that measures bone and tissue, where piercing is evaluated too


@dataclass(frozen=True)
class Ranking:
    """Cost of an orientation: weights of missing bone clearance, of the depth in tissue and of the length in tissue."""

    bone: float = 5.0
    depth: float = 0.3
    touched: float = 0.1


@dataclass(frozen=True, eq=False)
class _Grid:
    """Orientations: axes (d, 3) of the shaft towards the tip, frames (d · r, 3, 3), r rolls of each axis."""

    axes: Array
    frames: Array
    rolls: int


def ranked_shafts(
    room: Room,
    tool: Tool,
    path: SplinePath,
    stations: Array,
    margin_mm: float,
    rankings: tuple[Ranking, ...],
    steady: int,
    done: Callable[[float], object] = bool,
    ways: Ways | None = None,
) -> list[ShaftDirections]:
    """Plans of the shaft along a path: the best varying one of each ranking, and the ``steady`` best constant ones.

    Args:
        stations: (m,) arc lengths at which the plan has an orientation, including both ends of the path.
        done: called with the fraction that is done, often; an exception from it ends the search.
        ways: if given, piercing tissue adds to the cost of an orientation; that takes seconds.
    """
    grid = _orientations(path, tool)
    middle = 0.5 * (stations[1:] + stations[:-1])
    places, quick = np.concatenate([stations, middle]), 1.0 if ways is None else _MEASURED
    measured = _measured(room, tool, grid, path.position(places), lambda fraction: done(quick * fraction))
    at, between = measured[: len(stations)], measured[len(stations) :]
    plans = list[ShaftDirections]()
    pierces: Array | float = 0.0
    if ways is not None:
        rest = 1.0 - quick
        pierces = _piercing_cost(grid, tool, path, stations, ways, lambda fraction: done(quick + rest * fraction))
    for ranking in rankings:
        cost = np.stack([_cost(f, ranking, margin_mm) for f in at]) + pierces
        half = np.stack([_cost(f, ranking, margin_mm) for f in between])
        cost[:-1] += 0.5 * half
        cost[1:] += 0.5 * half
        plans.append(_plan(stations, grid.frames[_best_sequence(cost, grid, np.diff(stations))], tool))
    cost = np.sum(pierces + np.zeros((1, 1)), axis=0)
    cost = cost + sum(np.stack([_cost(f, rankings[0], margin_mm) for f in part]).sum(axis=0) for part in (at, between))
    for number in _spread(cost, grid, steady):
        plans.append(_plan(stations[:1], grid.frames[number][None], tool))
    return plans


def _plan(stations: Array, frames: Array, tool: Tool) -> ShaftDirections:
    rolls = np.array([roll_of(frame) for frame in frames]) if tool.bend > 0.0 else None
    return ShaftDirections(stations, -frames[:, :, 1], rolls)


def _orientations(path: SplinePath, tool: Tool) -> _Grid:
    """Directions distributed evenly over a cone about the path's chord; their rolls are transported from the chord."""
    chord = path.position(_CHORD * path.length) - path.position(0.0)
    chord = chord / np.linalg.norm(chord)
    bent = tool.bend > 0.0
    count, cone, rolls = (BENT_DIRECTIONS, BENT_CONE_DEG, ROLLS) if bent else (DIRECTIONS, CONE_DEG, 1)
    number = np.arange(count) + 0.5
    along = 1.0 - number / count * (1.0 - np.cos(np.radians(cone)))
    around = np.pi * (1.0 + np.sqrt(5.0)) * number
    upright = rolled_frame(-chord, 0.0)
    side, up = upright[:, 0], upright[:, 2]
    lean = np.cos(around)[:, None] * side + np.sin(around)[:, None] * up
    axes = along[:, None] * chord + np.sqrt(1.0 - along**2)[:, None] * lean
    frames = np.empty((count, rolls, 3, 3))
    for d, axis in enumerate(axes):
        carried = _smallest_turn(chord, axis) @ upright
        x, z = carried[:, 0], carried[:, 2]
        for r, roll in enumerate(2.0 * np.pi * np.arange(rolls) / rolls):
            c, s = np.cos(roll), np.sin(roll)
            frames[d, r] = np.column_stack([c * x + s * z, axis, c * z - s * x])
    return _Grid(axes, frames.reshape(-1, 3, 3), rolls)


def _smallest_turn(first: Array, second: Array) -> Array:
    """Smallest rotation (3, 3) from one unit vector to another, less than 180° away."""
    v, c = np.cross(first, second), float(first @ second)
    cross = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    turned: Array = np.eye(3) + cross + cross @ cross / (1.0 + c)
    return turned


def _measured(room: Room, tool: Tool, grid: _Grid, places: Array, done: Callable[[float], object]) -> list[Figures]:
    """Measure every orientation at every position."""

    def measured(place: Array) -> Figures:
        there = np.repeat(place[None], len(grid.frames), axis=0)
        return room.figures(tool, grid.frames, there, SAMPLE_MM)

    found = list[Figures]()
    with threads(2) as pool:
        for figures in pool.map(measured, places):
            found.append(figures)
            done(len(found) / len(places))
    return found


def _cost(figures: Figures, ranking: Ranking, margin: float) -> Array:
    """Cost (n,) of the orientations at one position."""
    missing = np.clip(margin + COMFORT_MM - figures.bone, 0.0, 10.0)
    blocked = (figures.bone < margin + 0.05) | (figures.unknown > 0.0)
    cost: Array = ranking.bone * missing**2 + ranking.depth * figures.depth + ranking.touched * figures.touched
    return cost + _BLOCKED * (blocked + missing * (figures.bone < margin))


def _piercing_cost(
    grid: _Grid, tool: Tool, path: SplinePath, stations: Array, ways: Ways, done: Callable[[float], object]
) -> Array:  # fmt: skip
    """Cost (m, n) of piercing tissue at each station, interpolated between those of a coarser grid."""
    from scipy.interpolate import interp1d  # imported here: slow to load
    from scipy.spatial import cKDTree

    directions = np.arange(0, len(grid.axes), max(len(grid.axes) // _PIERCES_DIRECTIONS, 1))
    rolls = np.arange(0, grid.rolls, max(grid.rolls // _PIERCES_ROLLS, 1))
    frames = grid.frames.reshape(len(grid.axes), grid.rolls, 3, 3)[np.ix_(directions, rolls)]
    looked_at = np.linspace(0.0, path.length, int(np.ceil(path.length / _PIERCES_EVERY_MM)) + 1)
    places = path.position(looked_at)
    coarse = np.empty((len(looked_at), *frames.shape[:2]))

    def cost_of(index: tuple[int, ...]) -> float:
        segments = tool.segments(frames[index[1:]], places[index[0]])
        worst = ways.of_pose(segments.start, segments.end).worst
        over = -np.inf if worst is None else worst.over_mm + _PIERCES_RESERVE_MM
        return min(max(_PIERCES_PER_MM * over, 0.0), _BLOCKED)

    with threads(2) as pool:
        every = list(np.ndindex(*coarse.shape))
        for number, (index, found) in enumerate(zip(every, pool.map(cost_of, every), strict=True), 1):
            coarse[index] = found
            done(number / len(every))
    away, near = cKDTree(grid.axes[directions]).query(grid.axes, k=3)
    weight = 1.0 / (away + 1e-3)
    weight /= weight.sum(axis=1, keepdims=True)
    blended = np.einsum("dk,mdkr->mdr", weight, coarse[:, near])
    nearest_roll = np.rint(np.arange(grid.rolls) / grid.rolls * len(rolls)).astype(int) % len(rolls)
    along = interp1d(looked_at, blended[:, :, nearest_roll].reshape(len(looked_at), -1), axis=0)
    along_path: Array = along(np.minimum(stations, path.length))
    return along_path


def _best_sequence(cost: Array, grid: _Grid, lengths: Array) -> IntArray:
    """Orientation (m,) at each station with the least total cost, limited to the robot's rotation speed (Viterbi)."""
    from scipy.spatial import cKDTree  # imported here: slow to load

    count = min(_NEIGHBOURS, len(grid.axes))
    chord, near = cKDTree(grid.axes).query(grid.axes, k=count)
    angle = np.degrees(2.0 * np.arcsin(0.5 * chord))
    total = cost[0].reshape(len(grid.axes), grid.rolls)
    came = list[IntArray]()
    step = 360.0 / grid.rolls
    for here, length in zip(cost[1:], lengths, strict=True):
        turn = np.where(angle <= MOST_TURN_DEG_PER_MM * length, _STEADY * angle**2, np.inf)
        most = min(int(MOST_ROLL_DEG_PER_MM * length / step), (grid.rolls - 1) // 2)
        best = np.full_like(total, np.inf)
        source = np.zeros(total.shape, dtype=np.int64)
        for shift in range(-most, most + 1):
            before = np.roll(total, shift, axis=1) + 0.1 * _STEADY * (shift * step) ** 2
            through = before[near] + turn[:, :, None]  # (d, neighbour, roll)
            least = through.argmin(axis=1)
            value = np.take_along_axis(through, least[:, None], axis=1)[:, 0]
            better = value < best
            best[better] = value[better]
            origin = np.take_along_axis(near, least, axis=1) * grid.rolls
            source[better] = (origin + (np.arange(grid.rolls) - shift) % grid.rolls)[better]
        came.append(source.ravel())
        total = best + here.reshape(total.shape)
    number = int(total.argmin())
    found = [number]
    for source in reversed(came):
        number = int(source[number])
        found.append(number)
    return np.array(found[::-1])


def _spread(cost: Array, grid: _Grid, count: int, apart_deg: float = 6.0) -> list[int]:
    """Indices of the cheapest orientations, no two of them closer than ``apart_deg``."""
    chosen = list[int]()
    for number in np.argsort(cost):
        if len(chosen) == count:
            break
        axis = grid.axes[number // grid.rolls]
        others = [float(axis @ grid.axes[other // grid.rolls]) for other in chosen]
        if all(cosine < np.cos(np.radians(apart_deg)) for cosine in others):
            chosen.append(int(number))
    return chosen
