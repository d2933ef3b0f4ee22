"""The shaft's directions of a plan as the engine takes them: over the arc length of the path."""

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
    """The planned directions of the shaft, at the points of the plan that have one; None where none has.

    Raises PlanError where two neighbouring directions are opposite, with the points' labels.
    """
    return shaft_at(plan.points, path)


def shaft_at(points: tuple[PlanPoint, ...], path: SplinePath) -> ShaftDirections | None:
    """As `shaft_of`, of the path's points."""
    given = [(s, point) for s, point in zip(point_stations(points, path), points, strict=True) if point.direction]
    if not given:
        return None
    rolls = [math.nan if point.roll_deg is None else math.radians(point.roll_deg) for _, point in given]
    for (_, first), (_, second) in pairwise(given):
        if np.dot(first.direction or (), second.direction or ()) < -1.0 + 1e-9:
            raise PlanError(
                f"the shaft's directions at {first.label} and {second.label} are opposite; turn one of them."
            )
    return ShaftDirections(
        np.array([s for s, _ in given]), np.array([p.direction for _, p in given]), np.array(rolls)
    )  # fmt: skip


def point_stations(points: tuple[PlanPoint, ...], path: SplinePath) -> list[float]:
    """Arc length of each path point in mm, increasing along the path even where it passes a place twice."""
    chords = np.linalg.norm(np.diff([point.position for point in points], axis=0), axis=1)
    found, guess = [0.0], 0.0
    for point, chord in zip(points[1:], chords, strict=True):
        guess = found[-1] + float(chord)
        s = float(path.closest(np.array(point.position), min(guess, path.length), max(2.0, float(chord)))[0])
        found.append(max(s, math.nextafter(found[-1], math.inf)))
    found[-1] = max(path.length, found[-1])
    return found
