"""What one simulated person is: parameters, each with its source, or said to be fitted or assumed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array
from ..errors import InputError

# Standard deviation over people of the logarithm of a parameter: all assumed, but that people differ is not.
SPREADS: Mapping[str, float] = {
    "delay_s": 0.12, "tremor_mm": 0.35, "see_across_mm": 0.30, "see_depth_mm": 0.35, "hand_speed_mm_per_s": 0.25,
    "motion_noise": 0.30, "force_n": 0.12, "force_noise": 0.30, "aim_rad": 0.30, "device_n": 0.15,
    "device_aim_rad": 0.25, "dead_band": 0.30, "learning": 0.40,
}  # fmt: skip
_PRACTISED_ERRORS = ("see_across_mm", "see_depth_mm", "aim_rad", "device_aim_rad")
_PRACTISED_SPEEDS = ("hand_speed_mm_per_s", "force_n", "device_n")


@dataclass(frozen=True)
class Person:
    """Parameters of a simulated person; the defaults are medians over people.

    delay_s: from what is seen to what the hand does; 0.15-0.25 s in visuomotor tracking, textbook range.
    tremor_mm: rms in three dimensions at 8-12 Hz; 0.05-0.2 mm: Riviere, Rader & Khosla 1997, and tremor of surgeons
        freehand 0.144 mm (PMC3989364).
    see_across_mm, see_depth_mm: rms of the error of the tip's seen place in the picture's plane (assumed) and in depth
        (fitted to the freehand error of 1.82 mm of Li 2004), which drifts with ``drift_s`` (assumed).
    hand_speed_mm_per_s: of a hand that follows a path freely; fitted to the 26.61 s of Li 2004.
    hand_lag_s: time constant of the hand (assumed).
    motion_noise: standard deviation of the speed relative to it, as noise grows with the signal: Harris & Wolpert
        1998; the size is assumed.
    force_n: with which a person leads a robot; fitted to the 17.24 s of Li 2004.
    force_noise: coefficient of variation of a force, 0.02-0.05: Hamilton, Jones & Wolpert 2004, upper end.
    aim_rad: error of the direction of that force (assumed, 12°).
    look_ahead_mm: how far ahead of the tip the pursued point of the path is (assumed).
    turn_s: time in which a seen error of the tool's orientation is turned away (assumed).
    device_n: deflection of a rate device with which a person leads a robot, as a force (assumed: such a device has no
        scale of its own). device_aim_rad: error of its direction (assumed, 30°, as its axes are turned against the
        picture). dead_band: share of full deflection below which an axis of the device says 0 (assumed).
    learning: exponent of the power law of practice (Newell & Rosenbloom 1981; the size is assumed): of slowness and
        errors of the first trial, (n + 1)^-learning is left in trial n.
    tiring: share by which each trial makes the next one slower, and its errors and tremor larger; 0, as the subjects
        of Li 2007 rested for one or two minutes between trials (assumed).

    Raises:
        InputError: a value is negative or not finite, or a time or length that divides is 0.
    """

    delay_s: float = 0.20
    tremor_mm: float = 0.10
    see_across_mm: float = 0.35
    see_depth_mm: float = 3.15
    drift_s: float = 1.5
    hand_speed_mm_per_s: float = 3.55
    hand_lag_s: float = 0.15
    motion_noise: float = 0.15
    force_n: float = 2.54
    force_noise: float = 0.05
    aim_rad: float = float(np.radians(12.0))
    look_ahead_mm: float = 4.0
    turn_s: float = 0.3
    device_n: float = 2.45
    device_aim_rad: float = float(np.radians(30.0))
    dead_band: float = 0.15
    learning: float = 0.06
    tiring: float = 0.0

    def __post_init__(self) -> None:
        for name, value in self.__dict__.items():
            if not (np.isfinite(value) and value >= 0.0):
                raise InputError(f"{name} of a person is {value!r:.40}; it is a number from 0 on")
        for name in ("drift_s", "hand_lag_s", "look_ahead_mm", "turn_s"):
            if getattr(self, name) == 0.0:
                raise InputError(f"{name} of a person must not be 0")

    @classmethod
    def exact(cls) -> Person:
        """A hand that follows what it sees at once, and sees it as it is."""
        return cls(
            delay_s=0.0, tremor_mm=0.0, see_across_mm=0.0, see_depth_mm=0.0, hand_lag_s=1e-3, motion_noise=0.0,
            force_noise=0.0, aim_rad=0.0, look_ahead_mm=1.0, device_aim_rad=0.0, dead_band=0.0, learning=0.0,
        )  # fmt: skip

    def drawn(self, random: np.random.Generator, spreads: Mapping[str, float] = SPREADS) -> Person:
        """One of many people with these medians.

        spreads: standard deviation of the natural logarithm of each parameter that differs between people.
        """
        factors = np.exp(np.array([*spreads.values()]) * random.standard_normal(len(spreads))).tolist()
        return replace(
            self, **{name: getattr(self, name) * factor for name, factor in zip(spreads, factors, strict=True)}
        )

    def practised(self, trial: int) -> Person:
        """The same person in trial 0, 1, …: faster, and wrong by less, but for what tires."""
        tired = 1.0 + self.tiring * trial
        left = (trial + 1) ** -self.learning * tired
        less = {name: left * getattr(self, name) for name in _PRACTISED_ERRORS}
        less["tremor_mm"] = tired * self.tremor_mm
        return replace(self, **less, **{name: getattr(self, name) / left for name in _PRACTISED_SPEEDS})


class DriftNoise:
    """Noise (3,) of unit variance whose correlation decays with a time constant in s (Ornstein-Uhlenbeck)."""

    def __init__(self, random: np.random.Generator, dt_s: float, decay_s: float):
        self._random, self._keep = random, float(np.exp(-dt_s / decay_s))
        self._new = float(np.sqrt(1.0 - self._keep**2))
        self.value: Array = random.standard_normal(3)

    def next(self) -> Array:
        """The value one period later."""
        self.value = self._keep * self.value + self._new * self._random.standard_normal(3)
        return self.value


class Tremor:
    """Velocity (3,) in 1/s of a tremor of unit rms in three dimensions: a line of 8-12 Hz that waxes and wanes."""

    def __init__(self, random: np.random.Generator, dt_s: float):
        self._rate = 2.0 * np.pi * random.uniform(8.0, 12.0)
        self._phase, self._t, self._dt = random.uniform(0.0, 2.0 * np.pi, 3), 0.0, dt_s
        self._size = DriftNoise(random, dt_s, 0.5)

    def next(self) -> Array:
        """The velocity one period later."""
        self._t += self._dt
        swing = np.cos(self._rate * self._t + self._phase)
        velocity: Array = np.sqrt(2.0 / 3.0) * np.abs(self._size.next()) * self._rate * swing
        return velocity
