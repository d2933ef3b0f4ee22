"""`vfix case`: list, show, rename, delete and restore cases, and their structures."""

from __future__ import annotations

import argparse
import json
from typing import Any

from app.cases.kinds import kind_of
from app.cases.service import Case
from app.commands import case_archive, case_labels, case_openings, case_purge, case_segment, case_skin, case_structures
from app.exchange.resolve import find
from app.services import build_services
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
    every += [case_structures.add_parser(actions), case_purge.add_parser(actions), case_segment.add_parser(actions)]
    every += [case_openings.add_parser(actions)]
    every += [case_skin.add_parser(actions), case_labels.add_parser(actions), *case_archive.add_parsers(actions)]
    for each in every:
        each.add_argument("--json", action="store_true", help="one JSON object on stdout")
    return parser


def run(args: argparse.Namespace) -> int:
    """Execute the action and print the result. Raises VfixError, which becomes exit status 2."""
    services = build_services(Settings.from_environment())
    cases = services.cases
    if args.action == "list":
        found = cases.list(include_deleted=args.deleted)
        _say(args, {"cases": [summary(case) for case in found]}, [_line(case) for case in found])
        return 0
    if args.action == "import-archive":
        case = case_archive.read(args, services)
        _say(args, summary(case), [_line(case)])
        return 0
    if args.action == "purge":
        services.purge.finish()  # one that was killed has left no case to be found by, but files
    case = find(cases.list(include_deleted=True), args.case, "case")
    if args.action == "purge":
        return case_purge.run(args, services, case)
    if args.action == "export":
        return case_archive.write(args, services, case)
    if args.action == "structures":
        return case_structures.run(args, services, case)
    if args.action == "labels":
        return case_labels.run(args, services, case)
    if args.action == "segment":
        return case_segment.run(args, services, case)
    if args.action == "openings":
        return case_openings.run(args, services, case)
    if args.action == "skin":
        return case_skin.run(args, services, case)
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
    """The JSON of a case."""
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
    } | ({"unreadable": case.unreadable} if case.unreadable else {})


def surface_lines(case: Case) -> list[str]:
    """Deviation of the surfaces, uncertainty of the anatomy, and doubts about the file, as lines."""
    if case.unreadable:  # its line says so
        return []
    uncertain = case.uncertainty.words(kind_of(case).anatomy)
    lines = [f"  {item.name}: {item.triangles:,} triangles; {item.words}" for item in case.surfaces if item.words]
    return [*lines, *(f"  {words}" for words in (uncertain, *case.notes) if words)]


def _line(case: Case) -> str:
    remarks = ("  (deleted)" if case.deleted_at else "") + (f"  ({case.unreadable})" if case.unreadable else "")
    return f"{case.id:24}  {case.name}{remarks}"


def _say(args: argparse.Namespace, data: dict[str, Any], lines: list[str]) -> None:
    print(json.dumps(data) if args.json else "\n".join(lines))
