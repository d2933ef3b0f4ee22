"""The virtual handle: a spring between the hand's grip and the tool's, kept alive by a heartbeat (HAZ-11).

All times are seconds of one monotonic clock that the caller reads.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..control.admittance import saturate

Array = NDArray[np.float64]

INTERPOLATION_S = 0.05  # two drag events of the page are this far apart
FRESH_S = 0.06  # a heartbeat keeps the force whole for this long
GONE_S = 0.1  # after it, or after the release, the force is gone
FARTHEST_MM = 1e6  # a grip further from the origin is no place
MAX_JUMP_MM = 200.0  # a grip further from the tool than this is an error of the sender, not a pull


class Handle:
    """Force of the hand on the tool's grip."""

    def __init__(self) -> None:
        self._from: Array | None = None
        self._to: Array | None = None
        self._moved_at = 0.0
        self._beat_at = -np.inf
        self._released_at: float | None = 0.0

    def press(self, grip: Array, now: float) -> None:
        """The hand holds the grip at (3,) in LPS mm; every call is a heartbeat as well."""
        if not (np.isfinite(grip).all() and np.abs(grip).max() <= FARTHEST_MM):
            return
        current = self._at(now) if self._released_at is None else None
        self._from, self._to = (grip if current is None else current), np.array(grip)
        self._moved_at, self._released_at = now, None
        self.beat(now)

    def beat(self, now: float) -> None:
        """The button is still down."""
        if self._released_at is None:
            self._beat_at = now

    def release(self, now: float) -> None:
        """The button is up: the force fades."""
        if self._released_at is None:
            self._released_at = now

    def active(self, now: float) -> bool:
        """There is a force, whole or fading."""
        return self._to is not None and self._share(now) > 0.0

    @staticmethod
    def fresh(beat_at: float, now: float) -> bool:
        """A heartbeat at ``beat_at`` still counts."""
        return now - beat_at < GONE_S - 1e-9

    def force(self, tool_grip: Array, stiffness: float, cap: float, now: float) -> Array:
        """Force (3,) in N on the tool: stiffness [N/mm] × pull, no more than cap [N], faded when the hand is gone."""
        target = self._at(now)
        if target is None:
            return np.zeros(3)
        share = self._share(now)
        if share == 0.0:
            self._from = self._to = None  # the grip returns to the tool
            self._released_at = now if self._released_at is None else self._released_at
            return np.zeros(3)
        pull = target - tool_grip
        if float(np.linalg.norm(pull)) > MAX_JUMP_MM:
            return np.zeros(3)
        return share * saturate(stiffness * pull, cap)

    def _at(self, now: float) -> Array | None:
        if self._from is None or self._to is None:
            return None
        share = min(max((now - self._moved_at) / INTERPOLATION_S, 0.0), 1.0)
        place: Array = self._from + share * (self._to - self._from)
        return place

    def _share(self, now: float) -> float:
        since_beat = now - self._beat_at
        if not self.fresh(self._beat_at, now):
            return 0.0
        share = 1.0 if since_beat <= FRESH_S else 1.0 - (since_beat - FRESH_S) / (GONE_S - FRESH_S)
        if self._released_at is not None:
            share = min(share, 1.0 - (now - self._released_at) / GONE_S)
        return max(share, 0.0)
