"""The attack on all scenes of a world, each in a separate process, and its summary."""

from __future__ import annotations

import argparse
import hashlib
import os
import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields
from multiprocessing import get_context
from typing import Any

from benchmarks.report import BenchmarkRefused, machine

from .campaign import Tally

Job = tuple[str, int, int]  # scene, seed, steps

WRONG = ("violations", "nan", "disagreements", "limit_violations", "exceptions", "replay_hits")


def chosen(args: argparse.Namespace, scenes: Iterable[str], steps: int) -> list[str]:
    """Return the names of the scenes to attack.

    Raises:
        BenchmarkRefused: an option makes no sense.
    """
    known = list(scenes)
    names = list(args.scene or known)
    unknown = sorted(set(names) - set(known))
    if unknown:
        raise BenchmarkRefused(f"no scene is called {', '.join(unknown)}; there are {', '.join(known)}")
    if steps < len(names) or args.jobs < 1:
        raise BenchmarkRefused(f"at least one step for each of {len(names)} scenes, and one job")
    return names


def attack(
    campaign: Callable[[Job], dict[str, Any]], names: list[str], args: argparse.Namespace, steps: int, tally: Tally
) -> dict[str, Any]:
    """Run a campaign in every scene and return the figures; ``tally``: an empty one of the world."""
    begin = time.perf_counter()
    share, more = divmod(steps, len(names))
    jobs = [(name, args.seed, share + (i < more)) for i, name in enumerate(names)]
    scenes = _each(campaign, jobs, args.jobs)
    return summary(scenes, time.perf_counter() - begin, tally) | {"seed": args.seed, "machine": machine().to_dict()}


def summary(scenes: list[dict[str, Any]], seconds: float, tally: Tally) -> dict[str, Any]:
    """Return the figures of all scenes together: counts are summed, and of lengths the largest ones are taken.

    Steps of a scene with missing data are not replaced by others.
    """
    fought = [scene for scene in scenes if "skipped" not in scene]
    total: dict[str, Any] = {}
    for name, empty in ((one.name, getattr(tally, one.name)) for one in fields(tally)):
        if isinstance(empty, int):
            total[name] = sum(scene[name] for scene in fought)
        elif isinstance(empty, float):
            total[name] = max((scene[name] for scene in fought if scene[name] is not None), default=empty)
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


def _each(campaign: Callable[[Job], dict[str, Any]], jobs: list[Job], count: int) -> list[dict[str, Any]]:
    """Run jobs in ``count`` processes and return their findings in order; each is reported on stderr when it ends."""
    if count == 1:
        return [campaign(job) for job in jobs]
    done = []
    with ProcessPoolExecutor(count, mp_context=get_context("spawn"), initializer=_quiet) as pool:
        for scene in pool.map(campaign, jobs):
            done.append(scene)
            found = scene.get("skipped") or f"{scene['steps']:,} steps, {scene['violations']} violations"
            print(f"vfix: {len(done)} of {len(jobs)}, {scene['name']}: {found}", file=sys.stderr, flush=True)
    return done


def _quiet() -> None:
    """Redirect the output of solver libraries to stderr, since stdout is for the result only."""
    os.dup2(2, 1)
    warnings.filterwarnings("ignore", module="qpsolvers")
