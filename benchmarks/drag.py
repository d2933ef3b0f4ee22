"""Previews of a dragged path point: seconds from its new position to the verdict and the plot of the resulting path.

The middle point of a stored plan is moved on a small circle with the robot's base unchanged, as when it is dragged on
the page. Each position is evaluated as by the page during a drag, and some of them also with the steps of the dry run.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from app.extras import has_app, need_app
from app.planning.placement import StoredPlacement
from app.services import Services, build_services
from app.settings import Settings
from benchmarks import report

if TYPE_CHECKING:
    from app.plans.service import Plan

SUMMARY = "the verdict while a path point is dragged"
AIMED_S = 0.3
_RADIUS_MM = 1.0  # of the circle
_JUDGED = 4  # positions that are also driven with the steps of the dry run


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options: which plan, and how many positions."""
    parser.add_argument("plan", metavar="PLAN", help="id or name of a stored plan")
    parser.add_argument("--places", type=int, default=20, help="of the dragged point (default 20)")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Return the seconds per position, and the error of the least clearance against the dry run with the same base.

    Raises:
        BenchmarkRefused: the plan has no path, or the number makes no sense.
        AppMissing: the planner is not installed.
    """
    if not has_app():
        raise need_app("vfix bench drag")
    if not 4 <= args.places <= 1000:
        raise report.BenchmarkRefused(f"--places {args.places} is not between 4 and 1000")
    from app.exchange.resolve import find  # not in an installation of the engine alone

    services = build_services(Settings.from_environment())
    try:
        plan = services.plans.get(find(services.plans.titles(), args.plan, "plan").id)
        if len(plan.content.points) < 2:
            raise report.BenchmarkRefused(f"the plan {plan.name!r} has no path of two points or more")
        return {"machine": report.machine().to_dict(), "plan": plan.name} | _measured(services, plan, args.places)
    finally:
        services.close()


def _measured(services: Services, plan: Plan, count: int) -> dict[str, Any]:
    planning = services.planning
    begin = time.perf_counter()
    stored = planning.evaluate(plan)
    placed_s = time.perf_counter() - begin
    placing = StoredPlacement(stored.base, stored.q_start)
    places = [_moved(plan, 2.0 * np.pi * turn / count) for turn in range(count)]
    planning.preview(places[0], placing)  # fills the caches that the first preview of a session fills
    seconds, least = [], []
    for moved in places:
        begin = time.perf_counter()
        least.append(planning.preview(moved, placing).min_clearance_mm)
        seconds.append(time.perf_counter() - begin)
    some = range(0, count, max(1, count // _JUDGED))
    off = [abs(least[k] - planning.evaluate(_with_base(places[k], placing)).min_clearance_mm) for k in some]
    return {
        "triangles": len(planning.bone(plan).mesh.faces),
        "length_mm": stored.length_mm,
        "placed_and_driven_s": placed_s,
        "median_s": float(np.median(seconds)),
        "slowest_s": max(seconds),
        "aimed_s": AIMED_S,
        "least_clearance_off_mm": max(off),
    }


def _moved(plan: Plan, angle: float) -> Plan:
    """Return the plan with the middle point of its path on a circle around its stored position."""
    from app.planning.previews import with_points  # not in an installation of the engine alone

    middle = len(plan.content.points) // 2
    x, y, z = plan.content.points[middle].position
    place = (x + _RADIUS_MM * float(np.cos(angle)), y, z + _RADIUS_MM * float(np.sin(angle)))
    points = [replace(point, position=place) if k == middle else point for k, point in enumerate(plan.content.points)]
    return with_points(plan, points)


def _with_base(plan: Plan, placing: StoredPlacement) -> Plan:
    """Return the plan with a placing of its robot."""
    robot = {**plan.content.robot, "base": placing.base.reshape(-1).tolist(), "q_start": placing.q_start.tolist()}
    return replace(plan, content=replace(plan.content, robot=robot))
