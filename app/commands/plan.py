"""`vfix plan`: list, show, export, import, evaluate, report, rename, delete and restore plans, and their versions."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any, get_args

from app.commands import plan_evaluate, plan_report, plan_suggest, plan_versions
from app.commands.head_options import say_notes
from app.commands.scene_python import plan_python
from app.exchange.patient_images import check_images
from app.exchange.plan_files import (
    FORMATS,
    PlanFormat,
    PointsAs,
    export_text,
    format_of,
    read_plan,
    to_native_json,
    write_export,
)
from app.exchange.resolve import find, read_bytes
from app.operations import verbs
from app.plans.imported_places import content_notes
from app.plans.model import FRAME, NOTICE, UNIT
from app.plans.service import Plan
from app.services import Services, build_services
from app.settings import Settings
from vfix_engine.errors import PlanError


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = subparsers.add_parser(
        "plan", help="list, import and export plans", description=f"{__doc__} Not for clinical use."
    )
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    listing = actions.add_parser("list", help="every plan")
    listing.add_argument("--case", help="id or name of a case; else of all")
    listing.add_argument("--deleted", action="store_true", help="those that can be restored as well")
    named = {
        "show": "everything of one plan",
        "export": "write a plan to a file",
        "python": "print Python that sets up its scene in the library",
    }
    every = {"list": listing}
    for action, words in named.items():
        every[action] = actions.add_parser(action, help=words)
        every[action].add_argument("plan", metavar="PLAN", help="id or name")
    every["export"].add_argument("file", metavar="FILE", type=Path, help=f"ends in {', '.join(FORMATS)}")
    every["export"].add_argument("--format", choices=FORMATS, help="instead of the one the file's ending tells")
    every["export"].add_argument(
        "--frame", choices=("image", "base"), default="image", help="base: of the placed robot, as json or csv"
    )
    every["export"].add_argument(
        "--registration", metavar="NAME", help="of the image, with --frame base; else the plan's"
    )
    every["export-slicer"] = actions.add_parser("export-slicer", help="write plan and head as a folder for 3D Slicer")
    every["export-slicer"].add_argument("plan", metavar="PLAN", help="id or name")
    every["export-slicer"].add_argument(
        "--with-images", action="store_true", help="confirm that the patient's images are written"
    )
    every["export-slicer"].add_argument("folder", metavar="FOLDER", type=Path, help="one that is not there yet")
    every["import"] = actions.add_parser("import", help="make a plan of a file")
    _add_import_options(every["import"])
    every["evaluate"] = plan_evaluate.add_parser(actions)
    every["report"] = plan_report.add_parser(actions)
    every |= plan_versions.add_actions(actions)
    every |= verbs.add_actions("plan", actions)
    every |= plan_suggest.add_actions(actions)
    for each in every.values():
        each.add_argument("--json", action="store_true", help="one JSON object on stdout")
    return parser


def _add_import_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", type=Path, help="a .json, .mrk.json, .csv or .fcsv file")
    parser.add_argument("--case", required=True, help="id or name of the case it belongs to")
    parser.add_argument("--name", help="of the plan; else the file's")
    parser.add_argument("--frame", choices=("LPS", "RAS"), help="frame of a file that does not name one")
    parser.add_argument("--points-as", choices=get_args(PointsAs), help="what a list of points without a curve is")
    parser.add_argument("--other-case", action="store_true", help="take a plan that was made for another case")


def run(args: argparse.Namespace) -> int:
    """Execute the action and print the result. Raises VfixError, which becomes exit status 2."""
    services = build_services(Settings.from_environment())
    if args.action in plan_suggest.ACTIONS:
        return plan_suggest.run(services, args)
    if args.action == "list":
        case_id = find(services.cases.list(), args.case, "case").id if args.case else None
        found = services.plans.list(case_id, include_deleted=args.deleted)
        _say(args, {"plans": [summary(plan) for plan in found]}, [_line(plan) for plan in found])
    elif args.action == "import":
        plan = _import(services, args)
        used = services.registering.registration_of(plan)
        wanting = [] if used.state in ("none", "ready") else [used.words]
        _say(args, {**summary(plan), "notes": wanting}, [_line(plan), *wanting])
    elif args.action == "evaluate":
        plan_evaluate.run(services, args)
    elif args.action == "report":
        plan_report.run(services, args)
    elif args.action in plan_versions.ACTIONS:
        plan_versions.run(services, args)
    elif (called := verbs.called_action("plan", args)) is not None:
        plan = called.perform(services, "", lambda text: _named(services, text))
        _say(args, summary(plan), [_line(plan)])
    else:
        _run_named(services, args)
    return 0


def _named(services: Services, text: str) -> str:
    return find(services.plans.titles(include_deleted=True), text, "plan").id


def _run_named(services: Services, args: argparse.Namespace) -> None:
    """The actions on one plan."""
    plan_id = _named(services, args.plan)
    if args.action == "show":
        plan = services.plans.get(plan_id)
        print(json.dumps(json.loads(to_native_json(plan))) if args.json else to_native_json(plan), end="\n")
        return
    if args.action == "python":
        plan = services.plans.get(plan_id)
        text = plan_python(services, plan)
        print(json.dumps({**summary(plan), "python": text}) if args.json else text, end="")
        return
    if args.action == "export":
        plan, form = services.plans.get(plan_id), args.format or format_of(args.file.name)
        write_export(args.file, _exported(services, plan, form, args))
        answer = {**summary(plan), "file": str(args.file), "format": form}
        if args.frame == "base":
            answer["frame"] = "base"
        notes = []
        if form == "json" and args.frame != "base" and plan.content.registration is not None:
            notes = ["It names the plan’s registration and does not hold it; `vfix case export` takes both along."]
        _say(args, {**answer, "notes": notes}, [f"{args.file} written. Not for clinical use.", *notes])
        return
    plan = services.plans.get(plan_id)
    check_images(services.cases.get(plan.case_id), args.with_images, "--with-images")
    names = services.slicer.write(plan, args.folder)
    answer = {**summary(plan), "folder": str(args.folder), "files": list(names)}
    _say(args, answer, [f"{args.folder / names[0]} written, with {len(names) - 1} files. Not for clinical use."])


def _exported(services: Services, plan: Plan, form: PlanFormat, args: argparse.Namespace) -> str:
    """The text of an export."""
    if args.frame == "base":
        return services.base_export.text(plan, form, args.registration)
    if args.registration is not None:
        raise PlanError("--registration goes with --frame base.")
    curve, remark = services.planning.curve(plan) if form == "mrk.json" else ((), "")
    return export_text(plan, form, curve, remark, services.instruments.carried(plan.content, form))


def _import(services: Services, args: argparse.Namespace) -> Plan:
    case = find(services.cases.list(), args.case, "case")
    file = read_plan(args.file.name, read_bytes(args.file), args.frame, args.points_as)
    say_notes([*file.notes, *content_notes(file.content, case.surfaces[0].bounds_lps_mm)])
    return services.plans.add_file(case.id, file, name=args.name, other_case=args.other_case)


def summary(plan: Plan) -> dict[str, Any]:
    """The JSON of a plan."""
    return {
        "plan": plan.id,
        "name": plan.name,
        "case": plan.case_id,
        "points": len(plan.content.points),
        "targets": len(plan.content.targets),
        "frame": FRAME,
        "unit": UNIT,
        "locked": plan.locked,
        "revision": plan.revision,
        "modified": plan.modified,
        "deleted_at": plan.deleted_at,
        "notice": NOTICE,
    } | ({"unreadable": plan.unreadable} if plan.unreadable else {})


def _line(plan: Plan) -> str:
    remarks = ("  (deleted)" if plan.deleted_at else "") + (f"  ({plan.unreadable})" if plan.unreadable else "")
    return f"{plan.id:24}  {plan.name}{remarks}"


def _say(args: argparse.Namespace, data: dict[str, Any], lines: list[str]) -> None:
    print(json.dumps(data) if args.json else "\n".join(lines))
