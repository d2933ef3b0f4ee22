"""Points that were touched on a surface of the anatomy, as a registration keeps them, and what a refinement did."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, Literal, get_args

from app.kit.values import Position, check_id, check_position, number
from vfix_engine.errors import InputError

TouchedFrom = Literal["file", "simulated", "tracker"]
MAX_TOUCHED = 2_000


@dataclass(frozen=True)
class Refinement:
    """What a refinement on the touched points did, see `vfix_engine.registration.SurfaceRefinement`; mm.

    residual_mm: of the points that were kept; it is never the accuracy. kept: how many they were. moved_mm: largest
    displacement of a point by it. stability: 0 to 1, how much the surface resists the motion it resists least.
    """

    residual_mm: float
    kept: int
    moved_mm: float
    stability: float


@dataclass(frozen=True)
class TouchedSurface:
    """Points touched on a structure of the case; in the frame that the registration is to, mm.

    structure: its id. refinement: None while the registration was not refined on them.
    """

    structure: str
    points: tuple[Position, ...]
    measured_from: TouchedFrom
    refinement: Refinement | None = None


def surface_to_json(surface: TouchedSurface | None) -> dict[str, Any] | None:
    """Plain JSON values, each number unrounded."""
    if surface is None:
        return None
    return {**asdict(surface), "points": [list(point) for point in surface.points]}


def surface_from_json(item: Any) -> TouchedSurface | None:
    """The inverse of `surface_to_json`, checked. Raises InputError."""
    if item is None:
        return None
    known = {field.name for field in fields(TouchedSurface)}
    if not isinstance(item, Mapping) or set(item) != known:
        raise InputError(f"the touched surface of a registration has {', '.join(sorted(known))}.")
    points = item["points"]
    if not isinstance(points, list) or not all(isinstance(point, list) for point in points):
        raise InputError("the points touched on a surface are lists of three numbers, in mm.")
    if len(points) > MAX_TOUCHED:
        raise InputError(f"{len(points)} points on a surface are too many; {MAX_TOUCHED:,} are kept at most.")
    places = tuple(check_position(point) for point in points)
    refinement = _refinement(item["refinement"])
    surface = TouchedSurface(item["structure"], places, item["measured_from"], refinement)
    return check_surface(surface)


def check_surface(surface: TouchedSurface | None) -> TouchedSurface | None:
    """The touched surface, where it can be one. Raises InputError."""
    if surface is None:
        return None
    check_id(surface.structure, "a structure")
    if not 0 < len(surface.points) <= MAX_TOUCHED:
        raise InputError(f"a surface is touched at 1 to {MAX_TOUCHED:,} points, not {len(surface.points)}.")
    for point in surface.points:
        check_position(point)
    if surface.measured_from not in get_args(TouchedFrom):
        raise InputError(f"points come from {', '.join(get_args(TouchedFrom))}, not {surface.measured_from!r:.20}.")
    done = surface.refinement
    if done is not None:
        for value in (done.residual_mm, done.moved_mm, done.stability):
            if number(value, "a figure of a refinement") < 0.0:
                raise InputError("a figure of a refinement is from 0 on.")
        if isinstance(done.kept, bool) or not isinstance(done.kept, int) or not 0 < done.kept <= len(surface.points):
            raise InputError("how many points a refinement kept is a count, of the touched points at most.")
    return surface


def unrefined(surface: TouchedSurface | None) -> TouchedSurface | None:
    """The touched points without what a refinement on them did, whose transform is not in use any more."""
    return None if surface is None else replace(surface, refinement=None)


def _refinement(item: Any) -> Refinement | None:
    if item is None:
        return None
    known = {field.name for field in fields(Refinement)}
    if not isinstance(item, Mapping) or set(item) != known:
        raise InputError(f"a refinement has {', '.join(sorted(known))}.")
    return Refinement(**item)
