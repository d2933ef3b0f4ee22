"""`vfix case`: list, show, rename, delete and restore cases."""

from __future__ import annotations

import argparse
import json
from typing import Any

from app.services import build_services
from app.services.cases import Case
from app.services.resolve import find
from app.settings import Settings


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = subparsers.add_parser(
        "case", help="list, rename, delete and restore cases", description=f"{__doc__} Not for clinical use."
    )
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    listing = actions.add_parser("list", help="every case")
    listing.add_argument("--deleted", action="store_true", help="those that can be restored as well")
    named = {
        "show": "one case",
        "rename": "give a case another name",
        "delete": "take a case off the lists",
        "restore": "bring a deleted case back",
    }
    every = [listing]
    for action, words in named.items():
        every.append(actions.add_parser(action, help=words))
        every[-1].add_argument("case", metavar="CASE", help="id or name")
        if action == "rename":
            every[-1].add_argument("name", metavar="NAME", help="the new name")
    for each in every:
        each.add_argument("--json", action="store_true", help="one JSON object on stdout")
    return parser


def run(args: argparse.Namespace) -> int:
    """Do it, and say what is there now. Raises VfixError, which becomes exit status 2."""
    cases = build_services(Settings.from_environment()).cases
    if args.action == "list":
        found = cases.list(include_deleted=args.deleted)
        _say(args, {"cases": [summary(case) for case in found]}, [_line(case) for case in found])
        return 0
    case = find(cases.list(include_deleted=True), args.case, "case")
    lines = surface_lines(case) if args.action == "show" else []
    if args.action == "rename":
        case = cases.rename(case.id, args.name)
    elif args.action == "delete":
        case = cases.delete(case.id)
    elif args.action == "restore":
        case = cases.restore(case.id)
    _say(args, summary(case), [_line(case), *lines])
    return 0


def summary(case: Case) -> dict[str, Any]:
    """What `--json` prints of a case."""
    return {
        "case": case.id,
        "name": case.name,
        "created": case.created,
        "deleted_at": case.deleted_at,
        "frame": {"name": case.frame.name, "assumed": case.frame.assumed},
        "spacing_mm": case.spacing_mm,
        "slice_thickness_mm": case.slice_thickness_mm,
        "surface_uncertainty_mm": case.surface_uncertainty_mm,
        "surfaces": [item.summary() for item in case.surfaces],
        "notes": list(case.notes),
    }


def surface_lines(case: Case) -> list[str]:
    """What making the surfaces cost, how far bone may lie off its surface, and what is doubtful about the file."""
    lines = [f"  {item.name}: {item.triangles:,} triangles; {item.words}" for item in case.surfaces if item.words]
    return [*lines, *(f"  {words}" for words in (case.uncertainty.words(), *case.notes) if words)]


def _line(case: Case) -> str:
    return f"{case.id:24}  {case.name}{'  (deleted)' if case.deleted_at else ''}"


def _say(args: argparse.Namespace, data: dict[str, Any], lines: list[str]) -> None:
    print(json.dumps(data) if args.json else "\n".join(lines))
