"""`vfix bench lumen --attack`: tries to break a snake's hard limits, and measures every configuration again."""

from __future__ import annotations

import argparse
import hashlib
import time
from collections import Counter
from typing import Any

from benchmarks.in_processes import each_scene
from benchmarks.report import BenchmarkRefused, machine

from .episodes import Campaign
from .scenes import BUILDERS

Job = tuple[str, int, int]  # scene, seed, steps

SUMMED = (
    "steps", "violations", "held", "shrunk", "moved", "inserted", "nan", "remeasured", "replayed",
    "replayed_insertions", "replayed_in_moving_tissue", "replay_hits", "disagreements", "limit_violations",
    "exceptions", "refused_commands", "refused_starts", "outrun", "outrun_in_time",
)  # fmt: skip
WORST = ("deepest_mm", "way_mm", "outrun_mm", "tissue_mm")
WRONG = ("violations", "nan", "disagreements", "limit_violations", "exceptions", "replay_hits")


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
    names = list(args.scene or BUILDERS)
    unknown = sorted(set(names) - set(BUILDERS))
    if unknown:
        raise BenchmarkRefused(f"no scene is called {', '.join(unknown)}; there are {', '.join(BUILDERS)}")
    if args.attack < len(names) or args.jobs < 1:
        raise BenchmarkRefused(f"at least one step for each of {len(names)} scenes, and one job")
    begin = time.perf_counter()
    share, more = divmod(args.attack, len(names))
    jobs = [(name, args.seed, share + (i < more)) for i, name in enumerate(names)]
    scenes = each_scene(_attack, jobs, args.jobs)
    return summary(scenes, time.perf_counter() - begin) | {"seed": args.seed, "machine": machine().to_dict()}


def summary(scenes: list[dict[str, Any]], seconds: float) -> dict[str, Any]:
    """Return the figures of all scenes together; steps of a scene with missing data are not replaced by others."""
    fought = [scene for scene in scenes if "skipped" not in scene]
    total: dict[str, Any] = {name: sum(scene[name] for scene in fought) for name in SUMMED}
    total |= {name: max((scene[name] for scene in fought), default=0.0) for name in WORST}
    digest = hashlib.sha256("".join(scene["hash"] for scene in fought).encode())
    rooms = [scene["least_room_mm"] for scene in fought if scene["least_room_mm"] is not None]
    used: Counter[str] = sum((Counter(scene["used"]) for scene in fought), Counter())
    return total | {
        "scenes": len(fought),
        "correct": bool(fought) and not any(total[name] for name in WRONG),
        "least_room_mm": min(rooms, default=None),
        "used": dict(sorted(used.items())),
        "failures": [{"scene": scene["name"], **failure} for scene in fought for failure in scene["failures"]],
        "hash": digest.hexdigest(),
        "seconds": seconds,
        "per_scene": fought,
        "missing": {scene["name"]: scene["skipped"] for scene in scenes if "skipped" in scene},
    }


def _attack(job: Job) -> dict[str, Any]:
    return Campaign(*job).run()
