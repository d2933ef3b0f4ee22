"""Checks of input values: numbers, positions and identifiers."""

from __future__ import annotations

import math
import secrets
from collections.abc import Iterable
from typing import Any

from vfix_engine.errors import PlanError

MAX_COORDINATE = 1e4  # [mm]

Position = tuple[float, float, float]


def rounded_up(bound: float) -> float:
    """A bound at the two digits that are shown: rounded up, so that 'below' stays true."""
    return math.ceil(bound * 100.0 - 1e-9) / 100.0


def new_id(letter: str) -> str:
    """Return a new random identifier."""
    return f"{letter}-{secrets.token_hex(5)}"


def check_position(position: Iterable[Any]) -> Position:
    """Return three finite coordinates in a plausible range (HAZ-05). Raises PlanError."""
    values = tuple(position)
    if len(values) != 3:
        raise PlanError("a position needs three numbers, in LPS mm.")
    checked = tuple(number(value, "a coordinate") for value in values)
    if any(abs(value) >= MAX_COORDINATE for value in checked):
        raise PlanError(f"a coordinate is beyond {MAX_COORDINATE:g} mm; check the unit of the position.")
    return (checked[0], checked[1], checked[2])


def number(value: Any, what: str) -> float:
    """Convert a JSON or array number to a finite float. Raises PlanError."""
    if isinstance(value, (bool, str, bytes)):
        raise PlanError(f"{what} must be a number.")
    try:
        result = float(value)
    except (TypeError, ValueError, OverflowError):
        raise PlanError(f"{what} must be a number.") from None
    if not math.isfinite(result):
        raise PlanError(f"{what} is not a finite number.")
    return result


def check_id(value: Any, what: str) -> str:
    """Check an identifier of a file and return it. Raises PlanError."""
    if not isinstance(value, str) or not 0 < len(value) <= 64 or not all(c.isalnum() or c in "_-." for c in value):
        raise PlanError(f"{what}'s identifier may hold up to 64 letters, digits, '_', '-' and '.'.")
    return value
