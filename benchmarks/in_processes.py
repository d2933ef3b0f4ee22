"""Scenes of an attack, each in a process of its own."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any, TypeVar

Job = TypeVar("Job")


def each_scene(attack: Callable[[Job], dict[str, Any]], jobs: Sequence[Job], count: int) -> list[dict[str, Any]]:
    """The findings of every job, in ``count`` processes; their order is that of the jobs. Told on stderr one by one."""
    if count == 1:
        return [attack(job) for job in jobs]
    done = []
    with ProcessPoolExecutor(count, mp_context=get_context("spawn"), initializer=_quiet) as pool:
        for scene in pool.map(attack, jobs):
            done.append(scene)
            found = scene.get("skipped") or f"{scene['steps']:,} steps, {scene['violations']} violations"
            print(f"vfix: {len(done)} of {len(jobs)}, {scene['name']}: {found}", file=sys.stderr, flush=True)
    return done


def _quiet() -> None:
    """What a solver's library prints goes to stderr: stdout is the result's alone; that it gave up is its answer."""
    os.dup2(2, 1)
    warnings.filterwarnings("ignore", module="qpsolvers")
