"""`vfix score`: what recorded runs are worth, from the runs alone."""

from __future__ import annotations

import argparse
import json
from typing import Any

from app.commands.found_runs import find_run, optional_services
from vfix_engine.study.metrics import score_run

NOTICE = "Not for clinical use."


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = subparsers.add_parser("score", help="score recorded runs", description=__doc__)
    parser.add_argument("runs", metavar="RUN", nargs="+", help="id of a stored run, or folder of a recorded one")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    return parser


def run(args: argparse.Namespace) -> int:
    """Score every run. Raises VfixError for one that is not there or cannot be scored; then nothing is printed."""
    services = optional_services()
    found = (find_run(services, name) for name in args.runs)
    scores = [one.origin | score_run(one.run).to_dict() for one in found]
    if args.json:
        print(json.dumps({"runs": scores, "notice": NOTICE}, allow_nan=False))
    else:
        for score in scores:
            _print_for_people(score)
        print(NOTICE)
    return 0


def _print_for_people(score: dict[str, Any]) -> None:
    for name, value in score.items():
        print(f"{name:>22}  {json.dumps(value) if isinstance(value, (dict, list, tuple)) else value}")
    if not score["certified"]:
        print(f"{'':>22}  Driven without the certificate.")
    print()
