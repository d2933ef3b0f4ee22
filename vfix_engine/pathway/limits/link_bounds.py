"""The bounds b_i of a snake's links by place: at most a share of the radius of what a link is measured against.

A bound that is wider than the lumen says nothing there. So one that nobody has set is never more than ``BOUND_SHARE``
of the least inscribed radius in the link's window; one that is given holds everywhere as it is.
"""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np

from ...arrays import Array, IntArray
from ..packed import INSCRIBED_RADIUS
from ..pathway import Pathway
from .limits import ROUNDING_MM

BOUND_MM, TIP_BOUND_MM = 8.0, 4.0  # of a link, and of the last one, where the lumen is wide and nobody has set them
BOUND_SHARE = 0.5  # of the least inscribed radius in a link's window: a bound that nobody has set is no more


class LinkBounds(NamedTuple):
    """b_i wherever a link may be.

    most: (L,) mm. share: (L,) of the least inscribed radius in the link's window, infinite where the bound is given.
    """

    most: Array
    share: Array

    @classmethod
    def of(cls, bound_mm: float | None, tip_bound_mm: float | None, links: int) -> Self:
        """Of so many links; None: not set, for the last link half of a bound that is given for the others."""
        most = np.full(links, BOUND_MM if bound_mm is None else bound_mm)
        share = np.full(links, BOUND_SHARE if bound_mm is None else np.inf)
        if tip_bound_mm is not None:
            most[-1], share[-1] = tip_bound_mm, np.inf
        else:
            most[-1] = TIP_BOUND_MM if bound_mm is None else 0.5 * bound_mm
        return cls(most, share)

    def at(self, inscribed: Array, windows: IntArray) -> Array:
        """(L,) mm for links with those windows (L, 2); ``inscribed`` as ``inscribed_radii`` gives it."""
        bound: Array = np.minimum(self.most, self.share * narrowest_of(inscribed, windows))
        return bound


def inscribed_radii(pathway: Pathway) -> Array:
    """Inscribed radius in mm of every segment of a pathway at rest, and infinity as one more.

    Not more than the lumen's own radius along the segment, where the pathway knows that.
    At rest: a wave that narrows the lumen moves its wall, against which links are measured, and not the bounds.
    """
    found = np.append(pathway.moved(None).packed().rows[:, INSCRIBED_RADIUS], np.inf)
    of_contours = found[:-1] if pathway.closed_ends else found[1:-2]
    np.minimum(of_contours, pathway.narrowest_between(pathway.s[:-1], pathway.s[1:]), out=of_contours)
    return found


def narrowest_of(inscribed: Array, windows: IntArray) -> Array:
    """(L,) the least radius in each window."""
    least: Array = np.minimum.reduceat(inscribed, windows.ravel())[::2]
    return least


def known_within(depth: Array, was: Array, bound: Array) -> Array:
    """(L,) mm, ``known`` of ``HardLimits.certify`` for a motion that gives links other bounds than they had.

    A link that is within the bound that it had has to be within a smaller one that it gets.
    """
    shrunk = (bound < was) & (depth <= was)
    return np.where(shrunk, np.minimum(depth, np.maximum(bound - ROUNDING_MM, 0.0)), depth)
