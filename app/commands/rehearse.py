"""`vfix rehearse`: a rehearsal without the page; prints the measurements."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from app.commands.found_runs import find_run, optional_services
from app.commands.head_options import say_notes, told_of_file
from app.commands.recorded_run import RecordedRun
from app.commands.rehearse_arguments import add_arguments, check_arguments
from app.commands.rehearse_errors import Truths
from app.commands.rehearse_freehand import drive_freehand, driven_preset
from app.commands.rehearse_person import led_by_person
from app.commands.rehearse_scene import build_scene, robots_of
from app.exchange.resolve import (
    ResolvedCase,
    resolve_case,
    resolve_plan,
)
from app.planning.distance_fields import plan_ways
from app.planning.piercing import PiercedReport, pierced_by_poses
from app.plans.imported_places import path_notes
from app.plans.model import Plan
from app.services import Services
from vfix_engine.anatomy.head_import import HeadRequest
from vfix_engine.anatomy.piercing import Ways
from vfix_engine.anatomy.soft_tissue import tissue_passed
from vfix_engine.control import ControlSettings
from vfix_engine.errors import VfixError
from vfix_engine.frames import ImageRegistration
from vfix_engine.runtime.control_mode import FREEHAND, Control
from vfix_engine.runtime.run import Run
from vfix_engine.runtime.system import Column, SystemSpec
from vfix_engine.study.metrics import score_run
from vfix_engine.worlds.freehand.spec import FreehandSpec, of_free_hand
from vfix_engine.worlds.freehand.system import FreehandSystem
from vfix_engine.worlds.rigid.covariance_watch import CovarianceWatch
from vfix_engine.worlds.rigid.dry_run import STATION_MM
from vfix_engine.worlds.rigid.headless import HeadlessRun
from vfix_engine.worlds.rigid.operators import RecordedOperator
from vfix_engine.worlds.rigid.presets import PRESETS
from vfix_engine.worlds.rigid.rehearsal import Rehearsal
from vfix_engine.worlds.rigid.scene import Scene
from vfix_engine.worlds.rigid.servo import ServoWatch
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot
from vfix_engine.worlds.rigid.spec import RigidSpec, SceneSpec

NOTICE = "Not for clinical use."
PUSHING_STEPS = 2000
SWINGING_STEPS = 4000


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = subparsers.add_parser("rehearse", help="run a rehearsal without a page", description=__doc__)
    add_arguments(parser)
    return parser


def run(args: argparse.Namespace) -> int:
    """Exit status 0 when the task was completed, 1 otherwise."""
    check_arguments(args)
    services = optional_services()
    hand = None if args.hand is None else find_run(services, args.hand).run
    case = resolve_case(services, args.case, HeadRequest(Path(args.case), **told_of_file(args)))
    resolved = resolve_plan(services, case, args.plan)
    plan = resolved.plan
    if args.path is not None:
        plan = replace(plan, content=plan.content.along(args.path))
    plan, registration, lost = registered_plan(services, plan)
    told = (plan.told,) if plan.told else ()
    notes = (*case.notes, *told, *path_notes(plan.content.points, case.mesh.bounds), *lost)
    say_notes(notes)
    robots = robots_of(services, resolved.urdf)
    scene, settings, obstacle, held_by, dropped = build_scene(case, plan, args, robots, registration)
    say_notes(dropped)
    report = {"case": case.name, "plan": plan.name, "operator": args.operator, "task": args.task}
    control, preset = _control(args), driven_preset(args)
    report |= control.labels() | {"preset": preset, "robot": scene.robot.name, "tool": scene.tool.name}
    if preset is not None:
        report |= PRESETS[preset].report()
    if scene.robot.notes:
        report["robot_notes"] = list(scene.robot.notes)
    if held_by:
        report["standing"] = held_by
    truths = Truths(args, services, plan, scene, settings.kept_mm - settings.deflection_mm)
    poses, ways = Poses(truths.add), plan_ways(case.scans, plan)
    world = _world(scene, settings, args, poses, None if hand is None else RecordedOperator(hand))
    recorded = _recorded(services, world.spec, world.row_layout, args)
    try:
        report |= world.drive(recorded)
        notes = (*notes, *dropped, *report.pop("notes", ()))
    except BaseException:
        if recorded is not None:
            recorded.drop()
        raise
    if recorded is not None:
        kept = recorded.keep(case.id, plan.id if plan.revision else None, ways, args.record)  # a file's plan has no id
        report |= {} if services is None else {"run": kept}
        if hand is not None:
            report |= {"hand": args.hand, "scores": _scores(services, hand, kept)}
    if obstacle:
        report["placing_reason"] = obstacle
    if not report["completed"]:
        report["reason"] = report["reason"] or obstacle or "the tool no longer moves along the path"
    if notes:
        report["notes"] = list(notes)
    report |= truths.report() | _passed(case, ways, poses)
    unknown = "" if case.uncertainty.voxel_mm else f"{case.uncertainty.words()}; the margin has to cover that"
    report["warnings"] = [words] if (words := case.uncertainty.warning(settings.margin_mm) or unknown) else []
    say_notes([f"{words}." for words in report["warnings"]])
    report["notice"] = NOTICE
    if args.json:
        print(json.dumps(report, allow_nan=False))
    else:
        _print_for_people(report)
    return 0 if report["completed"] else 1


def _passed(case: ResolvedCase, ways: Ways | None, poses: Poses) -> dict[str, Any]:
    """The soft tissue that the tool has pressed, and what it has pierced."""
    pierced = PiercedReport.of(pierced_by_poses(ways, poses.kept))
    return {"soft_tissue": asdict(tissue_passed(case.scan(), poses.kept)), "pierced": asdict(pierced)}


def _scores(services: Services | None, hand: Run, kept: str | None) -> dict[str, Any]:
    """Scores of the recorded hand and of the drive that it led, None where that was not stored."""
    own = None if kept is None else score_run(find_run(services, kept).run).to_dict()
    return {"hand": score_run(hand).to_dict(), "run": own}


class _World(NamedTuple):
    """The world that is driven, and its drive from a recorder, None for none, to what it came to."""

    spec: SystemSpec
    row_layout: tuple[Column, ...]
    drive: Callable[[RecordedRun | None], dict[str, Any]]


def _world(
    scene: Scene, settings: ControlSettings, args: argparse.Namespace, poses: Poses, hand: RecordedOperator | None
) -> _World:
    """A free hand, or a hand on the robot. hand: the recorded one of --operator recorded."""
    kept = SceneSpec.of(scene)
    if args.mode == FREEHAND:
        rated = of_free_hand(settings)
        free = FreehandSystem(scene, rated)
        drive = partial(drive_freehand, free, args, poses.add)
        return _World(FreehandSpec(kept, rated), free.row_layout, drive)
    rehearsal = Rehearsal(scene, settings)
    return _World(
        RigidSpec(kept, settings),
        rehearsal.system.row_layout,
        lambda recorded: _drive(_headless(rehearsal, poses.add, recorded, args), args, hand),
    )


class Poses:
    """Poses of the tool in a drive, at least 0.5 mm apart, for `tissue_passed`; ``also`` gets every snapshot."""

    def __init__(self, also: Callable[[RigidSnapshot], None]) -> None:
        self.kept: list[tuple[float, np.ndarray, np.ndarray]] = []
        self._also = also

    def add(self, snapshot: RigidSnapshot) -> None:
        self._also(snapshot)
        ends = snapshot.segments_start, snapshot.segments_end
        if self.kept:
            moved = max(float(np.abs(new - old).max()) for new, old in zip(ends, self.kept[-1][1:], strict=True))
            if moved < STATION_MM:
                return
        self.kept.append((snapshot.progress_mm, *ends))


def registered_plan(services: Services | None, plan: Plan) -> tuple[Plan, ImageRegistration | None, tuple[str, ...]]:
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


def _recorded(
    services: Services | None, spec: SystemSpec, columns: tuple[Column, ...], args: argparse.Namespace
) -> RecordedRun | None:
    """The recorder of the run; None without a writable store, unless --record asks for a run that is not stored."""
    seed = args.seed if args.operator != "scripted" or args.mode == FREEHAND else None
    labels = (seed, _control(args), driven_preset(args))
    if services is not None:
        try:
            return RecordedRun(services, spec, columns, *labels)
        except (OSError, VfixError) as error:
            say_notes([f"the run is not recorded: {error}"])
    return None if args.record is None else RecordedRun(None, spec, columns, *labels)


def _headless(
    rehearsal: Rehearsal, keep: Callable[[RigidSnapshot], None], recorded: RecordedRun | None, args: argparse.Namespace
) -> HeadlessRun:
    """The drive of a robot; with a preset the poses between its set points and the papers' tree are measured too."""
    servo, trees = (None, None) if args.preset is None else (ServoWatch(), CovarianceWatch(rehearsal.controller))
    return HeadlessRun(rehearsal, keep, recorded, args.approach, servo, _control(args), trees)


def _control(args: argparse.Namespace) -> Control:
    """Mode and device that are asked for."""
    return Control(args.mode, args.device or "position")


def _follow(run: HeadlessRun, args: argparse.Namespace) -> dict[str, Any]:
    return _followed(run, run.follow())


def _lead(run: HeadlessRun, args: argparse.Namespace) -> dict[str, Any]:
    return _followed(run, run.follow(led_by_person(run.rehearsal, args.seed)))


def _followed(run: HeadlessRun, last: RigidSnapshot) -> dict[str, Any]:
    done, path = last.phase == "done", run.rehearsal.scene.path
    reached = last.progress_mm  # during the approach that is the place that is approached, not where the tip is
    if last.phase == "approach" and path is not None:
        reached = float(path.closest(last.tip)[0])
    result = {"completed": done, "reason": "" if done else last.reason, "reached_mm": reached}
    return result if done else result | _stopped(last)


def _push(run: HeadlessRun, args: argparse.Namespace) -> dict[str, Any]:
    steps = PUSHING_STEPS if args.steps is None else args.steps
    return {"completed": True} | run.push(steps, args.seed, args.free)


def _repeat(run: HeadlessRun, hand: RecordedOperator) -> dict[str, Any]:
    """A recorded hand, which does not see that plan, tool or settings are others."""
    last = run.repeat(hand)
    done = last.phase == "done"
    reason = "" if done else last.reason or "the recorded hand ended"
    return {"completed": done, "reason": reason, "reached_mm": last.progress_mm}


DRIVES = {"scripted": _follow, "person": _lead, "pushing": _push}  # along the path, by the name of the operator


def _drive(run: HeadlessRun, args: argparse.Namespace, hand: RecordedOperator | None) -> dict[str, Any]:
    settings = run.rehearsal.settings
    result: dict[str, Any]
    if args.task == "inspect":
        scene = run.rehearsal.scene
        steps = SWINGING_STEPS if args.steps is None else args.steps
        targets = [run.inspect(i, steps) for i in range(len(scene.targets))]
        missed = [f"{t['target']}: {t['reason']}" for t in targets if not t["reached"]]
        result = {"completed": not missed, "reason": "; ".join(missed), "targets": targets}
    else:
        result = DRIVES[args.operator](run, args) if hand is None else _repeat(run, hand)
    path = run.rehearsal.scene.path
    length = math.nan if path is None else path.length
    zones = [
        {"name": zone.name, "margin_mm": zone.margin_mm, "min_distance_mm": least}
        for zone, least in zip(run.rehearsal.controller.zones, run.least_of_zones, strict=True)
    ]
    figures = {"time_s": run.tally.steps * settings.dt_s, "certified": True} | run.tally.report()
    figures |= {"margin_mm": settings.margin_mm, "path_length_mm": length}
    rooms = zip(run.limits, run.least_rooms, strict=True)
    limits = [{"name": limit.words, "least_room_mm": least} for limit, least in rooms]
    if run.covariance is not None:
        figures |= {"covariance_tree": run.covariance.report()}
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
    after = f"after {last.progress_mm:.1f} of {last.length_mm:.1f} mm"
    if last.phase == "approach":
        after = f"on its straight approach to the path's place at {last.progress_mm:.1f} mm"
        remedy = "Approach another place of the path by --approach, or follow it from its begin."
    say_notes(
        [
            f"the tool stopped {after} with its tip at {_place(at)}: "
            f"{last.reason or 'it no longer moves along the path'}. {remedy}"
        ]
    )
    return {"stopped_at_lps_mm": at, "blocked_at_lps_mm": blocked}


def _place(point: list[float]) -> str:
    return f"({', '.join(f'{x:.1f}' for x in point)}) mm, LPS"


def _print_for_people(report: dict[str, Any]) -> None:
    for name, value in report.items():
        print(f"{name:>18}  {json.dumps(value) if isinstance(value, (dict, list)) else value}", file=sys.stdout)
