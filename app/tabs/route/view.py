"""The sections of the Route tab, made of what is stored and computed."""

from __future__ import annotations

from app.drives.view import number, place
from app.lumen.document import StoredRoute
from app.lumen.paths import RoutePath
from app.tabs.route.marks import mark_kinds, mark_view
from app.tabs.route.sections import ReachOfferView, RoutePathSection, RouteSection
from vfix_engine.arrays import Array
from vfix_engine.worlds.snake.reach import ReachOffer


def route_section(route: StoredRoute, picking: str, moving: str) -> RouteSection:
    """The open route."""
    content = route.content
    return {
        "id": route.id,
        "name": route.name,
        "revision": route.revision,
        "locked": route.locked,
        "can_undo": route.can_undo,
        "can_redo": route.can_redo,
        "entry": None if content.entry is None else place(content.entry),
        "end": None if content.end is None else place(content.end),
        "links": content.links,
        "length_mm": content.length_mm,
        "radius_mm": content.radius_mm,
        "bound_mm": content.bound_mm,
        "breathing_mm": content.breathing_mm,
        "breathing_period_s": content.breathing_period_s,
        "peristalsis": content.peristalsis,
        "peristalsis_period_s": content.peristalsis_period_s,
        "marks": [mark_view(mark) for mark in content.marks],
        "mark_kinds": mark_kinds(),
        "picking": picking,  # type: ignore[typeddict-item]
        "moving": moving,
    }


def path_section(path: RoutePath | None, computing: bool, failure: str) -> RoutePathSection:
    """What was computed of it."""
    empty: RoutePathSection = {
        "state": "computing" if computing else "failed" if failure else "none",
        "words": failure,
        "length_mm": None,
        "links": None,
        "reach_mm": None,
        "reach_words": "",
        "limit": "",
        "offers": [],
        "behind_share": None,
        "behind_mm": None,
        "bound_mm": None,
        "least_mm": None,
        "least_at_mm": None,
        "by_hand_mm": None,
        "s_mm": [],
        "radius_mm": [],
        "wall_mm": [],
    }
    if path is None:
        return empty
    reach, narrow, wall = path.reach, path.reach.narrowest, path.reach.behind_wall
    return {
        "state": "ready",
        "words": "",
        "length_mm": number(path.length_mm, 1),
        "links": path.snake.links,
        "reach_mm": number(reach.depth_mm, 1),
        "reach_words": reach.words,
        "limit": reach.limit,
        "offers": [_offer(offer) for offer in reach.offers],
        "behind_share": None if wall is None else number(wall.outside, 4),
        "behind_mm": None if wall is None else number(wall.depth_mm[-1], 2),
        "bound_mm": number(path.bound_mm(path.settings), 2),
        "least_mm": number(narrow.radius_mm, 1),
        "least_at_mm": number(narrow.at_mm, 0),
        "by_hand_mm": None if narrow.by_hand is None else number(narrow.by_hand.at_mm, 0),
        "s_mm": _plain(path.s_mm),
        "radius_mm": _plain(path.radius_mm),
        "wall_mm": _plain(path.wall_mm),
    }


def _offer(offer: ReachOffer) -> ReachOfferView:
    robot = offer.snake
    return {
        "words": offer.words,
        "links": robot.links,
        "length_mm": robot.length_mm,
        "radius_mm": robot.radius_mm,
        "bound_mm": offer.bound_mm,
    }


def _plain(values: Array) -> list[float]:
    return [round(float(value), 2) for value in values]
