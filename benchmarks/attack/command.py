"""The attack on all scenes of a world, each in a separate process, and its summary."""

from __future__ import annotations

import argparse
import hashlib
import os
import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from typing import Any

from benchmarks.report import BenchmarkRefused, machine

from .campaign import Campaign

Kind = type[Campaign[Any, Any, Any, Any, Any]]
Job = tuple[str, int, int]  # scene, seed, steps

WRONG = ("violations", "nan", "disagreements", "limit_violations", "exceptions", "replay_hits")


def attack(kind: Kind, args: argparse.Namespace, steps: int, **options: Any) -> dict[str, Any]:
    """Attack every scene, or those of ``args.scene``, with ``steps`` in all, and return the figures.

    options: of the campaign.

    Raises:
        BenchmarkRefused: an option makes no sense.
    """
    begin, known = time.perf_counter(), list(kind.scenes)
    names = list(args.scene or known)
    unknown = sorted(set(names) - set(known))
    if unknown:
        raise BenchmarkRefused(f"no scene is called {', '.join(unknown)}; there are {', '.join(known)}")
    if steps < len(names) or args.jobs < 1:
        raise BenchmarkRefused(f"at least one step for each of {len(names)} scenes, and one job")
    share, more = divmod(steps, len(names))
    jobs = [(name, args.seed, share + (i < more)) for i, name in enumerate(names)]
    scenes = _each(partial(_run, kind, options), jobs, args.jobs)
    return summary(kind, scenes, time.perf_counter() - begin) | {"seed": args.seed, "machine": machine().to_dict()}


def summary(kind: Kind, scenes: list[dict[str, Any]], seconds: float = 0.0) -> dict[str, Any]:
    """Return the figures of all scenes together: counts are summed, and of lengths the largest ones are taken.

    Steps of a scene with missing data are not replaced by others.
    """
    fought = [scene for scene in scenes if "skipped" not in scene]
    total: dict[str, Any] = {}
    for name, empty in vars(kind.tally_type()).items():
        if isinstance(empty, int):
            total[name] = sum(scene[name] for scene in fought)
        elif isinstance(empty, float):
            total[name] = max((scene[name] for scene in fought if scene[name] is not None), default=empty)
    digest = hashlib.sha256("".join(scene["hash"] for scene in fought).encode())
    rooms = [scene["least_room_mm"] for scene in fought if scene["least_room_mm"] is not None]
    used: Counter[str] = sum((Counter(scene["used"]) for scene in fought), Counter())
    return (
        total
        | kind.shares(total)
        | {
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
    )


def _run(kind: Kind, options: dict[str, Any], job: Job) -> dict[str, Any]:
    return kind(*job, **options).run()


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
