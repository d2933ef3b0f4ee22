"""`vfix replay`: drive a recorded run again, with its commands, and compare every step with the recording."""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from multiprocessing import get_context
from typing import Any

from numba.core.event import install_recorder

from app.commands.found_runs import find_run, optional_services
from vfix_engine.runtime.replay import Replay, replay
from vfix_engine.runtime.run import Run
from vfix_engine.worlds.registry import preparation_of, spec_of

NOTICE = "Not for clinical use."
LAST_BITS = 1e-9  # [mm, rad, N] of another processor's arithmetic
_OF_THE_CPU = ("machine", "blas_core")
_NO_ARITHMETIC = ("vfix", "python")  # a later version of vfix must replay the same bits


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = subparsers.add_parser("replay", help="drive a recorded run again, step by step", description=__doc__)
    parser.add_argument("run", metavar="RUN", help="id of a stored run, or folder of a recorded one")
    parser.add_argument("--verify", action="store_true", help="exit status 1 unless it is the recorded run again")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    return parser


def run(args: argparse.Namespace) -> int:
    """Exit status 1 with --verify where the replay is not the run. Raises VfixError for one that cannot be replayed."""
    with install_recorder("numba:compile") as compiled:
        report = replayed(args.run)
    if (
        not report["same_hash"] and compiled.buffer
    ):  # a process that compiles a kernel may round its last bits otherwise
        with ProcessPoolExecutor(1, get_context("spawn")) as fresh:
            report = fresh.submit(replayed, args.run).result()
    if args.json:
        print(json.dumps(report, allow_nan=False))
    else:
        print(report["words"])
        print(NOTICE)
    return 0 if report["verified"] or not args.verify else 1


def replayed(name: str) -> dict[str, Any]:
    """The report on the replay of a run, by id or folder."""
    found = find_run(optional_services(), name)
    spec, prepared = spec_of(found.run), preparation_of(found.run)
    if not prepared.is_prepared():
        print("vfix: preparing the engine, on the first start only ...", file=sys.stderr, flush=True)
        with suppress(subprocess.SubprocessError, OSError):
            prepared.prepare()
    return found.origin | compare(found.run, replay(found.run, spec, keep_states=False)) | {"notice": NOTICE}


def compare(run: Run, again: Replay[Any]) -> dict[str, Any]:
    """What a replay shows: the same bits where the arithmetic is the recording's, elsewhere the last ones may differ.

    `verified` is that, `words` the same as a sentence; `largest_difference` is null where a value is not finite.
    """
    then, now = hashlib.sha256(run.ticks.tobytes()).hexdigest(), again.sha256
    other = {name: pair for name, pair in again.other_arithmetic.items() if name not in _NO_ARITHMETIC}
    same, near = now == then, again.largest_difference <= LAST_BITS
    return {
        "world": run.manifest["world"],
        "ticks": len(run.ticks),
        "whole": run.whole,
        "verified": same or (near and bool(other)),
        "same_hash": same,
        "sha256": {"recorded": then, "replayed": now},
        "first_difference": again.first_difference,
        "largest_difference": again.largest_difference if math.isfinite(again.largest_difference) else None,
        "tolerance": None if same or not other else LAST_BITS,
        "same_cpu": not any(name in other for name in _OF_THE_CPU),
        "other_arithmetic": {name: {"recorded": old, "here": new} for name, (old, new) in other.items()},
        "words": _words(again, same, near, other),
    }


def _words(again: Replay[Any], same: bool, near: bool, other: dict[str, tuple[str, str]]) -> str:
    if same:
        return "Replayed: every step is the recorded one, bit by bit."
    where = ", ".join(f"{name} {new or 'unknown'} for {old or 'unknown'}" for name, (old, new) in other.items())
    differs = f"from step {again.first_difference} on by at most {again.largest_difference:.1e}"
    if other and near:
        return f"Replayed within {LAST_BITS:g} (mm, rad, N) with other arithmetic ({where}): it differs {differs}."
    why = f", by more than other arithmetic ({where}) explains" if other else " with the same arithmetic"
    return f"The replay is not the recorded run: it differs {differs}{why}."
