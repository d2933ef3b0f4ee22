"""Scenes of an attack, each in a separate process."""

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
    """Run jobs in ``count`` processes and return their findings in order; each is reported on stderr when it ends."""
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
    """Redirect the output of solver libraries to stderr, since stdout is for the result only."""
    os.dup2(2, 1)
    warnings.filterwarnings("ignore", module="qpsolvers")
