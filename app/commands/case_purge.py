"""`vfix case purge`: remove a case for good, with its plans, runs, files and temporary data; asks first."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict

from app.cases.model import Case
from app.cases.purge import Purged
from app.services import Services
from vfix_engine.errors import InputError


def add_parser(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = actions.add_parser("purge", help="remove a case for good, with its plans, runs and files")
    parser.add_argument("case", metavar="CASE", help="id or name; a deleted case too")
    parser.add_argument("--yes", action="store_true", help="do not ask")
    return parser


def run(args: argparse.Namespace, services: Services, case: Case) -> int:
    """Ask, purge and print what was removed; 1 where the answer was no."""
    services.sweep()  # what killed planners have left, recordings of this head among it
    if not args.yes and not _is_confirmed(case, services.purge.preview(case.id)):
        print("vfix: nothing was removed.", file=sys.stderr)
        return 1
    done = services.purge.run(case.id)
    if args.json:
        print(
            json.dumps({"case": case.id, **{name: value for name, value in asdict(done).items() if name != "case_id"}})
        )
    else:
        print(f"{case.id} was removed: {_words(done)}, {done.files} files.")
    return 0


def _is_confirmed(case: Case, found: Purged) -> bool:
    """Whether the user types the name of the case. Raises InputError where nobody can be asked."""
    if not sys.stdin.isatty():
        raise InputError("this removes a case for good; say --yes where nobody can be asked.")
    print(f"{case.name} ({case.id}) will be removed for good: {_words(found)}.", file=sys.stderr)
    print("It cannot be brought back. Type the name of the case to go on: ", end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip() == case.name


def _words(found: Purged) -> str:
    copies = f", copies of the database from before an upgrade: {', '.join(found.copies)}" if found.copies else ""
    return f"{found.documents} plans and other documents, {found.runs} runs{copies}"
