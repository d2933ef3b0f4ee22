"""`vfix run comment`: comment on a stored run at a time, change a comment, or delete it."""

from __future__ import annotations

import argparse
import json

from app.services import Services
from vfix_engine.errors import InputError


def add_parser(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = actions.add_parser("comment", help="comment on a run at a time, change or delete a comment")
    parser.add_argument("run", metavar="RUN", help="id of a stored run")
    parser.add_argument("text", metavar="TEXT", help="one line; with --delete the comment's id")
    parser.add_argument("--at", type=float, metavar="SECONDS", help="driven time since the last return to the start")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--edit", metavar="ID", help="give this comment the text, and with --at another time")
    which.add_argument("--delete", action="store_true", help="delete a comment")
    return parser


def comment(services: Services, args: argparse.Namespace) -> int:
    """Raises InputError, NotFound and TooMany."""
    comments = services.run_comments
    if args.delete:
        comments.delete(args.run, args.text)
        print(json.dumps({"deleted": args.text}) if args.json else f"{args.text} deleted.")
        return 0
    if args.edit is not None:
        said = comments.edit(args.run, args.edit, args.text, args.at)
    elif args.at is None:
        raise InputError("say at which time: vfix run comment RUN --at SECONDS TEXT")
    else:
        said = comments.add(args.run, args.at, args.text)
    at = "before the last return to the start" if said.t_s is None else f"at {said.t_s:.1f} s"
    print(json.dumps(vars(said)) if args.json else f"{said.id} {at}: {said.text}")
    return 0
