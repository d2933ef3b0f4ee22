"""The hand on the stylus: from a wanted velocity to that of the camera, by lag, noise, tremor, and as it yields."""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Array
from ..person import DriftNoise, Tremor
from .endoscopist import Endoscopist

NOISE_S = 0.3  # in which the noise of a motion changes: assumed, as of a hand that follows a path


class StylusHand:
    """One hand in one trial; every random number is drawn from ``random``.

    feels: whether forces are on the stylus, as in every arm but the paper's without; there the hand turns a joint,
    whose axes may be turned against the picture (``Endoscopist.hand_turn_deg``).
    """

    def __init__(self, who: Endoscopist, random: np.random.Generator, dt_s: float, feels: bool) -> None:
        self._who, self._feels = who, feels
        turn = 0.0 if feels else math.radians(who.hand_turn_deg)
        cos, sin = math.cos(turn), math.sin(turn)
        self._turn = np.array([[cos, -sin], [sin, cos]])
        self._share = dt_s / (dt_s + who.person.hand_lag_s)
        self._noise, self._tremor = DriftNoise(random, dt_s, NOISE_S), Tremor(random, dt_s)
        self._velocity, self._feed = np.zeros(2), 0.0

    def moved(self, wanted: Array, force: Array) -> Array:
        """(2,) mm/s of the camera in its picture, for a wanted velocity (2,) and the force (2,) in N on the hand."""
        person, noise = self._who.person, self._noise.next()
        across = np.array([-wanted[1], wanted[0]])
        noisy = wanted + person.motion_noise * (noise[0] * wanted + noise[1] * across)
        self._velocity = self._velocity + self._share * (noisy - self._velocity)
        self._feed = 0.0
        led = self._who.yield_mm_per_s_per_n * force if self._feels else np.zeros(2)
        velocity: Array = self._turn @ (self._velocity + person.tremor_mm * self._tremor.next()[:2]) + led
        return velocity

    def fed(self, wanted: float) -> float:
        """mm/s of insertion for a wanted one; the camera stays where it is."""
        noisy = wanted * (1.0 + self._who.person.motion_noise * float(self._noise.next()[2]))
        self._feed += self._share * (noisy - self._feed)
        self._tremor.next()
        self._velocity = np.zeros(2)
        return self._feed
