"""`vfix score`: what recorded runs are worth, from the runs alone."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.commands.counts import natural
from app.commands.rehearse_errors import add_error_arguments, chain_of, registered_content
from app.extras import has_app, need_app
from app.services import Services, build_services
from app.settings import Settings
from vfix_engine.runtime.run import Run
from vfix_engine.study.metrics import score_run
from vfix_engine.worlds.registry import spec_of

if TYPE_CHECKING:
    from app.registration.document import RegistrationContent

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
    services = build_services(Settings.from_environment()) if has_app() else None
    scores = [_scored(services, name, args) for name in args.runs]
    if args.json:
        print(json.dumps({"runs": scores, "notice": NOTICE}, allow_nan=False))
    else:
        for score in scores:
            _print_for_people(score)
        print(NOTICE)
    return 0


def _scored(services: Services | None, name: str, args: argparse.Namespace) -> dict[str, Any]:
    """The score of a run, and what it is of where it is stored."""
    folder = Path(name)
    if folder.is_dir():
        of = {"run": name, "case": None, "plan": None, "recorded": None}
        return of | _score(Run.read(folder), args, None, "")
    if services is None:
        raise need_app("A stored run")
    stored = services.runs.get(name)
    registered = registered_content(services, stored.plan_id)
    with services.runs.laid_out(name) as place:
        score = _score(Run.read(place), args, registered, stored.case_id or "")
    return {"run": name, "case": stored.case_id, "plan": stored.plan_id, "recorded": stored.recorded} | score


def _score(run: Run, args: argparse.Namespace, registered: RegistrationContent | None, case_id: str) -> dict[str, Any]:
    """The score itself; with `--errors` the error chain, and ``true_error_mm`` of the path by its name there, too."""
    spec = spec_of(run)
    scene = getattr(spec, "scene", None)
    chain = chain_of(args.errors, args.seed, getattr(scene, "path_points", None), registered, case_id)
    score = score_run(run, spec, errors=chain)
    told: dict[str, Any] = {"error_chain": chain.to_dict(), "true_error_mm": None}
    if score.path_error_mm is not None:
        told["true_error_mm"] = asdict(score.path_error_mm.true_frame)
    return score.to_dict() | told


def _print_for_people(score: dict[str, Any]) -> None:
    for name, value in score.items():
        print(f"{name:>22}  {json.dumps(value) if isinstance(value, (dict, list, tuple)) else value}")
    if not score["certified"]:
        print(f"{'':>22}  Driven without the certificate.")
    print()
