"""The virtual coupling: a spring between the hand's grip and the tool's, kept alive by a heartbeat (HAZ-11).

All times are seconds of the monotonic clock, which all processes of a machine share: whoever hears the hand stamps what
it does, and the control loop reads the force off it, however late that is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array
from ..control.admittance import saturate
from ..kernels.triples import triple
from ..validate import FARTHEST_MM

INTERPOLATION_S = 0.05  # two drag events of the page are this far apart
RISE_S = 0.06  # a hand that takes hold has its whole force after this long
FRESH_S = 0.06  # a heartbeat keeps the force whole for this long
GONE_S = 0.1  # after it, or after the release, the force is gone
MAX_JUMP_MM = 200.0  # a grip further from the tool than this is an error of the sender, not a pull


@dataclass(frozen=True)
class Hold:
    """The dead man's switch of a grip, of keys or of axes: a press takes hold, heartbeats keep hold, nothing else does.

    begun_at: when the share of the force began to rise from 0; beat_at: the last sign of the hand; released_at: ∞ while
    the hand has not let go.
    """

    begun_at: float = -math.inf
    beat_at: float = -math.inf
    released_at: float = math.inf

    def press(self, now: float) -> Hold:
        """The hand takes hold, or moves on; its share of the force rises from what it is now."""
        return Hold(now - RISE_S * self.share(now), now)

    def beat(self, now: float) -> Hold:
        """The hand is still there; one that has been lost stays lost until it presses."""
        return self.press(now) if self.alive(now) else self

    def release(self, now: float) -> Hold:
        """The hand lets go: its share fades."""
        return replace(self, released_at=min(self.released_at, now))

    def alive(self, now: float) -> bool:
        """The hand holds on: not released, and heard of within the last ``GONE_S``."""
        return self.released_at > now and now - self.beat_at < GONE_S - 1e-9

    def lost(self, now: float) -> bool:
        """Nobody let go, but the heartbeats are late: only a new press takes hold again."""
        return math.isfinite(self.beat_at) and self.released_at == math.inf and not self.alive(now)

    def active(self, now: float) -> bool:
        """There is a force, or one begins."""
        return self.alive(now) or self.share(now) > 0.0

    def share(self, now: float) -> float:
        """Share of the whole force, 0 … 1: rising after a press, fading without heartbeats and after a release."""
        since = now - self.beat_at
        if since >= GONE_S - 1e-9:
            return 0.0
        silent = 1.0 - (since - FRESH_S) / (GONE_S - FRESH_S)
        released = 1.0 - (now - self.released_at) / GONE_S
        return max(min((now - self.begun_at) / RISE_S, silent, released, 1.0), 0.0)


NOBODY = Hold()


class VirtualCoupling:
    """Where the hand has its grip, and how it pulls."""

    def __init__(self) -> None:
        self._from = self._to = np.zeros(3)
        self._moved_at = 0.0

    def move(self, grip: Array, now: float, onwards: bool) -> None:
        """The grip goes to (3,) in LPS mm: ``onwards`` evenly within ``INTERPOLATION_S``, otherwise at once.

        What is no place of a tool is ignored (HAZ-05).
        """
        if not (np.abs(grip) <= FARTHEST_MM).all():
            return
        self._from = self._at(now) if onwards else grip
        self._to, self._moved_at = grip, now

    def force(self, tool_grip: Array, stiffness: float, cap: float, now: float) -> Array:
        """Whole force (3,) in N of a hand that holds: stiffness [N/mm] × pull, no more than cap [N]."""
        pull = self._at(now) - tool_grip
        if float(np.linalg.norm(pull)) > MAX_JUMP_MM:
            return np.zeros(3)
        return np.array(saturate(triple(stiffness * pull), cap))

    def _at(self, now: float) -> Array:
        share = min(max((now - self._moved_at) / INTERPOLATION_S, 0.0), 1.0)
        place: Array = self._from + share * (self._to - self._from)
        return place
