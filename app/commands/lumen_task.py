"""`vfix lumen task`: a simulated task of Kwok 2013, section IV.C, done by a scripted operator or one of your own."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from app.commands import lumen_kwok1, lumen_kwok2
from app.commands.counts import natural
from vfix_engine.study.endoscopy.own_hand import SCRIPTED
from vfix_engine.worlds.snake.settings import ARMS

NOTICE = "Not for clinical use."

Say = Callable[[str], None]


class TaskCommand(NamedTuple):
    """A task of the command line.

    title: of its help. add_options: those that only it has. run: does the task and returns JSON's types, of which
    `completed` (bool) decides the exit status; it may raise VfixError, and gets what says how far it is.
    """

    title: str
    add_options: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace, Say], dict[str, Any]]


TASKS: Mapping[str, TaskCommand] = {
    "kwok1": TaskCommand("study I: look at ten polyps of a colon", lumen_kwok1.add_options, lumen_kwok1.run),
    "kwok2": TaskCommand("study II: trace six lines in a cavity", lumen_kwok2.add_options, lumen_kwok2.run),
}


def add_task(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the action `task` with one parser for each task."""
    parser = actions.add_parser("task", help="do a task of a paper without a page", description=__doc__)
    tasks = parser.add_subparsers(dest="task", metavar="TASK", required=True)
    for name, task in TASKS.items():
        one = tasks.add_parser(name, help=task.title, description=f"Kwok 2013, {task.title}.")
        one.add_argument(
            "--operator", default=SCRIPTED, metavar="NAME",
            help="scripted: an oracle, which knows the targets; else the entry point of an installed package's hand",
        )  # fmt: skip
        one.add_argument("--arm", choices=ARMS, default="certified", help="what holds the links")
        one.add_argument("--seed", type=natural, default=0, help="of what is drawn for the task (default 0)")
        task.add_options(one)
        one.add_argument("--json", action="store_true", help="one JSON object on stdout")


def run_task(args: argparse.Namespace) -> int:
    """Exit status 0 when the task was completed, 1 otherwise."""
    found = TASKS[args.task].run(args, lambda words: print(f"vfix: {words}", file=sys.stderr, flush=True))
    found = {"task": args.task} | found | {"notice": NOTICE}
    if args.json:
        print(json.dumps(found, allow_nan=False))
    else:
        _print_for_people(found)
    return 0 if found["completed"] else 1


def _print_for_people(found: Mapping[str, Any], indent: str = "") -> None:
    for name, value in found.items():
        if isinstance(value, Mapping):
            print(f"{indent}{name}")
            _print_for_people(value, indent + "  ")
        else:
            lines = value if isinstance(value, list) and value and isinstance(value[0], Mapping) else [value]
            for line in lines:
                print(f"{indent}{name:>24}  {json.dumps(line) if isinstance(line, (dict, list)) else line}")
