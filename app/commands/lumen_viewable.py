"""`vfix lumen viewable`: the share of a lumen's wall that a snake robot can view, before any motion."""

from __future__ import annotations

import argparse
import json
import re
import sys
from dataclasses import asdict, replace
from pathlib import Path
from time import perf_counter
from typing import Any

from app.commands.lumen_options import lumen_surface, lumen_tissue, place
from vfix_engine.files.frame_report import FRAMES, MM_PER_UNIT
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.snake import NOTICE
from vfix_engine.worlds.snake.lumen import lumen_between
from vfix_engine.worlds.snake.offline.confirm_views import confirm_views
from vfix_engine.worlds.snake.settings import DriveSettings
from vfix_engine.worlds.snake.viewable import EVERY_MM, viewable_wall
from vfix_engine.worlds.snake.viewing import ViewLimits


def add_viewable(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """The action's arguments."""
    parser = actions.add_parser("viewable", help="how much of the wall the robot can view", description=__doc__)
    parser._negative_number_matcher = re.compile(r"^-[\d.]")  # a place to the patient's right begins with a minus
    parser.add_argument("surface", metavar="SURFACE", type=Path, help="the lumen's surface (.stl, .ply, .obj)")
    parser.add_argument("--frame", choices=FRAMES, help="of the surface, where its file does not say")
    parser.add_argument("--unit", choices=tuple(MM_PER_UNIT), help="of the surface, where its file does not say")
    parser.add_argument("--start", type=place, required=True, metavar="X,Y,Z", help="where it goes in, LPS mm")
    parser.add_argument("--end", type=place, required=True, metavar="X,Y,Z", help="where the way ends, LPS mm")
    parser.add_argument("--links", type=int, metavar="N", help="as many as it takes to the end by default")
    parser.add_argument("--length", type=float, default=28.0, metavar="MM", help="of a link")
    parser.add_argument("--radius", type=float, default=6.0, metavar="MM", help="of the robot")
    parser.add_argument("--manipulated", type=int, default=5, metavar="N", help="last links, which bend")
    parser.add_argument("--bound", type=float, metavar="MM", help="how far a link may leave the pathway, everywhere")
    parser.add_argument("--tip-bound", type=float, metavar="MM", help="how far the last link may")
    parser.add_argument("--breathing", type=float, metavar="MM", help="the lumen moves to and fro by so much")
    parser.add_argument("--peristalsis", type=float, metavar="SHARE", help="waves narrow it by that share")
    parser.add_argument("--every", type=float, default=EVERY_MM, metavar="MM", help="between two depths of the search")
    parser.add_argument("--starts", type=int, default=1, metavar="N", help="poses from which each place is searched")
    parser.add_argument("--confirm", type=int, default=0, metavar="N", help="places that are driven to")
    parser.add_argument("--seed", type=int, default=0, help="of the choice of these places")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")


def run_viewable(args: argparse.Namespace) -> int:
    """Exit status 0, or 1 when a place that was driven to was not viewed."""
    mesh, assumed = lumen_surface(args.surface, args.frame, args.unit)
    if assumed is not None:
        print(f"vfix: warning: {assumed}", file=sys.stderr, flush=True)
    settings = DriveSettings(bound_mm=args.bound, tip_bound_mm=args.tip_bound, manipulated=args.manipulated)
    model, tissue = SnakeModel(1, args.length, radius_mm=args.radius), lumen_tissue(args.breathing, args.peristalsis)
    lumen = lumen_between(mesh, args.start, args.end, model, settings, tissue)
    snake = lumen.snake(model, args.links)
    began, limits = perf_counter(), ViewLimits()
    found = viewable_wall(
        mesh, lumen.pathway, snake, settings, lumen.curve, lumen.slack, limits=limits, every_mm=args.every,
        starts=args.starts,
    )  # fmt: skip
    result: dict[str, Any] = {"surface": args.surface.name, **found.to_dict(), "seconds": perf_counter() - began}
    result |= {"limits": asdict(limits), "robot": asdict(snake), "settings": asdict(settings)}
    result["surface_assumed"] = assumed
    confirmed = None
    if args.confirm:
        confirmed = confirm_views(
            mesh, lumen.pathway, snake, replace(settings, control="view"), lumen.curve, lumen.slack, found,
            count=args.confirm, seed=args.seed,
        )  # fmt: skip
    result |= {"confirmed": None if confirmed is None else confirmed.to_dict(), "notice": NOTICE}
    if args.json:
        print(json.dumps(result, allow_nan=False))
    else:
        for name, value in result.items():
            print(f"{name:>24}  {json.dumps(value) if isinstance(value, (dict, list)) else value}")
    return 0 if confirmed is None or confirmed.viewed == confirmed.of else 1
