"""Which contour placed by hand makes a pathway narrow where the fitted one is not."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...pathway.hand_contours import EditedPathway, spread_mm
from ...pathway.interpolation import spline_maps
from ...pathway.pathway import Pathway

_MOVED_MM = 1e-3  # a contour that is nearer to its fitted place was not moved


class ContourByHand(NamedTuple):
    """A control contour placed by hand: its number from 1, of how many, mm along the way and its least radius in mm."""

    number: int
    of: int
    at_mm: float
    radius_mm: float

    @property
    def words(self) -> str:
        """For people."""
        return f"contour {self.number} of {self.of}, placed by hand at {self.at_mm:.0f} mm"


class HandEdits(NamedTuple):
    """edited: a pathway with contours placed by hand, as ``edited_lumen`` has it; fitted: the one without them."""

    edited: EditedPathway
    fitted: Pathway

    def reaching(self, s_mm: float) -> int | None:
        """Number from 0 of the nearest contour by hand that the edited pathway depends on at an arc length, in mm."""
        at_s, hand = self.edited.pathway.at_s, np.flatnonzero(self.edited.of_hand >= 0)
        moved = self._moved_mm()[hand].tolist()
        along = np.array([spread_mm(one) if one > _MOVED_MM else 0.0 for one in moved])
        low = np.minimum(at_s[np.maximum(hand - 1, 0)], at_s[hand] - along)
        high = np.maximum(at_s[np.minimum(hand + 1, len(at_s) - 1)], at_s[hand] + along)
        near = hand[(low <= s_mm) & (s_mm <= high)]
        return int(near[np.abs(at_s[near] - s_mm).argmin()]) if len(near) else None

    def narrowing(self, s_mm: float, robot_mm: float) -> int | None:
        """Number from 0 of the contour by hand that narrows the pathway.

        s_mm: arc length of the edited pathway at rest, where its radius is less than ``robot_mm``. None: no contour by
        hand reaches there, or the fitted pathway is as narrow.
        """
        edited, fitted = self.edited, self.fitted.moved(None)
        assert fitted.knots is not None
        knot = np.interp([s_mm], edited.pathway.at_s, edited.fit_knots)
        before = np.interp(knot, fitted.knots, fitted.at_s)
        contours = fitted.contours()
        radius = np.interp(before, contours.s, contours.radius.min(axis=1))
        radius = np.minimum(radius, fitted.narrowest_between(before, before))
        return None if radius[0] < robot_mm else self.reaching(s_mm)

    def named(self, number: int) -> ContourByHand:
        """The control contour with a number from 0."""
        at_mm, radius = self.edited.at_mm, self.edited.pathway.radius
        return ContourByHand(number + 1, len(radius), float(at_mm[number]), float(radius[number].min()))

    def _moved_mm(self) -> Array:
        """By how much each control contour (C0,) was moved from where the fit has it."""
        edited, fitted = self.edited, self.fitted
        assert fitted.knots is not None
        place = spline_maps(fitted.knots, edited.fit_knots)[0] @ fitted.centre
        moved: Array = np.linalg.norm(edited.pathway.centre - place, axis=1)
        return moved
