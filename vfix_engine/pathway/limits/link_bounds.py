"""Bounds b_i of a snake's links as a function of position: limited by the radius of the lumen at the link.

A bound wider than the lumen has no effect there. So a default bound is never more than ``BOUND_SHARE`` of the smallest
inscribed radius in the link's window; a configured one applies unchanged everywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np

from ...arrays import Array, IntArray
from ..packed import INSCRIBED_RADIUS
from ..pathway import Pathway
from .limits import ROUNDING_MM

BOUND_MM, TIP_BOUND_MM = 8.0, 4.0  # defaults of a link, and of the last one, where the lumen is wide
BOUND_SHARE = 0.5  # upper limit of a default bound, of the smallest inscribed radius in a link's window


class LinkBounds(NamedTuple):
    """b_i at every position of a link.

    most: (L,) mm. share: (L,) of the smallest inscribed radius in the link's window, infinite for a configured bound.
    """

    most: Array
    share: Array

    @classmethod
    def of(cls, bound_mm: float | None, tip_bound_mm: float | None, links: int) -> Self:
        """Create bounds of ``links`` links; None: default, for the last link half of a bound given for the others."""
        most = np.full(links, BOUND_MM if bound_mm is None else bound_mm)
        share = np.full(links, BOUND_SHARE if bound_mm is None else np.inf)
        if tip_bound_mm is not None:
            most[-1], share[-1] = tip_bound_mm, np.inf
        else:
            most[-1] = TIP_BOUND_MM if bound_mm is None else 0.5 * bound_mm
        return cls(most, share)

    def with_last(self, given: Sequence[float | None]) -> Self:
        """The same with bounds of the last links in mm, the same everywhere; None: as it was.

        Of more bounds than there are links the last ones count.
        """
        most, share = self.most.copy(), self.share.copy()
        first = max(len(most) - len(given), 0)
        for link, bound in enumerate(given[len(given) - (len(most) - first) :], first):
            if bound is not None:
                most[link], share[link] = bound, np.inf
        return type(self)(most, share)

    def largest_mm(self, pathway: Pathway) -> float:
        """The largest bound of any link anywhere in a pathway."""
        return float(np.minimum(self.most, self.share * inscribed_radii(pathway)[:-1].max()).max())

    def at(self, inscribed: Array, windows: IntArray) -> Array:
        """(L,) mm for links with those windows (L, 2); ``inscribed`` is the result of ``inscribed_radii``."""
        bound: Array = np.minimum(self.most, self.share * narrowest_of(inscribed, windows))
        return bound


def inscribed_radii(pathway: Pathway) -> Array:
    """Inscribed radius in mm of every segment of a pathway at rest, followed by infinity.

    At most the lumen's own radius along the segment, where the pathway contains it.
    At rest: a wave that narrows the lumen moves its wall, against which links are measured, but not the bounds.
    """
    found = np.append(pathway.moved(None).packed().rows[:, INSCRIBED_RADIUS], np.inf)
    of_contours = found[:-1] if pathway.closed_ends else found[1:-2]
    np.minimum(of_contours, pathway.narrowest_between(pathway.s[:-1], pathway.s[1:]), out=of_contours)
    return found


def narrowest_of(inscribed: Array, windows: IntArray) -> Array:
    """(L,) smallest radius in each window."""
    least: Array = np.minimum.reduceat(inscribed, windows.ravel())[::2]
    return least


def known_within(depth: Array, was: Array, bound: Array) -> Array:
    """(L,) mm, argument ``known`` of ``HardLimits.certify`` for a motion in which the links' bounds change.

    A link that is within its old bound must also be within its new one if that is smaller.
    """
    shrunk = (bound < was) & (depth <= was)
    return np.where(shrunk, np.minimum(depth, np.maximum(bound - ROUNDING_MM, 0.0)), depth)
