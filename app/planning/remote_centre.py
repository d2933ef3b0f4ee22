"""The remote centre of a rehearsal: a place along the plan's path, by default where it enters the head."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np

from app.kit.cache import Cache
from app.plans.model import Plan
from vfix_engine.anatomy.soft_tissue import surroundings
from vfix_engine.errors import PlanError
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.path import SplinePath
from vfix_engine.virtual_fixtures import RemoteCentre

TOLERANCE_MM = 3.0  # of the tool's axis about the centre: assumed, less than half the width of a nostril
STEP_MM = 0.5  # between the examined places of the path
STAYS_MM = 3.0  # a path that is inside for less than this touches the head, but does not enter it
_INSIDE = ("air_inside", "soft_tissue")
_KNOWN: Cache[str, float] = Cache(32)  # arc lengths at which paths enter their heads


@dataclass(frozen=True)
class PathPlace:
    """A place of the path: a path point by its id, or an arc length in mm; with neither, the entry."""

    point: str | None = None
    at_mm: float | None = None


ENTRY = PathPlace()


def path_of(plan: Plan) -> SplinePath:
    """Return the path of a plan. Raises PlanError for fewer than two points."""
    if len(plan.content.points) < 2:
        raise PlanError("a path needs at least two points.")
    return SplinePath(np.array([point.position for point in plan.content.points], dtype=np.float64))


def point_places(plan: Plan, path: SplinePath) -> list[float]:
    """Return the arc length of each path point in mm."""
    return [float(path.closest(np.array(point.position, dtype=np.float64))[0]) for point in plan.content.points]


def entry_mm(plan: Plan, path: SplinePath, volume: Volume | None) -> float:
    """Return the arc length in mm where the path enters the head: the first place in the CT from which it stays inside.

    Without a CT it is 0, the first path point.
    Raises PlanError if the path does not enter the head in the CT.
    """
    if volume is None:
        return 0.0
    key = json.dumps([plan.case_id, plan.case_hash, [point.position for point in plan.content.points]])
    return _KNOWN.get(key, lambda: _entry_in(path, volume))


def _entry_in(path: SplinePath, volume: Volume) -> float:
    count, first = 0, 0.0
    for s in np.append(np.arange(0.0, path.length, STEP_MM), path.length):
        inside = surroundings(volume, path.position(s)) in _INSIDE
        count, first = (count + 1, first if count else float(s)) if inside else (0, 0.0)
        if count and s - first >= min(STAYS_MM, path.length - first):
            return first
    raise PlanError("the path does not enter the head in its CT; choose another place for the remote centre.")


def place_mm(place: PathPlace, plan: Plan, path: SplinePath, volume: Volume | None) -> float:
    """Return the arc length in mm of a place, at most the length of the path.

    Raises PlanError if the path point does not exist, and as `entry_mm`.
    """
    if place.point is not None:
        ids = [point.id for point in plan.content.points]
        if place.point not in ids:
            raise PlanError("the path point of the remote centre is not there any more; choose another place.")
        return point_places(plan, path)[ids.index(place.point)]
    if place.at_mm is not None:
        return min(place.at_mm, path.length)
    return entry_mm(plan, path, volume)


def centre_at(path: SplinePath, s: float) -> RemoteCentre:
    """Return the fixture at arc length s in mm.

    Its direction is half way between the tangent there and the direction to the end of the path. It has no soft rows,
    since a pull towards the middle would keep the tip off its path.
    Raises PlanError if the path does not stay beyond the centre.
    """
    point = np.asarray(path.position(s))
    beyond = np.arange(s + STEP_MM, path.length, STEP_MM)
    if not len(beyond):
        raise PlanError("the remote centre is at the end of the path; choose a place before it.")
    onwards = np.asarray(path.position(path.length)) - point
    into = np.asarray(path.tangent(s)) + onwards / max(float(np.linalg.norm(onwards)), STEP_MM)
    back = beyond[(path.position(beyond) - point) @ into <= 0.0]
    if len(back):
        raise PlanError(
            f"the path leads back out past the remote centre at {back[0]:.0f} mm; choose a place further along."
        )
    return RemoteCentre(point, TOLERANCE_MM, weight=0.0, into=into)
