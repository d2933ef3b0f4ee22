"""A route through a lumen as a document: where the robot enters, where it is going, and which robot it is."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from app.documents import Document, new_in, struct_kind
from app.lumen.contours import RouteContours, check_radii, hand_contours
from app.lumen.marks import RouteMarks
from app.operations.fields import Place
from vfix_engine.errors import InputError
from vfix_engine.robots.snake import MOST_LINKS, SnakeModel

MOST_BREATHING_MM = 20.0
BREATH_S, WAVE_S = 4.0, 6.0  # of a breath, and of a wave of peristalsis

Links = Annotated[int, Meta(ge=1, le=min(MOST_LINKS, 120))]
LinkLength = Annotated[float, Meta(ge=1.0, le=100.0)]  # [mm]
LinkRadius = Annotated[float, Meta(ge=0.5, le=30.0)]  # [mm]
Bound = Annotated[float, Meta(ge=0.1, le=50.0)]  # [mm]
Amplitude = Annotated[float, Meta(ge=0.0, le=MOST_BREATHING_MM)]  # [mm]

Period = Annotated[float, Meta(ge=1.0, le=60.0)]  # [s]
WaveShare = Annotated[float, Meta(ge=0.0, le=0.9)]  # of the radius


class Route(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A route, LPS mm.

    entry, end: places in the lumen or on its wall; None until they are chosen.
    links: of the robot; None: as many as the way to the end needs. length_mm, radius_mm: of each link.
    bound_mm: how far a link may leave its pathway (Kwok 2013, b_i of eq. 17); None: by the lumen's radius, 8 mm at
        most. breathing_mm: amplitude of the tissue's motion along the body's axis; 0: none. breathing_period_s: of it.
    peristalsis: share of the radius by which waves narrow the lumen; 0: none. peristalsis_period_s: between two waves.
    contours: of the pathway that were placed by hand. marks: polyps and labels on the wall.
    """

    entry: Place | None = None
    end: Place | None = None
    links: Links | None = None
    length_mm: LinkLength = 28.0
    radius_mm: LinkRadius = 6.0
    bound_mm: Bound | None = None
    breathing_mm: Amplitude = 0.0
    breathing_period_s: Annotated[Period, new_in(2)] = BREATH_S
    peristalsis: Annotated[WaveShare, new_in(2)] = 0.0
    peristalsis_period_s: Annotated[Period, new_in(2)] = WAVE_S
    contours: Annotated[RouteContours, new_in(2)] = ()
    marks: Annotated[RouteMarks, new_in(2)] = ()

    def robot(self) -> SnakeModel:
        """One link of the robot, or as many as are given. Raises RobotError where the lengths fit no robot."""
        return SnakeModel(self.links or 1, length_mm=self.length_mm, radius_mm=self.radius_mm)


def _possible(route: Route) -> Route:
    """Raises RobotError, PathwayError and other InputErrors for lengths that fit no robot, and for such contours."""
    route.robot()
    for contour in route.contours:
        if contour.radii_mm or not contour.of_fit:
            check_radii(contour.radii_mm)
    if route.contours:
        hand_contours(route.contours)  # slow to load
    if len({mark.id for mark in route.marks}) < len(route.marks):
        raise InputError("two polyps or labels of the route have the same id.")
    return route


ROUTE = struct_kind(
    name="route",
    noun="route",
    schema="vfix-route/2",
    content=Route,
    rules=_possible,
)

StoredRoute = Document[Route]
