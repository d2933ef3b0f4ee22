"""The shaft directions of a plan over the arc length of its path, as the engine uses them."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from app.plans.model import Plan
from app.plans.points import PlanPoint
from vfix_engine.errors import PlanError
from vfix_engine.geometry.path import SplinePath
from vfix_engine.geometry.shaft_directions import ShaftDirections


def shaft_of(plan: Plan, path: SplinePath) -> ShaftDirections | None:
    """Return the planned shaft directions at the points that have one; None if no point has one.

    Raises PlanError with the points' labels if two neighbouring directions are opposite.
    """
    return shaft_at(plan.content.points, path)


def shaft_at(points: tuple[PlanPoint, ...], path: SplinePath) -> ShaftDirections | None:
    """Return the shaft directions at path points, as `shaft_of`."""
    directed = [(s, point) for s, point in zip(point_stations(points, path), points, strict=True) if point.direction]
    if not directed:
        return None
    rolls = [math.nan if point.roll_deg is None else math.radians(point.roll_deg) for _, point in directed]
    for (_, first), (_, second) in pairwise(directed):
        if np.dot(first.direction or (), second.direction or ()) < -1.0 + 1e-9:
            raise PlanError(
                f"the shaft's directions at {first.label} and {second.label} are opposite; turn one of them."
            )
    return ShaftDirections(
        np.array([s for s, _ in directed]), np.array([p.direction for _, p in directed]), np.array(rolls)
    )  # fmt: skip


def point_stations(points: tuple[PlanPoint, ...], path: SplinePath) -> list[float]:
    """Return the arc length of each path point in mm, increasing even if the path passes a place twice."""
    chords = np.linalg.norm(np.diff([point.position for point in points], axis=0), axis=1)
    found, guess = [0.0], 0.0
    for point, chord in zip(points[1:], chords, strict=True):
        guess = found[-1] + float(chord)
        s = float(path.closest(np.array(point.position), min(guess, path.length), max(2.0, float(chord)))[0])
        found.append(max(s, math.nextafter(found[-1], math.inf)))
    found[-1] = max(path.length, found[-1])
    return found
