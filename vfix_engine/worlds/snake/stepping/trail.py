"""The bends that the hand has passed, for the way back where the direct path is not free."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ....arrays import Array

SteeringAngles = tuple[float, float]

_APART = math.radians(1.0)  # difference of the most different joint between two stored bends
_REACHED = 1e-9  # [rad]


class Trail(NamedTuple):
    """Bends (2L',) rad off the conforming shape from rest on, each with its (u, v); loops are cut off.

    back: whether the links are on their way back along it.
    """

    bends: tuple[tuple[Array, SteeringAngles], ...] = ()
    back: bool = False

    def noted(self, bend: Array, steering: SteeringAngles) -> Trail:
        """The hand has reached a bend."""
        bends = self.bends
        if bends and float(np.abs(bends[-1][0] - bend).max()) < _APART:
            return Trail(bends)
        if bends:
            near = np.flatnonzero(np.abs(np.array([one for one, _ in bends]) - bend).max(axis=1) < _APART)
            if len(near):
                return Trail(bends[: int(near[0]) + 1])
        return Trail((*bends, (bend.copy(), steering)))

    def before(self, q: Array, joints: Callable[[Array], Array]) -> Trail:
        """On the way back from q (2L',), without the bends already reached.

        joints: of a bend, within their range; one that is beyond it, since the shape is another now, is reached at the
        range's end.
        """
        left = len(self.bends)
        while left and float(np.abs(joints(self.bends[left - 1][0]) - q).max()) < _REACHED:
            left -= 1
        return self if left == len(self.bends) else self._replace(bends=self.bends[:left])
