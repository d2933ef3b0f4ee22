"""`vfix rehearse`: a rehearsal without the page; prints the measurements."""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from app.cases.settings import settings_in_case
from app.commands.head_options import say_notes, told_of_file
from app.commands.rehearse_arguments import add_arguments
from app.commands.rehearse_freehand import at_hand_rate, check_options, check_zones, drive_freehand
from app.exchange.resolve import (
    ResolvedCase,
    resolve_case,
    resolve_plan,
    resolve_plan_zones,
    resolve_targets,
    resolve_zones,
)
from app.extras import has_app
from app.planning.bone_removal import tree_without_removed_bone
from app.planning.distance_fields import plan_tissue, plan_ways
from app.planning.piercing import PiercedReport, pierced_by_poses
from app.planning.placement import standing_base, stored_placement
from app.planning.rehearsal_options import NO_OPTIONS, RehearsalOptions, standing
from app.planning.remote_centre import ENTRY, PathPlace
from app.planning.shaft import shaft_of
from app.plans.imported_places import path_notes, target_notes
from app.plans.instruments import CarriedUrdf, RobotSource, plan_robot, plan_tool
from app.plans.model import Plan
from app.services import Services, build_services
from app.settings import Settings
from vfix_engine.anatomy.head_import import HeadRequest
from vfix_engine.anatomy.piercing import Ways
from vfix_engine.anatomy.soft_tissue import tissue_passed
from vfix_engine.control import ControlSettings
from vfix_engine.errors import InputError, VfixError
from vfix_engine.frames import ImageRegistration
from vfix_engine.geometry.path import SplinePath
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.runtime.system import Column, SystemSpec
from vfix_engine.virtual_fixtures import PathTube
from vfix_engine.virtual_fixtures.zone_file import ZoneSet
from vfix_engine.worlds.freehand.spec import FreehandSpec
from vfix_engine.worlds.freehand.system import FreehandSystem
from vfix_engine.worlds.rigid import preparation
from vfix_engine.worlds.rigid.csv_recorder import CsvRecorder
from vfix_engine.worlds.rigid.dry_run import STATION_MM
from vfix_engine.worlds.rigid.headless import HeadlessRun
from vfix_engine.worlds.rigid.placing import place_robot
from vfix_engine.worlds.rigid.presets import PRESETS
from vfix_engine.worlds.rigid.rehearsal import Rehearsal
from vfix_engine.worlds.rigid.scene import Scene
from vfix_engine.worlds.rigid.servo import ServoWatch
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot
from vfix_engine.worlds.rigid.spec import RigidSpec, SceneSpec

if TYPE_CHECKING:  # a drive without a store keeps no run
    from app.commands.recorded_run import RecordedRun

NOTICE = "Not for clinical use."
PUSHING_STEPS = 2000
SWINGING_STEPS = 4000


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = subparsers.add_parser("rehearse", help="run a rehearsal without a page", description=__doc__)
    add_arguments(parser, operators=tuple(DRIVES))
    return parser


def run(args: argparse.Namespace) -> int:
    """Exit status 0 when the task was completed, 1 otherwise."""
    if args.free and (args.operator != "pushing" or args.task != "path"):
        raise InputError("--free goes with --operator pushing: the other jobs need the path")
    if args.preset is not None and (args.soft_tissue or args.speed_limit):
        raise InputError("--preset goes without --soft-tissue and --speed-limit, which the papers do not have")
    if args.preset is not None and (args.free or args.view_distance is not None):
        raise InputError("--preset goes without --free and --view-distance, which would change its parameters")
    check_options(args)
    services = build_services(Settings.from_environment()) if has_app() else None
    case = resolve_case(services, args.case, HeadRequest(Path(args.case), **told_of_file(args)))
    resolved = resolve_plan(services, case, args.plan)
    plan = resolved.plan
    if args.path is not None:
        plan = replace(plan, content=plan.content.along(args.path))
    plan, registration, lost = _registered(services, plan)
    told = (plan.told,) if plan.told else ()
    notes = (*case.notes, *told, *path_notes(plan.content.points, case.mesh.bounds), *lost)
    say_notes(notes)
    robots = _robots(services, resolved.urdf)
    scene, settings, obstacle, held_by, dropped = build_scene(case, plan, args, robots, registration)
    say_notes(dropped)
    report = {"case": case.name, "plan": plan.name, "operator": args.operator, "task": args.task}
    report |= {"robot": scene.robot.name, "tool": scene.tool.name}
    if args.preset is not None:
        report |= PRESETS[args.preset].report()
    if scene.robot.notes:
        report["robot_notes"] = list(scene.robot.notes)
    if held_by:
        report["standing"] = held_by
    poses, ways = Poses(), plan_ways(case.scans, plan)
    freehand, kept = args.mode == "freehand", SceneSpec.of(scene)
    spec: SystemSpec = FreehandSpec(kept, at_hand_rate(settings)) if freehand else RigidSpec(kept, settings)
    rehearsal, hand = Rehearsal(scene, settings), FreehandSystem(scene, at_hand_rate(settings))
    recorded = _recorded(services, spec, (hand if freehand else rehearsal.system).row_layout, args)
    try:
        if freehand:
            report |= drive_freehand(hand, args, poses.add, recorded)
        else:
            report |= _rehearse(rehearsal, args, poses, recorded, ways)
        notes = (*notes, *dropped, *report.pop("notes", ()))
    except BaseException:
        if recorded is not None:
            recorded.drop()
        raise
    if recorded is not None:
        report["run"] = recorded.keep(case.id, plan.id if plan.revision else None, ways)  # a plan of a file has none
    if obstacle:
        report["placing_reason"] = obstacle
    if not report["completed"]:
        report["reason"] = report["reason"] or obstacle or "the tool no longer moves along the path"
    if notes:
        report["notes"] = list(notes)
    report["soft_tissue"] = asdict(tissue_passed(case.scan(), poses.kept))
    report["pierced"] = asdict(PiercedReport.of(pierced_by_poses(ways, poses.kept)))
    unknown = "" if case.uncertainty.voxel_mm else f"{case.uncertainty.words()}; the margin has to cover that"
    report["warnings"] = [words] if (words := case.uncertainty.warning(settings.margin_mm) or unknown) else []
    say_notes([f"{words}." for words in report["warnings"]])
    report["notice"] = NOTICE
    if args.json:
        print(json.dumps(report, allow_nan=False))
    else:
        _print_for_people(report)
    return 0 if report["completed"] else 1


class Poses:
    """Poses of the tool in a drive, at least 0.5 mm apart, for `tissue_passed`."""

    def __init__(self) -> None:
        self.kept: list[tuple[float, np.ndarray, np.ndarray]] = []

    def add(self, snapshot: RigidSnapshot) -> None:
        ends = snapshot.segments_start, snapshot.segments_end
        if self.kept:
            moved = max(float(np.abs(new - old).max()) for new, old in zip(ends, self.kept[-1][1:], strict=True))
            if moved < STATION_MM:
                return
        self.kept.append((snapshot.progress_mm, *ends))


def prepare_engine() -> None:
    """Compile missing kernels on two cores, with a message; on failure they are compiled when needed."""
    if not preparation.is_prepared():
        print("vfix: preparing the geometry engine, on the first start only ...", file=sys.stderr, flush=True)
        with suppress(subprocess.SubprocessError, OSError):
            preparation.prepare()


def _registered(services: Services | None, plan: Plan) -> tuple[Plan, ImageRegistration | None, tuple[str, ...]]:
    """The plan and the registration that it goes by; without that of a file, and a note, where it is not here.

    The notes say what is doubtful of it, too.

    A placement that a file holds is in the patient's frame, which is not known then: the robot is placed anew.
    Raises PlanError where a stored plan refers to one that cannot be used.
    """
    if plan.content.registration is None:
        return plan, None, ()
    if services is None or all(one.id != plan.id for one in services.plans.titles()):
        words = "The plan refers to a registration, which its file does not have: driven in the image's frame."
        return replace(plan, content=plan.content.without_placement()), None, (words,)
    registered = services.planning.registration(plan)
    if registered is None:
        return plan, None, ()
    return plan, registered.image, services.registering.registration_of(plan).doubts


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
    settings, preset = settings_in_case(plan.content.settings, case.uncertainty), PRESETS.get(args.preset)
    if preset is not None:
        settings = preset.in_settings(settings)
    if args.margin is not None:
        settings = replace(settings, margin_mm=args.margin)
    if args.view_distance is not None:
        settings = replace(settings, view_distance_mm=args.view_distance)
    if args.free:
        settings = replace(settings, k_tau=1.0)
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
    tube = () if args.tube is None else (PathTube(path, args.tube),)
    soft, shaft = (zones.soft_zones, shaft_of(plan, path)) if preset is None else ((), None)
    lost = len(zones.soft_zones) - len(soft)
    dropped = (f"{lost} soft zone{'s' * (lost > 1)} of the plan or --zones: off, the papers have none",) if lost else ()
    fixtures = (*soft, *stands.fixtures, *tube, *zones.envelopes)
    tree, _ = tree_without_removed_bone(case.tree, case.scan() if plan.content.removed_bone else None, plan)
    # A placement is of one robot, tool and margin among what there was; another of them asks for another one.
    others = (args.robot, args.tool_frame, args.tool, args.margin, args.zones, stands.words or None, args.tube)
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


def _robots(services: Services | None, urdf: bytes | None) -> RobotSource | None:
    """Where the plan's robot is found: in its file, else in the store."""
    if urdf is not None:
        return CarriedUrdf(urdf)
    return None if services is None else services.instruments


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


def _recorded(
    services: Services | None, spec: SystemSpec, columns: tuple[Column, ...], args: argparse.Namespace
) -> RecordedRun | None:
    """The recorder of the run; None without a writable store."""
    if services is None:
        return None
    from app.commands.recorded_run import RecordedRun

    try:
        seed = args.seed if args.operator == "pushing" or args.mode == "freehand" else None
        return RecordedRun(services, spec, columns, seed)
    except (OSError, VfixError) as error:
        say_notes([f"the run is not recorded: {error}"])
        return None


def _rehearse(
    rehearsal: Rehearsal, args: argparse.Namespace, poses: Poses, recorded: RecordedRun | None, ways: Ways | None
) -> dict[str, Any]:
    if args.record is None:
        return _drive(HeadlessRun(rehearsal, poses.add, recorded, args.approach, _servo(args)), args)
    try:
        with CsvRecorder(args.record, ways) as recorder:

            def keep(snapshot: RigidSnapshot) -> None:
                recorder.add(snapshot)
                poses.add(snapshot)

            return _drive(HeadlessRun(rehearsal, keep, recorded, args.approach, _servo(args)), args)
    except OSError as error:
        raise InputError(f"the recording {args.record} cannot be written: {error.strerror}") from error


def _servo(args: argparse.Namespace) -> ServoWatch | None:
    """What measures the poses between the set points of a preset's outer loop."""
    return None if args.preset is None else ServoWatch()


def _follow(run: HeadlessRun, args: argparse.Namespace) -> dict[str, Any]:
    last = run.follow()
    done = last.phase == "done"
    result = {"completed": done, "reason": "" if done else last.reason, "reached_mm": last.progress_mm}
    return result if done else result | _stopped(last)


def _push(run: HeadlessRun, args: argparse.Namespace) -> dict[str, Any]:
    steps = PUSHING_STEPS if args.steps is None else args.steps
    return {"completed": True} | run.push(steps, args.seed, args.free)


DRIVES = {"scripted": _follow, "pushing": _push}  # along the path, by the name of the operator


def _drive(run: HeadlessRun, args: argparse.Namespace) -> dict[str, Any]:
    settings = run.rehearsal.settings
    result: dict[str, Any]
    if args.task == "inspect":
        scene = run.rehearsal.scene
        steps = SWINGING_STEPS if args.steps is None else args.steps
        targets = [run.inspect(i, steps) for i in range(len(scene.targets))]
        missed = [f"{t['target']}: {t['reason']}" for t in targets if not t["reached"]]
        result = {"completed": not missed, "reason": "; ".join(missed), "targets": targets}
    else:
        result = DRIVES[args.operator](run, args)
    path = run.rehearsal.scene.path
    length = math.nan if path is None else path.length
    zones = [
        {"name": zone.name, "margin_mm": zone.margin_mm, "min_distance_mm": least}
        for zone, least in zip(run.rehearsal.controller.zones, run.least_of_zones, strict=True)
    ]
    figures = run.tally.report() | {"margin_mm": settings.margin_mm, "path_length_mm": length}
    rooms = zip(run.limits, run.least_rooms, strict=True)
    limits = [{"name": limit.words, "least_room_mm": least} for limit, least in rooms]
    if run.servo is not None:
        figures |= {"progress_fallbacks": run.fallbacks, "servo": run.servo.report()}
    return result | figures | ({"zones": zones} if zones else {}) | ({"tip_limits": limits} if limits else {})


def _stopped(last: RigidSnapshot) -> dict[str, Any]:
    """Where the tool stopped and what blocks it, LPS mm; printed on stderr with advice."""
    at = [round(float(x), 1) for x in last.tip]
    blocked = None if last.blocking_point is None else [round(float(x), 1) for x in last.blocking_point]
    remedy = "Lead the path another way there, or place the robot anew with another --robot or --tool."
    if blocked is not None:
        remedy = f"It is in the way at {_place(blocked)}: lead the path farther from it, or take a thinner --tool."
    say_notes(
        [
            f"the tool stopped after {last.progress_mm:.1f} of {last.length_mm:.1f} mm with its tip at {_place(at)}: "
            f"{last.reason or 'it no longer moves along the path'}. {remedy}"
        ]
    )
    return {"stopped_at_lps_mm": at, "blocked_at_lps_mm": blocked}


def _place(point: list[float]) -> str:
    return f"({', '.join(f'{x:.1f}' for x in point)}) mm, LPS"


def _print_for_people(report: dict[str, Any]) -> None:
    for name, value in report.items():
        print(f"{name:>18}  {json.dumps(value) if isinstance(value, (dict, list)) else value}", file=sys.stdout)
