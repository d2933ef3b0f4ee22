"""`vfix plan evaluate`: the verdict on a plan's paths, and the directions from which its targets can be inspected."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from app.exchange.plan_files import read_plan
from app.exchange.resolve import find, is_file, read_bytes, resolve_case, resolve_plan
from app.planning.path_evaluations import PathEvaluation, PlanReport
from app.plans.service import Plan
from app.services import Services
from vfix_engine.errors import InputError


def add_parser(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = actions.add_parser("evaluate", help="whether the tool fits along a plan's paths, and what it presses")
    parser.add_argument("plan", metavar="PLAN", help="id or name of a plan, or a file of one")
    parser.add_argument("--path", metavar="NAME", help="id or name of the path to evaluate; else all")
    parser.add_argument("--case", help="id or name of the case of a file; else the one it was made for")
    return parser


def run(services: Services, args: argparse.Namespace) -> None:
    """Print the report. Raises VfixError, which becomes exit status 2."""
    report = services.path_evaluations.of_plan(_plan(services, args), args.path)
    print(json.dumps(as_json(report)) if args.json else "\n".join(_lines(report)))


def as_json(report: PlanReport) -> dict[str, Any]:
    """The JSON of a report: the chosen path's values, and `paths`."""
    return {
        "plan": report.plan,
        "name": report.name,
        "case": report.case,
        **{key: value for key, value in asdict(report.chosen).items() if key not in ("path", "name")},
        "path": report.chosen.path,
        "paths": [asdict(path) for path in report.paths],
        "removed_mm3": report.removed.removed_mm3,
        "removed_bone": [asdict(region) for region in report.removed.regions],
        "notice": report.notice,
    }


def _plan(services: Services, args: argparse.Namespace) -> Plan:
    file = Path(args.plan)
    titles = services.plans.titles()
    if not is_file(file) or any(args.plan == title.id for title in titles):
        return services.plans.get(find(titles, args.plan, "plan").id)
    return resolve_plan(services, resolve_case(services, args.case or _case_of(services, file)), args.plan).plan


def _case_of(services: Services, file: Path) -> str:
    """The id of the stored case that a file of a plan was made for. Raises InputError where none is."""
    made_for = read_plan(file.name, read_bytes(file), points_as="path").case_hash
    found = [case.id for case in services.cases.list() if case.content_hash == made_for]
    if not found:
        raise InputError(f"{file.name} does not say which stored case it belongs to; name one with --case.")
    return found[0]


def _lines(report: PlanReport) -> list[str]:
    lines = []
    for path in report.paths:
        mark = "*" if path.path == report.chosen.path else " "
        lines += [f"{mark} {path.name}: {path.words}", *_target_lines(path)]
    lines += [f"Bone to be removed, {region.name}: {region.words}" for region in report.removed.regions]
    return [*lines, *filter(None, [report.removed.words, report.notice])]


def _target_lines(path: PathEvaluation) -> list[str]:
    return [
        f"    {target.label}: inspected within a cone of {target.cone_deg:.0f}°"
        if target.cone_deg
        else f"    {target.label}: no direction in which the tool fits"
        for target in path.targets
    ]
