"""The bends that the hand has come through, to go back by where the straight path from here is not free."""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Array

SteeringAngles = tuple[float, float]

_APART = math.radians(1.0)  # between two bends that are kept, the joint that differs most
_REACHED = 1e-9  # [rad]


class Trail:
    """Bends (2L',) rad off the conforming shape from rest on, each with its (u, v); loops are cut off.

    back: whether the links are on their way back along it.
    """

    def __init__(self) -> None:
        self.back = False
        self._kept: list[tuple[Array, SteeringAngles]] = []

    def copy(self) -> Trail:
        """A trail that goes on by itself."""
        other = Trail()
        other.back, other._kept = self.back, list(self._kept)
        return other

    def __len__(self) -> int:
        return len(self._kept)

    def note(self, bend: Array, steering: SteeringAngles) -> None:
        """The hand has come to a bend."""
        self.back = False
        if self._kept and float(np.abs(self._kept[-1][0] - bend).max()) < _APART:
            return
        if self._kept:
            near = np.flatnonzero(np.abs(np.array([one for one, _ in self._kept]) - bend).max(axis=1) < _APART)
            if len(near):
                del self._kept[int(near[0]) + 1 :]
                return
        self._kept.append((bend.copy(), steering))

    def next(self, bend: Array) -> tuple[Array, SteeringAngles]:
        """Where to go from a bend on the way back: to the last one kept that has not been reached, at the end to 0."""
        while self._kept and float(np.abs(self._kept[-1][0] - bend).max()) < _REACHED:
            self._kept.pop()
        return self._kept[-1] if self._kept else (np.zeros_like(bend), (0.0, 0.0))

    def clear(self) -> None:
        """The links are straight."""
        self.back = False
        self._kept.clear()
