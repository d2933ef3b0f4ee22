"""`vfix score`: what recorded runs are worth, from the runs alone."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from app.extras import has_app, need_app
from app.services import Services, build_services
from app.settings import Settings
from vfix_engine.runtime.run import Run
from vfix_engine.study.metrics import score_run

NOTICE = "Not for clinical use."


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = subparsers.add_parser("score", help="score recorded runs", description=__doc__)
    parser.add_argument("runs", metavar="RUN", nargs="+", help="id of a stored run, or folder of a recorded one")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    return parser


def run(args: argparse.Namespace) -> int:
    """Score every run. Raises VfixError for one that is not there or cannot be scored; then nothing is printed."""
    services = build_services(Settings.from_environment()) if has_app() else None
    scores = [_scored(services, name) for name in args.runs]
    if args.json:
        print(json.dumps({"runs": scores, "notice": NOTICE}, allow_nan=False))
    else:
        for score in scores:
            _print_for_people(score)
        print(NOTICE)
    return 0


def _scored(services: Services | None, name: str) -> dict[str, Any]:
    """The score of a run, and what it is of where it is stored."""
    folder = Path(name)
    if folder.is_dir():
        return {"run": name, "case": None, "plan": None, "recorded": None} | score_run(Run.read(folder)).to_dict()
    if services is None:
        raise need_app("A stored run")
    stored = services.runs.get(name)
    with services.runs.laid_out(name) as place:
        score = score_run(Run.read(place)).to_dict()
    return {"run": name, "case": stored.case_id, "plan": stored.plan_id, "recorded": stored.recorded} | score


def _print_for_people(score: dict[str, Any]) -> None:
    for name, value in score.items():
        print(f"{name:>22}  {json.dumps(value) if isinstance(value, (dict, list, tuple)) else value}")
    if not score["certified"]:
        print(f"{'':>22}  Driven without the certificate.")
    print()
