"""`vfix bench study`: what simulated trials cost, on one core, on all, on a Dask cluster, and as the problem grows.

The trials are those of Li 2007 in its three modes, in turn. Each way of running them runs the same trials, and all have
to give the same arrays to the last bit. Rates are of the second half of the trials, when every process has its kernels.
"""

from __future__ import annotations

import argparse
import functools
import hashlib
import itertools
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import trimesh

from benchmarks import report
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.study.drive import drive
from vfix_engine.study.endoscopy.endoscopist import Endoscopist
from vfix_engine.study.endoscopy.polyp_run import run_trial as run_polyp_trial
from vfix_engine.study.experiment.apparatus import apparatus
from vfix_engine.study.experiment.colon import colon_of
from vfix_engine.study.experiment.fit import Fitted
from vfix_engine.study.experiment.trials import Mode, TrialKey, run_trial, seeds, subject_of
from vfix_engine.study.farm import run_all
from vfix_engine.study.operator import PursuitOperator
from vfix_engine.worlds.rigid.rehearsal import Rehearsal

SUMMARY = "simulated trials a second on one core, on all and on a Dask cluster, and how their cost grows"
MODES: tuple[Mode, ...] = ("freehand", "hands-on", "teleoperated")
MANY = 100_000
SUBDIVIDED = 3  # how often each triangle of the phantom becomes four
LINKS = (8, 15, 30)
LUMEN_S = 20.0  # of simulated time of a trial in the colon
SUBJECTS = (1, 2, 4, 8)
_FEWEST = 12


class Timed(NamedTuple):
    """A trial: processor time in s, and a hash of its arrays."""

    cpu_s: float
    digest: str


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options: the number of trials, and whether growth is measured."""
    parser.add_argument("--trials", type=int, default=60, metavar="N", help=f"of each way, {_FEWEST} at least (60)")
    parser.add_argument("--no-growth", action="store_true", help="not with more triangles, links and subjects")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Return rates by way, cost by mode, growth. Raises BenchmarkRefused: fewer trials than are halved sensibly."""
    if args.trials < _FEWEST:
        raise report.BenchmarkRefused(f"--trials is {_FEWEST} or more")
    machine = report.machine()
    each = -(-args.trials // len(MODES))
    keys = [TrialKey(0, number, 0, mode) for number, mode in itertools.product(range(each), MODES)]
    timed(keys[0]), timed(keys[1])  # compiles the kernels
    ways, found = _ways(keys, machine.cores)
    alone = found["one process"]
    by_mode = {mode: float(np.mean([alone[key].cpu_s for key in keys if key.mode == mode])) for mode in MODES}
    digests = [[one.digest for one in results.values()] for results in found.values()]
    return {
        "machine": machine.to_dict(),
        "trials": len(keys),
        "ways": ways,
        "ratios": {
            way: rates["trials_per_s"] / ways["one process"]["trials_per_s"]
            for way, rates in ways.items()
            if way != "one process"
        },
        "cpu_s_of_a_trial": by_mode,
        "core_hours_of_100000_trials": MANY * float(np.mean(list(by_mode.values()))) / 3600.0,
        "growth": None if args.no_growth else _growth(),
        "correct": all(one == digests[0] for one in digests),
    }


def timed(key: TrialKey) -> Timed:
    """Run one trial."""
    begin = time.process_time()
    trial = run_trial(key, subject_of(key, Fitted.stored().person))
    return Timed(time.process_time() - begin, hashlib.sha256(trial.tip.tobytes() + trial.q.tobytes()).hexdigest())


def _ways(keys: Sequence[TrialKey], cores: int) -> tuple[dict[str, Any], dict[str, dict[TrialKey, Timed]]]:
    """Rates and results of each way of running the same trials."""
    ways: dict[str, Any] = {}
    found: dict[str, dict[TrialKey, Timed]] = {}

    def measure(way: str, processes: int, **where: Any) -> None:
        begin, ended = time.perf_counter(), []
        found[way] = run_all(timed, keys, keep=lambda key, value: ended.append(time.perf_counter()), **where)
        half = len(ended) // 2
        ways[way] = {
            "processes": processes,
            "wall_s": time.perf_counter() - begin,
            "first_result_s": ended[0] - begin,
            "trials_per_s": (len(ended) - 1 - half) / (ended[-1] - ended[half]),
        }

    measure("one process", 1, workers=1)
    measure("a pool of processes", cores, workers=cores)
    with _cluster(cores) as address:
        if address:
            measure("a local Dask cluster", cores, scheduler=address)
    return ways, found


@contextmanager
def _cluster(workers: int) -> Iterator[str | None]:
    """Address of a local Dask cluster of processes; None where the extra `cluster` is not installed."""
    try:
        import distributed
    except ImportError:
        yield None
        return
    with distributed.LocalCluster(
        n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None
    ) as local:
        yield str(local.scheduler_address)


def _growth() -> dict[str, list[dict[str, Any]]]:
    return {"triangles": _by_triangles(), "links": _by_links(), "subjects": _by_subjects()}


def _by_triangles() -> list[dict[str, Any]]:
    """The same hands-on trial on the phantom, each of whose triangles becomes four, again and again."""
    around, key = apparatus(), TrialKey(0, 0, 0, "hands-on")
    person, rows = subject_of(key, Fitted.stored().person), []
    mesh = around.scene.tree.mesh
    vertices, faces = mesh.vertices, mesh.faces
    for times in range(SUBDIVIDED + 1):
        if times:
            vertices, faces = trimesh.remesh.subdivide(vertices, faces)
        begin = time.perf_counter()
        scene = replace(around.scene, tree=ProximityTree(TriangleMesh(vertices, faces)))
        built = time.perf_counter() - begin
        hand = PursuitOperator(around.guide, person, scene.tool, around.settings, seeds(0, 0))
        driven, seconds = _cpu(functools.partial(drive, Rehearsal(scene, around.settings).system, hand))
        per_step = 1e6 * seconds / len(driven.step_us)
        rows.append({"triangles": len(faces), "build_s": built, "cpu_us_of_a_period": per_step})
    return rows


def _by_links() -> list[dict[str, Any]]:
    """The first seconds of a guided trial in the colon, with more links of the same length."""
    colon, rows = colon_of("guided"), []
    run_polyp_trial(colon, Endoscopist(), 0, 1.0)  # compiles the kernels
    for links in LINKS:
        snake = replace(colon.spec.snake, links=links)
        longer = colon._replace(spec=replace(colon.spec, snake=snake))
        _, seconds = _cpu(functools.partial(run_polyp_trial, longer, Endoscopist(), 0, LUMEN_S))
        rows.append({"links": links, "cpu_s_per_simulated_s": seconds / LUMEN_S})
    return rows


def _by_subjects() -> list[dict[str, Any]]:
    """More subjects with one trial in each mode, one process."""
    rows = []
    for subjects in SUBJECTS:
        keys = [TrialKey(0, number, 0, mode) for number, mode in itertools.product(range(subjects), MODES)]
        _, seconds = _cpu(functools.partial(run_all, timed, keys))
        rows.append({"subjects": subjects, "cpu_s": seconds, "cpu_s_of_a_subject": seconds / subjects})
    return rows


def _cpu(call: Callable[[], Any]) -> tuple[Any, float]:
    """What a call returns, and its processor time in s."""
    begin = time.process_time()
    value = call()
    return value, time.process_time() - begin
