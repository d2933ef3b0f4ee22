"""The virtual handle: a spring between the hand's grip and the tool's, kept alive by a heartbeat (HAZ-11).

All times are seconds of one monotonic clock that the caller reads.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..control.admittance import saturate

Array = NDArray[np.float64]

INTERPOLATION_S = 0.05  # two drag events of the page are this far apart
RISE_S = 0.06  # a hand that takes hold has its whole force after this long
FRESH_S = 0.06  # a heartbeat keeps the force whole for this long
GONE_S = 0.1  # after it, or after the release, the force is gone
FARTHEST_MM = 1e6  # a grip further from the origin is no place
MAX_JUMP_MM = 200.0  # a grip further from the tool than this is an error of the sender, not a pull


class Hold:
    """The dead man's switch of a handle or of keys: a press takes hold, heartbeats keep hold, nothing else does."""

    def __init__(self) -> None:
        self._begun_at = self._beat_at = -np.inf
        self._released_at: float | None = 0.0

    def press(self, now: float) -> None:
        """The hand takes hold, or moves on; its share of the force rises from what it is now."""
        self._begun_at = now - RISE_S * self.share(now)
        self._beat_at, self._released_at = now, None

    def beat(self, now: float) -> None:
        """The hand is still there; one that has been lost stays lost until it presses."""
        if self.alive(now):
            self.press(now)

    def release(self, now: float) -> None:
        """The hand lets go: its share fades."""
        if self._released_at is None:
            self._released_at = now

    def alive(self, now: float) -> bool:
        """The hand holds on: not released, and heard of within the last ``GONE_S``."""
        return self._released_at is None and now - self._beat_at < GONE_S - 1e-9

    def active(self, now: float) -> bool:
        """There is a force, or one begins."""
        return self.alive(now) or self.share(now) > 0.0

    def share(self, now: float) -> float:
        """Share of the whole force, 0 … 1: rising after a press, fading without heartbeats and after a release."""
        since = now - self._beat_at
        if since >= GONE_S - 1e-9:
            return 0.0
        share = min((now - self._begun_at) / RISE_S, 1.0 - (since - FRESH_S) / (GONE_S - FRESH_S), 1.0)
        if self._released_at is not None:
            share = min(share, 1.0 - (now - self._released_at) / GONE_S)
        return max(share, 0.0)


class Handle:
    """Force of the hand on the tool's grip."""

    def __init__(self) -> None:
        self._hold = Hold()
        self._from = self._to = np.zeros(3)
        self._moved_at = 0.0

    def press(self, grip: Array, now: float) -> None:
        """The hand holds the grip at (3,) in LPS mm; every call is a heartbeat as well."""
        if not (np.isfinite(grip).all() and np.abs(grip).max() <= FARTHEST_MM):
            return
        self._from = self._at(now) if self._hold.alive(now) else np.array(grip)
        self._to, self._moved_at = np.array(grip), now
        self._hold.press(now)

    def beat(self, now: float) -> None:
        """The button is still down; a heartbeat never presses it."""
        self._hold.beat(now)

    def release(self, now: float) -> None:
        """The button is up: the force fades."""
        self._hold.release(now)

    def active(self, now: float) -> bool:
        """There is a force, rising, whole or fading."""
        return self._hold.active(now)

    def force(self, tool_grip: Array, stiffness: float, cap: float, now: float) -> Array:
        """Force (3,) in N on the tool: the hand's share of stiffness [N/mm] × pull, no more than cap [N]."""
        pull = self._at(now) - tool_grip
        if float(np.linalg.norm(pull)) > MAX_JUMP_MM:
            return np.zeros(3)
        return self._hold.share(now) * saturate(stiffness * pull, cap)

    def _at(self, now: float) -> Array:
        """Where the grip is (3,) on its way from drag event to drag event."""
        share = min(max((now - self._moved_at) / INTERPOLATION_S, 0.0), 1.0)
        place: Array = self._from + share * (self._to - self._from)
        return place
