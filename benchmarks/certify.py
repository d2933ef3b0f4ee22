"""`vfix bench certify`: tries to break the certificate, and measures every accepted motion again (HAZ-01 to HAZ-06)."""

from __future__ import annotations

import argparse
import hashlib
import time
from collections import Counter
from typing import Any

from benchmarks.attack.rigid.arenas import BUILDERS
from benchmarks.attack.rigid.episodes import Campaign
from benchmarks.in_processes import each_scene
from benchmarks.report import BenchmarkRefused, machine, need

SUMMARY = "attack the certificate: adversarial steps, every accepted motion measured again"

Job = tuple[str, int, int, int]  # scene, seed, steps, number of replays measured by coal

DEFAULT_STEPS = 100_000
COAL_SHARE = 0.12  # fraction of all steps whose poses are also measured by coal
COAL_REPLAYS = 1000  # finer replays measured by coal in a million steps
SUMMED = (
    "steps", "violations", "held", "moved", "nan", "remeasured", "replayed", "replay_hits", "replay_remeasured",
    "emergencies", "limits_judged", "limit_violations", "beyond_limits", "disagreements",
    "exceptions", "episodes", "refused_starts", "inside_starts",
)  # fmt: skip


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
    names = list(args.scene or BUILDERS)
    unknown = sorted(set(names) - set(BUILDERS))
    if unknown:
        raise BenchmarkRefused(f"no scene is called {', '.join(unknown)}; there are {', '.join(BUILDERS)}")
    if args.steps < len(names) or args.jobs < 1:
        raise BenchmarkRefused(f"at least one step for each of {len(names)} scenes, and one job")
    begin = time.perf_counter()
    share, more = divmod(args.steps, len(names))
    replays = max(2, -(-COAL_REPLAYS * args.steps // (1_000_000 * len(names))))
    jobs = [(name, args.seed, share + (i < more), replays) for i, name in enumerate(names)]
    scenes = each_scene(_attack, jobs, args.jobs)
    return summary(scenes, time.perf_counter() - begin) | {"seed": args.seed, "machine": machine().to_dict()}


def summary(scenes: list[dict[str, Any]], seconds: float) -> dict[str, Any]:
    """Return the figures of all scenes together; steps of a scene with missing data are not replaced by others."""
    fought = [scene for scene in scenes if "skipped" not in scene]
    total: dict[str, Any] = {name: sum(scene[name] for scene in fought) for name in SUMMED}
    digest = hashlib.sha256("".join(scene["hash"] for scene in fought).encode())
    rooms = [scene["least_room_mm"] for scene in fought if scene["least_room_mm"] is not None]
    used: Counter[str] = sum((Counter(scene["used"]) for scene in fought), Counter())
    wrong = ("violations", "nan", "limit_violations", "disagreements", "exceptions", "replay_hits")
    total |= {
        "scenes": len(fought),
        "deepest_mm": max((scene["deepest_mm"] for scene in fought), default=0.0),
        "limits_judged_share": total["limits_judged"] / max(total["steps"], 1),
        "emergency_share": total["emergencies"] / max(total["limits_judged"], 1),
        "correct": bool(fought) and not any(total[name] for name in wrong),
        "least_room_mm": min(rooms, default=None),
        "used": dict(sorted(used.items())),
        "failures": [{"scene": scene["name"], **failure} for scene in fought for failure in scene["failures"]],
        "hash": digest.hexdigest(),
        "seconds": seconds,
        "per_scene": fought,
        "missing": {scene["name"]: scene["skipped"] for scene in scenes if "skipped" in scene},
    }
    return total


def _attack(job: Job) -> dict[str, Any]:
    name, seed, steps, replays = job
    return Campaign(name, seed, steps, need("coal"), COAL_SHARE, replays).run()
