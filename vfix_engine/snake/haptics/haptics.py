"""Forces on the operator's hand: resistance to haste, and guidance back into the pathway (Kwok 2013, section III.C)."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...errors import InputError
from ...robots.snake import JOINT_SPEED, JOINT_TORQUE

_STILL = 1e-9  # [mm/s, mm/s²] slower has no direction: (32) is 0/0 at rest
_STILL_MM = 1e-12  # [mm] of a camera that does not move when r changes: (35) is 0/0


@dataclass(frozen=True)
class HapticSettings:
    """Kwok 2013, Table II.

    tau_max: N·m, speed_max: rad/s, what the joints' motors can do.
    f_b_max, f_i_max: N, the most that damping and inertia resist with.
    c_b: N·rad/s, c_i: N·N·m (the paper names no unit; SI gives both curves the caps' size just before the limits).
    spring: N/mm and threshold: mm, one for each manipulated link; the last one is the tip's.
    f_h_max: N; not printed, assumed: the peak force of the device that the paper used.

    Raises:
        InputError: a number that is not finite or not positive (springs and thresholds may be 0), no spring, or springs
            and thresholds of different number.
    """

    tau_max: float = JOINT_TORQUE
    speed_max: float = JOINT_SPEED
    f_b_max: float = 0.88
    f_i_max: float = 3.30
    c_b: float = 1e-3
    c_i: float = 3e-3
    spring: tuple[float, ...] = (0.07, 0.07, 0.07, 0.07, 0.45)
    threshold: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)
    f_h_max: float = 3.3

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, tuple):
                if not (value and all(math.isfinite(v) and v >= 0.0 for v in value)):
                    raise InputError(f"haptic setting {field.name}: finite numbers of at least 0, not {value}")
            elif not (math.isfinite(value) and value > 0.0):
                raise InputError(f"haptic setting {field.name} must be finite and positive, not {value:g}")
        if len(self.spring) != len(self.threshold):
            raise InputError(f"{len(self.spring)} spring constants and {len(self.threshold)} thresholds")

    @property
    def most(self) -> float:
        """The largest force in N that can come out, whatever goes in."""
        return self.f_b_max + self.f_i_max + self.f_h_max

    def for_links(self, links: int) -> HapticSettings:
        """The same for another number of manipulated links: of fewer the last values, of more the first one again."""
        if links < 1:
            raise InputError(f"{links} manipulated links; there must be at least 1")
        if links == len(self.spring):
            return self
        more = links - len(self.spring)
        springs, thresholds = ((values[0],) * more + values[-links:] for values in (self.spring, self.threshold))
        return replace(self, spring=springs, threshold=thresholds)


class Forces(NamedTuple):
    """Forces (2,) in N in the camera's plane, x to the right and y down in the picture: (32), (35) and their sum."""

    resistance: Array
    guidance: Array
    total: Array


def step_forces(
    q_speed: Array,
    torque: Array,
    velocity: Array,
    acceleration: Array,
    depth: Array,
    outwards: Array,
    settings: HapticSettings,
) -> tuple[Array, Array]:
    """F_r (31)-(32) and F_h (33)-(35), (2,) in N each, together at most ``settings.most``; arrays are not checked.

    F_r holds the hand back as joints come near the speed or the torque of their motors. It opposes the camera's motion,
    and is 0 where that is still; the part against the acceleration helps a hand that slows down.
    F_h leads the hand to where links leave the pathway less: towards less bending.

    Args:
        q_speed: (2L',) rad/s and torque: (2L',) N·m of the manipulated joints.
        velocity: (2,) mm/s and acceleration: (2,) mm/s² of the camera in its plane.
        depth: (L',) mm, deviation of each manipulated link (16). outwards: (2,) the first column of the Jacobian (28),
            where the camera goes as r grows, any length.
    """
    motion = velocity.tolist(), acceleration.tolist()
    holding = _resistance(q_speed.tolist(), torque.tolist(), *motion, settings)
    return holding, _guidance(depth.tolist(), (-outwards).tolist(), settings)


def _resistance(
    speeds: list[float],
    torques: list[float],
    velocity: list[float],
    acceleration: list[float],
    settings: HapticSettings,
) -> Array:
    damping = _rising(settings.speed_max, max(map(abs, speeds)), settings.c_b, settings.f_b_max)
    inertia = _rising(settings.tau_max, max(map(abs, torques)), settings.c_i, settings.f_i_max)
    (right, down), (a, b) = _direction(velocity, _STILL), _direction(acceleration, _STILL)
    return np.array([-inertia * a - damping * right, -inertia * b - damping * down])  # (32)


def _guidance(deviation: list[float], towards_rest: list[float], settings: HapticSettings) -> Array:
    strength = 0.0
    for spring, deep, least in zip(settings.spring, deviation, settings.threshold, strict=True):
        strength += spring * max(0.0, max(deep, 0.0) - least)  # (33)
    towards = _direction(towards_rest, _STILL_MM)  # (34): J [−1, 0]ᵀ
    return min(strength, settings.f_h_max) * np.array(towards)  # (35)


def _rising(limit: float, used: float, constant: float, most: float) -> float:
    """A force in N that is 0 at rest and grows as the margin to the limit shrinks (31); ``most`` without a margin."""
    margin = limit - used
    if margin <= 0.0:
        return most
    # Without the cancellation of the printed bracket: 1/margin − 1/limit = used / (margin · limit).
    return min(constant * used / margin / limit, most)


def _direction(vector: list[float], least: float) -> list[float]:
    """The unit vector (2,), or 0 where the vector is shorter than ``least``; no size overflows."""
    largest = max(abs(vector[0]), abs(vector[1]), least)
    x, y = vector[0] / largest, vector[1] / largest
    size = math.hypot(x, y)
    if size * largest < least:
        return [0.0, 0.0]
    return [x / size, y / size]
