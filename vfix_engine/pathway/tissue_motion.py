"""Motion of a pathway's control contours P_k(t) by tissue, Kwok 2013, section III.A: breathing and peristalsis.

A motion maps the arc lengths (C,) of the control contours at rest in mm and the time in s to their displacements
(C, 3) in mm and the factors (C,) of their radii. Any such function can be used; these are two, and their sum.
They are plain values, so that a drive in moving tissue can be sent to another process and stored.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import PathwayError
from ..validate import positive, real, real_array, within
from .pathway import TissueMotion

_MOST_MM = 100.0  # of breathing; more indicates a typing error


@dataclass(frozen=True)
class Breathing:
    """``breathing`` along a unit vector ``along``; the other fields are its arguments."""

    along: tuple[float, float, float]
    amplitude_mm: float
    period_s: float
    falloff_s: float | None

    def __call__(self, s: Array, t: float) -> tuple[Array, Array]:
        """Displacements (C, 3) in mm and factors (C,) at the arc lengths s (C,) in mm and the time t in s."""
        share = 0.5 * self.amplitude_mm * (1.0 - math.cos(2.0 * math.pi * t / self.period_s))
        weight = np.ones(len(s)) if self.falloff_s is None else 1.0 - np.exp(-np.maximum(s, 0.0) / self.falloff_s)
        return (share * weight)[:, None] * np.array(self.along), np.ones(len(s))


@dataclass(frozen=True)
class Peristalsis:
    """``peristalsis``; the fields are its arguments."""

    amplitude: float
    wavelength_mm: float
    speed_mm_per_s: float

    def __call__(self, s: Array, t: float) -> tuple[Array, Array]:
        """Displacements (C, 3) in mm and factors (C,) at the arc lengths s (C,) in mm and the time t in s."""
        phase = 2.0 * math.pi * (s - self.speed_mm_per_s * t) / self.wavelength_mm
        return np.zeros((len(s), 3)), 1.0 - 0.5 * self.amplitude * (1.0 + np.cos(phase))


@dataclass(frozen=True)
class Together:
    """``together`` of several motions."""

    motions: tuple[TissueMotion, ...]

    def __call__(self, s: Array, t: float) -> tuple[Array, Array]:
        """Sum of the displacements (C, 3) in mm and product of the factors (C,)."""
        shift, factor = np.zeros((len(s), 3)), np.ones(len(s))
        for one in self.motions:
            moved, narrowed = one(s, t)
            shift, factor = shift + moved, factor * narrowed
        return shift, factor


def breathing(
    direction: ArrayLike, amplitude_mm: float = 8.0, period_s: float = 4.0, falloff_s: float | None = None
) -> TissueMotion:
    """Oscillation along ``direction``: amplitude · (1 − cos 2πt/T)/2, at rest at t = 0 and farthest after T/2.

    Args:
        direction: (3,) patient frame, of any length; the diaphragm moves the colon along the body's axis.
        amplitude_mm: largest displacement, 0 to 100.
        period_s: T.
        falloff_s: arc length in mm over which the motion decreases towards the entry, s = 0, which is fixed:
            factor 1 − exp(−s/falloff_s). None: everything moves equally.

    Raises:
        PathwayError: there is no direction, or a number is not finite, negative or zero where not allowed.
    """
    along = real_array("the direction of breathing", direction, PathwayError)
    if along.shape != (3,) or not np.isfinite(along).all() or not along.any():
        raise PathwayError(f"breathing needs a direction (3,), not {along}")
    along /= np.linalg.norm(along)
    within("breathing's amplitude in mm", amplitude_mm, 0.0, _MOST_MM, PathwayError)
    positive("breathing's period in s", period_s, PathwayError)
    if falloff_s is not None:
        positive("breathing's fall-off in mm", falloff_s, PathwayError)
    x, y, z = along.tolist()
    return Breathing((x, y, z), float(amplitude_mm), float(period_s), None if falloff_s is None else float(falloff_s))


def peristalsis(amplitude: float = 0.15, wavelength_mm: float = 120.0, speed_mm_per_s: float = 20.0) -> TissueMotion:
    """A wave that narrows the lumen and never widens it: factor 1 − amplitude · (1 + cos 2π(s − vt)/λ)/2 of the radii.

    Args:
        amplitude: largest relative reduction of the radius, 0 to below 1.
        wavelength_mm: λ.
        speed_mm_per_s: v along the pathway; negative towards the entry.

    Raises:
        PathwayError: the amplitude is outside [0, 1), the wavelength is not positive, or the speed is not finite.
    """
    if not 0.0 <= real("peristalsis's amplitude", amplitude, PathwayError) < 1.0:
        raise PathwayError(
            f"peristalsis's amplitude must be a share from 0 to below 1 of the radius, not {amplitude:g}"
        )
    positive("peristalsis's wavelength in mm", wavelength_mm, PathwayError)
    real("peristalsis's speed in mm/s", speed_mm_per_s, PathwayError)
    return Peristalsis(float(amplitude), float(wavelength_mm), float(speed_mm_per_s))


def together(*motions: TissueMotion) -> TissueMotion:
    """Superposition of motions: the sum of their displacements, the product of their factors."""
    return Together(motions)
