"""`vfix report`: a report on recorded runs to print, one page of HTML: scores, curves and holds, side by side."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from app.commands.found_runs import find_run, optional_services
from app.exchange.plan_files import write_export
from app.exchange.run_report.report import report_html
from app.exchange.run_report.reported import RunToReport
from app.services import Services
from vfix_engine.errors import InputError

NOTICE = "Not for clinical use."


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = subparsers.add_parser("report", help="write a report on recorded runs", description=__doc__)
    parser.add_argument("runs", metavar="RUN", nargs="+", help="id of a stored run, or folder of a recorded one")
    parser.add_argument("-o", "--output", metavar="FILE", type=Path, required=True, help="ends in .html")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    return parser


def run(args: argparse.Namespace) -> int:
    """Write the report. Raises VfixError, which becomes exit status 2."""
    if args.output.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"a report is HTML; name a file that ends in .html, not {args.output.name!r:.80}.")
    services = optional_services()
    write_export(args.output, report_html([_to_report(services, name) for name in args.runs]))
    answer = {"runs": args.runs, "file": str(args.output), "notice": NOTICE}
    print(json.dumps(answer) if args.json else f"{args.output} written. {NOTICE}")
    return 0


def _to_report(services: Services | None, name: str) -> RunToReport:
    """A run with the names of what was driven."""
    found = find_run(services, name)
    stored = found.stored
    if stored is None or services is None:
        return RunToReport(found.run, Path(name).name)
    from app.exchange.run_report.stored import stored_to_report  # with the store

    return stored_to_report(found.run, stored, services.cases, services.plans, services.lumen_routes)
