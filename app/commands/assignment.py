"""`vfix assignment`: check the file of an assignment, and print the results of its runs."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from app.assignments.file import read_assignment
from app.assignments.results import results_csv, results_lines
from app.exchange.plan_files import write_export
from app.exchange.resolve import is_file, read_bytes
from app.services import build_services
from app.settings import Settings
from vfix_engine.errors import InputError

NOTICE = "Not for clinical use."


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = subparsers.add_parser("assignment", help="check assignments, and print their results", description=__doc__)
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    check = actions.add_parser("check", help="whether a file is an assignment of a plan that is here")
    results = actions.add_parser("results", help="each run of the assignment by each criterion")
    for each in (check, results):
        each.add_argument("file", metavar="FILE", type=Path, help="a .json file")
        each.add_argument("--json", action="store_true", help="one JSON object on stdout")
    results.add_argument("--csv", metavar="FILE", dest="table", type=Path, help="write the table to a file, too")
    return parser


def run(args: argparse.Namespace) -> int:
    """Execute the action and print the result. Raises VfixError, which becomes exit status 2."""
    if not is_file(args.file):
        raise InputError(f"{args.file.name!r:.80} is no file.")
    data = read_bytes(args.file)
    services = build_services(Settings.from_environment())
    if args.action == "check":
        file = read_assignment(data)
        plan_id, case_id = services.assignments.plan_of(file)
        asked = file.criteria.asked()
        told: dict[str, Any] = {
            "name": file.name,
            "case": case_id,
            "plan": plan_id,
            "mode": file.mode,
            "preset": file.preset,
        }
        told |= {"runs": file.runs, "criteria": asked, "notice": NOTICE}
        how = file.mode + (f", {file.preset}" if file.preset else "")
        words = ", ".join(f"{name} {json.dumps(limit)}" for name, limit in asked.items())
        print(
            json.dumps(told) if args.json else f"{file.name}: {file.runs} runs of {plan_id}, {how}; {words}. {NOTICE}"
        )
        return 0
    results = services.assignments.results_of_file(data)
    if args.table is not None:
        write_export(args.table, results_csv(results))
    if args.json:
        print(json.dumps(results.to_dict() | {"notice": NOTICE}))
        return 0
    lines = [f"{results.name}, {results.mode}{f', since {results.since}' if results.since else ''}"]
    done = "complete" if results.complete else "not complete"
    lines += [*results_lines(results), f"{results.passed} of {results.wanted} runs passed: {done}", NOTICE]
    print("\n".join(lines))
    return 0
