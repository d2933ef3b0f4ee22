"""Independent trials on all cores: the result depends on the keys alone, not on who ran them when.

A worker that is killed costs nothing but time: what it had not finished runs again.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Hashable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

from ..errors import ControlError, InputError

TRIES = 3  # pools that may break before it is given up

K = TypeVar("K", bound=Hashable)
V = TypeVar("V")


def run_all(
    function: Callable[[K], V],
    keys: Sequence[K],
    workers: int = 1,
    keep: Callable[[K, V], object] = lambda key, value: None,
) -> dict[K, V]:
    """``{key: function(key)}`` in the order of the keys.

    function: of a module, since other processes import it. workers: processes; 1: this one.
    keep: called with each result as it comes, in any order; an exception from it, as of a user who cancels, ends all.

    Raises:
        ControlError: a trial's worker was killed each time. Whatever ``function`` raises.
    """
    if workers < 1:
        raise InputError(f"trials run in one process at least, not in {workers}")
    done: dict[K, V] = {}

    def add(key: K, value: V) -> None:
        done[key] = value
        keep(key, value)

    if workers == 1:
        for key in keys:
            add(key, function(key))
    else:
        _in_processes(function, keys, workers, add)
    return {key: done[key] for key in keys}


def _in_processes(function: Callable[[K], V], keys: Sequence[K], workers: int, add: Callable[[K, V], object]) -> None:
    left, context = dict.fromkeys(keys), multiprocessing.get_context("spawn")
    for _ in range(TRIES):
        try:
            with ProcessPoolExecutor(workers, mp_context=context) as pool:
                futures = {pool.submit(function, key): key for key in left}
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
