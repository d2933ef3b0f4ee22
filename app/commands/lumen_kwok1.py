"""`vfix lumen task kwok1`: study I of Kwok 2013, ten polyps of a colon that are looked at one after the other."""

from __future__ import annotations

import argparse
import re
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from app.commands.counts import positive
from app.commands.head_options import say_notes
from app.commands.lumen_options import lumen_surface, lumen_tissue, place, read_landmarks
from app.extras import has_app
from app.settings import Settings
from vfix_engine.anatomy.lumen.colon_case import colon_case
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError, VfixError
from vfix_engine.files.frame_report import FRAMES, MM_PER_UNIT
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.pathway.fit import containment
from vfix_engine.study.endoscopy.own_hand import KNOWS, SCRIPTED, HandMaker, OwnPolypOperator, hand_named
from vfix_engine.study.polyps.printed import POLYPS
from vfix_engine.study.polyps.sight import LumenSight
from vfix_engine.study.polyps.table import PRINTED
from vfix_engine.study.polyps.task import PolypTask
from vfix_engine.study.polyps.trial import polyp_trial
from vfix_engine.study.polyps.world import PolypWorld, polyp_world
from vfix_engine.worlds.snake.presets import PRESETS
from vfix_engine.worlds.snake.settings import CONTROLS
from vfix_engine.worlds.snake.viewable import EVERY_MM

if TYPE_CHECKING:  # a trial without a store keeps no run
    from app.services import Services

Say = Callable[[str], None]
_PRESET = PRESETS["kwok2013"]
_CONTROL = "view"  # the camera goes and looks where the hand pulls


class _Where(NamedTuple):
    """The lumen of a trial: its surface, the clicks at its ends, and landmarks by name, LPS mm."""

    name: str
    mesh: TriangleMesh
    start: Array
    end: Array
    landmarks: Mapping[str, Array]


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that only this task has."""
    parser._negative_number_matcher = re.compile(r"^-[\d.]")  # a place to the patient's right begins with a minus
    parser.add_argument("--surface", type=Path, help="a lumen's closed surface instead of the synthetic colon")
    parser.add_argument("--frame", choices=FRAMES, help="of the surface, where its file does not say")
    parser.add_argument("--unit", choices=tuple(MM_PER_UNIT), help="of the surface, where its file does not say")
    parser.add_argument("--start", type=place, metavar="X,Y,Z", help="of a surface: where it goes in, LPS mm")
    parser.add_argument("--end", type=place, metavar="X,Y,Z", help="of a surface: where the way ends, LPS mm")
    parser.add_argument("--landmarks", type=Path, metavar="FILE", help="of a surface: JSON with places by name")
    parser.add_argument("--polyps", type=positive, default=POLYPS, metavar="N", help=f"default {POLYPS}")
    parser.add_argument(
        "--links", type=positive, metavar="N", help=f"of 28 mm; default {_PRESET.links}, or fewer that reach the end"
    )
    parser.add_argument("--radius", type=float, metavar="MM", help="of the robot")
    parser.add_argument("--bound", type=float, metavar="MM", help="how far a link may leave the pathway, everywhere")
    parser.add_argument("--tip-bound", type=float, metavar="MM", help="how far the last link may")
    parser.add_argument("--control", choices=CONTROLS, default=_CONTROL, help="what bends the last links")
    parser.add_argument("--breathing", type=float, metavar="MM", help="the lumen moves to and fro by so much")
    parser.add_argument("--peristalsis", type=float, metavar="SHARE", help="waves narrow the lumen by that share")
    parser.add_argument("--every", type=float, default=EVERY_MM, metavar="MM", help="between two depths of the plan")
    parser.add_argument("--anyway", action="store_true", help="go on where the lumen is narrower than the robot")


def run(args: argparse.Namespace, say: Say) -> dict[str, Any]:
    """Do the task; see docs/lumen_tasks.md for the keys."""
    began = time.perf_counter()
    hand = None if args.operator == SCRIPTED else hand_named(args.operator)  # before what takes long
    where = _where(args, say)
    model = _PRESET.robot() if args.radius is None else replace(_PRESET.robot(), radius_mm=args.radius)
    named = {"bound_mm": args.bound, "tip_bound_mm": args.tip_bound}
    changed = {name: value for name, value in named.items() if value is not None}
    settings = _PRESET.settings(control=args.control, arm=args.arm, **changed)
    world = polyp_world(
        where.mesh, where.start, where.end, where.landmarks, model, args.links, settings,
        lumen_tissue(args.breathing, args.peristalsis), seed=args.seed, count=args.polyps, anyway=args.anyway,
        every_mm=args.every, say=say,
    )  # fmt: skip
    prepared = time.perf_counter()
    outside = containment(where.mesh, world.lumen.pathway.moved(None))
    operator_of = None if hand is None else _own(args, hand, where.mesh, world)
    with _run_folder() as (folder, keep):
        found = polyp_trial(where.mesh, world, folder, say, operator_of)
        found["run"] = keep()
    found["pathway_outside"] = {"share": outside.outside, "depth_mm": list(outside.depth_mm)}
    if hand is not None:
        found |= {"operator": args.operator, "operator_knows": KNOWS}
    spent = {"prepared": prepared - began, "driven": time.perf_counter() - prepared}
    printed = {name: {"without": pair[0][0], "with": pair[1][0]} for name, pair in PRINTED.items()}
    return {"surface": where.name} | found | {"table_iii_printed": printed, "seconds": spent}


def _own(
    args: argparse.Namespace, hand: HandMaker, mesh: TriangleMesh, world: PolypWorld
) -> Callable[[PolypTask, LumenSight], OwnPolypOperator]:
    """What makes the operator of the hand of an installed package."""
    return lambda task, sight: OwnPolypOperator(args.operator, hand, task, sight, mesh, args.arm, world.motion)


def _where(args: argparse.Namespace, say: Say) -> _Where:
    given = [args.start, args.end, args.landmarks, args.frame, args.unit]
    if args.surface is None:
        if any(one is not None for one in given):
            raise InputError("--start, --end, --landmarks, --frame and --unit are of a --surface: name one")
        colon = colon_case()
        return _Where("synthetic colon", colon.mesh, colon.start, colon.end, colon.course.landmarks)
    if args.start is None or args.end is None:
        raise InputError("a surface needs its two ends: --start X,Y,Z and --end X,Y,Z")
    mesh, assumed = lumen_surface(args.surface, args.frame, args.unit)
    if assumed is not None:
        say(f"warning: {assumed}")
    landmarks = {} if args.landmarks is None else read_landmarks(args.landmarks)
    return _Where(args.surface.name, mesh, args.start, args.end, landmarks)


@contextmanager
def _run_folder() -> Iterator[tuple[Path, Callable[[], str | None]]]:
    """A folder for the run, and what stores it and returns its id: None, with a message, where it is not stored."""
    services = _services()
    with tempfile.TemporaryDirectory(prefix="vfix-run-") as place:
        folder = Path(place) / "run" if services is None else services.runs.new_folder()

        def keep() -> str | None:
            if services is None:
                return None
            try:
                return services.runs.keep(folder, origin="command line").id
            except (OSError, VfixError) as error:
                say_notes([f"the run was not kept: {error}"])
                return None

        try:
            yield folder, keep
        finally:
            if services is not None:
                services.runs.discard(folder)
                services.close()


def _services() -> Services | None:
    """The store; None without one, nor, told on stderr, with one that takes nothing."""
    if not has_app():
        return None
    from app.services import build_services

    try:
        services = build_services(Settings.from_environment())
        services.runs.discard(services.runs.new_folder())
    except (OSError, VfixError) as error:
        say_notes([f"the run is not recorded: {error}"])
        return None
    return services
