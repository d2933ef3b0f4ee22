"""Control bends: the largest bends within the pathway in four or eight directions (Kwok 2013, eq. 14-20)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from ...arrays import Array
from ...errors import InputError
from .bending import DIRECTIONS, BendAxis, BendProblem
from .bending_kernel import DistalPathway, Family
from .bending_search import UTMOST, direction, search, survey

EVALUATIONS = 100  # Kwok 2013, section IV.B
_FAR = 4.0  # [q_max] first and last joint of a planar bend; Kwok 2013, fig. 4 has 2.7
_SCALE = 6.0  # α and β at most; Kwok 2013, fig. 4 has 3.35
_ZOOMS = 2
_FEWEST = 40  # evaluations of one search


@dataclass(frozen=True, eq=False)
class DistalBend:
    """One bend of the distal links.

    delta: (2L',) Δq in rad with joints at their limits, read-only. parameters: (m, q_c) in rad of (10), or (α, β) of
    (19). cost: z_eff/z_max of (14) and (20). angle: ϑ in rad. evaluations: of the query. feasible: whether the links'
    rest was within the bounds; where it was not, no link is deeper than it was at rest.
    """

    delta: Array
    parameters: tuple[float, float]
    cost: float
    angle: float
    evaluations: int
    feasible: bool


class Survey(NamedTuple):
    """Result of an exhaustive search: the best bend that its ray reaches, the best of all, exits of the rays (n, 2)."""

    reachable: DistalBend
    anywhere: DistalBend
    exits: Array


class _Side(NamedTuple):
    """Bends in one direction: their family, ϑ in rad, and (a, b) → the paper's parameters (2, 2)."""

    family: Family
    angle: float
    to_parameters: Array


def optimise_primary(problem: BendProblem, direction: BendAxis, evaluations: int = EVALUATIONS) -> DistalBend:
    """The planar bend (10) in one direction with the least z_eff/z_max within the bounds (14)-(17).

    Raises:
        InputError: another direction, or fewer than 40 evaluations.
    """
    return _optimised(problem, _planar(problem, direction), evaluations, *_within(problem))


def control_bends(problem: BendProblem, count: Literal[4, 8], evaluations: int = EVALUATIONS) -> tuple[DistalBend, ...]:
    """The four bends along the axes, or these and the four between them, by rising ϑ from 0.

    Each is searched with at most ``evaluations`` of the query.

    Raises:
        InputError: another count, or fewer than 40 evaluations.
    """
    if count not in (4, 8):
        raise InputError(f"there are 4 or 8 control bends, not {count}")
    within = _within(problem)
    bends = [_optimised(problem, _planar(problem, heading), evaluations, *within) for heading in DIRECTIONS]
    if count == 4:
        return tuple(bends)
    found: list[DistalBend] = []
    for one, two in zip(bends, [*bends[1:], bends[0]], strict=True):
        found += [one, _optimised(problem, _between(problem, one, two), evaluations, *within)]
    return tuple(found)


def search_globally(problem: BendProblem, heading: BendAxis | tuple[DistalBend, DistalBend], grid: int = 201) -> Survey:
    """Exhaustive search of the same problem: ``grid`` directions at ``grid`` radii each, then closer to the best.

    For tests and figures. ``heading``: a direction, or the two bends between which one is searched.
    """
    side = _between(problem, *heading) if isinstance(heading, tuple) else _planar(problem, heading)
    lumen, feasible = _within(problem)
    width = 2.0 * UTMOST / grid
    first = width * (0.5 + np.arange(grid)) - UTMOST
    places = np.array(first, dtype=np.float64)
    exits = np.empty(0)
    best, best_any = (0.0, 0.0, 1.0), (0.0, 0.0, 1.0)
    asked = 0
    for zoom in range(1 + _ZOOMS):
        left = np.empty(len(places))
        a, b, cost, any_a, any_b, any_cost, at = survey(lumen, side.family, places, grid, left, problem.scratch())
        asked += len(places) * grid
        exits = left if zoom == 0 else exits
        if cost < best[2]:
            best, middle = (a, b, cost), at
        best_any = min(best_any, (any_a, any_b, any_cost), best, key=lambda found: found[2])
        if best[2] >= 1.0:
            break
        places[:] = middle + width * np.linspace(-1.0, 1.0, grid)
        width *= 2.0 / grid
    reachable = _bend(problem, side, best, asked, feasible)
    anywhere = _bend(problem, side, best_any, asked, feasible)
    phi = np.array([direction(side.family, t) for t in first])
    rays = exits[:, None] * np.column_stack([np.cos(phi), np.sin(phi)])
    return Survey(reachable, anywhere, rays @ side.to_parameters.T)


def _within(problem: BendProblem) -> tuple[DistalPathway, bool]:
    """The links in their pathway with b_i, or D_i at rest where that is larger (a pathway that moved).

    Also whether none is larger.
    """
    at_rest = problem.deviations(np.zeros(problem.snake.dof))
    return problem.lumen(np.maximum(problem.bound, at_rest)), bool((at_rest <= problem.bound).all())


def _planar(problem: BendProblem, direction: BendAxis) -> _Side:
    """(10) by the first and the last joint's value in q_max instead of (m, q_c), so that both have the same scale."""
    if direction not in DIRECTIONS:
        raise InputError(f"{direction!r} is none of the directions {', '.join(DIRECTIONS)}")
    snake, quarter = problem.snake, DIRECTIONS[direction]
    links, odd = snake.links, quarter % 2 == 1
    sign = snake.q_max * (1.0 if quarter in (0, 3) else -1.0)
    share = np.linspace(0.0, 1.0, links) if links > 1 else np.ones(1)
    plane = np.zeros((2, 2 * links))
    plane[:, (0 if odd else 1) :: 2] = sign * np.array([1.0 - share, share])
    # To first order the tip moves by ℓ Σ (L' − k) Δq_k: the half plane in which that is the desired direction.
    lever = np.arange(links, 0, -1)
    middle = math.atan2(float(lever @ share), float(lever @ (1.0 - share)))
    towards = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[quarter]
    family = Family(plane, towards, middle - 0.5 * math.pi, middle + 0.5 * math.pi, _FAR)
    slope = sign / (2 * links - 2) if links > 1 else 0.0  # m (i − 2L') + q_c is b at the last joint, a at the first
    to_parameters = np.array([[-slope, slope], [0.0, sign]])
    if odd:
        to_parameters[1] += to_parameters[0]  # the last odd joint is 2L' − 1
    return _Side(family, quarter * 0.5 * math.pi, to_parameters)


def _between(problem: BendProblem, one: DistalBend, two: DistalBend) -> _Side:
    """(19): α at the first joint, going over to β at the last."""
    turn = (two.angle - one.angle) % (2.0 * math.pi)
    mean = 0.5 * (one.delta + two.delta)  # (18)
    share = np.arange(1, len(mean) + 1) / len(mean)
    plane = np.array([(1.0 - share) * mean, share * mean])
    family = Family(plane, (0.0, 0.0), 0.0, 0.5 * math.pi, _SCALE)
    return _Side(family, (one.angle + 0.5 * turn) % (2.0 * math.pi), np.eye(2))


def _optimised(problem: BendProblem, side: _Side, evaluations: int, lumen: DistalPathway, feasible: bool) -> DistalBend:
    if not isinstance(evaluations, int | np.integer) or evaluations < _FEWEST:
        raise InputError(f"a bend takes a whole number of at least {_FEWEST} evaluations, not {evaluations!r:.20}")
    a, b, cost, made = search(lumen, side.family, evaluations - 1, problem.scratch())
    return _bend(problem, side, (a, b, cost), made + 1, feasible)


def _bend(
    problem: BendProblem, side: _Side, found: tuple[float, float, float], evaluations: int, feasible: bool
) -> DistalBend:
    a, b, cost = found
    limit, plane = problem.snake.q_max, side.family.plane
    delta = np.clip(problem.q_nominal + (a * plane[0] + b * plane[1]), -limit, limit) - problem.q_nominal
    delta.setflags(write=False)
    one, two = side.to_parameters @ (a, b)
    return DistalBend(delta, (float(one), float(two)), cost, side.angle, evaluations, feasible)
