"""Planned orientation of a tool's shaft along a path: a direction, and for a bent tool a roll, over arc length."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import PlanError
from ..kernels.triples import triple
from .shaft_kernels import frames_at, turn_between, turned

_SUPERIOR, _POSTERIOR = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])
_STEEP = 0.95  # a shaft with a larger superior component uses posterior as the reference for its bend


def upright_frame(shaft: Array) -> Array:
    """Return the tip frame (3, 3) that is as upright as possible for a shaft direction.

    The y axis is the unit vector ``shaft`` (3,), from the tail towards the tip. The z axis, towards which a tool bends,
    points to superior, or to posterior if the shaft itself is nearly vertical.
    """
    side = np.cross(shaft, _SUPERIOR if abs(shaft[2]) < _STEEP else _POSTERIOR)
    side /= np.linalg.norm(side)
    return np.column_stack([side, shaft, np.cross(side, shaft)])


def rolled_frame(direction: ArrayLike, roll: float) -> Array:
    """Return the tip frame (3, 3) of a shaft with its tail in ``direction`` (3,) from its tip, and a ``roll`` in rad.

    With roll 0 it is the upright frame; the rotation is right-handed about ``direction``.
    """
    towards = np.asarray(direction, dtype=np.float64)
    frame = upright_frame(-towards / np.linalg.norm(towards))
    x, y, z = frame.T
    c, s = np.cos(roll), np.sin(roll)
    return np.column_stack([c * x + s * z, y, c * z - s * x])


def roll_of(frame: ArrayLike) -> float:
    """Return the roll in rad, −π … π, of a tip frame (3, 3): the inverse of ``rolled_frame``."""
    given = np.asarray(frame, dtype=np.float64)
    x, _, z = upright_frame(given[:, 1]).T
    return float(np.arctan2(-given[:, 2] @ x, given[:, 2] @ z))


@dataclass(frozen=True, eq=False)
class ShaftDirections:
    """Directions of the shaft at stations along a path, interpolated by the smallest rotation.

    Before the first station and after the last one the direction is constant.
    The roll is measured from the upright tip frame (``rolled_frame``). Between two stations with a roll the tool
    rotates uniformly about its shaft, the shorter way; between a station with and one without, the frame is parallel
    transported.

    Args:
        stations: (m,) arc lengths in mm, increasing.
        directions: (m, 3) from the tip towards the tail, patient frame; of any nonzero length.
        rolls: (m,) in rad, NaN where the roll is free; None: free everywhere.

    Raises:
        PlanError: there is no station, arc lengths do not increase, a direction is zero, two neighbouring
            directions are opposite, or the lengths of the arguments differ.
    """

    stations: Array
    directions: Array
    rolls: Array | None = None
    table: tuple[Array, Array, Array] = field(init=False, repr=False)
    has_roll: bool = field(init=False)

    def __post_init__(self) -> None:
        stations, directions = (np.array(a, dtype=np.float64) for a in (self.stations, self.directions))
        if stations.ndim != 1 or not len(stations) or directions.shape != (len(stations), 3):
            raise PlanError("directions of a shaft are (m, 3) at (m,) arc lengths, at least one")
        if not np.isfinite(stations).all() or (np.diff(stations) <= 0.0).any():
            raise PlanError("the arc lengths of a shaft's directions must be finite and increase")
        lengths = np.linalg.norm(directions, axis=1)
        if not (np.isfinite(lengths) & (lengths > 0.0)).all():
            raise PlanError("a shaft's direction is three finite numbers, not all 0")
        rolls = np.full(len(stations), np.nan) if self.rolls is None else np.array(self.rolls, dtype=np.float64)
        if rolls.shape != stations.shape or np.isinf(rolls).any():
            raise PlanError("a shaft's rolls are one number for each direction, in rad, or NaN where it is free")
        unit = directions / lengths[:, None]
        if (np.einsum("ij,ij->i", unit[:-1], unit[1:]) < -1.0 + 1e-9).any():
            raise PlanError("two neighbouring directions of the shaft are opposite; there is no shortest turn")
        frames, twists = _carried(stations, unit, rolls)
        own: dict[str, object] = {"stations": stations, "directions": directions, "rolls": rolls}
        own |= {"has_roll": bool(np.isfinite(rolls).any()), "table": (stations, frames, twists)}
        for array in (stations, directions, rolls, frames, twists):
            array.setflags(write=False)
        for name, value in own.items():
            object.__setattr__(self, name, value)

    def frame(self, s: ArrayLike) -> Array:
        """Tip frames at arc lengths s (scalar or (n,)): (3, 3) or (n, 3, 3); without rolls the roll is arbitrary."""
        places = np.asarray(s, dtype=np.float64)
        found: Array = frames_at(*self.table, np.atleast_1d(places))
        return found[0] if places.ndim == 0 else found

    def direction(self, s: ArrayLike) -> Array:
        """Unit vectors from the tip towards the tail at the arc lengths s (scalar or (n,)): (3,) or (n, 3)."""
        found: Array = -self.frame(s)[..., 1]
        return found


def _carried(stations: Array, unit: Array, rolls: Array) -> tuple[Array, Array]:
    """Return frames (m, 3, 3) at the stations, and the twist (m − 1,) from each to the next.

    The frames are parallel transported from station to station; given rolls are rotations relative to them, distributed
    over the arc length between them.
    """
    count = len(stations)
    carried = np.empty((count, 3, 3))
    carried[0] = upright_frame(-unit[0])
    for k in range(1, count):
        y, z = triple(carried[k - 1][:, 1]), triple(carried[k - 1][:, 2])
        axis, angle = turn_between(y, triple(-unit[k]), z)
        up = np.array(turned(z, axis, angle))
        carried[k] = np.column_stack([np.cross(-unit[k], up), -unit[k], up])
    given = np.flatnonzero(np.isfinite(rolls))
    turns = np.zeros(count)
    if len(given):
        wanted = [_turn(carried[k], rolled_frame(unit[k], float(rolls[k]))) for k in given]
        turns = np.interp(stations, stations[given], np.unwrap(wanted))
    frames = np.empty_like(carried)
    for k in range(count):
        x, y, z = carried[k].T
        c, s = np.cos(turns[k]), np.sin(turns[k])
        frames[k] = np.column_stack([c * x - s * z, y, s * x + c * z])
    return frames, np.diff(turns)


def _turn(frame: Array, onto: Array) -> float:
    """The angle in rad about the common y axis from one frame to another."""
    z = onto[:, 2]
    return float(np.arctan2(z @ frame[:, 0], z @ frame[:, 2]))
