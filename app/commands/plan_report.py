"""`vfix plan report`: the printable report on a plan, one page of HTML."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from app.exchange.patient_images import holds_images
from app.exchange.plan_files import write_export
from app.exchange.resolve import find
from app.plans.model import NOTICE
from app.services import Services
from vfix_engine.errors import InputError


def add_parser(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = actions.add_parser("report", help="write a report to print: verdict, figures and pictures on one page")
    parser.add_argument("plan", metavar="PLAN", help="id or name")
    parser.add_argument("-o", "--output", metavar="FILE", type=Path, required=True, help="ends in .html")
    parser.add_argument(
        "--with-images", action="store_true", help="show the scan in the pictures, which can identify the patient"
    )
    return parser


def run(services: Services, args: argparse.Namespace) -> None:
    """Write the report. Raises VfixError, which becomes exit status 2."""
    if args.output.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"a report is HTML; name a file that ends in .html, not {args.output.name!r:.80}.")
    plan = services.plans.get(find(services.plans.titles(), args.plan, "plan").id)
    images = args.with_images or not holds_images(services.cases.get(plan.case_id))
    write_export(args.output, services.plan_reports.html(plan, with_images=images))
    answer = {"plan": plan.id, "name": plan.name, "file": str(args.output), "images": images, "notice": NOTICE}
    print(json.dumps(answer) if args.json else f"{args.output} written. Not for clinical use.")
