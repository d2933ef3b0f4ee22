"""Sections of the Route tab."""

from __future__ import annotations

from typing import Literal, TypedDict

from app.messages.sections import Position


class RouteEntry(TypedDict):
    """A route in the list."""

    id: str
    name: str
    modified: str


class RouteList(TypedDict):
    """The routes of the open case."""

    items: list[RouteEntry]


class RouteSection(TypedDict):
    """The open route; lengths in mm. links: None for as many as the way needs. bound_mm: None by the lumen's radius.

    picking: what the next click on the wall is, '' for neither end.
    """

    id: str
    name: str
    revision: int
    locked: bool
    can_undo: bool
    can_redo: bool
    entry: Position | None
    end: Position | None
    links: int | None
    length_mm: float
    radius_mm: float
    bound_mm: float | None
    breathing_mm: float
    breathing_period_s: float
    peristalsis: float
    peristalsis_period_s: float
    picking: Literal["entry", "end", ""]


class ReachOfferView(TypedDict):
    """A robot, or a bound, with which the tip comes deeper; lengths in mm. bound_mm: None by the lumen's radius."""

    words: str
    links: int
    length_mm: float
    radius_mm: float
    bound_mm: float | None


class RoutePathSection(TypedDict):
    """What was computed of the open route; lengths in mm.

    words: why it failed. reach_mm: how deep the tip comes; limit, reach_words: what ends its way. offers: what would
    come deeper. behind_share, behind_mm: how much of the pathway's surface is behind the wall, and how deep at most.
    s_mm, radius_mm, wall_mm: along the pathway, its radius and the distance to the wall.
    """

    state: Literal["none", "computing", "ready", "failed"]
    words: str
    length_mm: float | None
    links: int | None
    reach_mm: float | None
    reach_words: str
    limit: Literal["", "end", "links", "narrow", "bound", "shape"]
    offers: list[ReachOfferView]
    behind_share: float | None
    behind_mm: float | None
    least_mm: float | None
    least_at_mm: float | None
    s_mm: list[float]
    radius_mm: list[float]
    wall_mm: list[float]


class RouteSections(TypedDict):
    """Routes of a lumen, the open one, and its pathway."""

    routes: RouteList
    route: RouteSection | None
    route_path: RoutePathSection
