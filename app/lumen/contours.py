"""Contours of a route that were placed by hand, as a route stores them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import msgspec
import numpy as np
from msgspec import Meta

from app.operations.fields import REFUSED, Place
from vfix_engine.errors import InputError

if TYPE_CHECKING:  # slow to load, and a planner without a lumen needs none of it
    from vfix_engine.pathway.hand_contours import EditedPathway, HandContour
    from vfix_engine.worlds.snake.lumen import Lumen

MOST_CONTOURS = 200  # placed by hand in one route
MOST_RADII = 72  # of a contour, every five degrees
_RADIUS_REFUSED = "a contour's radius is 0.5 to 150 mm, not {:g}."

ContourRadius = Annotated[float, Meta(ge=0.5, le=150.0, extra={REFUSED: _RADIUS_REFUSED})]  # [mm]
Radii = Annotated[tuple[ContourRadius, ...], Meta(max_length=MOST_RADII)]


class RouteContour(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A contour placed by hand, LPS mm.

    at: the place on the way that it is for. radii_mm: one of a circle, three or more around it; none: the fitted
    contour is left out. centre: where it was moved to; None: on the way. of_fit: it takes the place of the fitted
    contour nearest to `at`, else it is one more.
    """

    at: Place
    radii_mm: Radii = ()
    centre: Place | None = None
    of_fit: bool = False


RouteContours = Annotated[tuple[RouteContour, ...], Meta(max_length=MOST_CONTOURS)]


def check_radii(radii_mm: Sequence[float]) -> None:
    """Raises InputError for none and for two radii."""
    if len(radii_mm) in (0, 2):
        raise InputError("a contour has one radius, or three and more around its centre.")


def hand_contours(contours: Sequence[RouteContour]) -> list[HandContour]:
    """The same for the engine. Raises PathwayError for one that cannot be."""
    from vfix_engine.pathway.hand_contours import HandContour

    return [
        HandContour(
            np.array(one.at), np.array(one.radii_mm, dtype=np.float64),
            None if one.centre is None else np.array(one.centre), one.of_fit,
        )
        for one in contours
    ]  # fmt: skip


def with_contours(fit: Lumen, contours: Sequence[RouteContour]) -> EditedPathway:
    """The control contours of a fit and those placed by hand; takes some milliseconds.

    Raises PathwayError where they cannot be among them.
    """
    from vfix_engine.pathway.hand_contours import with_hand_contours

    return with_hand_contours(fit.pathway, fit.curve, hand_contours(contours))
