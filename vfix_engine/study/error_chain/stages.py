"""The stages of the error chain: each one source of error with its sizes, in mm, rad, s and N."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array
from ...errors import InputError
from ...geometry.rotations import rotation_vector
from ...registration.expected_error import sigma_per_axis
from ...registration.points import checked_points
from ...registration.rigid_fit import rigid_fits
from ...validate import point, real, rigid_transform, within

Triple = tuple[float, float, float]

LARGEST_MM, LARGEST_RAD, LONGEST_S = 50.0, math.pi, 3600.0  # larger ones are of a wrong unit
LARGEST_MM_PER_N = 10.0


@dataclass(frozen=True)
class RegistrationError:
    """A rigid motion from where the registration has a point of the head to where that point is; LPS.

    p_true = c + R (p − c) + shift, with c ``about_mm`` and R the rotation about ``turn_rad`` by its length.

    Raises:
        InputError: a value is not three finite numbers, or too large for an error.
    """

    shift_mm: Triple = (0.0, 0.0, 0.0)
    turn_rad: Triple = (0.0, 0.0, 0.0)
    about_mm: Triple = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("shift_mm", "turn_rad", "about_mm"):
            x, y, z = point(f"{name} of a registration's error", getattr(self, name)).tolist()
            object.__setattr__(self, name, (x, y, z))
        within("the shift of a registration's error in mm", math.hypot(*self.shift_mm), 0.0, LARGEST_MM)
        within("the turn of a registration's error in rad", math.hypot(*self.turn_rad), 0.0, LARGEST_RAD)

    @property
    def transform(self) -> Array:
        """transform_believed_to_true (4, 4)."""
        found, about = np.eye(4), np.array(self.about_mm)
        found[:3, :3] = _turn(np.array(self.turn_rad))
        found[:3, 3] = about + np.array(self.shift_mm) - found[:3, :3] @ about
        return found

    @classmethod
    def of(cls, transform_believed_to_true: ArrayLike, about_mm: ArrayLike = (0.0, 0.0, 0.0)) -> Self:
        """The error of a known motion (4, 4), told by the shift of a point. Raises InputError."""
        motion = rigid_transform(transform_believed_to_true, "the registration's error")
        about = point("the point of a registration's error", about_mm)
        shift = motion[:3, :3] @ about + motion[:3, 3] - about
        return cls(_triple(shift), _triple(rotation_vector(motion[:3, :3])), _triple(about))

    @classmethod
    def drawn(cls, fiducials: ArrayLike, fle_mm: float, seed: int, about_mm: ArrayLike | None = None) -> Self:
        """The error of one registration by fiducials (n, 3) that are each localised with an rms error, Li 2004, [12].

        fle_mm: rms length of the localisation error of one; seed: of the draw. about_mm: where the shift is told; the
        fiducials' centre without it.

        Raises:
            InputError: fewer than three fiducials, or an error that is not positive.
        """
        places = checked_points("the fiducials", fiducials, 3)
        off = np.random.default_rng(seed).normal(0.0, sigma_per_axis(fle_mm), places.shape)
        rotations, translations = rigid_fits((places + off)[None], places[None], np.ones(len(places)))
        motion = np.eye(4)
        motion[:3, :3], motion[:3, 3] = rotations[0], translations[0]
        return cls.of(motion, places.mean(axis=0) if about_mm is None else about_mm)


@dataclass(frozen=True)
class EncoderError:
    """Noise of the joints' encoders (standard deviation, a new value at each sample) and backlash behind them (full
    width), of prismatic joints in mm and of revolute ones in rad.

    An encoder that reads e too much makes a servo stop e too early, so its noise displaces the joint. Backlash is the
    play between the motor, where the encoder is, and the joint.

    Raises:
        InputError: a value is negative or too large for an error.
    """

    noise_mm: float = 0.0
    noise_rad: float = 0.0
    backlash_mm: float = 0.0
    backlash_rad: float = 0.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            within(f"{name} of the encoders", value, 0.0, LARGEST_RAD if name.endswith("_rad") else LARGEST_MM)


@dataclass(frozen=True)
class ServoLag:
    """Time constant of the position servo: a joint follows its set point as a first-order lag, behind a steady motion
    by ``time_s`` × speed.

    Raises:
        InputError: the time is negative or longer than an hour.
    """

    time_s: float

    def __post_init__(self) -> None:
        within("time_s of the servo", self.time_s, 0.0, LONGEST_S)


@dataclass(frozen=True)
class Compliance:
    """Deflection of the tip under a hand on the robot's handle: C · (f + the hand's weight), 0 where f is 0.

    mm_per_n: C, equal in all directions; f: the hand's force as measured. hand_weight_n: of the hand that pushes, which
    rests on the handle, towards the back of a supine patient (LPS +y); a sensor that is zeroed under it does not show
    it.

    Raises:
        InputError: a value is negative or too large.
    """

    mm_per_n: float
    hand_weight_n: float = 0.0

    def __post_init__(self) -> None:
        within("mm_per_n of the compliance", self.mm_per_n, 0.0, LARGEST_MM_PER_N)
        within("hand_weight_n of the compliance", self.hand_weight_n, 0.0, 100.0)

    def deflection(self, force: Array) -> Array:
        """Displacement (3,) in mm of the tip under a force (3,) in N."""
        if not force.any():
            return np.zeros(3)
        moved: Array = self.mm_per_n * (force + np.array([0.0, self.hand_weight_n, 0.0]))
        return moved


@dataclass(frozen=True)
class HeadMotion:
    """A head that moves relative to the robot's base since it was registered: d(t) = direction · amplitude · sin(2π
    t / period), as in breathing.

    followed: a reference on the head is tracked and the robot follows it, ``delay_s`` late; d(t) − d(t − delay) is
    left. direction: of the motion, LPS, any length but 0.

    Raises:
        InputError: a value is negative, too large, or a period or direction of 0.
    """

    amplitude_mm: float
    period_s: float = 4.0
    direction: Triple = (0.0, 0.0, 1.0)
    followed: bool = False
    delay_s: float = 0.05

    def __post_init__(self) -> None:
        within("amplitude_mm of the head's motion", self.amplitude_mm, 0.0, LARGEST_MM)
        within("period_s of the head's motion", self.period_s, 0.01, LONGEST_S)
        within("delay_s of the head's motion", self.delay_s, 0.0, LONGEST_S)
        if not isinstance(self.followed, bool):
            raise InputError(f"followed of the head's motion is {self.followed!r:.40}; it is true or false")
        way = point("direction of the head's motion", self.direction)
        if not way.any():
            raise InputError("direction of the head's motion must not be 0")
        object.__setattr__(self, "direction", _triple(way))

    def displacement(self, t: float) -> Array:
        """Displacement (3,) in mm of the head at a time that the robot does not know of."""
        left = self._along(t) - (self._along(t - self.delay_s) if self.followed else 0.0)
        way = np.array(self.direction)
        return np.asarray(left * way / np.linalg.norm(way))

    def _along(self, t: float) -> float:
        return self.amplitude_mm * math.sin(2.0 * math.pi * max(real("the time", t), 0.0) / self.period_s)


def _turn(vector: Array) -> Array:
    """Rotation (3, 3) about a vector (3,) by its length in rad (Rodrigues' formula)."""
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = (vector / angle).tolist()
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    found: Array = np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross)
    return found


def _triple(values: Array) -> Triple:
    x, y, z = values.tolist()
    return x, y, z
