"""Points of a plan: places in LPS mm, and the shaft's direction and roll where a path point has them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

from app.kit.names import check_label, check_stored_label
from app.kit.values import Position, check_id, check_position, new_id, number
from vfix_engine.errors import PlanError

MAX_ROLL_DEG = 360.0
_SHORTEST = 1e-6  # of a direction that is given; it is brought to length 1


@dataclass(frozen=True)
class PlanPoint:
    """A path point or a target; position in LPS mm.

    direction: of a path point, from the tool's tip towards the tail of its shaft, LPS, of length 1; None where the
    plan leaves it open. roll_deg: turn of a bent tool about that direction; None where the plan leaves it open.
    """

    id: str
    label: str
    position: Position
    direction: Position | None = None
    roll_deg: float | None = None


def new_point_id() -> str:
    """An identifier that no other point has."""
    return new_id("p")


def new_point(label: Any, position: Position) -> PlanPoint:
    """A point that enters the plan from outside."""
    return PlanPoint(new_point_id(), check_label("" if label is None else label, "label"), position)


def check_direction(direction: Any) -> Position | None:
    """A direction, brought to length 1; None stays None. Raises PlanError."""
    if direction is None:
        return None
    if not isinstance(direction, (list, tuple)) or len(direction) != 3:
        raise PlanError("a shaft's direction is three numbers, LPS, from tip to tail.")
    x, y, z = (number(value, "a direction's component") for value in direction)
    length = math.hypot(x, y, z)
    if not _SHORTEST < length < 1.0 / _SHORTEST:
        raise PlanError("a shaft's direction needs a length that is neither 0 nor huge; 1 is best.")
    # One that is of length 1 already stays as it is to the last digit, so that a file comes back as it was.
    scale = 1.0 if abs(length - 1.0) < 1e-12 else 1.0 / length
    return (x * scale, y * scale, z * scale)


def check_roll(roll_deg: Any) -> float | None:
    """A roll in degrees; None stays None. Raises PlanError."""
    if roll_deg is None:
        return None
    roll = number(roll_deg, "a shaft's roll")
    if abs(roll) > MAX_ROLL_DEG:
        raise PlanError(f"a shaft's roll is {roll:g}°; allowed is −{MAX_ROLL_DEG:g} to {MAX_ROLL_DEG:g}°.")
    return roll


def check_point(point: PlanPoint) -> PlanPoint:
    """The point, whose values are checked, its direction of length 1. Raises InputError or one of its kinds."""
    check_id(point.id, "a point")
    check_stored_label(point.label, "label")
    check_position(point.position)
    if check_roll(point.roll_deg) is not None and point.direction is None:
        raise PlanError("a shaft's roll is about its direction; give the direction as well.")
    return replace(point, direction=check_direction(point.direction))
