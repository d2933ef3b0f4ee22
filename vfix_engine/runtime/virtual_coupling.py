"""Virtual coupling: a spring between the hand's grip and the tool's, enabled by a heartbeat (HAZ-11).

All times are seconds of the monotonic clock, which all processes of a machine share: the receiver of an input stamps
it, and the control loop evaluates the force at its own time, so a delay between the two does not matter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array
from ..control.admittance import saturate
from ..kernels.triples import triple
from ..validate import FARTHEST_MM

INTERPOLATION_S = 0.05  # interval between two drag events of the page
RISE_S = 0.06  # time after a press until the force is fully on
FRESH_S = 0.06  # time after a heartbeat during which the force stays full
GONE_S = 0.1  # time after a heartbeat or a release until the force is 0
MAX_JUMP_MM = 200.0  # a grip further from the tool than this is an error of the sender


@dataclass(frozen=True)
class Hold:
    """Dead man's switch of a grip, of keys or of axes: a press starts a hold, and only heartbeats sustain it.

    begun_at: time when the force began to rise from 0; beat_at: last heartbeat; released_at: ∞ before the release.
    number: of the hold; a press after a release, or after heartbeats were missing, begins the next one.
    """

    begun_at: float = -math.inf
    beat_at: float = -math.inf
    released_at: float = math.inf
    number: int = 0

    def press(self, now: float) -> Hold:
        """Press, or continue a hold; the force fraction rises from its present value."""
        number = self.number if self.alive(now) else self.number + 1
        return Hold(now - RISE_S * self.share(now), now, number=number)

    def beat(self, now: float) -> Hold:
        """Heartbeat; a hold that has timed out stays lost until the next press."""
        return self.press(now) if self.alive(now) else self

    def release(self, now: float) -> Hold:
        """Release: the force fades."""
        return replace(self, released_at=min(self.released_at, now))

    def alive(self, now: float) -> bool:
        """Whether the hold is active: not released, and with a heartbeat within the last ``GONE_S``."""
        return self.released_at > now and now - self.beat_at < GONE_S - 1e-9

    def lost(self, now: float) -> bool:
        """Whether the hold timed out without a release: only a new press starts another one."""
        return math.isfinite(self.beat_at) and self.released_at == math.inf and not self.alive(now)

    def active(self, now: float) -> bool:
        """Whether there is a force, or one begins to rise."""
        return self.alive(now) or self.share(now) > 0.0

    def share(self, now: float) -> float:
        """Fraction of the full force, 0 … 1: rises after a press, fades without heartbeats and after a release."""
        since = now - self.beat_at
        if since >= GONE_S - 1e-9:
            return 0.0
        silent = 1.0 - (since - FRESH_S) / (GONE_S - FRESH_S)
        released = 1.0 - (now - self.released_at) / GONE_S
        return max(min((now - self.begun_at) / RISE_S, silent, released, 1.0), 0.0)


NOBODY = Hold()


class Glide:
    """A place that is told now and then, between two of these moved evenly."""

    def __init__(self) -> None:
        self._from = self._to = np.zeros(3)
        self._moved_at = 0.0

    def move(self, place: Array, now: float, onwards: bool) -> None:
        """Move to (3,) in LPS mm at ``now`` in s: ``onwards`` linearly within ``INTERPOLATION_S``, otherwise at once.

        Implausible places are ignored (HAZ-05).
        """
        if not (np.abs(place) <= FARTHEST_MM).all():
            return
        self._from = self.at(now) if onwards else place
        self._to, self._moved_at = place, now

    def at(self, now: float) -> Array:
        """(3,) the place at a time."""
        share = min(max((now - self._moved_at) / INTERPOLATION_S, 0.0), 1.0)
        place: Array = self._from + share * (self._to - self._from)
        return place


class VirtualCoupling(Glide):
    """Position of the hand's grip, and its spring force."""

    def force(self, tool_grip: Array, stiffness: float, cap: float, now: float) -> Array:
        """Full force (3,) in N of a hand that holds: stiffness [N/mm] × displacement, at most cap [N]."""
        pull = self.at(now) - tool_grip
        if float(np.linalg.norm(pull)) > MAX_JUMP_MM:
            return np.zeros(3)
        return np.array(saturate(triple(stiffness * pull), cap))
