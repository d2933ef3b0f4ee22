"""Independent trials on all cores, or on a cluster: the result depends on the keys alone, not on who ran them when.

A worker that is killed costs nothing but time: what it had not finished runs again.
"""

from __future__ import annotations

import multiprocessing
import pickle
import signal
from collections.abc import Callable, Hashable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import Any, TypeVar

from ..errors import ControlError, InputError
from .kept_trials import KeptTrials

TRIES = 3  # pools that may break before it is given up

K = TypeVar("K", bound=Hashable)
V = TypeVar("V")

_function: Callable[[Any], Any] | None = None  # of this worker


def run_all(
    function: Callable[[K], V],
    keys: Sequence[K],
    workers: int = 1,
    keep: Callable[[K, V], object] = lambda key, value: None,
    scheduler: str | None = None,
    kept: KeptTrials | None = None,
) -> dict[K, V]:
    """``{key: function(key)}`` in the order of the keys.

    function: pickled, and sent to each process once, so it may hold the data of all trials.
    workers: processes; 1: this one. scheduler: address of a Dask scheduler, 'tcp://…', whose workers run the trials
    instead. keep: called with each result as it comes, in any order; an exception from it, as of a user who cancels,
    ends all. kept: where results are read that are there already, and where the others are written.

    Raises:
        InputError: fewer than one worker; a scheduler that cannot be used.
        ControlError: a trial's worker was killed each time. Whatever ``function`` raises.
    """
    if workers < 1:
        raise InputError(f"trials run in one process at least, not in {workers}")
    done: dict[K, V] = {}

    def add(key: K, value: V) -> None:
        done[key] = value
        if kept is not None:
            kept.add(function, key, value)
        keep(key, value)

    left: list[K] = []
    for key in keys:
        value = None if kept is None else kept.get(function, key)
        if value is None:
            left.append(key)
        else:
            done[key] = value
            keep(key, value)
    if scheduler is not None:
        from .cluster import run_on_cluster  # its libraries are an extra

        run_on_cluster(function, left, scheduler, add)
    elif workers == 1:
        for key in left:
            add(key, function(key))
    elif left:
        _in_processes(function, left, workers, add)
    return {key: done[key] for key in keys}


def _in_processes(function: Callable[[K], V], keys: Sequence[K], workers: int, add: Callable[[K, V], object]) -> None:
    left, context = dict.fromkeys(keys), multiprocessing.get_context("spawn")
    packed = pickle.dumps(function)
    for _ in range(TRIES):
        try:
            with ProcessPoolExecutor(workers, context, _receive, (packed,)) as pool:
                futures = {pool.submit(_run_one, key): key for key in left}
                try:
                    for future in as_completed(futures):
                        add(futures[future], future.result())
                        del left[futures[future]]
                except BaseException:
                    pool.shutdown(wait=False, cancel_futures=True)
                    raise
            return
        except BrokenProcessPool:
            continue  # what is left runs again in a new pool
    raise ControlError(f"{len(left)} trials lost their worker {TRIES} times, the first of them {next(iter(left))}")


def _receive(packed: bytes) -> None:
    """Begin as a worker. Ctrl-C is for the process that started it, which then asks for nothing more."""
    global _function
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _function = pickle.loads(packed)


def _run_one(key: Any) -> Any:
    assert _function is not None
    return _function(key)
