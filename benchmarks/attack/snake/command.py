"""`vfix bench lumen --attack`: tries to break a snake's hard limits, and measures every configuration again."""

from __future__ import annotations

import argparse
from typing import Any

from benchmarks.attack import command

from .episodes import SnakeCampaign
from .scenes import BUILDERS
from .watch import SnakeTally


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the attack."""
    parser.add_argument("--attack", type=int, metavar="STEPS", help="attack the hard limits instead: so many steps")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of the attack; same seed, same motions")
    parser.add_argument("--jobs", type=int, default=2, metavar="J", help="processes of the attack (default 2)")
    parser.add_argument("--scene", action="append", metavar="NAME", help="attack this scene only; may be repeated")


def attack(args: argparse.Namespace) -> dict[str, Any]:
    """Run the attack and return its figures.

    Raises:
        BenchmarkRefused: an option makes no sense.
    """
    names = command.chosen(args, BUILDERS, args.attack)
    return command.attack(_attack, names, args, args.attack, SnakeTally())


def _attack(job: command.Job) -> dict[str, Any]:
    return SnakeCampaign(*job).run()
