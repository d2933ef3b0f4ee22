"""`vfix rehearse --mode freehand`: the plan in a free hand, without a robot and without the certificate."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np

from app.commands.head_options import say_notes
from vfix_engine.errors import ControlError, InputError
from vfix_engine.runtime.control_mode import FREEHAND, TELEOPERATED
from vfix_engine.runtime.driver import Log
from vfix_engine.runtime.snapshot import Snapshot
from vfix_engine.study.drive import LONGEST_S, drive
from vfix_engine.study.operator import Guide, PursuitOperator
from vfix_engine.study.person import Person
from vfix_engine.virtual_fixtures.zone_file import ZoneSet
from vfix_engine.worlds.freehand.snapshot import FreehandSnapshot
from vfix_engine.worlds.freehand.system import FreehandSystem
from vfix_engine.worlds.rigid.dry_run import dry_run

UNCERTIFIED = "Freehand: driven without the certificate; bone does not stop the tool."
NO_PRESET = "a preset's parameters are those of the robot: a free hand has none of them"


def driven_preset(args: argparse.Namespace) -> str | None:
    """The preset that is driven with: of a free hand none, whatever is asked for."""
    return None if args.mode == FREEHAND else args.preset


def check_options(args: argparse.Namespace) -> None:
    """Refuse what a free hand does not have. Raises InputError."""
    if args.device is not None and args.mode != TELEOPERATED:
        raise InputError("--device goes with --mode teleoperated")
    if args.mode != FREEHAND:
        if args.steady:
            raise InputError("--steady goes with --mode freehand")
        return
    robots = {
        f"--operator {args.operator}": args.operator != "scripted",
        "--task inspect": args.task != "path",
        "--soft-tissue": args.soft_tissue,
        "--remote-centre": args.remote_centre is not None,
        "--speed-limit": args.speed_limit,
        "--approach": args.approach is not None,
        "--tube": args.tube is not None,
        "--depth-stop": args.depth_stop is not None,
        "--margin": args.margin is not None,
    }
    wrong = [name for name, given in robots.items() if given]
    if wrong:
        raise InputError(f"--mode freehand does not go with {wrong[0]}, which is of a robot")


def check_zones(args: argparse.Namespace, zones: ZoneSet) -> None:
    """Refuse what a free hand does not feel of a file's zones. Raises InputError."""
    if args.mode == FREEHAND and (zones.soft_zones or zones.envelopes):
        raise InputError("--mode freehand goes with no-fly zones of --zones only: soft zones and envelopes do nothing")


def drive_freehand(
    system: FreehandSystem, args: argparse.Namespace, keep: Callable[[Any], None], log: Log | None
) -> dict[str, Any]:
    """Follow the plan's path by a simulated person, and say what it came to; ``notes``: of what the plan shows.

    Raises:
        StartRefused: the robot or the tool cannot start there.
        ControlError: the plan has no path.
    """
    scene, settings = system.scene, system.first_settings
    if scene.path is None:
        raise ControlError("path following needs a path of at least two points")
    dry = dry_run(scene, settings)
    guide = Guide.of(scene.path, dry)
    up_to = f"the plan shows the tool up to {dry.s.max():.1f} mm of the path: {dry.reason}"
    notes = [] if dry.completed else [up_to]
    if scene.fixtures:
        notes.append("soft zones of the plan do nothing to a free hand")
    if args.preset is not None:
        notes.append(NO_PRESET)
    person = PursuitOperator(guide, Person.exact() if args.steady else Person(), scene.tool, settings, args.seed)
    say_notes([UNCERTIFIED, *notes])
    errors, least, held, approach = [], np.inf, 0, 0

    def look(snapshot: Snapshot) -> None:
        nonlocal least, held, approach
        assert isinstance(snapshot, FreehandSnapshot)
        least, held = min(least, snapshot.clearance_mm), held + snapshot.held
        if snapshot.phase == "approach":
            approach += 1
        else:
            errors.append(snapshot.tip_error_mm)
        keep(snapshot)

    done = drive(system, person, look, log)
    last = done.last
    assert isinstance(last, FreehandSnapshot)
    contacts = [{name: value for name, value in asdict(one).items() if name != "depth_mm"} for one in last.contacts]
    return {
        "certified": last.certified,
        "completed": done.finished,
        "reason": "" if done.finished else f"the hand did not reach the end within {LONGEST_S:.0f} s",
        "reached_mm": last.progress_mm,
        "time_s": last.t,
        "contacts": sum(one.count for one in last.contacts),
        "max_depth_mm": max((one.max_depth_mm for one in last.contacts), default=0.0),
        "contacts_by": contacts,
        "contact_stiffness_n_per_mm": system.around.stiffness_n_per_mm,
        "steps": last.steps,
        "held_steps": held,
        "approach_steps": approach,
        "tip_error_mm": {"mean": float(np.mean(errors)), "max": float(np.max(errors))} if errors else None,
        "min_clearance_mm": least,
        "min_bone_clearance_mm": least,
        "step_time_us": {"median": float(np.median(done.step_us)), "p99": float(np.percentile(done.step_us, 99))},
        "qp_rows": {"min": 0, "max": 0},
        "margin_mm": settings.margin_mm,
        "path_length_mm": scene.path.length,
        "notes": notes,
    }
