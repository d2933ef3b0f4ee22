"""`vfix bench certify`: tries to break the certificate, and measures every accepted motion again (HAZ-01 to HAZ-06)."""

from __future__ import annotations

import argparse
from functools import partial
from typing import Any

from benchmarks.attack import command
from benchmarks.attack.rigid.arenas import BUILDERS
from benchmarks.attack.rigid.episodes import RigidCampaign
from benchmarks.attack.rigid.watch import RigidTally
from benchmarks.report import need

SUMMARY = "attack the certificate: adversarial steps, every accepted motion measured again"

DEFAULT_STEPS = 100_000
COAL_SHARE = 0.12  # fraction of all steps whose poses are also measured by coal
COAL_REPLAYS = 1000  # finer replays measured by coal in a million steps


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the attack."""
    parser.add_argument("--steps", type=int, default=DEFAULT_STEPS, metavar="N", help="control steps over all scenes")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="same seed, same trajectories")
    parser.add_argument("--jobs", type=int, default=2, metavar="J", help="processes; the result is the same")
    parser.add_argument("--scene", action="append", metavar="NAME", help="only this scene; may be repeated")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Run the attack and return its figures.

    Raises:
        BenchmarkRefused: coal is not installed, or an option makes no sense.
    """
    need("coal")
    names = command.chosen(args, BUILDERS, args.steps)
    replays = max(2, -(-COAL_REPLAYS * args.steps // (1_000_000 * len(names))))
    return _with_shares(command.attack(partial(_attack, replays), names, args, args.steps, RigidTally()))


def summary(scenes: list[dict[str, Any]], seconds: float) -> dict[str, Any]:
    """Return the figures of all scenes together."""
    return _with_shares(command.summary(scenes, seconds, RigidTally()))


def _with_shares(total: dict[str, Any]) -> dict[str, Any]:
    return total | {
        "limits_judged_share": total["limits_judged"] / max(total["steps"], 1),
        "emergency_share": total["emergencies"] / max(total["limits_judged"], 1),
    }


def _attack(replays: int, job: command.Job) -> dict[str, Any]:
    """``replays``: number of finer replays measured by coal."""
    return RigidCampaign(*job, need("coal"), COAL_SHARE, replays).run()
