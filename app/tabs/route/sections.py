"""Sections of the Route tab."""

from __future__ import annotations

from typing import Literal, TypedDict

from app.lumen.marks import MarkKind
from app.messages.sections import Position


class RouteEntry(TypedDict):
    """A route in the list."""

    id: str
    name: str
    modified: str


class RouteList(TypedDict):
    """The routes of the open case."""

    items: list[RouteEntry]


class MarkView(TypedDict):
    """A polyp or a label on the wall, LPS mm."""

    id: str
    kind: MarkKind
    name: str
    at: Position


class MarkKindView(TypedDict):
    """A kind of marks; many: of them, in words."""

    kind: MarkKind
    many: str


class ContourView(TypedDict):
    """A control contour of the pathway; lengths in mm. radii_mm: one of a circle, else those around it.

    cut_mm: by how much it was reduced, so that it does not cross a neighbour. behind_mm: by how much its rim lies
    behind the wall; None: not known yet.
    """

    at_mm: float
    centre: Position
    radii_mm: list[float]
    by_hand: bool
    cut_mm: float
    behind_mm: float | None


class ContourList(TypedDict):
    """Control contours of the open route. chosen: number of the one that is edited. by_hand: edits that are stored.

    left_out: of them, those that are too far from the way. words: what is to be known of those by hand.
    """

    items: list[ContourView]
    chosen: int | None
    by_hand: int
    left_out: int
    words: str


class WallViewsSection(TypedDict):
    """The viewable share of the wall up to depth_mm, None until it is computed. shown: tinted in the scene."""

    state: Literal["none", "computing", "ready", "failed"]
    words: str
    share: float | None
    depth_mm: float | None
    shown: bool


class RouteSection(TypedDict):
    """The open route; lengths in mm. links: None for as many as the way needs. bound_mm: None by the lumen's radius.

    mark_kinds: that there are. picking: what the next click on the wall is, '' for nothing. moving: the polyp or label
    that it moves, or ''.
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
    marks: list[MarkView]
    mark_kinds: list[MarkKindView]
    picking: Literal["entry", "end", MarkKind, "move", ""]
    moving: str


class ReachOfferView(TypedDict):
    """A robot, or a bound, with which the tip comes deeper; lengths in mm. bound_mm: None by the lumen's radius."""

    words: str
    links: int
    length_mm: float
    radius_mm: float
    bound_mm: float | None


class RoutePathSection(TypedDict):
    """What was computed of the open route; lengths in mm, all along the way of the robot's tip.

    words: why it failed. length_mm: to the end. reach_mm: how deep the tip comes; limit, reach_words: what
    ends its way. offers: what would come deeper. behind_share, behind_mm: how much of the
    pathway's surface is behind the wall, and how deep at most; bound_mm: the largest bound of a link.
    by_hand_mm: where the contour by hand is that makes it narrower than the robot; None: the lumen is, or it is not.
    s_mm, radius_mm, wall_mm: along the way, the pathway's radius and the distance from the centreline to the wall.
    """

    state: Literal["none", "computing", "ready", "failed"]
    words: str
    length_mm: float | None
    links: int | None
    reach_mm: float | None
    reach_words: str
    limit: Literal["", "end", "links", "narrow", "bound", "shape", "base"]
    offers: list[ReachOfferView]
    behind_share: float | None
    behind_mm: float | None
    bound_mm: float | None
    least_mm: float | None
    least_at_mm: float | None
    by_hand_mm: float | None
    s_mm: list[float]
    radius_mm: list[float]
    wall_mm: list[float]


class RouteSections(TypedDict):
    """Routes of a lumen, the open one, its pathway, the pathway's contours, and what can be viewed."""

    routes: RouteList
    route: RouteSection | None
    route_path: RoutePathSection
    route_contours: ContourList
    route_views: WallViewsSection
