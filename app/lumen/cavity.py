"""The body cavity that travels with vfix: its pathway comes along, and its robot stands on a fixed base in it."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from app.cases.files import shipped_cavity
from app.lumen.contours import hand_contours
from app.lumen.document import Route

if TYPE_CHECKING:  # slow to load, as in `paths`
    from app.lumen.paths import RoutePath
    from vfix_engine.worlds.snake import DriveSettings
    from vfix_engine.worlds.snake.lumen import Lumen

_STEP_MM = 5.0  # between two radii of the plot
_FIXED = "from a fixed base; labels are drawn where it can trace them"


def cavity_lumen() -> Lumen:
    """The cavity with its pathway; no robot follows its middle."""
    from vfix_engine.anatomy.lumen.centreline import Centreline
    from vfix_engine.worlds.snake.lumen import Lumen

    pathway = shipped_cavity().pathway
    curve, radius = pathway.curve(), pathway.contours().radius.min(axis=1)
    at = np.linspace(0.0, pathway.length, len(curve.points))
    line = Centreline(curve, np.interp(at, pathway.s, radius))
    return Lumen(line, curve, np.zeros(len(curve.points)), pathway)


def cavity_path(route: Route) -> RoutePath:
    """The pathway with the contours that were placed by hand, and the robot of the route on its base.

    Raises PathwayError for contours that cross.
    """
    from app.lumen.paths import RoutePath
    from vfix_engine.pathway.fit import containment
    from vfix_engine.pathway.hand_contours import with_hand_contours
    from vfix_engine.pathway.pathway_surface import pathway_surface
    from vfix_engine.proximity.proximity import ProximityTree
    from vfix_engine.worlds.snake.cavity import LINKS
    from vfix_engine.worlds.snake.lumen import Lumen
    from vfix_engine.worlds.snake.narrow import narrowest
    from vfix_engine.worlds.snake.reach import Reach

    case, fit, model = shipped_cavity(), cavity_lumen(), route.robot()
    edited = with_hand_contours(fit.pathway, fit.curve, hand_contours(route.contours))
    pathway, snake = edited.pathway, fit.snake(model, route.links or LINKS)
    s = np.linspace(0.0, pathway.length, max(2, math.ceil(pathway.length / _STEP_MM) + 1))
    contours, tip_mm = pathway.contours(), min(snake.reach_mm(), pathway.length)
    x, y, z = (float(value) for value in case.base[:3, 3])
    narrow = narrowest(pathway, snake, route.bound_mm, tip_mm)
    reach = Reach(tip_mm, pathway.length, "base", _FIXED, (x, y, z), narrow, (), containment(case.mesh, pathway))
    return RoutePath(
        Lumen(fit.centreline, edited.curve, fit.slack, pathway), edited, snake, _settings(route), None, s,
        np.interp(s, contours.s, contours.radius.min(axis=1)),
        ProximityTree(case.mesh).point_distance(edited.curve.position(s))[0],
        reach, pathway_surface(pathway), case.base,
    )  # fmt: skip


def _settings(route: Route) -> DriveSettings:
    """Those of the study, but for a bound of the route."""
    drive = shipped_cavity().drive
    return drive if route.bound_mm is None else replace(drive, bound_mm=route.bound_mm, tip_bound_mm=None)
