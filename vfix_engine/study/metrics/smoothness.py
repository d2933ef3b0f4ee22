"""Smoothness of a motion from its speed profile: spectral arc length, and log dimensionless jerk."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array

PAD = 4  # the spectrum is that of 2^PAD times as many samples, the others 0
CUT_HZ, AMPLITUDE = 10.0, 0.05  # highest frequency of the spectrum, and its least amplitude relative to the largest
REST = 0.05  # of the peak speed: slower samples at both ends are rest
WINDOW_S, ORDER = 0.05, 3  # of the Savitzky-Golay filter


def spectral_arc_length(speed: ArrayLike, rate_hz: float) -> float:
    """SPARC of a speed profile (n,), Balasubramanian et al. 2015: 0 is smoothest; NaN if nothing moves."""
    v = np.asarray(speed, dtype=np.float64)
    n = 2 ** (math.ceil(math.log2(len(v))) + PAD) if len(v) else 0
    spectrum = np.abs(np.fft.rfft(v, n)) if n else np.zeros(1)
    if not spectrum.max() > 0.0:
        return math.nan
    frequency = np.arange(len(spectrum)) * rate_hz / n
    seen = frequency <= CUT_HZ
    amplitude, frequency = spectrum[seen] / spectrum.max(), frequency[seen]
    last = int(np.flatnonzero(amplitude >= AMPLITUDE)[-1]) + 1
    if last < 2:
        return math.nan
    return -float(np.hypot(np.diff(frequency[:last]) / frequency[last - 1], np.diff(amplitude[:last])).sum())


def moving(speed: Array) -> slice:
    """The samples between the rest at both ends of a speed profile (n,); empty if nothing moves."""
    peak = float(speed.max(initial=0.0))
    fast = np.flatnonzero((speed >= REST * peak) & (speed > 0.0))
    return slice(int(fast[0]), int(fast[-1]) + 1) if len(fast) else slice(0, 0)


def filter_samples(rate_hz: float) -> int:
    """Length of the Savitzky-Golay filter in samples: that of ``WINDOW_S``, odd, and long enough for its order."""
    return max(int(WINDOW_S * rate_hz) | 1, ORDER + 2)


def filter_words(rate_hz: float) -> str:
    """What is done to a speed profile before its jerk is computed."""
    window = 1e3 * filter_samples(rate_hz) / rate_hz
    return f"rest below {REST:.0%} of the peak speed trimmed; Savitzky-Golay, order {ORDER}, {window:.0f} ms"


def log_dimensionless_jerk(speed: ArrayLike, rate_hz: float) -> float:
    """LDLJ of a speed profile (n,), trimmed and filtered as ``filter_words`` says; NaN if it is too short.

    −ln(T³ / v_peak² · ∫ (d²v/dt²)² dt), Balasubramanian et al. 2015; a motion of minimum jerk has −ln 204.8 = −5.32.
    """
    from scipy.signal import savgol_filter  # slow to load

    v = np.asarray(speed, dtype=np.float64)
    v = v[moving(v)]
    window = filter_samples(rate_hz)
    if len(v) < window:
        return math.nan
    jerk = savgol_filter(v, window, ORDER, deriv=2, delta=1.0 / rate_hz)
    return dimensionless(v, jerk, rate_hz)


def dimensionless(speed: Array, jerk: Array, rate_hz: float) -> float:
    """−ln(T³ / v_peak² · Σ jerk² / rate) of a speed profile and its second derivative."""
    squared = float(np.sum(jerk**2)) / rate_hz
    if not squared > 0.0:
        return math.nan  # of constant speed
    return -math.log((len(speed) / rate_hz) ** 3 / float(np.abs(speed).max()) ** 2 * squared)
