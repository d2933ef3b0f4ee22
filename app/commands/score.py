"""`vfix score`: what recorded runs are worth, from the runs alone."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from typing import Any

from app.commands.counts import natural
from app.commands.found_runs import FoundRun, find_run, optional_services
from app.commands.rehearse_errors import NONE, add_error_arguments, chain_of, registered_content
from app.commands.score_words import facts_of
from app.services import Services
from vfix_engine.errors import InputError
from vfix_engine.study.lumen import score_lumen_run
from vfix_engine.study.metrics import score_run
from vfix_engine.worlds.registry import spec_of
from vfix_engine.worlds.snake import SnakeSystemSpec

NOTICE = "Not for clinical use."


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = subparsers.add_parser("score", help="score recorded runs", description=__doc__)
    parser.add_argument("runs", metavar="RUN", nargs="+", help="id of a stored run, or folder of a recorded one")
    add_error_arguments(parser)
    parser.add_argument("--seed", type=natural, default=0, help="of --errors papers")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    return parser


def run(args: argparse.Namespace) -> int:
    """Score every run. Raises VfixError for one that is not there or cannot be scored; then nothing is printed."""
    services = optional_services()
    scores = [_scored(services, find_run(services, name), args) for name in args.runs]
    if args.json:
        print(json.dumps({"runs": scores, "notice": NOTICE}, allow_nan=False))
    else:
        for score in scores:
            _print_for_people(score)
        print(NOTICE)
    return 0


def _scored(services: Services | None, found: FoundRun, args: argparse.Namespace) -> dict[str, Any]:
    """The score of a run, with the error chain, and ``true_error_mm`` of the path by its name there, too.

    One in a lumen has no error chain. Raises InputError where one is asked for.
    """
    spec, case, plan = spec_of(found.run), found.origin["case"], found.origin["plan"]
    if isinstance(spec, SnakeSystemSpec):
        if args.errors != NONE:
            raise InputError(f"{found.name} is a run in a lumen, whose robot has no error chain; leave out --errors")
        wall = None if services is None else services.lumen_routes.tasks.known_wall(case)
        return found.origin | score_lumen_run(found.run, spec, wall).to_dict()
    path = getattr(getattr(spec, "scene", None), "path_points", None)
    chain = chain_of(args.errors, args.seed, path, registered_content(services, plan), case or "")
    score = score_run(found.run, spec, errors=None if chain.empty else chain)
    told: dict[str, Any] = {"error_chain": chain.to_dict(), "true_error_mm": None}
    if score.path_error_mm is not None:
        told["true_error_mm"] = asdict(score.path_error_mm.true_frame)
    return found.origin | score.to_dict() | told


def _print_for_people(score: dict[str, Any]) -> None:
    driven = score["mode"] if "mode" in score else score["arm"]
    about = [("Run", score["run"]), ("Recorded", score["recorded"]), ("Case", score["case"]), ("Plan", score["plan"])]
    facts = [(name, value) for name, value in about if value is not None]
    for name, value in [*facts, ("Driven", driven or "–"), *facts_of(score)]:
        print(f"{name:>28}  {value}")
    if not score["certified"]:
        print(f"{'':>28}  Driven without the certificate.")
    if not score["whole"]:
        print(f"{'':>28}  Interrupted: what came after the recording is in no figure.")
    if score["lost"]:
        print(f"{'':>28}  {score['lost']} steps were not recorded, and are in no figure.")
    print()
