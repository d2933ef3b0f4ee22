"""The scene that `vfix rehearse` drives: head, robot, tool and path of a plan, with what the arguments change."""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from app.cases.settings import settings_in_case
from app.commands.head_options import say_notes
from app.commands.rehearse_errors import compensating
from app.commands.rehearse_freehand import check_zones, driven_preset
from app.exchange.resolve import (
    ResolvedCase,
    resolve_plan_zones,
    resolve_targets,
    resolve_zones,
)
from app.planning.bone_removal import tree_without_removed_bone
from app.planning.distance_fields import plan_tissue
from app.planning.placement import standing_base, stored_placement
from app.planning.rehearsal_options import NO_OPTIONS, RehearsalOptions, standing
from app.planning.remote_centre import ENTRY, PathPlace
from app.planning.shaft import shaft_of
from app.plans.imported_places import target_notes
from app.plans.instruments import CarriedUrdf, RobotSource, plan_robot, plan_tool
from app.plans.model import Plan
from app.services import Services
from vfix_engine.control import ControlSettings
from vfix_engine.errors import InputError
from vfix_engine.frames import ImageRegistration
from vfix_engine.geometry.path import SplinePath
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.virtual_fixtures.zone_file import ZoneSet
from vfix_engine.worlds.rigid import preparation
from vfix_engine.worlds.rigid.placing import place_robot
from vfix_engine.worlds.rigid.presets import PRESETS
from vfix_engine.worlds.rigid.scene import Scene


def build_scene(
    case: ResolvedCase,
    plan: Plan,
    args: argparse.Namespace,
    robots: RobotSource | None = None,
    registration: ImageRegistration | None = None,
) -> tuple[Scene, ControlSettings, str, str, tuple[str, ...]]:
    """Scene and settings of a plan, why its placement does not arrive, what its options stand for, and notes, in words.

    A plan without a robot placement gets one; behind a registration that says where the robot stands, its joints alone.
    """
    settings, preset = _settings(plan, case, args), PRESETS.get(driven_preset(args) or "")
    robot, tool = _robot(plan, args, robots), Tool.load(args.tool) if args.tool else plan_tool(plan.content)
    path = SplinePath(np.array([p.position for p in plan.content.points]))
    if args.task == "inspect":
        targets, names = _targets(plan, args.targets)
    else:
        targets, names = np.zeros((0, 3)), ()
    zones = _zones(plan, case, args)
    prepare_engine()  # everything that was given has been read
    options = _options(plan, args)
    scan = None if options == NO_OPTIONS else case.scan()
    stands = standing(options, plan, scan, lambda: plan_tissue(case.scans, plan) if case.scans else None)
    soft, shaft = (zones.soft_zones, shaft_of(plan, path)) if preset is None else ((), None)
    lost = len(zones.soft_zones) - len(soft)
    dropped = (f"{lost} soft zone{'s' * (lost > 1)} of the plan or --zones: off, the papers have none",) if lost else ()
    fixtures = (*soft, *stands.fixtures, *zones.envelopes)
    tree, _ = tree_without_removed_bone(case.tree, case.scan() if plan.content.removed_bone else None, plan)
    # A placement is of one robot, tool and margin among what there was; another of them asks for another one.
    others = (
        args.robot,
        args.tool_frame,
        args.tool,
        args.margin,
        args.zones,
        stands.words or None,
        args.compensate or None,
    )
    stored = stored_placement(plan.content.robot) if registration is None else None
    standing_at = None if registration is None else standing_base(plan.content.robot, registration)
    if stored is not None and all(other is None for other in others):
        base, q_start = stored
        obstacle = ""
    else:
        placement = place_robot(
            tree, robot, tool, path, settings, zones.zones, fixtures, structure_names=case.structure_names,
            shaft=shaft, base=standing_at,
        )  # fmt: skip
        base, q_start, obstacle = placement.base, placement.q_start, placement.run.reason
    scene = Scene(
        tree, robot, tool, base, q_start, path, targets, names, zones.zones, fixtures, case.structure_names, shaft
    )
    return scene if preset is None else preset.in_scene(scene), settings, obstacle, stands.words, dropped


def _settings(plan: Plan, case: ResolvedCase, args: argparse.Namespace) -> ControlSettings:
    """The plan's settings, changed by the preset and then by what is said on the command line."""
    settings, preset = settings_in_case(plan.content.settings, case.uncertainty), PRESETS.get(driven_preset(args) or "")
    if preset is not None:
        settings = preset.in_settings(settings)
    if args.margin is not None:
        settings = replace(settings, margin_mm=args.margin)
    if args.view_distance is not None:
        settings = replace(settings, view_distance_mm=args.view_distance)
    if args.free:
        settings = replace(settings, k_tau=1.0)
    return compensating(settings, args)


def _zones(plan: Plan, case: ResolvedCase, args: argparse.Namespace) -> ZoneSet:
    """The plan's protected structures, and beside them the zones of a file."""
    own, more = resolve_plan_zones(plan, case), ZoneSet() if args.zones is None else resolve_zones(args.zones, case)
    check_zones(args, more)
    return ZoneSet((*own.zones, *more.zones), (*own.soft_zones, *more.soft_zones), more.envelopes)


def _options(plan: Plan, args: argparse.Namespace) -> RehearsalOptions:
    """The options that are asked for. Raises InputError for a place that the plan does not have."""
    place = ENTRY
    if args.remote_centre not in (None, "entry"):
        named = [point.id for point in plan.content.points if args.remote_centre in (point.id, point.label)]
        try:
            place = PathPlace(named[0]) if named else PathPlace(at_mm=float(args.remote_centre))
        except ValueError:
            labels = ", ".join(point.label for point in plan.content.points)
            raise InputError(
                f"--remote-centre {args.remote_centre!r:.80} is neither a number of mm nor a path point: {labels}"
            ) from None
        if place.at_mm is not None and not 0.0 <= place.at_mm < math.inf:
            raise InputError("--remote-centre takes mm from the start of the path, from 0 on")
    return RehearsalOptions(
        soft_tissue=args.soft_tissue,
        remote_centre=args.remote_centre is not None,
        speed_limit=args.speed_limit,
        tube_mm=args.tube,
        centre=place,
    )


def _robot(plan: Plan, args: argparse.Namespace, robots: RobotSource | None) -> RobotModel:
    """The requested robot, else the plan's."""
    if args.robot is None and args.tool_frame is None:
        return plan_robot(plan.content, robots)
    if args.robot is None and plan.content.robot.get("urdf") is not None:
        return plan_robot(replace(plan.content, robot={**plan.content.robot, "tool_frame": args.tool_frame}), robots)
    return RobotModel.load(args.robot or plan.content.robot["name"], args.tool_frame)


def _targets(plan: Plan, file: Path | None) -> tuple[np.ndarray, tuple[str, ...]]:
    """Targets from a file, from the plan, or the path's end."""
    targets = resolve_targets(file) if file is not None else plan.content.targets
    if file is not None:
        say_notes(target_notes(targets))
    if targets:
        return np.array([t.position for t in targets]), tuple(t.label for t in targets)
    return np.array([plan.content.points[-1].position]), ("the path's end",)


def robots_of(services: Services | None, urdf: bytes | None) -> RobotSource | None:
    """Where the plan's robot is found: in its file, else in the store."""
    if urdf is not None:
        return CarriedUrdf(urdf)
    return None if services is None else services.instruments


def prepare_engine() -> None:
    """Compile missing kernels on two cores, with a message; on failure they are compiled when needed."""
    if not preparation.is_prepared():
        print("vfix: preparing the geometry engine, on the first start only ...", file=sys.stderr, flush=True)
        with suppress(subprocess.SubprocessError, OSError):
            preparation.prepare()
